#include "vpo/vpo.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/geometry.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::draw_of;
using testing::flat_box;

struct Assembled {
  explicit Assembled(const Draw& draw, std::uint32_t splat = 0)
      : context(testing::context_of(draw)), vpo(parameters, context), count(vpo.assemble(0, splat, primitives)) {}
  RenderContext context;
  PrimitiveAssembly::Parameters parameters;
  PrimitiveAssembly vpo;
  std::array<Primitive, 2> primitives;
  unsigned count;
};

TEST(PrimitiveAssembly, ASplatIsTwoTrianglesInOrder) {
  const Assembled a(draw_of(64, 64, {flat_box(10, 10, 20, 20, 0.5F)}));
  ASSERT_EQ(a.count, 2U);
  EXPECT_EQ(a.primitives[0].triangle, 0);
  EXPECT_EQ(a.primitives[1].triangle, 1);
  EXPECT_EQ(a.vpo.primitives.value(), 2U);
}

TEST(PrimitiveAssembly, AFilledRectangleIsOneOfExactBounds) {
  // The right and the lower edge pass through samples, which do not belong to it.
  const Draw draw = draw_of(64, 64, {flat_box(10.5F, 11.5F, 20.5F, 13.5F, 0.5F)});
  RenderContext context = testing::context_of(draw);
  testing::change_state(context, [](DrawState& state) {
    state.splat_extent = SplatExtent::fill_rectangle;
    state.obb_padding = 0;
  });
  PrimitiveAssembly vpo(PrimitiveAssembly::Parameters{}, context);
  std::array<Primitive, 2> primitives;
  ASSERT_EQ(vpo.assemble(0, 0, primitives), 1U);
  EXPECT_EQ(primitives[0].bounds.x0, 10);
  EXPECT_EQ(primitives[0].bounds.x1, 20);
  EXPECT_EQ(primitives[0].bounds.y0, 11);
  EXPECT_EQ(primitives[0].bounds.y1, 13);
  EXPECT_EQ(vpo.primitives.value(), 1U);
}

TEST(PrimitiveAssembly, AFilledRectangleBetweenSamplesIsCulled) {
  const Draw draw = draw_of(64, 64, {flat_box(10.6F, 11, 11.4F, 20, 0.5F), flat_box(10.2F, 11, 10.2F, 20, 0.5F)});
  RenderContext context = testing::context_of(draw);
  testing::change_state(context, [](DrawState& state) {
    state.splat_extent = SplatExtent::fill_rectangle;
    state.obb_padding = 0;
  });
  PrimitiveAssembly vpo(PrimitiveAssembly::Parameters{}, context);
  std::array<Primitive, 2> primitives;
  EXPECT_EQ(vpo.assemble(0, 0, primitives), 0U);
  EXPECT_EQ(vpo.culled_outside.value(), 1U);
  EXPECT_EQ(vpo.assemble(0, 1, primitives), 0U);
}

TEST(PrimitiveAssembly, AnExplicitTriangleIsOne) {
  Draw draw = draw_of(64, 64, {Splat{}});
  draw.triangles = {testing::one_quad_triangle(4, 4)};
  const Assembled a(draw);
  ASSERT_EQ(a.count, 1U);
  EXPECT_EQ(a.primitives[0].bounds.x0, 4);
  EXPECT_EQ(a.primitives[0].bounds.x1, 6);
  EXPECT_EQ(a.primitives[0].bounds.y0, 4);
  EXPECT_EQ(a.primitives[0].bounds.y1, 6);
}

TEST(PrimitiveAssembly, BoundsHoldEverySampleInTheViewport) {
  const Assembled a(draw_of(64, 48, {flat_box(-10, 30, 70, 60, 0.5F)}));
  ASSERT_EQ(a.count, 2U);
  for (const Primitive& primitive : a.primitives) {
    EXPECT_EQ(primitive.bounds.x0, 0);
    EXPECT_EQ(primitive.bounds.x1, 64);
    EXPECT_EQ(primitive.bounds.y0, 30);
    EXPECT_EQ(primitive.bounds.y1, 48);
  }
}

