#include <vrpipe/workloads/multi_pass.h>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/mixed_frame.h>

#include "support/coverage.h"
#include "workload_test_support.h"

namespace vrpipe {
namespace {

Draw some_splats(std::uint32_t count, std::uint32_t width = 67, std::uint32_t height = 35) {
  Draw draw;
  draw.width = width;
  draw.height = height;
  draw.splats.resize(count);
  return draw;
}

DrawState some_state() {
  DrawState state;
  state.early_termination = true;
  state.termination_threshold = 0.75F;
  state.termination_inclusive = false;
  state.pruning_threshold = 0.02F;
  return state;
}

TEST(MultiPass, InOnePassItIsTheOneDraw) {
  const Draw splats = some_splats(5);
  const auto frame = multi_pass_frame(splats, some_state(), 1);
  ASSERT_EQ(frame->draws().size(), 1U);
  EXPECT_EQ(frame->draws()[0].state, some_state());
  EXPECT_EQ(frame->draws()[0].geometry.get(), &splats);
  EXPECT_EQ(frame->draws()[0].name, "");
}

TEST(MultiPass, BatchesAreAsEqualAsCanBeAndInOrder) {
  const Draw splats = some_splats(11);
  for (std::uint32_t passes = 2; passes <= 11; ++passes) {
    const auto frame = multi_pass_frame(splats, some_state(), passes);
    ASSERT_EQ(frame->draws().size(), 2 * passes - 1);
    EXPECT_EQ(frame->commands().size(), frame->draws().size()) << "no clears";
    std::uint32_t next = 0;
    for (std::size_t i = 0; i < frame->draws().size(); i += 2) {
      const DrawCall& batch = frame->draws()[i];
      EXPECT_EQ(batch.first, next);
      EXPECT_GE(batch.splats, 11 / passes);
      EXPECT_LE(batch.splats, 11 / passes + 1);
      next += batch.splats;
    }
    EXPECT_EQ(next, 11U);
  }
}

TEST(MultiPass, ABatchIsDrawnWhereTheStencilIsZeroAndWritesNone) {
  const auto frame = multi_pass_frame(some_splats(4), some_state(), 2);
  for (const std::size_t i : {0U, 2U}) {
    const DrawState& state = frame->draws()[i].state;
    EXPECT_TRUE(state.stencil.test);
    for (unsigned stored = 0; stored < 128; ++stored)
      EXPECT_EQ(state.stencil.front.test(static_cast<std::uint8_t>(stored)), stored == 0);
    EXPECT_FALSE(state.writes_depth_stencil());
    EXPECT_TRUE(state.early_termination) << "in a variant that has it";
    EXPECT_EQ(state.pruning_threshold, 0.02F);
    EXPECT_EQ(state.shader, FragmentShader::splat);
  }
}

TEST(MultiPass, BetweenBatchesTheStencilBecomesOneByTheRuleOfTheBatches) {
  const auto frame = multi_pass_frame(some_splats(4), some_state(), 2);
  const DrawState& state = frame->draws()[1].state;
  EXPECT_EQ(state.shader, FragmentShader::alpha_threshold);
  EXPECT_EQ(state.terminating_alpha(), some_state().terminating_alpha());
  EXPECT_GT(state.terminating_alpha(), 0.75F);
  EXPECT_FALSE(state.early_termination);
  EXPECT_FALSE(state.depth.test);
  for (unsigned stored = 0; stored < 128; ++stored) {
    const auto value = static_cast<std::uint8_t>(stored);
    EXPECT_TRUE(state.stencil.front.test(value));
    EXPECT_EQ(state.stencil.front.apply(state.stencil.front.pass, value), 1U);
  }
}

TEST(MultiPass, BetweenBatchesEveryPixelIsCoveredOnce) {
  for (const auto& [width, height] :
       {std::pair{67U, 35U}, std::pair{1U, 1U}, std::pair{64U, 64U}, std::pair{999U, 2U}}) {
    const auto frame = multi_pass_frame(some_splats(2, width, height), some_state(), 2);
    Frame alone(width, height);
    alone.draw(frame->draws()[1].geometry, frame->draws()[1].state);
    RenderContext context;
    context.frame = std::make_shared<Frame>(alone);
    const testing::Coverage coverage = testing::rasterize(context);
    EXPECT_EQ(coverage.fragments, std::uint64_t{width} * height);
    for (const unsigned times : coverage.times) EXPECT_EQ(times, 1U);
  }
}

TEST(MultiPass, APartOfTheSplatsIsSplit) {
  const auto splats = std::make_shared<const Draw>(some_splats(20));
  Frame frame(67, 35);
  draw_in_passes(frame, splats, some_state(), 3, "far", 5, 9);
  ASSERT_EQ(frame.draws().size(), 5U);
  EXPECT_EQ(frame.draws()[0].name, "far, pass 1");
  EXPECT_EQ(frame.draws()[1].name, "far, end of pass 1");
  EXPECT_EQ(frame.draws()[0].first, 5U);
  EXPECT_EQ(frame.draws()[4].first, 11U);
  EXPECT_EQ(frame.draws()[4].splats, 3U);
}

TEST(MultiPass, InAMixedFrameTheSplatsAreSplitAndStillTestDepth) {
  const Draw splats = some_splats(4);
  Draw mesh = some_splats(0);
  mesh.mesh.resize(1);
  MixedFrameOptions options;
  options.passes = 2;
  const auto frame = mixed_frame(splats, {mesh}, options);
  ASSERT_EQ(frame->draws().size(), 5U) << "depth, pass, end of it, pass, colour";
  for (const std::size_t i : {1U, 3U}) {
    EXPECT_TRUE(frame->draws()[i].state.depth.test);
    EXPECT_TRUE(frame->draws()[i].state.stencil.test);
  }
  EXPECT_FALSE(frame->draws()[4].state.stencil.test) << "lies under what the splats left";
}

TEST(MultiPass, WhatCannotBeIsRefused) {
  const Draw splats = some_splats(4);
  EXPECT_NO_THROW(multi_pass_frame(splats, some_state(), 4));
  for (const std::uint32_t passes : {0U, 5U}) EXPECT_THROW(multi_pass_frame(splats, some_state(), passes), UserError);
  DrawState stencil = some_state();
  stencil.stencil.test = true;
  EXPECT_THROW(multi_pass_frame(splats, stencil, 2), UserError);
  Frame frame(67, 35);
  EXPECT_THROW(draw_in_passes(frame, std::make_shared<Draw>(splats), some_state(), 2, "", 5), UserError);
}

}  // namespace
}  // namespace vrpipe
