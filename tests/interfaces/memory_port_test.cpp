#include <vrpipe/memory/memory_port.h>

#include <deque>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/platforms/simulation.h>

#include "support/foreign_memory.h"
#include "support/refusals.h"

namespace vrpipe {
namespace {

/// Reads line after line as fast as the port allows, and keeps when each came back.
class ClockedReader : public sc_core::sc_module, public Clocked, public PortOwner {
 public:
  ClockedReader(const sc_core::sc_module_name& name, ClockDomain& domain, unsigned in_flight, unsigned accesses,
                unsigned bytes = 32)
      : sc_module(name),
        PortOwner({&domain, domain.attach(*this)}),
        memory(*this, "memory", in_flight, {MemoryTraffic::vertex, 3}),
        left_(accesses),
        bytes_(bytes) {}

  MemoryPort memory;
  std::vector<Cycle> issued, completed;
  std::vector<std::uint32_t> tags;  ///< of what came back; accesses are numbered
  unsigned most_in_flight = 0;
  bool sleeps = true;  ///< in cycles in which it has nothing to do

 private:
  Cycle tick(Cycle now) override {
    std::uint32_t tag = 0;
    while (memory.next_completed(tag)) {
      completed.push_back(now);
      tags.push_back(tag);
      --in_flight_;
    }
    while (left_ > 0 && memory.available()) {
      memory.read(address_, bytes_, static_cast<std::uint32_t>(issued.size()));
      address_ += bytes_;
      issued.push_back(now);
      --left_;
      most_in_flight = std::max(most_in_flight, ++in_flight_);
    }
    return sleeps || (left_ == 0 && in_flight_ == 0) ? memory.next_completion() : now + 1;
  }
  unsigned left_;
  unsigned bytes_;
  unsigned in_flight_ = 0;
  std::uint64_t address_ = 0;
};

/// A timed port and whoever it takes to have one.
class TimedReader : public sc_core::sc_module, public PortOwner {
 public:
  TimedReader(const sc_core::sc_module_name& name, ClockDomain& domain)
      : sc_module(name), PortOwner({&domain, 0}), memory(*this, "memory", {MemoryTraffic::attribute, 2}) {}
  TimedMemoryPort memory;
};

/// A memory of another make: approximately timed, all four phases, processes and time of its own.
class FourPhaseMemory : public sc_core::sc_module, private tlm::tlm_fw_transport_if<> {
 public:
  SC_HAS_PROCESS(FourPhaseMemory);
  FourPhaseMemory(const sc_core::sc_module_name& name, sc_core::sc_time accept, sc_core::sc_time latency)
      : sc_module(name), socket("socket"), accept_(accept), latency_(latency) {
    socket.bind(*this);
    SC_THREAD(serve);
  }
  tlm::tlm_target_socket<32> socket;
  /// How long it keeps a payload after the response.
  void hold(sc_core::sc_time time) { hold_ = time; }
  unsigned begin_requests = 0, end_responses = 0;
  bool overlapped_requests = false;
  bool held_payload_came_again = false;

