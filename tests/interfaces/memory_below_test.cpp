// The L2 with a memory below it: a cache of unbounded capacity.

#include <algorithm>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tlm_utils/simple_initiator_socket.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/platforms/simulation.h>

#include "support/foreign_memory.h"
#include "support/memory_initiators.h"

namespace vrpipe {
namespace {

/// A memory of another make that keeps what it was asked; 50 ns for each.
class Recorder : public sc_core::sc_module {
 public:
  explicit Recorder(const sc_core::sc_module_name& name) : sc_module(name), socket("socket") {
    socket.register_b_transport(this, &Recorder::b_transport);
    socket.register_nb_transport_fw(this, &Recorder::nb_transport_fw);
  }
  tlm_utils::simple_target_socket<Recorder> socket;
  std::vector<MemoryRequest> requests;
  tlm::tlm_response_status status = tlm::TLM_OK_RESPONSE;

 private:
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) {
    requests.push_back(request_of(payload));
    delay += sc_core::sc_time(50, sc_core::SC_NS);
    payload.set_response_status(status);
  }
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) {
    if (phase == tlm::BEGIN_REQ) b_transport(payload, delay);
    return tlm::TLM_COMPLETED;
  }
};

// Of the L2: 32 bytes a cycle. Of the memory below: two cycles for a sector.
constexpr Cycle l2_latency = 10;
constexpr Cycle fill_cycles = 40 + 2;
/// Of 32 bytes.
constexpr Cycle hit_cycles = l2_latency + 1;
constexpr Cycle miss_cycles = 1 + fill_cycles + hit_cycles;

class MemoryBelowTest : public ::testing::Test {
 protected:
  MemoryBelowTest() { start(); }
  void start() {
    fresh_simulation();
    clock = std::make_unique<ClockDomain>("clock", 1000);
  }
  sc_core::sc_time cycles(double count) const { return sc_core::sc_time(1000.0 * count, sc_core::SC_PS); }

  std::unique_ptr<FixedLatencyMemory> make_l2(MemoryBelow below, unsigned ports = 1) {
    return std::make_unique<FixedLatencyMemory>("l2", *clock, l2_latency, 32, ports, below);
  }
  /// When each access completes that a unit makes. Those of `cycle` are in the order of time.
  std::vector<Cycle> completed(FixedLatencyMemory& l2, MemoryBelow below, const std::vector<Access>& accesses) {
    if (below != MemoryBelow::annotated) {
      ClockedInitiator unit("unit", *clock, accesses);
      unit.memory.socket.bind(l2.port(0));
      while (!clock->run_to_rest(cycles(1000))) {}
      return unit.completed;
    }
    TimedInitiator unit("unit", *clock);
    unit.memory.socket.bind(l2.port(0));
    clock->run(cycles(1));
    std::vector<Cycle> completed;
    for (const Access& access : accesses) completed.push_back(unit.memory.access(access.request, access.at));
    return completed;
  }
  std::unique_ptr<ClockDomain> clock;
};

class MemoryBelowAtEachFidelity : public MemoryBelowTest, public ::testing::WithParamInterface<MemoryBelow> {
 protected:
  /// Of an L2 with a memory of fixed latency below it.
  std::vector<Cycle> completed(const std::vector<Access>& accesses) {
    start();
    l2 = make_l2(GetParam());
    below = std::make_unique<FixedLatencyMemory>("below", *clock, 40, 16, 1);
    l2->below().bind(below->port(0));
    return MemoryBelowTest::completed(*l2, GetParam(), accesses);
  }
  std::uint64_t fetched() const { return below->traffic().accesses(MemoryTraffic::color, false); }
  std::unique_ptr<FixedLatencyMemory> l2, below;
};

INSTANTIATE_TEST_SUITE_P(With, MemoryBelowAtEachFidelity,
                         ::testing::Values(MemoryBelow::annotated, MemoryBelow::clocked), [](const auto& below) {
                           return std::string(below.param == MemoryBelow::clocked ? "Clocked" : "Annotated");
                         });

