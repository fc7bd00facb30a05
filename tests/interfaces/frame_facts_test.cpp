// What is known of a frame before it is simulated. That bounds hold for any geometry is in tests/properties.
#include <vrpipe/pipeline/frame_facts.h>

#include <limits>
#include <memory>

#include <gtest/gtest.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::flat_box;
using testing::geometry_of;
using testing::round_splat;

constexpr std::uint32_t facts_side = 64;
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float infinite = std::numeric_limits<float>::infinity();

std::shared_ptr<Draw> mesh(float x, float y, float size, float red = 0.5F) {
  auto draw = std::make_shared<Draw>(testing::draw_of(facts_side, facts_side));
  const auto corner = [&](float u, float v) { return MeshVertex{u, v, 0.5F, 1, red, 0.5F, 0.5F, 0, 0, 1}; };
  draw->mesh.push_back({{corner(x, y), corner(x, y + size), corner(x + size, y)}});
  return draw;
}

FrameFacts facts_of(const std::vector<Splat>& splats, const DrawState& state = {}) {
  Frame frame(facts_side, facts_side);
  frame.draw(geometry_of(facts_side, facts_side, splats), state);
  return FrameFacts(testing::context_of(frame));
}

TEST(FrameFacts, OfNothing) {
  const FrameFacts facts(testing::context_of(Frame(33, 17)));
  EXPECT_EQ(facts.draws, 0U);
  EXPECT_EQ(facts.primitives, 0U);
  EXPECT_EQ(facts.tiles, 6U);
  EXPECT_EQ(facts.tiles_touched, 0U);
  EXPECT_EQ(facts.widest_edge, 0);
  EXPECT_EQ(facts.largest_color, 0);
}

TEST(FrameFacts, CountDrawsByWhatTheyAre) {
  Frame frame(facts_side, facts_side);
  const auto splats = geometry_of(facts_side, facts_side, {round_splat(8, 8, 2, 0.5F), round_splat(9, 8, 2, 0.5F)});
  const auto triangles = mesh(4, 4, 8);
  DrawState state;
  frame.draw(splats, state, "plain");
  state.early_termination = true;
  frame.draw(splats, state, "terminates");
  state.depth = {true, Compare::less, true};
  frame.draw(splats, state, "terminates, and is tested late");
  frame.clear({true});
  state = {};
  state.shader = FragmentShader::none;
  state.cull = CullMode::back;
  frame.draw(triangles, state, "shades nothing");
  state.shader = FragmentShader::lit;
  state.depth.test = true;
  frame.draw(triangles, state, "is tested early");
  frame.draw(splats, testing::alpha_threshold_state(), "reads the target");
  frame.clear({false, true});
  const FrameFacts facts(testing::context_of(frame));
  EXPECT_EQ(facts.draws, 6U);
  EXPECT_EQ(facts.of_splats, 4U);
  EXPECT_EQ(facts.of_meshes, 2U);
  EXPECT_EQ(facts.testing_depth_stencil, 3U);
  EXPECT_EQ(facts.tested_late, 2U);
  EXPECT_EQ(facts.terminating, 2U);
  EXPECT_EQ(facts.shading_nothing, 1U);
  EXPECT_EQ(facts.reading_color, 1U);
  EXPECT_EQ(facts.culling_faces, 2U);
  EXPECT_EQ(facts.clears, 2U);
  EXPECT_EQ(facts.primitives, 2U * 4 + 2);
  EXPECT_EQ(facts.not_finite, 0U);
}

TEST(FrameFacts, SplatsHaveNoFaceToCull) {
  DrawState state;
  state.cull = CullMode::back;
  EXPECT_EQ(facts_of({round_splat(8, 8, 2, 0.5F)}, state).culling_faces, 0U);
}

// A frame may draw a part of a geometry.
TEST(FrameFacts, LookAtWhatIsDrawnAlone) {
  Frame frame(facts_side, facts_side);
  frame.draw(geometry_of(facts_side, facts_side,
                         {round_splat(8, 8, 300, 1, 9), flat_box(36, 36, 44, 44, 0.5F, 0.25F, 0.5F, 0.75F)}),
             {}, "the second", 1);
  const FrameFacts facts(testing::context_of(frame));
  EXPECT_EQ(facts.primitives, 1U);
  EXPECT_EQ(facts.tiles_touched, 1U);
  EXPECT_EQ(facts.largest_color, 0.75F);
  EXPECT_EQ(facts.largest_opacity, 0.5F);
}