 private:
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time&) override {
    if (phase == tlm::BEGIN_REQ) {
      overlapped_requests = overlapped_requests || request_open_;
      request_open_ = true;
      ++begin_requests;
      held_payload_came_again = held_payload_came_again || &payload == held_;
      payload.acquire();
      queue_.push_back(&payload);
      arrived_.notify(sc_core::SC_ZERO_TIME);
      return tlm::TLM_ACCEPTED;
    }
    ++end_responses;
    return tlm::TLM_COMPLETED;
  }
  void serve() {
    while (true) {
      while (queue_.empty()) wait(arrived_);
      tlm::tlm_generic_payload* const payload = queue_.front();
      queue_.pop_front();
      wait(accept_);
      tlm::tlm_phase phase = tlm::END_REQ;
      sc_core::sc_time delay;
      request_open_ = false;
      socket->nb_transport_bw(*payload, phase, delay);
      wait(latency_);
      payload->set_response_status(tlm::TLM_OK_RESPONSE);
      phase = tlm::BEGIN_RESP;
      delay = sc_core::SC_ZERO_TIME;
      const tlm::tlm_sync_enum status = socket->nb_transport_bw(*payload, phase, delay);
      if (status == tlm::TLM_COMPLETED || phase == tlm::END_RESP) ++end_responses;
      held_ = payload;
      wait(hold_);
      held_ = nullptr;
      payload->release();
    }
  }
  void b_transport(tlm::tlm_generic_payload&, sc_core::sc_time&) override {}
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  sc_core::sc_time accept_, latency_, hold_;
  sc_core::sc_event arrived_;
  std::deque<tlm::tlm_generic_payload*> queue_;
  const tlm::tlm_generic_payload* held_ = nullptr;  ///< after its response
  bool request_open_ = false;
};

/// Answers one request at a time from a method, which kernels run before threads: at an edge perhaps before the clock.
class MethodMemory : public sc_core::sc_module, private tlm::tlm_fw_transport_if<> {
 public:
  SC_HAS_PROCESS(MethodMemory);
  MethodMemory(const sc_core::sc_module_name& name, sc_core::sc_time accept)
      : sc_module(name), socket("socket"), accept_(accept) {
    socket.bind(*this);
    SC_METHOD(respond);
    sensitive << accepted_;
    dont_initialize();
  }
  tlm::tlm_target_socket<32> socket;

 private:
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time&) override {
    if (phase != tlm::BEGIN_REQ) return tlm::TLM_COMPLETED;
    payload_ = &payload;
    accepted_.notify(accept_);
    return tlm::TLM_ACCEPTED;
  }
  void respond() {
    payload_->set_response_status(tlm::TLM_OK_RESPONSE);
    tlm::tlm_phase phase = tlm::BEGIN_RESP;
    sc_core::sc_time delay = 5 * accept_;
    socket->nb_transport_bw(*payload_, phase, delay);
  }
  void b_transport(tlm::tlm_generic_payload&, sc_core::sc_time&) override {}
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  sc_core::sc_time accept_;
  sc_core::sc_event accepted_;
  tlm::tlm_generic_payload* payload_ = nullptr;
};

/// Answers in the call itself, in one of the ways that the base protocol allows.
class ImmediateMemory : public sc_core::sc_module, private tlm::tlm_fw_transport_if<> {
 public:
  enum class Way { completed, updated_to_response, response_from_within, accepted_from_within, error, sooner_each };
  ImmediateMemory(const sc_core::sc_module_name& name, Way way, sc_core::sc_time delay)
      : sc_module(name), socket("socket"), way_(way), delay_(delay) {
    socket.bind(*this);
  }
  tlm::tlm_target_socket<32> socket;
  unsigned end_responses = 0;

 private:
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    if (phase == tlm::END_RESP) {
      ++end_responses;
      return tlm::TLM_COMPLETED;
    }
    payload.set_response_status(way_ == Way::error ? tlm::TLM_ADDRESS_ERROR_RESPONSE : tlm::TLM_OK_RESPONSE);
    switch (way_) {
      case Way::sooner_each:
        delay += delay_;
        delay_ -= sc_core::sc_time(2, sc_core::SC_NS);
        return tlm::TLM_COMPLETED;
      case Way::completed:
      case Way::error: delay += delay_; return tlm::TLM_COMPLETED;
      case Way::updated_to_response:
        delay += delay_;
        phase = tlm::BEGIN_RESP;
        return tlm::TLM_UPDATED;
      case Way::accepted_from_within: {
        tlm::tlm_phase back = tlm::END_REQ;
        sc_core::sc_time none;
        socket->nb_transport_bw(payload, back, none);
        [[fallthrough]];
      }
      case Way::response_from_within: {
        tlm::tlm_phase back = tlm::BEGIN_RESP;
        sc_core::sc_time after = delay_;
        socket->nb_transport_bw(payload, back, after);
        return tlm::TLM_ACCEPTED;
      }
    }
    return tlm::TLM_COMPLETED;
  }
  void b_transport(tlm::tlm_generic_payload&, sc_core::sc_time&) override {}
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  Way way_;
  sc_core::sc_time delay_;
};

