// The SM array at lt; what has one closed form at every fidelity is compared with cycle by it.
#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/sm.h>

#include "sm/sm_scene.h"
#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::fragment_cycles;
using testing::issue_cycles;
using testing::merge_cycles;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class SmTimedTest : public ::testing::TestWithParam<Fidelity>, protected testing::SmScene {};

INSTANTIATE_TEST_SUITE_P(Fidelities, SmTimedTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

/// The unit with everything around it: what is shaded is noted and its slot released at once, or later.
struct TimedSmBench {
  TimedSmBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {},
               unsigned in_depth = 64, unsigned out_depth = 64)
      : bench(fidelity, "sm", "splat-shader", context, settings),
        warps(bench.source<Warp>("in_warps", in_depth)),
        release(bench.source<WarpRelease>("in_release", 4096)),
        shaded(bench.sink<ShadedWarpItem>("out_shaded", out_depth)) {
    shaded.on_take([this](const ShadedWarpItem& item, Cycle now) {
      if (item.warp->mark == Mark::end_of_frame) {
        ++ends;
      } else {
        cycles[item.warp->sequence] = now;
      }
      quads += item.warp->count;
      item.warp->release();
      if (release_after != never) release.add({item.warp->slot}, now + release_after);
    });
  }
  /// With the end of the frame behind the warps: at lt an array hands on what is done when something comes.
  void run() {
    Warp end;
    end.mark = Mark::end_of_frame;
    end.sequence = 1000;
    warps.add(end);
    bench.run();
  }
  Bench bench;
  Source<Warp>& warps;
  Source<WarpRelease>& release;
  Sink<ShadedWarpItem>& shaded;
  Cycle release_after = 1;                ///< `never`: not at all
  std::map<std::uint32_t, Cycle> cycles;  ///< in which a warp was taken, by its number
  unsigned ends = 0;
  unsigned quads = 0;
};

constexpr Cycle vertex_cycles = (4 + 16) * 2 + 146 + 75;

TEST_P(SmTimedTest, AWarpAloneTakesItsInstructionsAndLatencies) {
  for (const bool pairs : {false, true}) {
    TimedSmBench sm(GetParam(), context);
    sm.warps.add(warp(0, {0, 0}, pairs ? 0b0001 : 0), 10);
    sm.run();
    // In hand at 11, seen a link later.
    EXPECT_EQ(sm.cycles[0], 11 + fragment_cycles + (pairs ? merge_cycles : 0) + 1);
  }
}

TEST_P(SmTimedTest, FewerLanesMakeAnInstructionIssueLonger) {
  TimedSmBench sm(GetParam(), context, {{"lanes_per_scheduler", "8"}});
  sm.warps.add(warp(0), 10);
  sm.run();
  EXPECT_EQ(sm.cycles[0], 11 + fragment_cycles + issue_cycles + 1);
}

TEST_P(SmTimedTest, AnArrayWithRoomToSpareLaunchesAWarpACycle) {
  TimedSmBench sm(GetParam(), context, {{"warps_to_one_core", "8"}}, 256, 256);
  for (std::uint32_t i = 0; i < 200; ++i) sm.warps.add(warp(i));
  sm.run();
  ASSERT_EQ(sm.cycles.size(), 200U);
  // Of the eight warps of a core the second four wait for the schedulers of the first: at cycle for the 40 cycles of the
  // second segment less the 4 that they come later. At lt, where a warp of such an array has its scheduler for all
  // its instructions at once, for 48 less 4; at lt what is done before those of smaller number leaves with them.
  const Cycle wait = (GetParam() == Fidelity::cycle ? 40 : issue_cycles) - 4;
  Cycle before = 0;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const Cycle done = 1 + i + fragment_cycles + (i % 8 < 4 ? 0 : wait) + 1;
    before = GetParam() == Fidelity::lt ? std::max(before, done) : done;
    EXPECT_EQ(sm.cycles[i], before) << i;
  }
  // 24 instructions of 16 cores of 4 schedulers that take 2 cycles for one.
  EXPECT_DOUBLE_EQ(testing::occupied(sm.bench.unit(), SmWork::fragment), 200.0 * 24 / 32);
  testing::charged(sm.bench.unit(), UnitState::busy, 1 + 200 + fragment_cycles);
}

TEST_P(SmTimedTest, WarpsOfOneSchedulerHideOneAnothersLatencies) {
  TimedSmBench sm(GetParam(), context, {{"cores", "1"}, {"schedulers_per_core", "1"}});
  for (std::uint32_t i = 0; i < 48; ++i) sm.warps.add(warp(i));
  sm.run();
  ASSERT_EQ(sm.cycles.size(), 48U);
  // First come, first served: the first segments of all take cycles 1 to 384, in which the attributes of the first
  // come; then the second segments follow one another, and behind each are the last 75 cycles.
  for (std::uint32_t i = 0; i < 48; ++i) EXPECT_EQ(sm.cycles[i], 1 + 48 * 8 + (i + 1) * 40 + 75 + 1);
}