/// A triangle of a mesh; as one sees it, y down, its vertices go counter-clockwise.
Draw front_face() {
  Draw draw = draw_of(64, 64);
  MeshTriangle triangle{};
  const float x[] = {10, 10, 40};
  const float y[] = {10, 40, 10};
  for (unsigned i = 0; i < 3; ++i) triangle.vertices[i] = {x[i], y[i], 0.5F, 1, 1, 1, 1, 0, 0, 1};
  draw.mesh.push_back(triangle);
  return draw;
}

TEST(PrimitiveAssembly, CullsTheSidesOfAMeshThatItsDrawSays) {
  for (const bool is_back : {false, true}) {
    Draw draw = front_face();
    if (is_back) std::swap(draw.mesh[0].vertices[1], draw.mesh[0].vertices[2]);
    for (const CullMode cull : {CullMode::none, CullMode::back, CullMode::front}) {
      DrawState state;
      state.shader = FragmentShader::vertex;
      state.cull = cull;
      const RenderContext context = testing::context_of(draw, state);
      const PrimitiveAssembly::Parameters parameters;
      PrimitiveAssembly vpo(parameters, context);
      std::array<Primitive, 2> primitives;
      const bool culled = cull == (is_back ? CullMode::back : CullMode::front);
      EXPECT_EQ(vpo.assemble(0, 0, primitives), culled ? 0U : 1U);
      EXPECT_EQ(vpo.culled_facing.value(), culled ? 1U : 0U);
    }
  }
}

TEST(PrimitiveAssembly, ATriangleOfAMeshThatIsNotFiniteIsDropped) {
  for (unsigned field = 0; field < 30; ++field) {
    Draw draw = front_face();
    float values[30];
    std::memcpy(values, draw.mesh.data(), sizeof values);
    values[field] = std::numeric_limits<float>::infinity();
    std::memcpy(static_cast<void*>(draw.mesh.data()), values, sizeof values);
    DrawState state;
    state.shader = FragmentShader::vertex;
    const RenderContext context = testing::context_of(draw, state);
    const PrimitiveAssembly::Parameters parameters;
    PrimitiveAssembly vpo(parameters, context);
    std::array<Primitive, 2> primitives;
    EXPECT_EQ(vpo.assemble(0, 0, primitives), 0U);
    EXPECT_EQ(vpo.dropped_not_finite.value(), 1U) << "field " << field;
  }
}

// case R08
TEST(PrimitiveAssembly, WhatHasNoAreaAfterSnappingIsCulledAndCounted) {
  Draw draw = draw_of(64, 64, {Splat{}});
  draw.triangles = {{{10, 30, 20.001F}, {10, 30, 20.001F}}};
  const Assembled a(draw);
  EXPECT_EQ(a.count, 0U);
  EXPECT_EQ(a.vpo.culled_zero_area.value(), 1U);
  EXPECT_EQ(a.vpo.culled_outside.value(), 0U);
}

TEST(PrimitiveAssembly, WhatMissesTheViewportIsCulledAndCounted) {
  const Assembled a(draw_of(64, 64, {flat_box(70, 10, 90, 20, 0.5F)}));
  EXPECT_EQ(a.count, 0U);
  EXPECT_EQ(a.vpo.culled_outside.value(), 2U);
}

// case R07
TEST(PrimitiveAssembly, WhatLiesBetweenSamplesIsCulledAndCounted) {
  const Assembled a(draw_of(64, 64, {flat_box(10.6F, 10.6F, 11.4F, 11.4F, 0.5F)}));
  EXPECT_EQ(a.count, 0U);
  EXPECT_EQ(a.vpo.culled_outside.value(), 2U);
}

TEST(PrimitiveAssembly, WhatIsNotFiniteIsDroppedAndCounted) {
  Splat splat = flat_box(10, 10, 20, 20, 0.5F);
  splat.cx = std::nanf("");
  const Assembled a(draw_of(64, 64, {splat}));
  EXPECT_EQ(a.count, 0U);
  EXPECT_EQ(a.vpo.dropped_not_finite.value(), 1U);
}

// case O12
TEST(PrimitiveAssembly, EitherWindingIsKept) {
  Splat mirrored = flat_box(10, 10, 20, 20, 0.5F);
  mirrored.by = -mirrored.by;
  EXPECT_EQ(Assembled(draw_of(64, 64, {mirrored})).count, 2U);
}

}  // namespace
}  // namespace vrpipe