/// Stands between a port and its memory, so that they have to keep to the protocol.
class Relay : public sc_core::sc_module, private tlm::tlm_fw_transport_if<>, private tlm::tlm_bw_transport_if<> {
 public:
  explicit Relay(const sc_core::sc_module_name& name) : sc_module(name), in("in"), out("out") {
    in.bind(*static_cast<tlm::tlm_fw_transport_if<>*>(this));
    out.bind(*static_cast<tlm::tlm_bw_transport_if<>*>(this));
  }
  tlm::tlm_target_socket<32> in;
  tlm::tlm_initiator_socket<32> out;
  unsigned accesses = 0;
  MemoryRequest last;

 private:
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    ++accesses;
    last = request_of(payload);
    return out->nb_transport_fw(payload, phase, delay);
  }
  tlm::tlm_sync_enum nb_transport_bw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    return in->nb_transport_bw(payload, phase, delay);
  }
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    ++accesses;
    last = request_of(payload);
    out->b_transport(payload, delay);
  }
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }
  void invalidate_direct_mem_ptr(sc_dt::uint64, sc_dt::uint64) override {}
};

std::unique_ptr<Relay> bind(tlm::tlm_initiator_socket<32>& port, FixedLatencyMemory& memory, bool relayed) {
  if (!relayed) {
    port.bind(memory.port(0));
    return nullptr;
  }
  auto relay = std::make_unique<Relay>("relay");
  port.bind(relay->in);
  relay->out.bind(memory.port(0));
  return relay;
}

class MemoryPortTest : public ::testing::Test {
 protected:
  MemoryPortTest() {
    fresh_simulation();
    clock = std::make_unique<ClockDomain>("clock", 1000);
  }
  sc_core::sc_time cycles(double count) const { return sc_core::sc_time(1000.0 * count, sc_core::SC_PS); }
  std::unique_ptr<ClockDomain> clock;
};

TEST_F(MemoryPortTest, WhatEndsAtAnEdgeIsSeenInTheNextWhetherOrNotTheUnitSleeps) {
  for (const double accept : {0.5, 1.0, 1.5, 3.0}) {
    std::vector<Cycle> issued[2];
    for (const bool sleeps : {false, true}) {
      fresh_simulation();
      clock = std::make_unique<ClockDomain>("clock", 1000);
      ClockedReader reader("reader", *clock, 4, 6);
      reader.sleeps = sleeps;
      MethodMemory memory("memory", cycles(accept));
      reader.memory.socket.bind(memory.socket);
      clock->run(cycles(100));
      issued[sleeps ? 1 : 0] = reader.issued;
      EXPECT_EQ(reader.completed.size(), 6U);
    }
    EXPECT_EQ(issued[1], issued[0]) << accept;
  }
}

TEST_F(MemoryPortTest, AFixedLatencyMemoryAnswersAfterLatencyAndTransfer) {
  ClockedReader reader("reader", *clock, 4, 1);
  FixedLatencyMemory memory("memory", *clock, 10, 32, 1);
  reader.memory.socket.bind(memory.port(0));
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{11}));
  EXPECT_EQ(memory.bytes(), 32u);
  EXPECT_EQ(reader.tags, (std::vector<std::uint32_t>{0}));
}

TEST_F(MemoryPortTest, AFixedLatencyMemoryMovesItsBytesPerCycle) {
  ClockedReader reader("reader", *clock, 8, 8);
  FixedLatencyMemory memory("memory", *clock, 10, 64, 1);
  reader.memory.socket.bind(memory.port(0));
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{11, 11, 12, 12, 13, 13, 14, 14}));
}

TEST_F(MemoryPortTest, AMemoryAskedDirectlyAnswersInTheSameCyclesAsThroughItsSocket) {
  for (const unsigned bytes_per_cycle : {7U, 16U, 32U, 64U, 1024U}) {
    std::vector<Cycle> issued, completed;
    for (const bool relayed : {false, true}) {
      fresh_simulation();
      clock = std::make_unique<ClockDomain>("clock", 735);
      ClockedReader reader("reader", *clock, 5, 40);
      FixedLatencyMemory memory("memory", *clock, 10, bytes_per_cycle, 1);
      const std::unique_ptr<Relay> relay = bind(reader.memory.socket, memory, relayed);
      sc_core::sc_start();
      EXPECT_EQ(memory.bytes(), 40U * 32U);
      if (relayed) {
        EXPECT_EQ(relay->accesses, 40U);
        EXPECT_EQ(reader.issued, issued) << bytes_per_cycle;
        EXPECT_EQ(reader.completed, completed) << bytes_per_cycle;
      }
      issued = reader.issued;
      completed = reader.completed;
    }
    EXPECT_EQ(completed.size(), 40U);
  }
}

