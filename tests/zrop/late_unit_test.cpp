// When ZROP tests what has been shaded: before what waits to be, through the same z-cache port; and marks that come around.
#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

#include "support/fidelities.h"
#include "zrop/zrop.h"

namespace vrpipe {
namespace {

using testing::beat_of;
using testing::numbers;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

constexpr std::uint32_t late_side = 64;
constexpr std::size_t early_command = 1;

/// A late draw of splats of depth 0.5, and one behind it that is tested before it is shaded.
Frame late_and_early() {
  auto splats = std::make_shared<Draw>(testing::draw_of(late_side, late_side, std::vector<Splat>(64)));
  for (Splat& splat : splats->splats) splat.depth = 0.5F;
  Frame frame(late_side, late_side);
  DrawState state;
  state.depth = {true, Compare::less, true};
  frame.draw(splats, state, "late");
  state.depth = {true, Compare::equal, false};
  frame.draw(splats, state, "early");
  return frame;
}

class LateZropTest : public ::testing::Test {
 protected:
  LateZropTest() : context(testing::context_of(late_and_early())) {}

  /// Of the late draw; quads are of splats first, first + 1, ...
  ShadedWarpItem warp(const std::vector<unsigned>& positions, std::uint32_t first = 0) {
    ShadedWarp& made = pool_.take();
    made.tile = {0, 0};
    made.sequence = sequence_;
    made.tile_sequence = sequence_++;
    made.count = static_cast<std::uint8_t>(positions.size());
    made.mark = Mark::none;
    for (unsigned i = 0; i < positions.size(); ++i) {
      made.position[i] = static_cast<std::uint8_t>(positions[i]);
      made.live[i] = all_lanes;
      made.first_primitive[i] = made.last_primitive[i] = 2 * (first + i);
      made.color[i] = testing::color_of(0.5F, 0.5F, 0.5F, 0.5F);
    }
    return {&made};
  }
  ShadedWarpItem mark(std::size_t command) {
    ShadedWarp& made = pool_.take();
    made.mark = Frame::mark_of(command);
    made.count = 0;
    return {&made};
  }
  /// Of a draw, in the tile of the warps.
  static QuadBeat quads_of_draw(DrawIndex draw, const std::vector<unsigned>& positions) {
    QuadBeat beat = beat_of({0, 0}, positions, draw == 0 ? 0 : 64, true);
    for (unsigned i = 0; i < beat.count; ++i) beat.quads[i].draw = draw & 0x7fffU;
    return beat;
  }

  const RenderContext context;
  ShadedWarpPool pool_;
  std::uint32_t sequence_ = 0;
};
class LateZrop : public LateZropTest, public ::testing::WithParamInterface<Fidelity> {};
INSTANTIATE_TEST_SUITE_P(Zrop, LateZrop, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(LateZrop, AWarpComesBackAfterTheLatencyWithoutWhatHasFailed) {
  Bench bench(GetParam(), "zrop", "depth-stencil-rop", context, {{"latency_cycles", "8"}});
  Source<ShadedWarpItem>& in = bench.source<ShadedWarpItem>("in_late", 8);
  Sink<ShadedWarpItem>& out = bench.sink<ShadedWarpItem>("out_late", 8);
  in.add(warp({3, 4, 5}), 10);
  in.add(warp({3, 9}, 3), 30);  // 3 holds 0.5 by now
  in.add(warp({3, 4}, 5), 50);
  bench.run();
  ASSERT_EQ(out.records().size(), 3U);
  EXPECT_EQ(out.records()[0].cycle, 11U + 8);
  EXPECT_EQ(out.records()[1].cycle, 31U + 8);
  EXPECT_EQ(out.records()[0].item.warp->count, 3);
  ASSERT_EQ(out.records()[1].item.warp->count, 1);
  EXPECT_EQ(out.records()[1].item.warp->position[0], 9);
  EXPECT_EQ(out.records()[2].item.warp->count, 0) << "it comes back all the same";
  const auto& rop = bench.behaviour<DepthStencilRop>();
  EXPECT_EQ(rop.quads_tested_late.value(), 7U);
  EXPECT_EQ(rop.quads_late_failed.value(), 3U);
  EXPECT_EQ(rop.fragments_late_failed.value(), 12U);
  EXPECT_TRUE(bench.unit().idle());
}

TEST_P(LateZrop, TestsItsQuadsPerCycle) {
  for (const unsigned rate : {4U, 8U, 16U}) {
    Bench bench(GetParam(), "zrop", "depth-stencil-rop", context, {{"quads_per_cycle", std::to_string(rate)}});
    Source<ShadedWarpItem>& in = bench.source<ShadedWarpItem>("in_late", 32);
    Sink<ShadedWarpItem>& out = bench.sink<ShadedWarpItem>("out_late", 32);
    for (unsigned i = 0; i < 32; ++i) in.add(warp(numbers(8)));
    bench.run();
    ASSERT_EQ(out.records().size(), 32U);
    EXPECT_EQ(out.records().back().cycle - out.records().front().cycle, 31U * 8 / rate);
    bench.unit().close_account(10'000);
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), ZropWork::late_tests, 10'000), 32.0 * 8 / rate);
  }
}

TEST_F(LateZropTest, HasThePortBeforeOtherTests) {
  Bench bench("zrop", "depth-stencil-rop", context, {{"latency_cycles", "1"}, {"quads_per_cycle", "16"}});
  Source<QuadBeat>& early = bench.source<QuadBeat>("in_quads", 8);
  Source<ShadedWarpItem>& late = bench.source<ShadedWarpItem>("in_late", 8);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 8);
  Sink<ShadedWarpItem>& back = bench.sink<ShadedWarpItem>("out_late", 8);
  for (unsigned i = 0; i < 6; ++i) early.add(quads_of_draw(1, numbers(16)));
  for (const Cycle at : {2U, 3U}) late.add(warp(numbers(8), 0), at);
  bench.run();
  // A beat of 16 quads in each cycle from 1 on; beside a warp of 8 there is no room for one.
  ASSERT_EQ(back.records().size(), 2U);
  EXPECT_EQ(back.records()[0].cycle, 4U);
  EXPECT_EQ(back.records()[1].cycle, 5U);
  EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), ZropWork::tests, 100), 6);
  EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), ZropWork::late_tests, 100), 1);
  EXPECT_EQ(bench.behaviour<DepthStencilRop>().quads_tested.value(), 96U);
  static_cast<void>(out);
}

