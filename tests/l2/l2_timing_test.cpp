// The sectored L2 in time, at `lt` (annotated) and at `cycle` (clocked), with a memory of fixed latency below.

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "l2/annotated_l2.h"
#include "l2/clocked_l2.h"

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>

#include "support/memory_initiators.h"

namespace vrpipe {
namespace {

constexpr Cycle l2_latency = 10;
/// Of a sector, from the memory below: 40 cycles and two to move it.
constexpr Cycle fill_cycles = 40 + 2;
constexpr Cycle hit_cycles = l2_latency + 1;
constexpr Cycle miss_cycles = 1 + fill_cycles + hit_cycles;
constexpr std::uint64_t line_bytes = 128;

enum class Time { annotated, clocked };

class L2Test : public ::testing::Test {
 protected:
  L2Test() {
    start();
    // 32 lines in 16 sets of 2 ways; a line's bank is its number's lowest bit.
    set("bytes", "4096");
    set("ways", "2");
    set("banks", "2");
    set("latency_cycles", "10");
    set("bytes_per_cycle", "32");
  }
  /// Another simulation.
  void start() {
    units.clear();
    l2.reset();
    below.reset();
    dram.reset();
    fresh_simulation();
    clock = std::make_unique<ClockDomain>("clock", 1000);
    if (passes_sockets) clock->set_passes_sockets();
  }
  void set(const std::string& name, const std::string& value) { parameters.set("l2", name, value); }

  void make(Time time, unsigned ports = 1) {
    auto behaviour = std::make_unique<SectoredL2>(parameters, RenderContext());
    model = behaviour.get();
    const std::vector<unsigned> port_bytes(ports, port_width * behaviour->sizes().bytes_per_cycle);
    if (time == Time::clocked) {
      l2 = std::make_unique<ClockedL2>("l2", *clock, std::move(behaviour), port_bytes);
    } else {
      l2 = std::make_unique<AnnotatedL2>("l2", *clock, std::move(behaviour), port_bytes);
    }
    if (over_dram) {
      dram = memory_unit_maker("dram")("dram", *clock, dram_behaviour(), {{0}, false, time == Time::clocked});
      l2->below()->bind(dram->target(0));
      return;
    }
    below = std::make_unique<FixedLatencyMemory>("below", *clock, 40, 16, 1);
    l2->below()->bind(below->port(0));
  }
  /// Two channels of LPDDR3, 12.8 GB/s at the L2's 1 GHz.
  std::unique_ptr<Behaviour> dram_behaviour() const {
    const Implementation& implementation = Registry::instance().find("dram", "lpddr3-1600");
    const auto of_dram = implementation.make_parameters();
    of_dram->set("dram", "channels", "2");
    of_dram->set("dram", "port_requests", dram_port_requests);
    return implementation.make_behaviour(*of_dram, RenderContext());
  }
  /// When each access of each port completes.
  std::vector<std::vector<Cycle>> run(Time time, const std::vector<std::vector<Access>>& accesses) {
    make(time, static_cast<unsigned>(accesses.size()));
    std::vector<std::vector<Cycle>> completed;
    if (time == Time::clocked) {
      for (std::size_t port = 0; port < accesses.size(); ++port) {
        units.push_back(
            std::make_unique<ClockedInitiator>(("unit_" + std::to_string(port)).c_str(), *clock, accesses[port]));
        units.back()->memory.socket.bind(l2->target(static_cast<unsigned>(port)));
      }
      if (!tick_order.empty()) clock->set_tick_order(tick_order);
      while (!clock->run_to_rest(sc_core::sc_time(1, sc_core::SC_US))) {}
      for (const auto& unit : units) completed.push_back(unit->completed);
      return completed;
    }
    std::vector<std::unique_ptr<TimedInitiator>> ports;
    for (std::size_t port = 0; port < accesses.size(); ++port) {
      ports.push_back(std::make_unique<TimedInitiator>(("unit_" + std::to_string(port)).c_str(), *clock));
      ports.back()->memory.socket.bind(l2->target(static_cast<unsigned>(port)));
      completed.emplace_back();
    }
    clock->run(sc_core::sc_time(1, sc_core::SC_NS));
    for (std::size_t port = 0; port < accesses.size(); ++port) {
      for (const Access& access : accesses[port])
        completed[port].push_back(ports[port]->memory.access(access.request, access.at));
    }
    return completed;
  }
  std::vector<Cycle> run(Time time, const std::vector<Access>& accesses) {
    return run(time, std::vector<std::vector<Access>>{accesses}).front();
  }
  std::uint64_t bytes_below(bool written) const { return below->traffic().bytes(MemoryTraffic::color, written); }