// A box that is a few pixels within its tiles touches no others.
TEST(FrameFacts, BoxesTouchTheTilesThatTheyCover) {
  for (unsigned x0 = 0; x0 < 4; ++x0) {
    for (unsigned x1 = x0; x1 < 4; ++x1) {
      const auto tile = [](unsigned index) { return static_cast<float>(16 * index); };
      const Splat box = flat_box(tile(x0) + 4, tile(1) + 4, tile(x1) + 12, tile(2) + 12, 0.5F);
      EXPECT_EQ(facts_of({box}).tiles_touched, 2 * (x1 - x0 + 1)) << x0 << " to " << x1;
    }
  }
}

TEST(FrameFacts, TilesThatSeveralTouchCountOnce) {
  EXPECT_EQ(facts_of({flat_box(4, 4, 12, 12, 0.5F), flat_box(4, 4, 12, 12, 0.5F), flat_box(4, 4, 28, 12, 0.5F),
                      flat_box(52, 52, 60, 60, 0.5F)})
                .tiles_touched,
            3U);
}

TEST(FrameFacts, NothingOutsideOfTheScreenIsTouched) {
  EXPECT_EQ(facts_of({flat_box(-30, 4, -10, 12, 0.5F), flat_box(4, 90, 12, 99, 0.5F), flat_box(80, 4, 99, 12, 0.5F),
                      flat_box(4, -90, 12, -9, 0.5F)})
                .tiles_touched,
            0U);
  EXPECT_EQ(facts_of({flat_box(-1e6F, -1e6F, 1e6F, 1e6F, 0.5F)}).tiles_touched, 16U);
}

TEST(FrameFacts, WhatIsNotFiniteIsCountedAndBoundsNothing) {
  for (const float value : {not_a_number, infinite, -infinite}) {
    for (float Splat::*const field : {&Splat::cx, &Splat::ax, &Splat::by, &Splat::r, &Splat::red, &Splat::opacity}) {
      Splat broken = flat_box(4, 4, 12, 12, 0.5F);
      broken.*field = value;
      const FrameFacts facts = facts_of({broken, flat_box(36, 36, 44, 44, 0.25F, 0.5F, 0.5F, 0.5F)});
      EXPECT_EQ(facts.primitives, 2U);
      EXPECT_EQ(facts.not_finite, 1U);
      EXPECT_EQ(facts.tiles_touched, 1U);
      EXPECT_EQ(facts.largest_color, 0.5F);
      EXPECT_EQ(facts.largest_opacity, 0.25F);
      EXPECT_LT(facts.widest_edge, 64);
    }
  }
}

// A splat that is finite may be drawn as a triangle that is not.
TEST(FrameFacts, TrianglesThatAreNotFiniteBoundNothing) {
  for (const float value : {not_a_number, infinite, -infinite}) {
    auto draw = std::make_shared<Draw>(testing::draw_of(facts_side, facts_side, {flat_box(4, 4, 12, 12, 0.5F)}));
    draw->triangles = {{{4, 12, value}, {4, value, 12}}};
    Frame frame(facts_side, facts_side);
    frame.draw(draw, {});
    const FrameFacts facts(testing::context_of(frame));
    EXPECT_EQ(facts.not_finite, 1U);
    EXPECT_EQ(facts.tiles_touched, 0U);
    EXPECT_EQ(facts.widest_edge, 0);
  }
}

TEST(FrameFacts, OfMeshesBoundVerticesAndColors) {
  Frame frame(facts_side, facts_side);
  DrawState state;
  state.shader = FragmentShader::vertex;
  frame.draw(mesh(20, 20, 8, 3), state);
  frame.draw(mesh(36, 4, 8), state);
  const FrameFacts facts(testing::context_of(frame));
  EXPECT_EQ(facts.tiles_touched, 2U);
  EXPECT_EQ(facts.largest_color, 3);
  EXPECT_EQ(facts.largest_opacity, 1);
  EXPECT_GE(facts.widest_edge, 16);
  EXPECT_LT(facts.widest_edge, 24);
}

TEST(FrameFacts, SayWhereTheSurfacesAre) {
  const Frame frame(facts_side, facts_side);
  RenderContext context = testing::context_of(frame);
  context.format = ColorFormat::rgba32f;
  EXPECT_EQ(FrameFacts(context).addresses.color.bytes, facts_side * facts_side * 16U);
  context.format = ColorFormat::rgba8;
  EXPECT_EQ(FrameFacts(context).addresses.color.bytes, facts_side * facts_side * 4U);
}

}  // namespace
}  // namespace vrpipe