TEST_F(MemoryBelowTest, InAClockOfItsOwnOfHalfTheFrequencyAMemoryTakesTwiceAsLongAndMovesHalfAsMuch) {
  for (const MemoryBelow time : {MemoryBelow::none, MemoryBelow::annotated}) {
    start();
    FixedLatencyMemory memory("memory", *clock, l2_latency, std::vector<unsigned>{32}, MemoryBelow::none, 2000);
    constexpr Cycle takes = 2 * hit_cycles;
    // It takes what comes between two of its edges at the later one.
    EXPECT_EQ(completed(memory, time, {read(100, 0), read(100, 64), read(301, 0)}),
              (std::vector<Cycle>{100 + takes, 100 + takes + 2, 302 + takes}));
    EXPECT_EQ(memory.peak_rate(), 16);
    EXPECT_EQ(memory.bytes(), 96U);
    EXPECT_EQ(memory.bytes(101), 0U) << "a cycle of its own is not over";
    EXPECT_EQ(memory.bytes(102), 32U);
  }
}

TEST_P(MemoryBelowAtEachFidelity, ASectorIsFetchedWhenItIsFirstRead) {
  EXPECT_EQ(completed({read(100, 64), read(300, 64)}), (std::vector<Cycle>{100 + miss_cycles, 300 + hit_cycles}));
  EXPECT_EQ(fetched(), 1U);
  EXPECT_EQ(below->bytes(), 32U);
}

TEST_P(MemoryBelowAtEachFidelity, AReadOfASectorOnItsWayWaitsForThatFill) {
  const Cycle there = 100 + 1 + fill_cycles;
  EXPECT_EQ(completed({read(100, 64), read(120, 64), read(there, 64)}),
            (std::vector<Cycle>{there + hit_cycles, there + 1 + hit_cycles, there + 2 + hit_cycles}));
  EXPECT_EQ(fetched(), 1U);
}

TEST_P(MemoryBelowAtEachFidelity, AWriteOfWholeSectorsNeedsNoFill) {
  EXPECT_EQ(completed({write(100, 64, 64), read(200, 64), read(300, 96)}),
            (std::vector<Cycle>{100 + l2_latency + 2, 200 + hit_cycles, 300 + hit_cycles}));
  EXPECT_EQ(fetched(), 0U);
}

TEST_P(MemoryBelowAtEachFidelity, AWriteOfPartOfASectorFetchesIt) {
  EXPECT_EQ(completed({write(100, 80, 16), write(200, 64, 16)}),
            (std::vector<Cycle>{100 + miss_cycles, 200 + hit_cycles}));
  EXPECT_EQ(fetched(), 1U);
}

TEST_P(MemoryBelowAtEachFidelity, WhatIsWrittenWholeWhileItIsOnItsWayIsThere) {
  EXPECT_EQ(completed({read(100, 64), write(110, 64), read(120, 64)}),
            (std::vector<Cycle>{100 + miss_cycles, 110 + hit_cycles, 120 + hit_cycles}));
  EXPECT_EQ(fetched(), 1U);
}

TEST_P(MemoryBelowAtEachFidelity, AnAccessToSeveralSectorsWaitsForTheLast) {
  // The memory below takes two cycles for each; then four sectors move from the L2.
  EXPECT_EQ(completed({read(100, 0, 32), read(200, 0, 128)}),
            (std::vector<Cycle>{100 + miss_cycles, 200 + 1 + (40 + 3 * 2) + l2_latency + 4}));
  EXPECT_EQ(fetched(), 4U) << "32 bytes each";
}

TEST_P(MemoryBelowAtEachFidelity, NothingIsWrittenBack) {
  completed({write(100, 0, 128), write(200, 128, 16), read(300, 256)});
  EXPECT_EQ(below->traffic().accesses(MemoryTraffic::color, true), 0U);
}