TEST_P(SmTimedTest, SchedulersWorkSideBySide) {
  TimedSmBench sm(GetParam(), context, {{"cores", "1"}, {"schedulers_per_core", "4"}});
  for (std::uint32_t i = 0; i < 48; ++i) sm.warps.add(warp(i));
  sm.run();
  // Twelve warps each, the first of which is launched in cycles 1 to 4; a quarter of the time but for the latencies.
  const Cycle last = 4 + 12 * 8 + 146 - 11 * 8 + 12 * 40 + 75 + 1;
  EXPECT_EQ(sm.cycles.size(), 48U);
  const auto later = [](const auto& a, const auto& b) { return a.second < b.second; };
  EXPECT_EQ(std::max_element(sm.cycles.begin(), sm.cycles.end(), later)->second, last);
}

TEST_P(SmTimedTest, AWarpWaitsForASlotUntilACycleAfterItsRelease) {
  TimedSmBench sm(GetParam(), context, {{"cores", "1"}, {"warps_per_core", "1"}});
  sm.release_after = 500;
  sm.warps.add(warp(0));
  sm.warps.add(warp(1));
  sm.warps.add(warp(2));
  sm.run();
  ASSERT_EQ(sm.cycles.size(), 3U);
  // Shaded seen at s, released at s + 500, known at s + 501, launched in that cycle.
  EXPECT_EQ(sm.cycles[0], 1 + fragment_cycles + 1);
  EXPECT_EQ(sm.cycles[1], sm.cycles[0] + 501 + fragment_cycles + 1);
  EXPECT_EQ(sm.cycles[2], sm.cycles[1] + 501 + fragment_cycles + 1);
}

TEST_P(SmTimedTest, WarpsWithoutASlotStayOutside) {
  TimedSmBench sm(GetParam(), context, {{"cores", "1"}, {"warps_per_core", "2"}}, 1);
  sm.release_after = never;
  for (std::uint32_t i = 0; i < 5; ++i) sm.warps.add(warp(i));
  if (GetParam() == Fidelity::lt) {
    EXPECT_THROW(sm.bench.run(), SimulationFault) << "a blocking call cannot wait for a release that never comes";
    return;
  }
  sm.bench.run();
  EXPECT_EQ(sm.cycles.size(), 2U);
  EXPECT_EQ(sm.warps.sent().size(), 3U) << "one more waits in the queue";
}

TEST_P(SmTimedTest, ConsecutiveWarpsOfATileGoToOneCore) {
  // Two cores of one scheduler: whether two warps share it tells.
  for (const bool together : {false, true}) {
    TimedSmBench sm(GetParam(), context,
                    {{"cores", "2"}, {"schedulers_per_core", "1"}, {"warps_to_one_core", together ? "8" : "1"}});
    for (std::uint32_t i = 0; i < 2; ++i) sm.warps.add(warp(i), 10);
    sm.run();
    // Launched at 12; one that shares the scheduler issues its first segment 7 cycles late, and its second once that of
    // the first has issued, 40 cycles after it.
    const Cycle alone = 12 + fragment_cycles + 1;
    EXPECT_EQ(sm.cycles[1], together ? 11 + fragment_cycles + 40 + 1 : alone);
  }
}

TEST_P(SmTimedTest, WarpsThatAlternateBetweenCoresFindAllSchedulersOfEach) {
  TimedSmBench sm(GetParam(), context, {{"cores", "2"}, {"schedulers_per_core", "2"}, {"warps_to_one_core", "1"}});
  for (std::uint32_t i = 0; i < 4; ++i) sm.warps.add(warp(i), 10);
  sm.run();
  for (std::uint32_t i = 0; i < 4; ++i)
    EXPECT_EQ(sm.cycles[i], 11 + i + fragment_cycles + 1) << "alone on its scheduler";
}

