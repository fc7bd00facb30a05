// Depth and stencil of ZROP against tables made from the OpenGL specification (4.6, 17.3.5 and 17.3.6).
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "support/builders.h"
#include "support/mixed_reference.h"
#include "zrop/zrop.h"

namespace vrpipe {
namespace {

using testing::passes_by_table;
using testing::stencil_by_table;

constexpr unsigned largest_stencil = 127;
const unsigned stencil_values[] = {0, 1, 2, 63, 64, 85, 126, 127};
const unsigned stencil_masks[] = {0, 1, 15, 85, 126, 127};

/// One triangle over 16x16 pixels, of one depth, that faces the viewer or turns its back.
std::shared_ptr<Draw> triangle_of(float depth, bool is_back = false) {
  auto draw = std::make_shared<Draw>(testing::draw_of(16, 16));
  MeshTriangle triangle{};
  const float x[] = {-1, -1, 40};
  const float y[] = {-1, 40, -1};
  for (unsigned i = 0; i < 3; ++i) {
    const unsigned from = is_back ? 2 - i : i;
    triangle.vertices[i] = {x[from], y[from], depth, 1, 1, 1, 1, 0, 0, 1};
  }
  draw->mesh.push_back(triangle);
  return draw;
}

struct Tested {
  bool passed;
  std::uint32_t depth;
  unsigned stencil;
  bool changed;
  bool terminated;  ///< after the test, as before it
};

enum class When { early, late };

/// A shaded warp of these quads.
ShadedWarp shaded_warp_of(const QuadBeat& beat) {
  ShadedWarp warp{};
  warp.tile = beat.tile;
  warp.count = beat.count;
  for (unsigned i = 0; i < beat.count; ++i) {
    const Quad& quad = beat.quads[i];
    warp.position[i] = quad.position;
    warp.live[i] = quad.coverage;
    warp.first_primitive[i] = warp.last_primitive[i] = primitive_order(quad);
    warp.draw[i] = quad.draw;
    warp.color[i] = testing::color_of(1, 0.5F, 0.25F, 1);
  }
  return warp;
}

/// The test of a quad with one live sample, of which this is stored; its pixel has terminated, or not.
Tested test_one(When when, DrawState state, float depth, bool is_back, float stored_depth, unsigned stored_stencil,
                bool terminated, DepthFormat format = DepthFormat::d24) {
  state.late_tests = when == When::late;
  const std::shared_ptr<Draw> draw = triangle_of(depth, is_back);
  Frame frame(16, 16);
  frame.set_depth_format(format);
  frame.draw(draw, state);
  const RenderContext context = testing::context_of(frame);
  const DepthStencilRop::Parameters parameters;
  DepthStencilRop rop(parameters, context);
  DepthStencilSurface surface(16, 16, 0, format);
  rop.attach(surface);
  constexpr unsigned position = 11;
  constexpr unsigned lane = 2;
  DepthStencilQuad& stored = surface.quad(position);
  stored.depth[lane] = store_depth(format, static_cast<double>(stored_depth));
  stored.stencil[lane] = static_cast<std::uint8_t>(stored_stencil);
  surface.terminated(position) = terminated ? 1U << lane : 0;
  QuadBeat beat = testing::beat_of({0, 0}, {position});
  beat.quads[0].coverage = 1U << lane;
  std::uint32_t changed = 0;
  if (when == When::early) {
    changed = rop.test(beat);
  } else {
    ShadedWarp warp = shaded_warp_of(beat);
    changed = rop.test_late(warp);
    beat.count = warp.count;
  }
  EXPECT_EQ(changed & ~1U, 0U);
  for (unsigned other = 0; other < 4; ++other) {
    if (other == lane) continue;
    EXPECT_EQ(stored.depth[other], store_depth(format, 1)) << "not covered";
    EXPECT_EQ(stored.stencil[other], 0) << "not covered";
  }
  return {beat.count == 1, stored.depth[lane], stored.stencil[lane], changed == 1,
          (surface.terminated(position) >> lane & 1U) != 0};
}
/// Before shading; after it the same comes out.
Tested test_one(const DrawState& state, float depth, bool is_back, float stored_depth, unsigned stored_stencil,
                bool terminated, DepthFormat format = DepthFormat::d24) {
  const Tested early = test_one(When::early, state, depth, is_back, stored_depth, stored_stencil, terminated, format);
  const Tested late = test_one(When::late, state, depth, is_back, stored_depth, stored_stencil, terminated, format);
  if (!(terminated && state.early_termination)) {
    EXPECT_EQ(late.passed, early.passed);
  }
  EXPECT_EQ(late.depth, early.depth);
  EXPECT_EQ(late.stencil, early.stencil);
  EXPECT_EQ(late.changed, early.changed);
  EXPECT_EQ(late.terminated, early.terminated);
  return early;
}

TEST(DepthTest, FollowsTheTableForEveryFunctionAndFormat) {
  const float depths[] = {0, 0.25F, 0.5F, 0.75F, 1};
  for (const DepthFormat format : {DepthFormat::d16, DepthFormat::d24, DepthFormat::d32f}) {
    for (unsigned function = 0; function < compares; ++function) {
      for (const bool write : {false, true}) {
        for (const float depth : depths) {
          for (const float stored : depths) {
            DrawState state;
            state.shader = FragmentShader::vertex;
            state.depth = {true, static_cast<Compare>(function), write};
            const Tested tested = test_one(state, depth, false, stored, 5, false, format);
            const bool passes = passes_by_table(static_cast<Compare>(function), depth, stored);
            SCOPED_TRACE(std::string(name_of(format)) + " function " + std::to_string(function) + " depth " +
                         std::to_string(depth) + " stored " + std::to_string(stored));
            EXPECT_EQ(tested.passed, passes);
            const float now = passes && write ? depth : stored;
            EXPECT_EQ(tested.depth, store_depth(format, static_cast<double>(now)));
            EXPECT_EQ(tested.stencil, 5U) << "not tested, not written";
            EXPECT_EQ(tested.changed, now != stored);
          }
        }
      }
    }
  }
}

TEST(DepthTest, WithoutItAllPassAndNothingIsWritten) {
  DrawState state;
  state.shader = FragmentShader::vertex;
  state.depth = {false, Compare::none, true};
  state.stencil.test = true;
  const Tested tested = test_one(state, 0.75F, false, 0.25F, 3, false);
  EXPECT_TRUE(tested.passed);
  EXPECT_EQ(tested.depth, store_depth(DepthFormat::d24, 0.25));
}

TEST(StencilTest, FollowsTheTableForEveryFunctionAndMask) {
  for (unsigned function = 0; function < compares; ++function) {
    for (const unsigned mask : stencil_masks) {
      for (const unsigned reference : stencil_values) {
        for (const unsigned stored : stencil_values) {
          DrawState state;
          state.shader = FragmentShader::vertex;
          state.stencil.test = true;
          state.stencil.front.compare = static_cast<Compare>(function);
          state.stencil.front.reference = static_cast<std::uint8_t>(reference);
          state.stencil.front.read_mask = static_cast<std::uint8_t>(mask);
          const Tested tested = test_one(state, 0.5F, false, 1, stored, false);
          EXPECT_EQ(tested.passed, passes_by_table(static_cast<Compare>(function), reference & mask, stored & mask))
              << "function " << function << " mask " << mask << " reference " << reference << " stored " << stored;
          EXPECT_EQ(tested.stencil, stored);
          EXPECT_FALSE(tested.changed);
        }
      }
    }
  }
}

// In each of the three cases another operation, on the face that the triangle shows.
TEST(StencilTest, EveryOperationFollowsTheTableForEveryCaseFaceAndMask) {
  enum Case { stencil_fails, depth_fails, both_pass };
  for (const Case which : {stencil_fails, depth_fails, both_pass}) {
    for (const bool is_back : {false, true}) {
      for (unsigned operation = 0; operation < stencil_operations; ++operation) {
        for (const unsigned mask : stencil_masks) {
          for (const unsigned reference : {0U, 77U, 127U}) {
            for (const unsigned stored : stencil_values) {
              DrawState state;
              state.shader = FragmentShader::vertex;
              state.depth = {true, which == depth_fails ? Compare::none : Compare::always, false};
              state.stencil.test = true;
              // The other face would tell: it never passes and sets 99.
              StencilFace other;
              other.compare = Compare::none;
              other.stencil_fail = other.depth_fail = other.pass = StencilOperation::replace;
              other.reference = 99;
              state.stencil.front = state.stencil.back = other;
              StencilFace& face = is_back ? state.stencil.back : state.stencil.front;
              face.compare = which == stencil_fails ? Compare::none : Compare::always;
              // So would the other operations.
              face.stencil_fail = face.depth_fail = face.pass = StencilOperation::keep;
              (which == stencil_fails ? face.stencil_fail
               : which == depth_fails ? face.depth_fail
                                      : face.pass) = static_cast<StencilOperation>(operation);
              face.reference = static_cast<std::uint8_t>(reference);
              face.write_mask = static_cast<std::uint8_t>(mask);
              const Tested tested = test_one(state, 0.5F, is_back, 1, stored, false);
              const unsigned value = stencil_by_table(static_cast<StencilOperation>(operation), stored, reference);
              const unsigned expected = (stored & (largest_stencil - mask)) + (value & mask);
              SCOPED_TRACE("case " + std::to_string(which) + " back " + std::to_string(is_back) + " operation " +
                           std::to_string(operation) + " mask " + std::to_string(mask) + " reference " +
                           std::to_string(reference) + " stored " + std::to_string(stored));
              EXPECT_EQ(tested.passed, which == both_pass);
              EXPECT_EQ(tested.stencil, expected);
              EXPECT_EQ(tested.changed, expected != stored);
            }
          }
        }
      }
    }
  }
}

TEST(StencilTest, NoOperationTouchesTheTerminationBit) {
  for (unsigned operation = 0; operation < stencil_operations; ++operation) {
    for (const bool terminated : {false, true}) {
      for (const bool early : {false, true}) {
        DrawState state;
        state.shader = FragmentShader::vertex;
        state.early_termination = early;
        state.stencil.test = true;
        state.stencil.front.reference = 0;
        state.stencil.front.write_mask = 0xff;
        state.stencil.front.pass = static_cast<StencilOperation>(operation);
        const Tested tested = test_one(state, 0.5F, false, 1, 127, terminated);
        EXPECT_EQ(tested.terminated, terminated);
        EXPECT_EQ(tested.stencil, stencil_by_table(static_cast<StencilOperation>(operation), 127, 0))
            << "also where the pixel has terminated";
        EXPECT_EQ(tested.passed, !(terminated && early));
      }
    }
  }
}

/// ZROP in a frame of one draw of such a triangle, with a surface of its own.
struct RopOfOneDraw {
  explicit RopOfOneDraw(const DrawState& state) {
    Frame frame(16, 16);
    frame.draw(triangle_of(0.5F), state);
    context = testing::context_of(frame);
    rop = std::make_unique<DepthStencilRop>(parameters, context);
    rop->attach(surface);
  }
  const DepthStencilRop::Parameters parameters;
  RenderContext context;
  DepthStencilSurface surface{16, 16};
  std::unique_ptr<DepthStencilRop> rop;
};

TEST(DepthStencilCounts, AFragmentThatFailsBothTestsFailedTheFirst) {
  DrawState state;
  state.shader = FragmentShader::vertex;
  state.early_termination = true;
  state.depth = {true, Compare::less, false};
  RopOfOneDraw one(state);
  DepthStencilRop& rop = *one.rop;
  DepthStencilSurface& surface = one.surface;
  // Lanes 0 and 1 fail the depth test, lanes 1 and 2 have terminated.
  surface.quad(3).depth[0] = surface.quad(3).depth[1] = 0;
  surface.terminated(3) = 0b0110;
  QuadBeat beat = testing::beat_of({0, 0}, {3, 3});
  beat.quads[1].splat = 0;
  beat.quads[1].coverage = 0b0110;
  rop.test(beat);
  ASSERT_EQ(beat.count, 1);
  EXPECT_EQ(beat.quads[0].coverage, 0b1000);
  EXPECT_EQ(rop.quads_tested.value(), 2U);
  EXPECT_EQ(rop.fragments_depth_stencil_failed.value(), 3U);
  EXPECT_EQ(rop.fragments_terminated.value(), 2U);
  EXPECT_EQ(rop.quads_depth_stencil_failed.value(), 0U);
  EXPECT_EQ(rop.quads_terminated.value(), 1U);
}

TEST(DepthStencilCounts, WhatIsNotShadedEndsHere) {
  DrawState state;
  state.shader = FragmentShader::none;
  state.depth.test = true;
  RopOfOneDraw one(state);
  DepthStencilRop& rop = *one.rop;
  DepthStencilSurface& surface = one.surface;
  surface.quad(3).depth[0] = 0;
  QuadBeat beat = testing::beat_of({0, 0}, {3});
  EXPECT_EQ(rop.test(beat), 1U);
  EXPECT_EQ(beat.count, 0);
  EXPECT_EQ(rop.quads_unshaded.value(), 1U);
  EXPECT_EQ(rop.fragments_unshaded.value(), 3U);
  EXPECT_EQ(rop.fragments_depth_stencil_failed.value(), 1U);
  EXPECT_EQ(rop.quads_depth_stencil_failed.value(), 0U);
  EXPECT_EQ(surface.quad(3).depth[1], store_depth(DepthFormat::d24, 0.5));
}

TEST(DepthStencilCounts, WhatIsTestedLateCountsAsFailedLate) {
  DrawState state;
  state.shader = FragmentShader::vertex;
  state.depth = {true, Compare::less, true};
  state.late_tests = true;
  RopOfOneDraw one(state);
  DepthStencilRop& rop = *one.rop;
  one.surface.quad(3).depth[0] = 0;
  one.surface.quad(4).depth = {0, 0, 0, 0};
  QuadBeat beat = testing::beat_of({0, 0}, {3, 4, 5});
  for (unsigned i = 0; i < beat.count; ++i) beat.quads[i].splat = 0;
  beat.quads[2].coverage = 0b0110;
  EXPECT_EQ(rop.test(beat), 0U) << "not before it is shaded";
  ASSERT_EQ(beat.count, 3);
  EXPECT_EQ(rop.quads_tested.value(), 0U);
  ShadedWarp warp = shaded_warp_of(beat);
  EXPECT_EQ(rop.test_late(warp), 0b101U);
  ASSERT_EQ(warp.count, 2);
  EXPECT_EQ(warp.position[0], 3);
  EXPECT_EQ(warp.live[0], 0b1110);
  EXPECT_EQ(warp.position[1], 5);
  EXPECT_EQ(warp.live[1], 0b0110);
  for (int lane = 0; lane < 4; ++lane) {
    EXPECT_EQ(warp.color[0].alpha[lane], lane == 0 ? 0.0F : 1.0F) << "dead lanes have no colour";
    EXPECT_EQ(warp.color[1].green[lane], lane == 1 || lane == 2 ? 0.5F : 0.0F);
  }
  EXPECT_EQ(rop.quads_tested_late.value(), 3U);
  EXPECT_EQ(rop.quads_late_failed.value(), 1U);
  EXPECT_EQ(rop.fragments_late_failed.value(), 5U);
  EXPECT_EQ(rop.fragments_depth_stencil_failed.value(), 0U);
  const std::uint32_t half = store_depth(DepthFormat::d24, 0.5);
  EXPECT_EQ(one.surface.quad(3).depth[1], half);
  EXPECT_EQ(one.surface.quad(5).depth[0], store_depth(DepthFormat::d24, 1)) << "the shader has dropped it";
  EXPECT_EQ(one.surface.quad(5).depth[1], half);
}

// What a fragment writes depends on whether the shader keeps it, not on what can be seen.
TEST(DepthStencilCounts, WhereTestsThatWriteComeAfterShadingTerminationDropsNothingBefore) {
  for (const bool write : {false, true}) {
    DrawState state;
    state.shader = FragmentShader::vertex;
    state.early_termination = true;
    state.depth = {true, Compare::less, write};
    state.late_tests = true;
    RopOfOneDraw one(state);
    one.surface.terminated(3) = all_lanes;
    QuadBeat beat = testing::beat_of({0, 0}, {3});
    one.rop->test(beat);
    EXPECT_EQ(beat.count, write ? 1 : 0);
    EXPECT_EQ(one.rop->quads_terminated.value(), write ? 0U : 1U);
    EXPECT_EQ(one.rop->quads_tested.value(), write ? 0U : 1U);
  }
}

}  // namespace
}  // namespace vrpipe