TEST_F(MemoryPortTest, AMemoryOfAnotherClockIsAskedThroughItsSocket) {
  ClockDomain slow("slow", 4000);
  ClockedReader reader("reader", *clock, 2, 2);
  FixedLatencyMemory memory("memory", slow, 10, 32, 1);
  reader.memory.socket.bind(memory.port(0));
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{44, 48})) << "11 and 12 of its cycles";
}

TEST_F(MemoryPortTest, NoMoreAccessesAreInFlightThanItHasSlots) {
  ClockedReader reader("reader", *clock, 3, 20);
  FixedLatencyMemory memory("memory", *clock, 50, 1024, 1);
  reader.memory.socket.bind(memory.port(0));
  sc_core::sc_start();
  EXPECT_EQ(reader.most_in_flight, 3u);
  EXPECT_EQ(reader.completed.size(), 20u);
}

TEST_F(MemoryPortTest, AFourPhaseMemoryWithTimeOfItsOwnIsServedWhileAllUnitsSleep) {
  ClockedReader reader("reader", *clock, 4, 5);
  FourPhaseMemory memory("memory", cycles(3), cycles(40.5));
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  ASSERT_EQ(reader.completed.size(), 5u);
  // Accepted at 3, answered at 43.5, seen at the next edge.
  EXPECT_EQ(reader.completed[0], 44u);
  EXPECT_EQ(reader.completed[1], 88u) << "one at a time: 43.5 more, then the next edge";
  EXPECT_FALSE(memory.overlapped_requests);
  EXPECT_EQ(memory.begin_requests, 5u);
  EXPECT_EQ(memory.end_responses, 5u);
}

TEST_F(MemoryPortTest, AnAnswerAtAnEdgeIsSeenACycleLater) {
  ClockedReader reader("reader", *clock, 1, 1);
  FourPhaseMemory memory("memory", cycles(2), cycles(8));
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{11}));
}

TEST_F(MemoryPortTest, TheNextRequestWaitsForTheEndOfTheLast) {
  ClockedReader reader("reader", *clock, 4, 2);
  FourPhaseMemory memory("memory", cycles(6), cycles(100));
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  EXPECT_EQ(reader.issued, (std::vector<Cycle>{0, 7}));
}

TEST_F(MemoryPortTest, APayloadThatTheMemoryStillHoldsIsNotUsedAgain) {
  ClockedReader reader("reader", *clock, 1, 2);
  FourPhaseMemory memory("memory", cycles(2), cycles(8));
  memory.hold(cycles(20));
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  EXPECT_EQ(reader.issued, (std::vector<Cycle>{0, 11})) << "answered at 10, held until 30";
  EXPECT_FALSE(memory.held_payload_came_again);
}

class EarlyCompletion : public MemoryPortTest, public ::testing::WithParamInterface<ImmediateMemory::Way> {};

TEST_P(EarlyCompletion, IsSeenAfterTheAnnotatedDelay) {
  ClockedReader reader("reader", *clock, 2, 3);
  ImmediateMemory memory("memory", GetParam(), cycles(9.5));
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{10, 10, 20}));
}

TEST_P(EarlyCompletion, IsSeenInTheNextCycleAtTheEarliest) {
  ClockedReader reader("reader", *clock, 1, 2);
  ImmediateMemory memory("memory", GetParam(), sc_core::SC_ZERO_TIME);
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{1, 2}));
}

const char* name_of(ImmediateMemory::Way way) {
  constexpr const char* names[] = {"Completed", "UpdatedToResponse", "ResponseFromWithin", "AcceptedFromWithin",
                                   "Error"};
  return names[static_cast<int>(way)];
}

INSTANTIATE_TEST_SUITE_P(Ways, EarlyCompletion,
                         ::testing::Values(ImmediateMemory::Way::completed, ImmediateMemory::Way::updated_to_response,
                                           ImmediateMemory::Way::response_from_within,
                                           ImmediateMemory::Way::accepted_from_within),
                         [](const auto& way) { return std::string(name_of(way.param)); });