  std::vector<unsigned> tick_order;  ///< of the L2 and its initiators; as they were made if empty
  unsigned port_width = 1;           ///< in ports of the crossbar
  std::unique_ptr<ClockDomain> clock;
  SectoredL2Parameters parameters;
  std::unique_ptr<FixedLatencyMemory> below;
  bool over_dram = false;  ///< instead
  std::string dram_port_requests = "64";
  bool passes_sockets = false;
  std::unique_ptr<MemoryUnit> dram;
  std::unique_ptr<MemoryUnit> l2;
  SectoredL2* model = nullptr;
  std::vector<std::unique_ptr<ClockedInitiator>> units;
};

/// Random accesses of three ports to so many lines, 64 of which are twice what the L2 holds; a seventh of them are of
/// attributes.
std::vector<std::vector<Access>> random_accesses(std::uint64_t seed, Cycle apart, std::uint64_t lines = 64) {
  std::vector<std::vector<Access>> accesses(3);
  Cycle at = 100;
  for (std::uint64_t i = 0; i < 600; ++i) {
    const std::uint64_t bits = mix(seed + i);
    const unsigned bytes = 16U << (bits % 4);
    const std::uint64_t address = (bits >> 8) % (lines * line_bytes) / bytes * bytes;
    Access access = (bits >> 40) % 3 == 0 ? write(at, address, bytes) : read(at, address, bytes);
    if (address / line_bytes % 7 == 0) access.request.origin.traffic = MemoryTraffic::attribute;
    accesses[bits >> 32 & 1].push_back(access);
    at += apart;
  }
  return accesses;
}

class L2AtEachFidelity : public L2Test, public ::testing::WithParamInterface<Time> {};
INSTANTIATE_TEST_SUITE_P(With, L2AtEachFidelity, ::testing::Values(Time::annotated, Time::clocked),
                         [](const auto& time) {
                           return std::string(time.param == Time::clocked ? "Clocked" : "Annotated");
                         });

TEST_P(L2AtEachFidelity, ASectorIsFetchedWhenItIsFirstRead) {
  EXPECT_EQ(run(GetParam(), {read(100, 64), read(300, 64)}), (std::vector<Cycle>{100 + miss_cycles, 300 + hit_cycles}));
  EXPECT_EQ(bytes_below(false), 32U);
}

TEST_P(L2AtEachFidelity, AReadOfASectorOnItsWayWaitsForThatFill) {
  const Cycle there = 100 + 1 + fill_cycles;
  EXPECT_EQ(run(GetParam(), {read(100, 64), read(120, 64)}),
            (std::vector<Cycle>{there + hit_cycles, there + 1 + hit_cycles}));
  EXPECT_EQ(bytes_below(false), 32U);
}

TEST_P(L2AtEachFidelity, NeighbouringSectorsAreFetchedInOneAccess) {
  // Eight cycles to move 128 bytes from below; the bank passes a sector a cycle, as does the port.
  EXPECT_EQ(run(GetParam(), {read(100, 0, 128)}), (std::vector<Cycle>{100 + 1 + 40 + 8 + 4 + l2_latency}));
  EXPECT_EQ(below->traffic().accesses(MemoryTraffic::color, false), 1U);
}

TEST_P(L2AtEachFidelity, AWriteOfWholeSectorsNeedsNoFill) {
  const std::vector<Cycle> completed = run(GetParam(), {write(100, 64, 64), read(200, 64), read(300, 96)});
  EXPECT_EQ(completed[1], 200 + hit_cycles);
  EXPECT_EQ(completed[2], 300 + hit_cycles);
  EXPECT_EQ(bytes_below(false), 0U);
}

TEST_P(L2AtEachFidelity, AWriteOfPartOfASectorFetchesIt) {
  EXPECT_EQ(run(GetParam(), {write(100, 80, 16), read(300, 64, 16)}),
            (std::vector<Cycle>{100 + miss_cycles, 300 + hit_cycles}));
  EXPECT_EQ(bytes_below(false), 32U);
}

TEST_P(L2AtEachFidelity, WrittenThroughItIsServedWithTheMemoryBelowAndLeavesWhatIsThere) {
  set("write_policy", "write-through");
  EXPECT_EQ(run(GetParam(), {read(100, 64), write(300, 64), read(500, 64)}),
            (std::vector<Cycle>{100 + miss_cycles, 300 + miss_cycles, 500 + hit_cycles}));
  EXPECT_EQ(bytes_below(true), 32U);
  EXPECT_EQ(bytes_below(false), 32U);
  EXPECT_EQ(model->statistics().sector_accesses.value(), 2U) << "the reads";
  EXPECT_EQ(l2->delivered().written, l2->memory_bytes().written);
}

TEST_P(L2AtEachFidelity, WrittenThroughWhatIsNotThereIsNotKept) {
  set("write_policy", "write-through");
  EXPECT_EQ(run(GetParam(), {write(100, 0, 128), read(300, 0)})[1], 300 + miss_cycles);
  EXPECT_EQ(bytes_below(true), 128U);
}

// A read does not overtake a write to the same place, though both wait for the memory below.
TEST_P(L2AtEachFidelity, WrittenThroughGoesBelowInTheOrderOfItsBank) {
  set("write_policy", "write-through");
  const std::vector<Cycle> completed = run(GetParam(), {write(100, 64), read(100, 64)});
  EXPECT_EQ(completed[0], 100 + miss_cycles);
  EXPECT_GT(completed[1], completed[0]);
}

// Writes come faster than the memory below takes them, so that some always wait.
TEST_P(L2AtEachFidelity, ReadsDoNotWaitForWhatIsWrittenThroughLater) {
  set("write_policy", "write-through");
  over_dram = true;
  dram_port_requests = "1";
  std::vector<Access> accesses;
  for (Cycle i = 0; i < 1000; ++i) accesses.push_back(write(100 + i, 32 * i));
  accesses.insert(accesses.begin() + 500, read(600, 1 << 20));
  const std::vector<Cycle> completed = run(GetParam(), accesses);
  const Cycle read_at = completed[500];
  EXPECT_LT(std::count_if(completed.begin(), completed.end(), [&](Cycle at) { return at < read_at; }), 700);
}

TEST_P(L2AtEachFidelity, SeesHowLongFillsTakeAndHowManyAreOnTheirWay) {
  run(GetParam(), {read(100, 0, 64), read(110, line_bytes), read(500, 2 * line_bytes)});
  const Histogram& filling = model->statistics().sectors_filling;
  const Histogram& fills = model->statistics().fill_cycles;
  // Of the first access the second sector finds the first, the second access both, the third nobody.
  EXPECT_EQ(filling.count(), 4U);
  EXPECT_EQ(filling.sum(), 0U + 1 + 2 + 0);
  EXPECT_EQ(filling.largest(), 2U);
  // Of a run of sectors each is seen.
  EXPECT_EQ(fills.count(), 4U);
  EXPECT_EQ(fills.sum(), 2 * (40U + 4) + 2 * fill_cycles);
}

// Sets are 16 lines apart.
TEST_P(L2AtEachFidelity, DirtySectorsOfALineThatGoesAreWrittenBackInTheNameOfWhoWroteThem) {
  constexpr MemoryOrigin depth{MemoryTraffic::depth_stencil, 0};
  std::vector<Access> accesses = {write(100, 32), write(110, 64), read(200, 16 * line_bytes),
                                  read(300, 32 * line_bytes)};
  accesses[0].request.origin = depth;
  accesses[1].request.origin = depth;
  run(GetParam(), accesses);
  EXPECT_EQ(below->traffic().bytes(MemoryTraffic::depth_stencil, true), 64U);
  EXPECT_EQ(below->traffic().accesses(MemoryTraffic::depth_stencil, true), 2U) << "32 bytes each: at 32 and at 64";
  EXPECT_EQ(bytes_below(true), 0U);
}

TEST_P(L2AtEachFidelity, BanksWorkSideBySideAndOneAfterTheOtherInThemselves) {
  const auto second = [&](std::uint64_t address) {
    start();
    // Written before, so that all hit.
    const auto completed =
        run(GetParam(),
            {{write(10, 0), write(20, line_bytes), write(30, 2 * line_bytes), read(200, 0)}, {read(200, address)}});
    return std::max(completed[0].back(), completed[1].back());
  };
  EXPECT_EQ(second(line_bytes), 200 + hit_cycles);
  EXPECT_EQ(second(2 * line_bytes), 200 + hit_cycles + 1);
}

TEST_P(L2AtEachFidelity, APortWithOneRequestDoesNotWaitForAllThatAnotherHasAtABank) {
  constexpr std::size_t many = 30;
  constexpr Cycle cycles_of_one = 128 / 32;
  // All hit in bank 0.
  std::vector<Access> of_busy_port{write(10, 0, 128), write(20, 2 * line_bytes, 128)};
  of_busy_port.insert(of_busy_port.end(), many, read(200, 0, 128));
  const auto one = [&](const char* arbitration) {
    start();
    set("arbitration", arbitration);
    return run(GetParam(), {of_busy_port, {read(220, 2 * line_bytes)}})[1].back();
  };
  EXPECT_LE(one("round-robin"), 220 + hit_cycles + cycles_of_one);
  EXPECT_GE(one("oldest"), 200 + hit_cycles + 20 * cycles_of_one);
}

TEST_P(L2AtEachFidelity, APortPassesItsBytesACycle) {
  const std::vector<Cycle> completed =
      run(GetParam(), {write(10, 0), write(20, line_bytes), read(200, 0), read(200, line_bytes)});
  EXPECT_EQ(completed[2], 200 + hit_cycles);
  EXPECT_EQ(completed[3], 200 + hit_cycles + 1);
}

TEST_P(L2AtEachFidelity, AWiderPortPassesMore) {
  port_width = 2;
  const std::vector<Cycle> completed =
      run(GetParam(), {write(10, 0), write(20, line_bytes), read(200, 0), read(200, line_bytes)});
  EXPECT_EQ(completed[2], 200 + hit_cycles);
  EXPECT_EQ(completed[3], 200 + hit_cycles);
}

// Its parts go to their banks on their own; it is answered with the last.
TEST_P(L2AtEachFidelity, ARequestOfSeveralLinesIsAnAccessToEach) {
  run(GetParam(), {read(100, 0, 512)});
  EXPECT_EQ(model->statistics().line_accesses.value(), 4U);
  EXPECT_EQ(model->statistics().sector_misses.value(), 16U);
  EXPECT_EQ(bytes_below(false), 512U);
  EXPECT_EQ(l2->delivered().read, 512U);
}

// Of 1 GHz the units', of 500 MHz the L2's: its cycles are two of the units.
TEST_P(L2AtEachFidelity, OfHalfTheFrequencyItTakesTwiceAsLong) {
  set("frequency_mhz", "500");
  constexpr Cycle hit = 2 * hit_cycles;
  // The fill leaves a cycle of the L2 later, and comes at one of its edges.
  constexpr Cycle miss = 2 + fill_cycles + hit;
  EXPECT_EQ(run(GetParam(), {read(100, 64), read(300, 64), read(401, 64), write(500, 32)}),
            (std::vector<Cycle>{100 + miss, 300 + hit, 402 + hit, 500 + hit}));
}

TEST_P(L2AtEachFidelity, OfHalfTheFrequencyItMovesHalfAsManyBytes) {
  const auto last_of = [&](const char* frequency, const std::vector<Access>& accesses) {
    start();
    set("frequency_mhz", frequency);
    const std::vector<Cycle> completed = run(GetParam(), accesses);
    return *std::max_element(completed.begin(), completed.end());
  };
  // All hit, of both banks; the port passes 32 bytes a cycle.
  std::vector<Access> accesses;
  for (std::uint64_t line = 0; line < 8; ++line) accesses.push_back(write(100, line * line_bytes, 128));
  for (std::uint64_t i = 0; i < 200; ++i) accesses.push_back(read(1000, i % 8 * line_bytes, 128));
  const Cycle whole = last_of("0", accesses);
  EXPECT_EQ(whole, 1000 + 200 * 4 + l2_latency);
  EXPECT_EQ(last_of("1000", accesses), whole);
  EXPECT_EQ(last_of("500", accesses), 1000 + 2 * (whole - 1000));
  EXPECT_EQ(last_of("250", accesses), 1000 + 4 * (whole - 1000));
}

TEST_P(L2AtEachFidelity, IsNeverOccupiedForMoreThanItsTimeWhateverItsFrequency) {
  for (const char* frequency : {"0", "999", "701", "500", "333", "17"}) {
    start();
    set("frequency_mhz", frequency);
    Cycle last = 0;
    for (const auto& of_port : run(GetParam(), random_accesses(5, 1))) {
      for (const Cycle cycle : of_port) last = std::max(last, cycle);
    }
    clock->frame_end().not_before(100);
    for (const Cycle end : {Cycle{100}, Cycle{101}, Cycle{150}, Cycle{307}, last}) {
      for (const OccupancyPart& part : l2->parts(end)) {
        EXPECT_LE(part.cycles, static_cast<double>(end) * (1 + 1e-9)) << part.name << " at " << frequency;
      }
    }
    EXPECT_EQ(l2->memory_bytes().read, below->traffic().bytes().read);
    EXPECT_EQ(l2->memory_bytes().written, below->traffic().bytes().written);
  }
}

TEST_F(L2Test, OfAnyFrequencyItDoesNotMatterWhoTicksFirst) {
  for (const char* frequency : {"999", "701", "500", "333"}) {
    set("frequency_mhz", frequency);
    set("port_requests", "2");
    std::vector<std::vector<Cycle>> completed[2];
    for (const bool last : {false, true}) {
      start();
      tick_order = last ? std::vector<unsigned>{3, 2, 1, 0} : std::vector<unsigned>{0, 1, 2, 3};
      completed[last] = run(Time::clocked, random_accesses(6, 1));
    }
    EXPECT_EQ(completed[0], completed[1]) << frequency;
  }
}

TEST_F(L2Test, WhatIsWrittenWholeWhileItIsOnItsWayIsAwaitedAllTheSame) {
  const std::vector<Cycle> completed = run(Time::clocked, {read(100, 0), write(110, 0), read(120, 0)});
  EXPECT_EQ(completed[0], 100 + miss_cycles);
  EXPECT_GE(completed[1], completed[0]);
  EXPECT_GE(completed[2], completed[0]);
}

// Also where what waits for its place below is answered before it has one.
TEST_F(L2Test, IsTheSameInEveryCycleThroughTheSocketsAndPastThem) {
  over_dram = true;
  for (const char* places : {"1", "3", "64"}) {
    dram_port_requests = places;
    for (const char* port_requests : {"1", "512"}) {
      set("port_requests", port_requests);
      std::vector<std::vector<Cycle>> completed[2];
      for (const bool through : {false, true}) {
        passes_sockets = through;
        start();
        completed[through] = run(Time::clocked, random_accesses(6, 1, 256));
      }
      EXPECT_EQ(completed[0], completed[1]) << places << ", " << port_requests;
      EXPECT_GT(model->memory_bytes().written, 1000U);
    }
  }
}

TEST_F(L2Test, APortWhoseWidthItsUnitSaysKeepsItInCyclesOfTheUnit) {
  const MemoryPlace place{{0, 512, 0, 3}, true, true};
  const auto ports_of = [&](std::uint32_t frequency) {
    return OwnClock("l2", frequency, RenderContext()).port_bytes(place, 128);
  };
  EXPECT_EQ(ports_of(0), (std::vector<unsigned>{128, 512, 128, 3}));
  EXPECT_EQ(ports_of(500), (std::vector<unsigned>{128, 1024, 128, 6}));
  EXPECT_EQ(ports_of(701), (std::vector<unsigned>{128, 731, 128, 5})) << "of 1427 ps, at least as wide";
}

TEST_F(L2Test, WhatTheBoundKnowsOfItIsInCyclesOfTheUnits) {
  const auto timing_of = [&](const char* frequency) {
    set("frequency_mhz", frequency);
    const auto timing = SectoredL2(parameters, RenderContext()).timing();
    return std::pair{timing.latency_cycles, timing.bytes_per_cycle};
  };
  EXPECT_EQ(timing_of("0"), (std::pair{10U, 32U}));
  EXPECT_EQ(timing_of("500"), (std::pair{20U, 16U}));
  EXPECT_EQ(timing_of("701"), (std::pair{14U, 23U})) << "of 1427 ps: at least 14.27 cycles, at most 22.4 bytes";
}

TEST_F(L2Test, AClockFasterThanThatOfTheUnitsIsRefused) {
  set("frequency_mhz", "1001");
  EXPECT_THROW(SectoredL2(parameters, RenderContext()), UserError);
}

// "Blocked at t - 1, ready at t".
TEST_F(L2Test, AMissWithoutAnMshrWaitsForAFillOfItsBank) {
  set("mshrs", "1");
  const Cycle there = 100 + 1 + fill_cycles;
  const std::vector<Cycle> completed =
      run(Time::clocked, {read(100, 0), read(101, 2 * line_bytes), read(102, line_bytes)});
  EXPECT_EQ(completed[0], there + hit_cycles);
  // Taken when the first fill has passed the bank, a cycle; its own fill leaves then.
  EXPECT_EQ(completed[1], there + 1 + fill_cycles + hit_cycles);
  EXPECT_EQ(completed[2], 102 + miss_cycles) << "another bank has its own";
}

TEST_F(L2Test, AHitBehindAMissWithoutAnMshrWaitsInItsBank) {
  set("mshrs", "1");
  const std::vector<Cycle> completed = run(Time::clocked, {write(10, 4 * line_bytes), read(100, 0),
                                                           read(101, 2 * line_bytes), read(102, 4 * line_bytes)});
  EXPECT_GT(completed[3], 100 + 1 + fill_cycles + l2_latency);
}

TEST_F(L2Test, ALineThatIsBeingFilledDoesNotGo) {
  // Both ways of a set are on their way when a third line wants one.
  const std::vector<Cycle> completed = run(Time::clocked, {read(100, 0), read(101, 16 * line_bytes),
                                                           read(102, 32 * line_bytes), read(400, 16 * line_bytes)});
  EXPECT_EQ(completed[0], 100 + miss_cycles);
  EXPECT_GT(completed[2], 100 + 1 + fill_cycles + fill_cycles + hit_cycles);
  EXPECT_EQ(completed[3], 400 + hit_cycles) << "the first line went";
}

TEST_F(L2Test, AFullPortHoldsRequestsBack) {
  set("port_requests", "1");
  set("mshrs", "1");
  run(Time::clocked, {read(100, 0), read(100, 2 * line_bytes), read(100, 4 * line_bytes), read(100, 6 * line_bytes)});
  // The first is taken by its bank at 101, the second waits there for the MSHR and takes the port's place.
  EXPECT_EQ(units[0]->issued[0], 100U);
  EXPECT_GT(units[0]->issued[2], 101U);
  EXPECT_GT(units[0]->issued[3], 100 + fill_cycles);
}

// The first leaves its place in cycle 101, in which the second comes, before or after.
TEST_F(L2Test, APlaceIsFreeFromTheNextCycleOnWhoeverTicksFirst) {
  for (const std::vector<unsigned>& order : {std::vector<unsigned>{0, 1}, std::vector<unsigned>{1, 0}}) {
    start();
    set("port_requests", "1");
    tick_order = order;
    const std::vector<Cycle> completed = run(Time::clocked, {read(100, 0), read(101, line_bytes)});
    EXPECT_EQ(completed[0], 100 + miss_cycles);
    EXPECT_EQ(completed[1], 102 + miss_cycles);
  }
}

TEST_F(L2Test, TheOldestRequestOrTheNextPortGoesFirst) {
  // Three ports want bank 0, which is busy for four cycles with 128 bytes from 99 on; that of port 2 has come first.
  const auto order = [&](const char* arbitration) {
    start();
    set("arbitration", arbitration);
    return run(Time::clocked, {{write(10, 0, 128), read(99, 0, 128)}, {read(101, 0)}, {read(100, 0)}});
  };
  const auto oldest = order("oldest");
  EXPECT_LT(oldest[2][0], oldest[1][0]);
  const auto in_turn = order("round-robin");
  EXPECT_LT(in_turn[1][0], in_turn[2][0]);
}

// Those of low numbers, or of even ones, came first, and what was asked of others waited until they had nothing to do.
TEST_F(L2Test, BanksHaveAPortsWayInInTurn) {
  constexpr unsigned banks = 16, of_each = 12;
  set("banks", std::to_string(banks));
  set("bytes", "8192");
  for (const unsigned bytes : {32U, 64U, 128U}) {
    start();
    std::vector<Access> accesses;
    for (unsigned bank = 0; bank < banks; ++bank)
      accesses.push_back(write(10, bank * line_bytes, bytes));  // that all hit
    for (unsigned i = 0; i < of_each * banks; ++i) accesses.push_back(write(500, i % banks * line_bytes, bytes));
    const std::vector<Cycle> completed = run(Time::clocked, accesses);
    const auto [first, last] = std::minmax_element(completed.end() - banks, completed.end());
    const Cycle of_all = *last - 500 - hit_cycles;
    EXPECT_LT(*last - *first, of_all * 2 / of_each) << bytes << " bytes";
  }
}

std::uint64_t value_of(const StatisticSet& set, const std::string& name) {
  for (const Counter* const counter : set.counters()) {
    if (counter->name() == name) return counter->value();
  }
  ADD_FAILURE() << "no counter " << name;
  return 0;
}

// Far apart, so that each finds the fills of those before it done: then order is all that counts.
TEST_P(L2AtEachFidelity, CountsWhatItCountsWithoutTime) {
  const std::vector<std::vector<Access>> accesses = random_accesses(1, 200);
  std::vector<Access> in_order;
  for (const auto& of_port : accesses) in_order.insert(in_order.end(), of_port.begin(), of_port.end());
  std::stable_sort(in_order.begin(), in_order.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  SectoredL2 untimed(parameters, RenderContext());
  for (const Access& access : in_order) untimed.access(access.request);
  if (GetParam() == Time::clocked) {
    run(GetParam(), accesses);
  } else {
    run(GetParam(), in_order);
  }
  const auto expect_equal = [](const StatisticSet& actual, const StatisticSet& expected) {
    for (std::size_t i = 0; i < actual.counters().size(); ++i) {
      const Counter& counter = *actual.counters()[i];
      EXPECT_EQ(counter.value(), expected.counters()[i]->value()) << counter.name();
    }
  };
  expect_equal(*model, untimed);
  expect_equal(model->statistics(), untimed.statistics());
  EXPECT_GT(untimed.statistics().sectors_written_back.value(), 0U);
  EXPECT_GT(value_of(untimed, "attribute_lines_held"), 50U);
}

// Close together, so that they are in one another's way.
TEST_P(L2AtEachFidelity, WhatItAsksForIsWhatTheMemoryBelowDelivers) {
  for (const char* mshrs : {"1", "2", "64"}) {
    start();
    set("mshrs", mshrs);
    set("write_backs", mshrs);
    set("port_requests", "4");
    const auto completed = run(GetParam(), random_accesses(7, 1));
    for (const auto& of_port : completed) {
      for (const Cycle cycle : of_port) EXPECT_NE(cycle, never);
    }
    EXPECT_EQ(l2->memory_bytes().read, below->traffic().bytes().read);
    EXPECT_EQ(l2->memory_bytes().written, below->traffic().bytes().written);
    EXPECT_EQ(l2->memory_bytes().read, model->statistics().bytes_filled.value());
    EXPECT_EQ(l2->memory_bytes().written, model->statistics().bytes_written_back.value());
  }
}

/// Accesses to lines one after the other, a sector of each, by two ports.
std::vector<std::vector<Access>> stream(bool writes) {
  std::vector<std::vector<Access>> accesses(2);
  for (std::uint64_t i = 0; i < 800; ++i) {
    accesses[i % 2].push_back(writes ? write(100 + i, i * line_bytes) : read(100 + i, i * line_bytes));
  }
  return accesses;
}

// Over a DRAM. Annotated, the ports ask one after the other, each for all of its time.
TEST_F(L2Test, AnnotatedItTakesAsLongAsClockedWithFewMshrsAndPlacesForWriteBacks) {
  struct Pattern {
    const char* name;
    std::vector<std::vector<Access>> accesses;
    double tolerance;  ///< of the time that all of it takes
  };
  const Pattern patterns[] = {{"a stream that is read", stream(false), 0.1},
                              {"a stream that is written", stream(true), 0.15},
                              {"random", random_accesses(3, 1, 4096), 0.1},
                              {"random, with pauses", random_accesses(4, 6, 4096), 0.1}};
  set("bytes", "32768");
  set("ways", "16");
  over_dram = true;
  for (const Pattern& pattern : patterns) {
    const auto cycles = [&](Time time) {
      start();
      Cycle last = 0;
      for (const auto& of_port : run(time, pattern.accesses)) {
        for (const Cycle cycle : of_port) last = std::max(last, cycle);
      }
      return static_cast<double>(last - 100);
    };
    std::vector<double> with;  // so many MSHRs
    for (const char* places : {"1", "2", "4", "64"}) {
      set("mshrs", places);
      set("write_backs", places);
      with.push_back(cycles(Time::clocked));
      EXPECT_NEAR(cycles(Time::annotated) / with.back(), 1, pattern.tolerance) << pattern.name << ", " << places;
    }
    EXPECT_GT(with[0], (&pattern == &patterns[1] ? 1.2 : 4) * with[3]) << pattern.name << ": writes need no fills";
  }
}

}  // namespace
}  // namespace vrpipe
