// What is shaded and writes no colour ends behind its late tests.
#include <gtest/gtest.h>

#include "zrop/zrop.h"

#include "support/builders.h"

namespace vrpipe {
namespace {

TEST(DepthStencilCounts, WhatWritesNoColourEndsBehindItsLateTests) {
  Frame frame(16, 16);
  DrawState state = testing::alpha_threshold_state();
  state.stencil.front.compare = Compare::not_equal;  // to 1, the reference
  frame.draw(testing::geometry_of(16, 16, {Splat{}}), state);
  const RenderContext context = testing::context_of(frame);
  const DepthStencilRop::Parameters parameters;
  DepthStencilRop rop(parameters, context);
  DepthStencilSurface surface(16, 16);
  rop.attach(surface);
  surface.quad(3).stencil = {1, 0, 0, 0};
  surface.quad(4).stencil = {1, 1, 1, 1};

  QuadBeat beat = testing::beat_of({0, 0}, {3, 4, 5});
  EXPECT_EQ(rop.test(beat), 0U) << "the shader discards, so it is not tested before it is shaded";
  EXPECT_EQ(beat.count, 3);

  ShadedWarp warp;
  warp.tile = {0, 0};
  warp.count = 3;
  for (unsigned i = 0; i < 3; ++i) {
    warp.position[i] = static_cast<std::uint8_t>(3 + i);
    warp.live[i] = i == 2 ? 0b0011 : all_lanes;
    warp.first_primitive[i] = warp.last_primitive[i] = 0;
    warp.color[i] = QuadColor{};
  }
  EXPECT_EQ(rop.test_late(warp), 0b101U);
  EXPECT_EQ(warp.count, 0);
  EXPECT_EQ(surface.quad(3).stencil, (std::array<std::uint8_t, 4>{1, 1, 1, 1}));
  EXPECT_EQ(surface.quad(5).stencil, (std::array<std::uint8_t, 4>{1, 1, 0, 0}));
  EXPECT_EQ(rop.quads_tested_late.value(), 3U);
  EXPECT_EQ(rop.quads_late_failed.value(), 1U);
  EXPECT_EQ(rop.fragments_late_failed.value(), 1U + 4U);
  EXPECT_EQ(rop.quads_unblended.value(), 2U);
  EXPECT_EQ(rop.fragments_unblended.value(), 3U + 2U);
}

}  // namespace
}  // namespace vrpipe