TEST_F(MemoryPortTest, AnswersOutOfOrderComeBackWhenEachIsThere) {
  ClockedReader reader("reader", *clock, 4, 4);
  ImmediateMemory memory("memory", ImmediateMemory::Way::sooner_each, cycles(10));
  reader.memory.socket.bind(memory.socket);
  clock->run(cycles(100));
  EXPECT_EQ(reader.issued, (std::vector<Cycle>{0, 0, 0, 0}));
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{4, 6, 8, 10}));
  EXPECT_EQ(reader.tags, (std::vector<std::uint32_t>{3, 2, 1, 0}));
}

TEST_F(MemoryPortTest, AnErrorResponseIsAFault) {
  ClockedReader reader("reader", *clock, 1, 1);
  ImmediateMemory memory("memory", ImmediateMemory::Way::error, sc_core::SC_ZERO_TIME);
  reader.memory.socket.bind(memory.socket);
  EXPECT_THROW(clock->run(cycles(100)), SimulationFault);
}

TEST_F(MemoryPortTest, ATimedPortAsksInTheSameCyclesDirectlyAsThroughTheSocket) {
  for (const unsigned bytes_per_cycle : {7U, 32U, 64U}) {
    std::vector<Cycle> completed[2];
    for (const bool relayed : {false, true}) {
      fresh_simulation();
      clock = std::make_unique<ClockDomain>("clock", 735);
      TimedReader reader("reader", *clock);
      FixedLatencyMemory memory("memory", *clock, 10, bytes_per_cycle, 1);
      const std::unique_ptr<Relay> relay = bind(reader.memory.socket, memory, relayed);
      for (std::uint64_t i = 0; i < 40; ++i) completed[relayed].push_back(reader.memory.read(64 * i, 64, 3 * i / 2));
      EXPECT_EQ(relayed ? relay->accesses : 40U, 40U);
    }
    EXPECT_EQ(completed[0], completed[1]) << bytes_per_cycle;
    EXPECT_EQ(completed[0][0], 10U + (63U + bytes_per_cycle) / bytes_per_cycle);
  }
}

TEST_F(MemoryPortTest, ATimedPortAsksOutOfOrderAndBehindTheClockInTheSameCyclesEitherWay) {
  for (const std::uint64_t stream : {1U, 2U, 3U}) {
    std::vector<Cycle> completed[2];
    for (const bool relayed : {false, true}) {
      fresh_simulation();
      clock = std::make_unique<ClockDomain>("clock", 735);
      TimedReader reader("reader", *clock);
      ClockedReader later("later", *clock, 1, 0);  // for the clock to advance
      FixedLatencyMemory memory("memory", *clock, 10, 48, 2);
      const std::unique_ptr<Relay> relay = bind(reader.memory.socket, memory, relayed);
      later.memory.socket.bind(memory.port(1));
      clock->run(cycles(2));
      clock->wake(later.clock.unit, 500);
      clock->run(cycles(1000));
      ASSERT_EQ(clock->now(), 500U);
      for (std::uint64_t i = 0; i < 300; ++i) {
        const Cycle at = 470 + mix(stream << 32U | i) % 300;
        completed[relayed].push_back(i % 3 == 0 ? reader.memory.write(64 * i, 64, at)
                                                : reader.memory.read(64 * i, 64, at));
      }
      EXPECT_EQ(memory.traffic().accesses(MemoryTraffic::attribute, false), 200U);
      EXPECT_EQ(memory.traffic().bytes(MemoryTraffic::attribute, true), 6400U);
    }
    EXPECT_EQ(completed[0], completed[1]);
  }
}

TEST_F(MemoryPortTest, AnAccessAheadOfTimeDoesNotDelayAnEarlierOne) {
  TimedReader reader("reader", *clock);
  FixedLatencyMemory memory("memory", *clock, 10, 32, 1);
  reader.memory.socket.bind(memory.port(0));
  clock->run(cycles(1));
  for (Cycle at = 4000; at < 4100; ++at) EXPECT_EQ(reader.memory.read(0, 32, at), at + 11);
  EXPECT_EQ(reader.memory.read(0, 32, 7), 18U);
}

