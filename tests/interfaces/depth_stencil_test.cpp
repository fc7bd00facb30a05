#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include <gtest/gtest.h>
#include <boost/multiprecision/cpp_int.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/depth_plane.h>
#include <vrpipe/pipeline/depth_stencil.h>

#include "support/builders.h"
#include "support/coverage.h"

namespace vrpipe {
namespace {

using Rational = boost::multiprecision::cpp_rational;

TEST(DepthFormat, UnormsHaveTheirEndsAndTheNearestStep) {
  EXPECT_EQ(store_depth(DepthFormat::d16, 0), 0U);
  EXPECT_EQ(store_depth(DepthFormat::d16, 1), 65535U);
  EXPECT_EQ(store_depth(DepthFormat::d24, 1), 16777215U);
  EXPECT_EQ(store_depth(DepthFormat::d16, 0.5), 32768U) << "32767.5 rounds up";
  for (const DepthFormat format : {DepthFormat::d16, DepthFormat::d24}) {
    const std::uint32_t steps = store_depth(format, 1);
    for (const std::uint32_t step : {0U, 1U, 2U, 12345U, 54321U, steps - 1, steps}) {
      const double exact = static_cast<double>(step) / steps;
      EXPECT_EQ(store_depth(format, exact), step);
      EXPECT_EQ(store_depth(format, exact + 0.499 / steps), step);
      EXPECT_EQ(store_depth(format, exact - 0.499 / steps), step);
      EXPECT_DOUBLE_EQ(depth_of(format, step), exact);
    }
  }
}

TEST(DepthFormat, AFloatKeepsItsBitsWhichAreInTheOrderOfDepth) {
  std::uint32_t before = 0;
  for (const float depth : {0.0F, 1e-40F, 1e-30F, 0.001F, 0.5F, std::nextafter(0.5F, 1.0F), 0.999999F, 1.0F}) {
    const std::uint32_t stored = store_depth(DepthFormat::d32f, static_cast<double>(depth));
    std::uint32_t bits;
    std::memcpy(&bits, &depth, sizeof bits);
    EXPECT_EQ(stored, bits);
    EXPECT_TRUE(stored > before || depth == 0);
    before = stored;
    EXPECT_EQ(depth_of(DepthFormat::d32f, stored), static_cast<double>(depth));
  }
}

TEST(DepthFormat, WhatIsOutOfRangeIsClampedAndNaNIs0) {
  for (const DepthFormat format : {DepthFormat::d16, DepthFormat::d24, DepthFormat::d32f}) {
    EXPECT_EQ(store_depth(format, -1), store_depth(format, 0));
    EXPECT_EQ(store_depth(format, -0.0), store_depth(format, 0));
    EXPECT_EQ(store_depth(format, 1e300), store_depth(format, 1));
    EXPECT_EQ(store_depth(format, std::numeric_limits<double>::quiet_NaN()), store_depth(format, 0));
  }
}

TEST(DepthFormat, IsKnownByName) {
  for (const DepthFormat format : {DepthFormat::d16, DepthFormat::d24, DepthFormat::d32f}) {
    EXPECT_EQ(depth_format_named(name_of(format)), format);
  }
  EXPECT_THROW(depth_format_named("d48"), UserError);
}

/// A triangle of random depths; slivers among them.
MeshTriangle random_triangle(std::uint64_t seed, float side) {
  MeshTriangle triangle{};
  for (unsigned i = 0; i < 3; ++i) {
    MeshVertex& vertex = triangle.vertices[i];
    vertex.x = testing::uniform(seed, 10 * i, -0.5F * side, 1.5F * side);
    vertex.y = testing::uniform(seed, 10 * i + 1, -0.5F * side, 1.5F * side);
    vertex.depth = testing::uniform(seed, 10 * i + 2, 0, 1);
    vertex.inverse_w = 1;
  }
  if (seed % 3 == 0) {
    // Nearly on the line through the others.
    const MeshVertex& a = triangle.vertices[0];
    const MeshVertex& b = triangle.vertices[1];
    triangle.vertices[2].x = (a.x + b.x) / 2 + 0.01F;
    triangle.vertices[2].y = (a.y + b.y) / 2;
  }
  return triangle;
}

TEST(StencilFace, HasSevenBitsOrAllOfThem) {
  StencilFace face;
  face.compare = Compare::less;
  EXPECT_TRUE(face.test(127));
  EXPECT_FALSE(face.test(128)) << "its low bits are 0";
  EXPECT_EQ(face.apply(StencilOperation::increment, 127), 127);
  EXPECT_EQ(face.apply(StencilOperation::decrement, 200), 199);
  EXPECT_EQ(face.apply(StencilOperation::decrement, 128), 128);
  face.bits = face.read_mask = face.write_mask = all_stencil_bits;
  EXPECT_TRUE(face.test(128));
  EXPECT_FALSE(face.test(0));
  EXPECT_EQ(face.apply(StencilOperation::decrement, 128), 127);
  EXPECT_EQ(face.apply(StencilOperation::decrement, 0), 0);
  EXPECT_EQ(face.apply(StencilOperation::increment, 127), 128);
  EXPECT_EQ(face.apply(StencilOperation::increment, 255), 255);
}

TEST(DepthPlane, IsThatThroughTheSnappedVerticesInExactArithmetic) {
  std::uint64_t samples = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const std::uint32_t side = seed % 2 == 0 ? 16 : 1024;
    auto draw = std::make_shared<Draw>(testing::draw_of(side, side));
    draw->mesh.push_back(random_triangle(seed, static_cast<float>(side)));
    Frame frame(side, side);
    DrawState state;
    state.shader = FragmentShader::none;
    frame.draw(draw, state);
    const RenderContext context = testing::context_of(frame);
    SnappedTriangle t;
    ASSERT_TRUE(snap_triangle(context, 0, 0, 0, t));
    if (doubled_area(t) == 0) continue;
    const DepthPlane plane(context, 0, 0, 0);
    EXPECT_EQ(plane.is_back_face(), doubled_area(t) > 0);
    const auto& vertices = draw->mesh[0].vertices;
    const Rational z[] = {Rational(vertices[0].depth), Rational(vertices[1].depth), Rational(vertices[2].depth)};
    // Cramer's rule for the gradient.
    const Rational x1 = t.x[1] - t.x[0], y1 = t.y[1] - t.y[0], x2 = t.x[2] - t.x[0], y2 = t.y[2] - t.y[0];
    const Rational area = x1 * y2 - x2 * y1;
    const Rational dx = ((z[1] - z[0]) * y2 - (z[2] - z[0]) * y1) / area;
    const Rational dy = ((z[2] - z[0]) * x1 - (z[1] - z[0]) * x2) / area;
    for (std::uint32_t y = 0; y < side; y += side / 16) {
      for (std::uint32_t x = 0; x < side; ++x) {
        if (!testing::covers(t, 8, x, y)) continue;
        ++samples;
        const Rational exact =
            z[0] + dx * (256 * static_cast<int>(x) + 128 - t.x[0]) + dy * (256 * static_cast<int>(y) + 128 - t.y[0]);
        const double depth = plane.at(static_cast<std::int32_t>(x), static_cast<std::int32_t>(y));
        EXPECT_NEAR(depth, exact.convert_to<double>(), 4e-16) << "seed " << seed << " at " << x << "," << y;
        EXPECT_GE(depth, plane.nearest());
        EXPECT_LE(depth, plane.farthest());
      }
    }
  }
  EXPECT_GT(samples, 10'000U);
}

TEST(DepthPlane, OfASplatIsThatOfItsCentre) {
  Draw draw = testing::draw_of(16, 16, {testing::round_splat(8, 8, 3, 0.5F)});
  draw.splats[0].depth = 0.375F;
  const RenderContext context = testing::context_of(draw);
  const DepthPlane plane(context, 0, 0, 1);
  EXPECT_TRUE(plane.is_flat());
  EXPECT_FALSE(plane.is_back_face());
  EXPECT_EQ(plane.at(0, 15), 0.375);
}

}  // namespace
}  // namespace vrpipe