TEST_P(SmTimedTest, VerticesComeBackInOrderAfterTheirShader) {
  Bench bench(GetParam(), "sm", "splat-shader", context);
  Source<VertexWarp>& in = bench.source<VertexWarp>("in_vertices");
  Sink<VertexWarp>& out = bench.sink<VertexWarp>("out_vertices");
  for (std::uint32_t i = 0; i < 100; ++i) in.add({8 * i, 8}, 10 + 20 * i);
  in.add({0, 0, 0, Mark::end_of_frame});
  bench.run();
  ASSERT_EQ(out.records().size(), 101U);
  for (std::uint32_t i = 0; i < 100; ++i) {
    EXPECT_EQ(out.records()[i].item.first_splat, 8 * i);
    EXPECT_EQ(out.records()[i].cycle, 11 + 20 * i + vertex_cycles + 1);
  }
  EXPECT_TRUE(out.records()[100].item.mark == Mark::end_of_frame);
  EXPECT_TRUE(bench.unit().idle());
}

TEST_P(SmTimedTest, NoMoreVertexWarpsAreInFlightThanItHasPlaces) {
  Bench bench(GetParam(), "sm", "splat-shader", context, {{"vertex_warps", "4"}});
  Source<VertexWarp>& in = bench.source<VertexWarp>("in_vertices", 64);
  Sink<VertexWarp>& out = bench.sink<VertexWarp>("out_vertices", 64);
  for (std::uint32_t i = 0; i < 8; ++i) in.add({8 * i, 8});
  bench.run();
  ASSERT_EQ(out.records().size(), 8U);
  // The fifth is launched in the cycle after the first has left.
  for (std::uint64_t i = 0; i < 4; ++i) {
    EXPECT_EQ(out.records()[i].cycle, 1 + i + vertex_cycles + 1);
    EXPECT_EQ(out.records()[4 + i].cycle, out.records()[i].cycle + vertex_cycles + 1);
  }
}

TEST_P(SmTimedTest, FragmentsThatFillAllSlotsDoNotHoldUpVertices) {
  TimedSmBench sm(GetParam(), context, {{"cores", "1"}, {"warps_per_core", "2"}});
  Source<VertexWarp>& vertices = sm.bench.source<VertexWarp>("in_vertices");
  Sink<VertexWarp>& out = sm.bench.sink<VertexWarp>("out_vertices");
  sm.release_after = 1'000'000;
  for (std::uint32_t i = 0; i < 4; ++i) sm.warps.add(warp(i));
  vertices.add({0, 8, false}, 1000);
  sm.run();
  ASSERT_EQ(out.records().size(), 1U);
  EXPECT_LT(out.records()[0].cycle, 2000U);
}

TEST_P(SmTimedTest, VerticesTakeIssueSlotsFromFragments) {
  // One scheduler: a vertex warp's 20 instructions, or its first 4, go before the fragment warp's.
  TimedSmBench sm(GetParam(), context, {{"cores", "1"}, {"schedulers_per_core", "1"}});
  Source<VertexWarp>& vertices = sm.bench.source<VertexWarp>("in_vertices");
  sm.bench.sink<VertexWarp>("out_vertices");
  vertices.add({0, 8, false}, 5);
  sm.warps.add(warp(0), 10);
  sm.run();
  EXPECT_GT(sm.cycles.at(0), 11 + fragment_cycles + 1);
  EXPECT_LE(sm.cycles.at(0), 11 + fragment_cycles + 20 * 2 + 1);
}

// case M06
TEST_P(SmTimedTest, EveryWarpComesOutOnceUnderAnyStallsInWhateverOrder) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    TimedSmBench sm(GetParam(), context, {{"cores", "2"}, {"warps_per_core", "6"}, {"vertex_warps", "3"}},
                    static_cast<unsigned>(1 + seed % 9), static_cast<unsigned>(1 + seed % 10));
    Source<VertexWarp>& vertices = sm.bench.source<VertexWarp>("in_vertices");
    Sink<VertexWarp>& shaded_vertices = sm.bench.sink<VertexWarp>("out_vertices");
    sm.release_after = 1 + seed % 40;
    for (std::uint32_t i = 0; i < 60; ++i) {
      sm.warps.add(warp(i, {static_cast<std::uint16_t>(i % 4), 0}, static_cast<std::uint8_t>(i % 3 == 0 ? 0b1111 : 0)));
      vertices.add({8 * i, 8, false});
    }
    sm.bench.stall_randomly(seed, 100);
    sm.run();
    ASSERT_EQ(sm.shaded.records().size(), 61U) << seed;
    ASSERT_EQ(sm.cycles.size(), 60U) << seed;
    ASSERT_EQ(sm.ends, 1U) << seed;
    ASSERT_EQ(sm.quads, 40U * 8 + 20 * 4) << seed;
    ASSERT_EQ(shaded_vertices.records().size(), 60U) << seed;
    for (std::uint32_t i = 0; i < 60; ++i) ASSERT_EQ(shaded_vertices.records()[i].item.first_splat, 8 * i) << seed;
    ASSERT_TRUE(sm.bench.unit().idle()) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