TEST_F(MemoryPortTest, ABlockingMemoryOfAnotherMakeIsAskedAheadOfTheClockAndBehindIt) {
  TimedReader reader("reader", *clock);
  ClockedReader later("later", *clock, 1, 0);
  foreign::Dram dram("dram", cycles(0), cycles(10), cycles(25.5));
  dram.never_refresh();
  FixedLatencyMemory memory("memory", *clock, 10, 32, 1);
  reader.memory.socket.bind(dram.socket);
  later.memory.socket.bind(memory.port(0));
  clock->run(cycles(2));
  clock->wake(later.clock.unit, 500);
  clock->run(cycles(1000));
  EXPECT_EQ(reader.memory.read(4096, 32, 600), 626U);
  EXPECT_EQ(reader.memory.read(4128, 32, 700), 710U);
  EXPECT_EQ(reader.memory.read(4160, 32, 480), 490U) << "its cycle, though the annotation cannot say so";
}

/// Waits where it should annotate its time.
class WaitingMemory : public sc_core::sc_module {
 public:
  explicit WaitingMemory(const sc_core::sc_module_name& name) : sc_module(name), socket("socket") {
    socket.register_b_transport(this, &WaitingMemory::b_transport);
  }
  tlm_utils::simple_target_socket<WaitingMemory> socket;

 private:
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time&) {
    wait(20, sc_core::SC_NS);
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
  }
};

/// A unit of lt that reads once.
class OneRead : public sc_core::sc_module, public Clocked, public PortOwner {
 public:
  OneRead(const sc_core::sc_module_name& name, ClockDomain& domain)
      : sc_module(name), PortOwner({&domain, domain.attach(*this)}), memory(*this, "memory") {}
  TimedMemoryPort memory;

 private:
  Cycle tick(Cycle now) override {
    memory.read(0, 32, now);
    return never;
  }
};

TEST_F(MemoryPortTest, ABlockingMemoryThatWaitsIsNamed) {
  OneRead reader("reader", *clock);
  WaitingMemory memory("memory");
  reader.memory.socket.bind(memory.socket);
  try {
    clock->run(cycles(10));
    FAIL() << "it waited";
  } catch (const SimulationFault& fault) {
    const std::string what = fault.what();
    EXPECT_NE(what.find("reader.memory"), std::string::npos) << what;
    EXPECT_NE(what.find("must not wait"), std::string::npos) << what;
  }
}

TEST_F(MemoryPortTest, AtCycleABlockingMemoryMayWait) {
  ClockedReader reader("reader", *clock, 2, 3);
  WaitingMemory memory("memory");
  reader.memory.socket.bind(memory.socket);
  EXPECT_TRUE(clock->run_to_rest(cycles(1000)));
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{21, 42, 63})) << "one at a time, by the socket's own process";
}

TEST_F(MemoryPortTest, ARequestSaysWhoAsksAndForWhat) {
  ClockedReader reader("reader", *clock, 2, 3);
  FixedLatencyMemory memory("memory", *clock, 10, 32, 1);
  const std::unique_ptr<Relay> relay = bind(reader.memory.socket, memory, true);
  clock->run(cycles(100));
  EXPECT_EQ(relay->last.address, 64U);
  EXPECT_EQ(relay->last.bytes, 32U);
  EXPECT_EQ(relay->last.command, tlm::TLM_READ_COMMAND);
  EXPECT_EQ(relay->last.origin.traffic, MemoryTraffic::vertex);
  EXPECT_EQ(relay->last.origin.gpc, 3U);
  for (const Counter* counter : memory.counters()) {
    const std::string name = counter->name();
    EXPECT_EQ(counter->value(), name == "vertex_reads" ? 3U : name == "vertex_bytes_read" ? 96U : 0U) << name;
  }
  EXPECT_EQ(memory.counters().size(), 4 * memory_traffics);
}

