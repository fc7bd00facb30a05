#include <algorithm>

#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

#include "sm/sm_scene.h"

namespace vrpipe {
namespace {

using testing::fragment_cycles;
using testing::merge_cycles;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class SmUnitTest : public ::testing::Test, protected testing::SmScene {
 protected:
  static Warp end(std::uint32_t warps) {
    Warp result;
    result.mark = Mark::end_of_frame;
    result.sequence = warps;
    return result;
  }
};

/// The unit with everything around it: what is shaded is noted and its slot released at once, or later.
struct SmBench {
  SmBench(const RenderContext& context, const Bench::Settings& settings = {}, unsigned in_depth = 8,
          unsigned out_depth = 64)
      : bench("sm", "splat-shader", context, settings),
        warps(bench.source<Warp>("in_warps", in_depth)),
        release(bench.source<WarpRelease>("in_release", 4096)),
        shaded(bench.sink<ShadedWarpItem>("out_shaded", out_depth)) {
    shaded.on_take([this](const ShadedWarpItem& item, Cycle now) {
      sequences.push_back(item.warp->mark == Mark::end_of_frame ? ~0U : item.warp->sequence);
      quads += item.warp->count;
      cycles.push_back(now);
      item.warp->release();
      release.add({item.warp->slot}, now + release_after);
    });
  }
  Bench bench;
  Source<Warp>& warps;
  Source<WarpRelease>& release;
  Sink<ShadedWarpItem>& shaded;
  Cycle release_after = 1;
  std::vector<std::uint32_t> sequences;
  std::vector<Cycle> cycles;
  unsigned quads = 0;
};

TEST_F(SmUnitTest, AWarpAloneTakesItsInstructionsAndLatencies) {
  SmBench sm(context);
  sm.warps.add(warp(0), 10);
  sm.bench.run();
  ASSERT_EQ(sm.cycles.size(), 1U);
  EXPECT_EQ(sm.cycles[0], 11 + fragment_cycles + 1) << "in hand at 11, seen a link later";
}

TEST_F(SmUnitTest, AWarpWithPairsTakesTheMergeAsWell) {
  SmBench sm(context);
  sm.warps.add(warp(0, {0, 0}, 0b0001), 10);
  sm.bench.run();
  EXPECT_EQ(sm.cycles.at(0), 11 + fragment_cycles + merge_cycles + 1);
}

TEST_F(SmUnitTest, FewerLanesMakeAnInstructionIssueLonger) {
  SmBench sm(context, {{"lanes_per_scheduler", "8"}});
  sm.warps.add(warp(0), 10);
  sm.bench.run();
  EXPECT_EQ(sm.cycles.at(0), 11 + fragment_cycles + 24 * 2 + 1);
}

TEST_F(SmUnitTest, WarpsOfOneSchedulerHideOneAnothersLatencies) {
  SmBench sm(context, {{"cores", "1"}, {"schedulers_per_core", "1"}}, 64);
  for (std::uint32_t i = 0; i < 48; ++i) sm.warps.add(warp(i));
  sm.bench.run();
  ASSERT_EQ(sm.cycles.size(), 48U);
  // 48 warps of 24 instructions keep one scheduler busy for 2304 cycles; what shows beside is one warp's latency.
  EXPECT_GE(sm.cycles.back(), 48U * 24 * 2);
  EXPECT_LE(sm.cycles.back(), 48U * 24 * 2 + 146 + 75 + 10);
}

TEST_F(SmUnitTest, SchedulersWorkSideBySide) {
  SmBench one(context, {{"cores", "1"}, {"schedulers_per_core", "1"}}, 64);
  for (std::uint32_t i = 0; i < 48; ++i) one.warps.add(warp(i));
  one.bench.run();
  SmBench four(context, {{"cores", "1"}, {"schedulers_per_core", "4"}}, 64);
  for (std::uint32_t i = 0; i < 48; ++i) four.warps.add(warp(i));
  four.bench.run();
  EXPECT_LT(four.cycles.back() - fragment_cycles, (one.cycles.back() - fragment_cycles) / 3);
}

TEST_F(SmUnitTest, AWarpWaitsForASlotUntilACycleAfterItsRelease) {
  SmBench sm(context, {{"cores", "1"}, {"warps_per_core", "1"}});
  sm.release_after = 500;
  sm.warps.add(warp(0));
  sm.warps.add(warp(1));
  sm.bench.run();
  ASSERT_EQ(sm.cycles.size(), 2U);
  // Shaded seen at s, released at s + 500, known at s + 501, launched in that cycle.
  EXPECT_EQ(sm.cycles[1], sm.cycles[0] + 501 + fragment_cycles + 1);
}

TEST_F(SmUnitTest, ConsecutiveWarpsOfATileGoToOneCore) {
  // Two cores of one slot: with 1 warp to one core the second warp finds the other core, with 8 of them too since the
  // first is full; with two slots each, whether they share a scheduler tells.
  const auto last = [&](const char* to_one_core) {
    SmBench sm(context, {{"cores", "2"}, {"schedulers_per_core", "1"}, {"warps_to_one_core", to_one_core}});
    for (std::uint32_t i = 0; i < 2; ++i) sm.warps.add(warp(i), 10);
    sm.bench.run();
    return sm.cycles.back();
  };
  EXPECT_EQ(last("1"), 12 + fragment_cycles + 1) << "a core each: only the launch a cycle later";
  EXPECT_GT(last("8"), 12 + fragment_cycles + 1) << "one scheduler for both";
}

TEST_F(SmUnitTest, VerticesComeBackInOrderAfterTheirShader) {
  Bench bench("sm", "splat-shader", context);
  Source<VertexWarp>& in = bench.source<VertexWarp>("in_vertices");
  Sink<VertexWarp>& out = bench.sink<VertexWarp>("out_vertices");
  for (std::uint32_t i = 0; i < 100; ++i) in.add({8 * i, 8}, 10);
  in.add({0, 0, 0, Mark::end_of_frame});
  bench.run();
  ASSERT_EQ(out.records().size(), 101U);
  EXPECT_EQ(out.records()[0].cycle, 11U + 4 * 2 + 146 + 16 * 2 + 75 + 1) << "20 instructions";
  for (std::uint32_t i = 0; i < 100; ++i) EXPECT_EQ(out.records()[i].item.first_splat, 8 * i);
  EXPECT_TRUE(out.records()[100].item.mark == Mark::end_of_frame);
  EXPECT_TRUE(bench.unit().idle());
}

TEST_F(SmUnitTest, NoMoreVertexWarpsAreInFlightThanItHasPlaces) {
  Bench bench("sm", "splat-shader", context, {{"vertex_warps", "4"}});
  Source<VertexWarp>& in = bench.source<VertexWarp>("in_vertices", 64);
  Sink<VertexWarp>& out = bench.sink<VertexWarp>("out_vertices");
  for (std::uint32_t i = 0; i < 8; ++i) in.add({8 * i, 8});
  bench.run();
  const Cycle program = 4 * 2 + 146 + 16 * 2 + 75;
  EXPECT_GE(out.records()[4].cycle, 2 * program) << "the fifth waits for the first to leave";
  EXPECT_LT(out.records()[3].cycle, program + 10);
}

TEST_F(SmUnitTest, FragmentsThatFillAllSlotsDoNotHoldUpVertices) {
  SmBench sm(context, {{"cores", "1"}, {"warps_per_core", "2"}});
  Source<VertexWarp>& vertices = sm.bench.source<VertexWarp>("in_vertices");
  Sink<VertexWarp>& out = sm.bench.sink<VertexWarp>("out_vertices");
  sm.release_after = 1'000'000;
  for (std::uint32_t i = 0; i < 4; ++i) sm.warps.add(warp(i));
  vertices.add({0, 8, false}, 1000);
  sm.bench.run();
  ASSERT_EQ(out.records().size(), 1U);
  EXPECT_LT(out.records()[0].cycle, 2000U);
}

// case M06
TEST_F(SmUnitTest, EveryWarpComesOutOnceUnderAnyStallsInWhateverOrder) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SmBench sm(context, {{"cores", "2"}, {"warps_per_core", "6"}, {"vertex_warps", "3"}},
               static_cast<unsigned>(1 + seed % 4), static_cast<unsigned>(1 + seed % 5));
    Source<VertexWarp>& vertices = sm.bench.source<VertexWarp>("in_vertices");
    Sink<VertexWarp>& shaded_vertices = sm.bench.sink<VertexWarp>("out_vertices");
    sm.release_after = 1 + seed % 40;
    for (std::uint32_t i = 0; i < 60; ++i) {
      sm.warps.add(warp(i, {static_cast<std::uint16_t>(i % 4), 0}, static_cast<std::uint8_t>(i % 3 == 0 ? 0b1111 : 0)));
      vertices.add({8 * i, 8, false});
    }
    sm.warps.add(end(60));
    sm.bench.stall_randomly(seed, 100);
    sm.bench.shuffle_ticks(seed + 1);
    sm.bench.run();
    ASSERT_EQ(sm.sequences.size(), 61U) << seed;
    std::vector<std::uint32_t> sorted = sm.sequences;
    std::sort(sorted.begin(), sorted.end());
    for (std::uint32_t i = 0; i < 60; ++i) ASSERT_EQ(sorted[i], i) << seed;
    ASSERT_EQ(sm.quads, 40U * 8 + 20 * 4) << seed;
    ASSERT_EQ(shaded_vertices.records().size(), 60U) << seed;
    for (std::uint32_t i = 0; i < 60; ++i) ASSERT_EQ(shaded_vertices.records()[i].item.first_splat, 8 * i) << seed;
    ASSERT_TRUE(sm.bench.unit().idle()) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
