#include <vrpipe/memory_port.h>

#include <deque>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/error.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/timed.h>

namespace vrpipe {
namespace {

/// Reads line after line as fast as the port allows, and keeps when each came back.
class Reader : public sc_core::sc_module, public Clocked, public PortOwner {
 public:
  Reader(const sc_core::sc_module_name& name, ClockDomain& domain, unsigned in_flight, unsigned accesses,
         unsigned bytes = 32)
      : sc_module(name),
        PortOwner({&domain, domain.attach(*this)}),
        memory(*this, "memory", in_flight),
        left_(accesses),
        bytes_(bytes) {}

  MemoryPort memory;
  std::vector<Cycle> issued, completed;
  std::vector<std::uint32_t> tags;  ///< of what came back; accesses are numbered
  unsigned most_in_flight = 0;

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
    return memory.next_completion();
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
      : sc_module(name), PortOwner({&domain, 0}), memory(*this, "memory") {}
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

 private:
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    ++accesses;
    return out->nb_transport_fw(payload, phase, delay);
  }
  tlm::tlm_sync_enum nb_transport_bw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    return in->nb_transport_bw(payload, phase, delay);
  }
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    ++accesses;
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

TEST_F(MemoryPortTest, AFixedLatencyMemoryAnswersAfterLatencyAndTransfer) {
  Reader reader("reader", *clock, 4, 1);
  FixedLatencyMemory memory("memory", *clock, 10, 32, 1);
  reader.memory.socket.bind(memory.port(0));
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{11}));
  EXPECT_EQ(memory.bytes(), 32u);
  EXPECT_EQ(reader.tags, (std::vector<std::uint32_t>{0}));
}

TEST_F(MemoryPortTest, AFixedLatencyMemoryMovesItsBytesPerCycle) {
  Reader reader("reader", *clock, 8, 8);
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
      Reader reader("reader", *clock, 5, 40);
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
  Reader reader("reader", *clock, 2, 2);
  FixedLatencyMemory memory("memory", slow, 10, 32, 1);
  reader.memory.socket.bind(memory.port(0));
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{44, 48})) << "11 and 12 of its cycles";
}

TEST_F(MemoryPortTest, NoMoreAccessesAreInFlightThanItHasSlots) {
  Reader reader("reader", *clock, 3, 20);
  FixedLatencyMemory memory("memory", *clock, 50, 1024, 1);
  reader.memory.socket.bind(memory.port(0));
  sc_core::sc_start();
  EXPECT_EQ(reader.most_in_flight, 3u);
  EXPECT_EQ(reader.completed.size(), 20u);
}

TEST_F(MemoryPortTest, AFourPhaseMemoryWithTimeOfItsOwnIsServedWhileAllUnitsSleep) {
  Reader reader("reader", *clock, 4, 5);
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
  Reader reader("reader", *clock, 1, 1);
  FourPhaseMemory memory("memory", cycles(2), cycles(8));
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{11}));
}

TEST_F(MemoryPortTest, TheNextRequestWaitsForTheEndOfTheLast) {
  Reader reader("reader", *clock, 4, 2);
  FourPhaseMemory memory("memory", cycles(6), cycles(100));
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  EXPECT_EQ(reader.issued, (std::vector<Cycle>{0, 7}));
}

TEST_F(MemoryPortTest, APayloadThatTheMemoryStillHoldsIsNotUsedAgain) {
  Reader reader("reader", *clock, 1, 2);
  FourPhaseMemory memory("memory", cycles(2), cycles(8));
  memory.hold(cycles(20));
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  EXPECT_EQ(reader.issued, (std::vector<Cycle>{0, 11})) << "answered at 10, held until 30";
  EXPECT_FALSE(memory.held_payload_came_again);
}

class EarlyCompletion : public MemoryPortTest, public ::testing::WithParamInterface<ImmediateMemory::Way> {};

TEST_P(EarlyCompletion, IsSeenAfterTheAnnotatedDelay) {
  Reader reader("reader", *clock, 2, 3);
  ImmediateMemory memory("memory", GetParam(), cycles(9.5));
  reader.memory.socket.bind(memory.socket);
  sc_core::sc_start();
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{10, 10, 20}));
}

TEST_P(EarlyCompletion, IsSeenInTheNextCycleAtTheEarliest) {
  Reader reader("reader", *clock, 1, 2);
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
  Reader reader("reader", *clock, 4, 4);
  ImmediateMemory memory("memory", ImmediateMemory::Way::sooner_each, cycles(10));
  reader.memory.socket.bind(memory.socket);
  clock->run(cycles(100));
  EXPECT_EQ(reader.issued, (std::vector<Cycle>{0, 0, 0, 0}));
  EXPECT_EQ(reader.completed, (std::vector<Cycle>{4, 6, 8, 10}));
  EXPECT_EQ(reader.tags, (std::vector<std::uint32_t>{3, 2, 1, 0}));
}

TEST_F(MemoryPortTest, AnErrorResponseIsAFault) {
  Reader reader("reader", *clock, 1, 1);
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

TEST_F(MemoryPortTest, AnAccessThatIsNotNaturallyAlignedIsRefused) {
  Reader reader("reader", *clock, 8, 0);
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