TEST_F(MemoryPortTest, AnAccessOnBehalfOfAnotherKeepsItsOrigin) {
  const MemoryRequest request{256, 64, tlm::TLM_WRITE_COMMAND, {MemoryTraffic::depth_stencil, 7}};
  TimedReader timed("timed", *clock);
  ClockedReader reader("reader", *clock, 4, 0);
  FixedLatencyMemory memory("memory", *clock, 10, 64, 2);
  const std::unique_ptr<Relay> relay = bind(timed.memory.socket, memory, true);
  reader.memory.socket.bind(memory.port(1));
  clock->run(cycles(1));
  timed.memory.access(request, 5);
  EXPECT_EQ(relay->last.origin.traffic, MemoryTraffic::depth_stencil);
  EXPECT_EQ(relay->last.origin.gpc, 7U);
  reader.memory.access(request, 0);  // through the socket, since it is the first
  reader.memory.access(request, 1);
  EXPECT_EQ(memory.traffic().accesses(MemoryTraffic::depth_stencil, true), 3U);
  EXPECT_EQ(memory.traffic().bytes(MemoryTraffic::depth_stencil, true), 192U);
}

TEST_F(MemoryPortTest, AnInitiatorOfAnotherMakeIsServedWithoutAnOrigin) {
  tlm::tlm_generic_payload payload;
  payload.set_command(tlm::TLM_WRITE_COMMAND);
  payload.set_address(64);
  payload.set_data_length(16);
  EXPECT_EQ(request_of(payload).address, 64U);
  EXPECT_EQ(request_of(payload).origin.traffic, MemoryTraffic::other);
  EXPECT_STREQ(name_of(MemoryTraffic::depth_stencil), "depth_stencil");
}

TEST_F(MemoryPortTest, AMemoryOfAnotherMakeAnswersOutOfOrderUnderBackPressureAndRefresh) {
  ClockedReader reader("reader", *clock, 16, 2000, 256);
  foreign::Dram dram("dram", cycles(1.3), cycles(30.7), cycles(61.1));
  reader.memory.socket.bind(dram.socket);
  while (!clock->run_to_rest(cycles(1000))) {}
  EXPECT_EQ(reader.completed.size(), 2000U);
  EXPECT_EQ(dram.responses, 2000U);
  EXPECT_GT(dram.out_of_order, 0U);
  EXPECT_GT(dram.refreshes, 1U);
  EXPECT_TRUE(sc_core::sc_pending_activity()) << "the refresh never ends";
  std::vector<std::uint32_t> tags = reader.tags;
  EXPECT_FALSE(std::is_sorted(tags.begin(), tags.end()));
  std::sort(tags.begin(), tags.end());
  for (std::uint32_t tag = 0; tag < 2000; ++tag) ASSERT_EQ(tags[tag], tag);
  for (std::size_t i = 1; i < reader.issued.size(); ++i) ASSERT_GE(reader.issued[i] - reader.issued[i - 1], 2U);
}

TEST_F(MemoryPortTest, TheKernelKeepsStepWithTheClockWhereAMemoryHasTimeOfItsOwn) {
  for (const unsigned kind : {0U, 1U, 2U}) {
    fresh_simulation();
    clock = std::make_unique<ClockDomain>("clock", 1000);
    ClockDomain slow("slow", 4000);
    ClockedReader reader("reader", *clock, 1, 10);
    FixedLatencyMemory memory("memory", kind == 1 ? slow : *clock, 2, 32, 1);
    const std::unique_ptr<Relay> relay = bind(reader.memory.socket, memory, kind == 2);
    clock->set_cycles_per_activation(64);
    clock->run(cycles(1000));
    EXPECT_EQ(reader.completed.size(), 10U);
    EXPECT_EQ(clock->activations() < clock->edges(), kind == 0) << kind;
  }
}

/// Answers at once, from a table that depends on sc_time.
class DriftingMemory : public sc_core::sc_module, private tlm::tlm_fw_transport_if<>, public EarlyCompletionMemory {
 public:
  DriftingMemory(const sc_core::sc_module_name& name, const ClockDomain& domain)
      : sc_module(name), socket("socket"), domain_(domain) {
    socket.bind(*this);
  }
  tlm::tlm_target_socket<32> socket;

 private:
  Cycle serve(const MemoryRequest&, Cycle arrival) override { return arrival + 3; }
  const ClockDomain& clock() const override { return domain_; }
  bool has_own_time() const override { return true; }
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase&,
                                     sc_core::sc_time& delay) override {
    b_transport(payload, delay);
    return tlm::TLM_COMPLETED;
  }
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    delay += 3 * domain_.period();
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
  }
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  const ClockDomain& domain_;
};