TEST_F(LateZropTest, ABeatIsTestedBesideAWarpThatLeavesRoom) {
  Bench bench("zrop", "depth-stencil-rop", context, {{"latency_cycles", "1"}});
  Source<QuadBeat>& early = bench.source<QuadBeat>("in_quads", 8);
  Source<ShadedWarpItem>& late = bench.source<ShadedWarpItem>("in_late", 8);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 8);
  Sink<ShadedWarpItem>& back = bench.sink<ShadedWarpItem>("out_late", 8);
  late.add(warp(numbers(8)), 20);
  late.add(warp(numbers(8)), 21);
  early.add(quads_of_draw(0, numbers(8)), 20);
  early.add(quads_of_draw(0, numbers(16)), 21);
  bench.run();
  ASSERT_EQ(out.records().size(), 2U);
  EXPECT_EQ(back.records()[0].cycle, 22U);
  EXPECT_EQ(out.records()[0].cycle, 22U);
  EXPECT_EQ(back.records()[1].cycle, 23U);
  EXPECT_EQ(out.records()[1].cycle, 24U) << "16 and 8 quads are more than a cycle's";
}

// The mark goes on, and comes around behind the warp: by then what it tests is stored.
TEST_F(LateZropTest, WhatIsBehindAMarkIsTestedWhenThatHasComeAround) {
  Bench bench("zrop", "depth-stencil-rop", context, {{"latency_cycles", "8"}});
  Source<QuadBeat>& early = bench.source<QuadBeat>("in_quads", 8);
  Source<ShadedWarpItem>& late = bench.source<ShadedWarpItem>("in_late", 8);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 8);
  Sink<ShadedWarpItem>& back = bench.sink<ShadedWarpItem>("out_late", 8);
  QuadBeat boundary;
  boundary.mark = Frame::mark_of(early_command);
  early.add(quads_of_draw(0, {3}), 10);
  early.add(boundary, 11);
  early.add(quads_of_draw(1, {3, 4}), 12);
  late.add(warp({3}), 100);
  late.add(mark(early_command), 110);
  bench.run();
  ASSERT_EQ(out.records().size(), 3U);
  EXPECT_EQ(out.records()[0].cycle, 11U + 8);
  EXPECT_EQ(out.records()[1].cycle, 12U + 8) << "the mark is not held up";
  EXPECT_EQ(out.records()[2].cycle, 111U + 8);
  ASSERT_EQ(out.records()[2].item.count, 1) << "0.5 equals what the warp has stored, and 1 it does not";
  EXPECT_EQ(out.records()[2].item.quads[0].position, 3);
  ASSERT_EQ(back.records().size(), 2U);
  EXPECT_EQ(back.records()[1].cycle, 111U + 8);
  EXPECT_TRUE(back.records()[1].item.warp->mark == boundary.mark);
  EXPECT_TRUE(bench.unit().idle());
}