TEST_P(MemoryBelowAtEachFidelity, WhatIsThereTakesAsLongAsWithoutAMemoryBelow) {
  std::vector<Access> accesses;
  for (std::uint64_t address = 0; address < 2048; address += 128)
    accesses.push_back(write(2 * address / 32, address, 128));
  Cycle at = 1000;
  for (std::uint64_t i = 0; i < 300; ++i) {
    const unsigned bytes = 16U << mix(i) % 4;
    const std::uint64_t address = mix(i + 1000) % 2048 / bytes * bytes;
    accesses.push_back(mix(i + 2000) % 3 == 0 ? write(at, address, bytes) : read(at, address, bytes));
    at += mix(i + 3000) % 4;
  }
  const std::vector<Cycle> with = completed(accesses);
  EXPECT_EQ(fetched(), 0U);
  start();
  const std::unique_ptr<FixedLatencyMemory> alone = make_l2(MemoryBelow::none);
  const MemoryBelow port = GetParam() == MemoryBelow::annotated ? MemoryBelow::annotated : MemoryBelow::none;
  EXPECT_EQ(with, MemoryBelowTest::completed(*alone, port, accesses));
  EXPECT_EQ(l2->bytes(), alone->bytes());
}

TEST_P(MemoryBelowAtEachFidelity, CountsSectors) {
  completed({read(100, 0), read(101, 0), read(300, 0, 64), write(400, 64, 64), write(500, 128, 16)});
  const CompulsoryMissStatistics& cache = l2->cache();
  EXPECT_EQ(cache.sector_accesses.value(), 7U);
  EXPECT_EQ(cache.sector_hits.value(), 2U) << "one of them on its way";
  EXPECT_EQ(cache.sector_misses.value(), 5U);
  EXPECT_EQ(cache.bytes_filled.value(), 3U * 32U) << "not of the two that are written whole";
  EXPECT_EQ(cache.sector_hit_rate.numerator(), 2U);
}

TEST_P(MemoryBelowAtEachFidelity, AFillSaysWhoAskedAndForWhat) {
  const std::unique_ptr<FixedLatencyMemory> cache = make_l2(GetParam());
  Recorder memory("recorder");
  cache->below().bind(memory.socket);
  MemoryBelowTest::completed(*cache, GetParam(),
                             {{100, {4096, 16, tlm::TLM_WRITE_COMMAND, {MemoryTraffic::depth_stencil, 7}}}});
  ASSERT_EQ(memory.requests.size(), 1U);
  EXPECT_EQ(memory.requests[0].address, 4096U);
  EXPECT_EQ(memory.requests[0].bytes, 32U);
  EXPECT_EQ(memory.requests[0].command, tlm::TLM_READ_COMMAND);
  EXPECT_EQ(memory.requests[0].origin.traffic, MemoryTraffic::depth_stencil);
  EXPECT_EQ(memory.requests[0].origin.gpc, 7U);
}

TEST_P(MemoryBelowAtEachFidelity, AnErrorOfTheMemoryBelowIsAFaultOfTheL2) {
  const std::unique_ptr<FixedLatencyMemory> cache = make_l2(GetParam());
  Recorder memory("recorder");
  memory.status = tlm::TLM_ADDRESS_ERROR_RESPONSE;
  cache->below().bind(memory.socket);
  try {
    MemoryBelowTest::completed(*cache, GetParam(), {read(100, 0)});
    FAIL() << "no fault";
  } catch (const SimulationFault& fault) {
    EXPECT_NE(std::string(fault.what()).find("l2.below"), std::string::npos) << fault.what();
  }
}

TEST_P(MemoryBelowAtEachFidelity, AMemoryBelowWithTimeOfItsOwnIsAsked) {
  const std::unique_ptr<FixedLatencyMemory> cache = make_l2(GetParam());
  foreign::Dram dram("dram", cycles(0), cycles(20.5), cycles(60.5));
  cache->below().bind(dram.socket);
  // In the open row, in another one, in that one.
  const std::vector<Cycle> done =
      MemoryBelowTest::completed(*cache, GetParam(), {read(500, 0), read(1000, 4096), read(2000, 4128)});
  EXPECT_EQ(done,
            (std::vector<Cycle>{500 + 1 + 21 + hit_cycles, 1000 + 1 + 61 + hit_cycles, 2000 + 1 + 21 + hit_cycles}));
}

// At lt.
TEST_F(MemoryBelowTest, AnAccessAheadOfTimeDoesNotDelayAnEarlierOne) {
  const std::unique_ptr<FixedLatencyMemory> l2 = make_l2(MemoryBelow::annotated);
  FixedLatencyMemory below("below", *clock, 40, 16, 1);
  l2->below().bind(below.port(0));
  EXPECT_EQ(completed(*l2, MemoryBelow::annotated, {read(4000, 64), read(100, 64), read(300, 64)}),
            (std::vector<Cycle>{4000 + miss_cycles, 100 + miss_cycles, 300 + hit_cycles}));
  EXPECT_EQ(below.bytes(), 32U) << "fetched once all the same";
}