TEST_F(MemoryPortTest, AnEarlyCompletionMemoryMayDeclareTimeOfItsOwn) {
  ClockedReader reader("reader", *clock, 1, 10);
  DriftingMemory memory("memory", *clock);
  reader.memory.socket.bind(memory.socket);
  clock->set_cycles_per_activation(64);
  clock->run(cycles(200));
  EXPECT_EQ(reader.completed.size(), 10U);
  EXPECT_EQ(clock->activations(), clock->edges());
}

/// What is thrown once the clock does not come to rest.
std::string fault_before_rest(ClockDomain& clock) {
  return testing::refusal_of<SimulationFault>([&] {
    while (!clock.run_to_rest(sc_core::sc_time(100, sc_core::SC_US))) {}
  });
}

TEST_F(MemoryPortTest, AMemoryThatFallsSilentIsNamedWithTheOldestRequest) {
  ClockedReader reader("reader", *clock, 4, 100);
  foreign::Dram dram("dram", cycles(1), cycles(30), cycles(60));
  dram.fall_silent_after(10);
  reader.memory.socket.bind(dram.socket);
  const std::string what = fault_before_rest(*clock);
  EXPECT_NE(what.find("reader.memory at cycle"), std::string::npos) << what;
  EXPECT_NE(what.find("the read of 32 bytes at address 320 in cycle"), std::string::npos) << what;
  EXPECT_NE(what.find("the oldest of 4"), std::string::npos) << what;
  EXPECT_GE(sc_core::sc_time_stamp(), ClockDomain::longest_silence());
  EXPECT_LE(sc_core::sc_time_stamp(), ClockDomain::longest_silence() + sc_core::sc_time(1, sc_core::SC_MS));
}

TEST_F(MemoryPortTest, AMemoryWithoutTimersThatFallsSilentIsNamedAtOnce) {
  ClockedReader reader("reader", *clock, 4, 100);
  foreign::Dram dram("dram", cycles(1), cycles(30), cycles(60));
  dram.never_refresh();
  dram.fall_silent_after(0);
  reader.memory.socket.bind(dram.socket);
  const std::string what = fault_before_rest(*clock);
  EXPECT_NE(what.find("the read of 32 bytes at address 0 in cycle 0, the oldest of 4"), std::string::npos) << what;
  EXPECT_NE(what.find("nothing is left that could answer"), std::string::npos) << what;
  EXPECT_LE(sc_core::sc_time_stamp(), sc_core::sc_time(100, sc_core::SC_US));
}

TEST_F(MemoryPortTest, AnErrorResponseFromAProcessOfTheMemoryIsAFaultOfThePort) {
  ClockedReader reader("reader", *clock, 4, 100);
  foreign::Dram dram("dram", cycles(1), cycles(30), cycles(60));
  dram.answer_with(tlm::TLM_ADDRESS_ERROR_RESPONSE);
  reader.memory.socket.bind(dram.socket);
  const std::string what = fault_before_rest(*clock);
  EXPECT_NE(what.find("reader.memory at cycle"), std::string::npos) << what;
  EXPECT_NE(what.find("TLM_ADDRESS_ERROR_RESPONSE"), std::string::npos) << what;
}

TEST_F(MemoryPortTest, AnAccessThatIsNotNaturallyAlignedIsRefused) {
  ClockedReader reader("reader", *clock, 8, 0);
  FixedLatencyMemory memory("memory", *clock, 1, 32, 1);
  reader.memory.socket.bind(memory.port(0));
  for (const auto& [address, bytes] : {std::pair{16U, 32U}, {8U, 16U}, {0U, 48U}, {0U, 0U}, {1U, 2U}}) {
    EXPECT_THROW(reader.memory.read(address, bytes, 0), SimulationFault) << address << " " << bytes;
    EXPECT_THROW(reader.memory.write(address, bytes, 0), SimulationFault) << address << " " << bytes;
  }
  EXPECT_NO_THROW(reader.memory.read(32, 32, 0));
}

}  // namespace
}  // namespace vrpipe