// Also while nothing takes what was tested before shading: CROP waits for what was tested after it.
TEST_F(LateZropTest, GoesOnWhileSurvivorsAreHeldUp) {
  Bench bench("zrop", "depth-stencil-rop", context);
  Source<QuadBeat>& early = bench.source<QuadBeat>("in_quads", 1);
  Source<ShadedWarpItem>& late = bench.source<ShadedWarpItem>("in_late", 1);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 1);
  Sink<ShadedWarpItem>& back = bench.sink<ShadedWarpItem>("out_late", 1);
  out.close(0, 5000);
  for (unsigned i = 0; i < 40; ++i) early.add(quads_of_draw(0, numbers(16)));
  for (unsigned i = 0; i < 40; ++i) late.add(warp(numbers(8)));
  bench.run();
  EXPECT_EQ(back.records().size(), 40U);
  EXPECT_LT(back.records().back().cycle, 1000U);
  EXPECT_GE(out.records().front().cycle, 5000U);
}

TEST_P(LateZrop, TellsHiZWhatIsStoredLate) {
  Bench bench(GetParam(), "zrop", "depth-stencil-rop", context, {{"latency_cycles", "20"}});
  Source<ShadedWarpItem>& in = bench.source<ShadedWarpItem>("in_late", 8);
  bench.sink<ShadedWarpItem>("out_late", 8);
  Sink<HiZUpdate>& told = bench.sink<HiZUpdate>("out_hi_z");
  // A raster tile of 16 quads, in two warps.
  in.add(warp({0, 1, 2, 3, 8, 9, 10, 11}), 10);
  in.add(warp({16, 17, 18, 19, 24, 25, 26, 27}, 8), 50);
  bench.run();
  ASSERT_EQ(told.records().size(), 2U);
  EXPECT_EQ(told.records()[0].item.farthest, store_depth(DepthFormat::d24, 1)) << "half of it is as it was";
  EXPECT_EQ(told.records()[1].item.farthest, store_depth(DepthFormat::d24, 0.5));
  EXPECT_EQ(told.records()[1].cycle, 51U + 20);
}

// Through a z-cache: what a warp needs is read first, and what it stores is written back some time.
TEST_F(LateZropTest, WaitsForTheFillOfItsSectors) {
  Bench bench("zrop", "depth-stencil-rop", context,
              {{"latency_cycles", "1"}, {"cache_bytes", "256"}, {"fast_clear", "off"}});
  Source<ShadedWarpItem>& late = bench.source<ShadedWarpItem>("in_late", 8);
  Sink<ShadedWarpItem>& back = bench.sink<ShadedWarpItem>("out_late", 8);
  bench.set_memory(100, 32);
  late.add(warp({0}), 10);
  late.add(warp({0}), 200);           // a hit
  late.add(warp({16, 32, 48}), 300);  // three lines of a cache of two
  bench.run();
  ASSERT_EQ(back.records().size(), 3U);
  EXPECT_GE(back.records()[0].cycle, 111U);
  EXPECT_EQ(back.records()[1].cycle, 202U);
  EXPECT_GE(back.records()[2].cycle, 400U);
  EXPECT_TRUE(bench.unit().idle());
  EXPECT_GT(bench.unit().memory_bytes().written, 0U) << "what was stored of the line that went";
}

TEST_P(LateZrop, NoStallLosesAWarpOrMovesOnePastAnother) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const bool cached : {false, true}) {
      Bench bench(GetParam(), "zrop", "depth-stencil-rop", context,
                  {{"quads_per_cycle", seed % 2 == 0 ? "16" : "3"}, {"cache_bytes", "128"}, {"mshrs", "2"}});
      Source<ShadedWarpItem>& late = bench.source<ShadedWarpItem>("in_late", static_cast<unsigned>(1 + seed % 4));
      Sink<ShadedWarpItem>& back = bench.sink<ShadedWarpItem>("out_late", static_cast<unsigned>(1 + seed % 3));
      if (cached) bench.set_memory(30, 32);
      const std::uint32_t first = sequence_;
      for (unsigned i = 0; i < 60; ++i) {
        late.add(warp({i, (i + 17) % 64, (i + 40) % 64}), 2 * i);
      }
      back.close(20, 20 + 40 * (seed % 3));
      bench.stall_randomly(seed, 100);
      bench.run();
      ASSERT_EQ(back.records().size(), 60U);
      for (unsigned i = 0; i < 60; ++i) EXPECT_EQ(back.records()[i].item.warp->sequence, first + i);
      const auto& rop = bench.behaviour<DepthStencilRop>();
      EXPECT_EQ(rop.quads_tested_late.value(), 180U);
      // Each position passes once: then it holds 0.5.
      EXPECT_EQ(rop.quads_late_failed.value(), 180U - 64);
      EXPECT_TRUE(bench.unit().idle());
    }
  }
}

}  // namespace
}  // namespace vrpipe