// At cycle.
TEST_F(MemoryBelowTest, TheOrderInWhichUnitsTickDoesNotMatter) {
  std::vector<std::vector<Cycle>> completed;
  std::vector<std::uint64_t> fetched;
  std::vector<unsigned> order(4);
  std::iota(order.begin(), order.end(), 0U);
  do {
    start();
    const std::unique_ptr<FixedLatencyMemory> l2 = make_l2(MemoryBelow::clocked, 3);
    foreign::Dram dram("dram", cycles(3), cycles(20), cycles(60));
    l2->below().bind(dram.socket);
    std::vector<std::unique_ptr<ClockedInitiator>> units;
    for (unsigned index = 0; index < 3; ++index) {
      std::vector<Access> accesses;
      for (std::uint64_t i = 0; i < 60; ++i) {
        const std::uint64_t address = mix(100 * index + i) % 128 * 32;
        accesses.push_back(mix(i) % 4 == 0 ? write(100 + i / 2, address) : read(100 + i / 2, address));
      }
      units.push_back(std::make_unique<ClockedInitiator>(("unit" + std::to_string(index)).c_str(), *clock, accesses));
      units.back()->memory.socket.bind(l2->port(index));
    }
    clock->set_tick_order(order);
    while (!clock->run_to_rest(cycles(1000))) {}
    std::vector<std::vector<Cycle>> of_units;
    for (const auto& unit : units) of_units.push_back(unit->completed);
    if (completed.empty()) completed = of_units;
    EXPECT_EQ(of_units, completed);
    fetched.push_back(dram.requests);
  } while (std::next_permutation(order.begin(), order.end()));
  EXPECT_EQ(fetched, std::vector<std::uint64_t>(24, fetched.front()));
  EXPECT_GT(fetched.front(), 40U);
}

TEST_F(MemoryBelowTest, FillsWaitInTheL2WhileTheMemoryBelowDoesNotTakeThem) {
  const std::unique_ptr<FixedLatencyMemory> l2 = make_l2(MemoryBelow::clocked);
  foreign::Dram dram("dram", cycles(4.5), cycles(30), cycles(90));
  l2->below().bind(dram.socket);
  std::vector<Access> accesses;
  for (std::uint64_t i = 0; i < 200; ++i) accesses.push_back(read(100, i * 256));
  const std::vector<Cycle> done = completed(*l2, MemoryBelow::clocked, accesses);
  EXPECT_EQ(dram.requests, 200U);
  EXPECT_GT(dram.out_of_order, 0U);
  for (std::size_t i = 0; i < done.size(); ++i) {
    ASSERT_NE(done[i], never) << i;
    // Taken one in five cycles, of the clock that is; a hit at once takes none of it.
    ASSERT_GE(done[i], 101 + 5 * i + 35 + hit_cycles) << i;
  }
}

TEST_F(MemoryBelowTest, ThatFallsSilentIsNamedWithTheOldestRequest) {
  const std::unique_ptr<FixedLatencyMemory> l2 = make_l2(MemoryBelow::clocked);
  foreign::Dram dram("dram", cycles(1), cycles(30), cycles(60));
  dram.fall_silent_after(2);
  l2->below().bind(dram.socket);
  try {
    completed(*l2, MemoryBelow::clocked, {read(100, 0), read(200, 32), read(300, 64), read(400, 96)});
    FAIL() << "no fault";
  } catch (const SimulationFault& fault) {
    const std::string what = fault.what();
    EXPECT_NE(what.find("l2.below at cycle"), std::string::npos) << what;
    EXPECT_NE(what.find("the read of 32 bytes at address 64 in cycle 301"), std::string::npos) << what;
  }
}

