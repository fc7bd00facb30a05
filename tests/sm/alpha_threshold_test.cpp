// The shader that reads the colour target: what it discards, and what it costs.
#include <gtest/gtest.h>

#include "sm/sm.h"

#include <vrpipe/pipeline/surface.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::alpha_threshold_state;
using testkit::Bench;

constexpr std::uint32_t threshold_side = 64;

RenderContext context_with(const DrawState& state, ColorFormat format = ColorFormat::rgba16f) {
  Frame frame(threshold_side, threshold_side);
  frame.draw(testing::geometry_of(threshold_side, threshold_side,
                                  {testing::flat_box(0, 0, threshold_side, threshold_side, 1)}),
             state);
  RenderContext context = testing::context_of(frame);
  context.format = format;
  return context;
}

Warp warp_of(std::initializer_list<unsigned> positions, TileId tile = {0, 0}, std::uint32_t sequence = 0) {
  Warp warp;
  warp.tile = tile;
  warp.sequence = warp.tile_sequence = sequence;
  for (const unsigned position : positions)
    warp.quads[warp.count++] = {0, static_cast<std::uint8_t>(position), all_lanes, 0, 0};
  return warp;
}

struct ThresholdShader {
  explicit ThresholdShader(const DrawState& state) : context(context_with(state)), sm(parameters, context) {
    sm.set_draws(1);
    sm.attach(surface);
  }
  ShadedWarp shade(const Warp& warp) {
    ShadedWarp out;
    sm.shade(warp, out);
    return out;
  }
  RenderContext context;
  SplatShader::Parameters parameters;
  SplatShader sm;
  ColorSurface surface{threshold_side, threshold_side, ColorFormat::rgba16f};
};

TEST(AlphaThreshold, PixelsBelowTheThresholdAreDiscarded) {
  ThresholdShader shader(alpha_threshold_state(0.5F));
  shader.surface.quad({1, 2}, 9).alpha = Lanes{0.5F, 0.499F, 1.0F, 0.0F};
  shader.surface.quad({1, 2}, 11).alpha = Lanes{0.9F, 0.9F, 0.9F, 0.1F};
  Warp warp = warp_of({9, 10, 11}, {1, 2});
  warp.quads[2].coverage = 0b1010;
  const ShadedWarp out = shader.shade(warp);
  ASSERT_EQ(out.count, 2U);
  EXPECT_EQ(out.position[0], 9U);
  EXPECT_EQ(out.live[0], 0b0101U);
  EXPECT_EQ(out.position[1], 11U);
  EXPECT_EQ(out.live[1], 0b0010U) << "of what is covered";
  EXPECT_EQ(shader.sm.quads_pruned.value(), 1U);
  EXPECT_EQ(shader.sm.fragments_pruned.value(), 2U + 4U + 1U);
  EXPECT_EQ(shader.sm.fragments_shaded.value(), 10U);
}

// As CROP signals: by `ge` the threshold itself, by `gt` what exceeds it.
TEST(AlphaThreshold, TheThresholdItselfGoesByTheRuleOfTermination) {
  constexpr float threshold = 0.75F;
  for (const bool inclusive : {true, false}) {
    DrawState state = alpha_threshold_state(threshold);
    state.termination_inclusive = inclusive;
    ThresholdShader shader(state);
    shader.surface.quad({0, 0}, 0).alpha = Lanes{threshold, 0.75048828F, 0.74951172F, 1};
    const ShadedWarp out = shader.shade(warp_of({0}));
    ASSERT_EQ(out.count, 1U);
    EXPECT_EQ(out.live[0], inclusive ? 0b1011U : 0b1010U);
  }
}

class AlphaThresholdTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  /// The cycles in which warps are seen behind the array, which a memory of 100 cycles serves if it is connected.
  static std::vector<Cycle> run(const RenderContext& context, bool memory, const std::vector<Warp>& warps,
                                MemoryBytes* moved = nullptr) {
    Bench bench(GetParam(), "sm", "splat-shader", context);
    auto& in = bench.source<Warp>("in_warps", 64);
    auto& release = bench.source<WarpRelease>("in_release", 64);
    auto& out = bench.sink<ShadedWarpItem>("out_shaded", 64);
    std::vector<Cycle> cycles;
    out.on_take([&](const ShadedWarpItem& item, Cycle now) {
      if (item.warp->mark == Mark::none) {
        cycles.push_back(now);
        release.add({item.warp->slot}, now + 1);
      }
      item.warp->release();
    });
    if (memory) bench.set_memory(100, 128);
    for (const Warp& warp : warps) in.add(warp);
    Warp end;
    end.mark = Mark::end_of_frame;
    in.add(end);
    bench.run();
    if (moved != nullptr) *moved = bench.unit().memory_bytes();
    return cycles;
  }
};
INSTANTIATE_TEST_SUITE_P(Fidelities, AlphaThresholdTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

// Five instructions of two cycles each: three up to the load, 146 cycles for that, two behind it. Seen by the SM in cycle 1,
// and a cycle after it is done.
TEST_P(AlphaThresholdTest, AWarpTakesItsFiveInstructionsAndTheLoad) {
  EXPECT_EQ(run(context_with(alpha_threshold_state()), false, {warp_of({0})}),
            std::vector<Cycle>{1 + 3 * 2 + 146 + 2 * 2 + 1});
}

TEST_P(AlphaThresholdTest, AWarpOfAMeshTakesThoseOfItsOwnProgram) {
  Frame frame(threshold_side, threshold_side);
  auto mesh = std::make_shared<Draw>(testing::draw_of(threshold_side, threshold_side));
  mesh->mesh.resize(1);
  for (MeshVertex& vertex : mesh->mesh[0].vertices) vertex = {0, 0, 0.5F, 1, 1, 1, 1, 0, 0, 1};
  mesh->mesh[0].vertices[1].x = mesh->mesh[0].vertices[2].y = threshold_side;
  DrawState state;
  state.shader = FragmentShader::vertex;
  frame.draw(mesh, state);
  EXPECT_EQ(run(testing::context_of(frame), false, {warp_of({0})}),
            std::vector<Cycle>{1 + 4 * 2 + 146 + 25 * 2 + 75 + 1});
}

// RGBA16F: a sector a quad, four quads of 4x4 pixels a line.
TEST_P(AlphaThresholdTest, WithAMemoryItReadsTheSectorsOfItsQuadsAndWaitsForThem) {
  MemoryBytes moved;
  const std::vector<Cycle> cycles =
      run(context_with(alpha_threshold_state()), true, {warp_of({0, 1, 8, 9, 2, 3, 63})}, &moved);
  EXPECT_EQ(moved.read, 7U * 32);
  EXPECT_EQ(moved.written, 0U);
  EXPECT_GE(cycles.at(0), 1U + 100U + 2 * 2 + 1);
  EXPECT_LT(cycles.at(0), 1U + 100U + 2 * 2 + 1 + 10) << "a few cycles for three lines";
}

// Past the L1, which may hold what was there before.
TEST_P(AlphaThresholdTest, WhatIsReadAgainComesFromMemoryAgain) {
  std::vector<Warp> warps;
  for (std::uint32_t i = 0; i < 5; ++i) warps.push_back(warp_of({0, 1, 8, 9}, {0, 0}, i));
  MemoryBytes moved;
  run(context_with(alpha_threshold_state()), true, warps, &moved);
  EXPECT_EQ(moved.read, 5U * 128);
}

TEST_P(AlphaThresholdTest, ASectorOfTwoQuadsIsReadOnceAndOneQuadMayHaveTwo) {
  MemoryBytes moved;
  run(context_with(alpha_threshold_state(), ColorFormat::rgba8), true, {warp_of({0, 1, 8, 9})}, &moved);
  EXPECT_EQ(moved.read, 2U * 32);
  run(context_with(alpha_threshold_state(), ColorFormat::rgba32f), true, {warp_of({0, 1})}, &moved);
  EXPECT_EQ(moved.read, 4U * 32);
}

}  // namespace
}  // namespace vrpipe