TEST_F(MemoryBelowTest, OfOneClockTheKernelMayLagBehindAsWithoutIt) {
  const std::unique_ptr<FixedLatencyMemory> l2 = make_l2(MemoryBelow::clocked);
  FixedLatencyMemory below("below", *clock, 40, 16, 1);
  l2->below().bind(below.port(0));
  clock->set_cycles_per_activation(64);
  EXPECT_EQ(completed(*l2, MemoryBelow::clocked, {read(100, 0), read(101, 32), read(102, 0)}),
            (std::vector<Cycle>{100 + miss_cycles, 101 + 1 + fill_cycles + 1 + hit_cycles, 100 + miss_cycles + 1}));
  EXPECT_LT(clock->activations(), clock->edges());
}

/// An initiator of another make, which ends a response 20 ns after it began.
class SlowToEnd : public sc_core::sc_module {
 public:
  SC_HAS_PROCESS(SlowToEnd);
  explicit SlowToEnd(const sc_core::sc_module_name& name) : sc_module(name), socket("socket") {
    socket.register_nb_transport_bw(this, &SlowToEnd::nb_transport_bw);
    SC_METHOD(request);
    SC_METHOD(end_response);
    sensitive << end_;
    dont_initialize();
  }
  tlm_utils::simple_initiator_socket<SlowToEnd> socket;
  std::vector<sc_core::sc_time> responses;

 private:
  struct Payload : tlm::tlm_generic_payload, tlm::tlm_mm_interface {
    Payload() : tlm_generic_payload(this) { acquire(); }
    void free(tlm::tlm_generic_payload*) override {}
  };
  void request() {
    for (Payload& payload : payloads_) {
      payload.set_command(tlm::TLM_WRITE_COMMAND);
      payload.set_data_length(32);
      tlm::tlm_phase phase = tlm::BEGIN_REQ;
      sc_core::sc_time delay(100, sc_core::SC_NS);
      EXPECT_EQ(socket->nb_transport_fw(payload, phase, delay), tlm::TLM_UPDATED);
      EXPECT_EQ(phase, tlm::END_REQ);
    }
  }
  tlm::tlm_sync_enum nb_transport_bw(tlm::tlm_generic_payload& payload, tlm::tlm_phase&, sc_core::sc_time& delay) {
    EXPECT_EQ(responding_, nullptr) << "one at a time";
    EXPECT_TRUE(payload.is_response_ok());
    responding_ = &payload;
    responses.push_back(sc_core::sc_time_stamp() + delay);
    end_.notify(delay + sc_core::sc_time(20, sc_core::SC_NS));
    return tlm::TLM_ACCEPTED;
  }
  void end_response() {
    tlm::tlm_phase phase = tlm::END_RESP;
    sc_core::sc_time delay;
    tlm::tlm_generic_payload* const ended = responding_;
    responding_ = nullptr;
    socket->nb_transport_fw(*ended, phase, delay);
  }
  std::vector<Payload> payloads_ = std::vector<Payload>(3);
  tlm::tlm_generic_payload* responding_ = nullptr;
  sc_core::sc_event end_;
};

TEST_F(MemoryBelowTest, AnInitiatorMayEndItsResponsesLater) {
  const std::unique_ptr<FixedLatencyMemory> l2 = make_l2(MemoryBelow::clocked);
  FixedLatencyMemory below("below", *clock, 40, 16, 1);
  l2->below().bind(below.port(0));
  SlowToEnd initiator("initiator");
  initiator.socket.bind(l2->port(0));
  clock->run(cycles(1000));
  const auto next = 20 + 2;  // seen at the edge after the end, answered at the one after that
  EXPECT_EQ(initiator.responses,
            (std::vector<sc_core::sc_time>{cycles(100 + hit_cycles), cycles(100 + hit_cycles + next),
                                           cycles(100 + hit_cycles + 2 * next)}));
}

TEST_F(MemoryBelowTest, AtCycleBTransportIsAFault) {
  const std::unique_ptr<FixedLatencyMemory> l2 = make_l2(MemoryBelow::clocked);
  FixedLatencyMemory below("below", *clock, 40, 16, 1);
  l2->below().bind(below.port(0));
  EXPECT_THROW(completed(*l2, MemoryBelow::annotated, {read(100, 0)}), SimulationFault);
}

TEST_F(MemoryBelowTest, WithoutOneThereIsNoSocketForIt) {
  EXPECT_THROW(make_l2(MemoryBelow::none)->below(), std::logic_error);
}

}  // namespace
}  // namespace vrpipe
