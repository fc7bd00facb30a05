#include <vrpipe/pipeline/geometry.h>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::context_of;
using testing::draw_of;
using testing::flat_box;

TEST(SnapTriangle, RoundsVerticesToTheSubpixelGrid) {
  Draw draw = draw_of(64, 64, {Splat{}});
  draw.triangles = {{{1.0F, 2.5F, 3.00390625F}, {0.0F, 1.001953125F, -7.25F}}};
  const RenderContext context = context_of(draw);
  SnappedTriangle t;
  ASSERT_TRUE(snap_triangle(context, 0, 0, 0, t));
  EXPECT_EQ(t.x, (std::array<std::int32_t, 3>{256, 640, 769}));
  EXPECT_EQ(t.y, (std::array<std::int32_t, 3>{0, 257, -1856})) << "half a step goes up";
}

TEST(SnapTriangle, TheTwoTrianglesOfABoxShareItsDiagonal) {
  const Draw draw = draw_of(64, 64, {testing::splat_at(20, 30, 5, 2, 0.7F, 0.8F)});
  const RenderContext context = context_of(draw);
  SnappedTriangle first;
  SnappedTriangle second;
  ASSERT_TRUE(snap_triangle(context, 0, 0, 0, first));
  ASSERT_TRUE(snap_triangle(context, 0, 0, 1, second));
  EXPECT_EQ(first.x[1], second.x[0]);
  EXPECT_EQ(first.y[1], second.y[0]);
  EXPECT_EQ(first.x[2], second.x[2]);
  EXPECT_EQ(first.y[2], second.y[2]);
}

TEST(SnapTriangle, PaddingPushesTheCornersOutward) {
  const Draw draw = draw_of(64, 64, {flat_box(10, 10, 20, 20, 0.5F)});
  RenderContext context = context_of(draw);
  SnappedTriangle padded;
  SnappedTriangle plain;
  ASSERT_TRUE(snap_triangle(context, 0, 0, 0, padded));
  testing::change_state(context, [&](DrawState& drawn) { drawn.obb_padding = 0; });
  ASSERT_TRUE(snap_triangle(context, 0, 0, 0, plain));
  EXPECT_EQ(plain.x[0], 2560);
  EXPECT_EQ(padded.x[0], 2559);
}

// case R02
TEST(SnapTriangle, WhatIsNotFiniteHasNoVertices) {
  for (const float bad : {std::nanf(""), HUGE_VALF, -HUGE_VALF}) {
    for (unsigned field = 0; field < 6; ++field) {
      Splat splat = flat_box(10, 10, 20, 20, 0.5F);
      float* const fields[] = {&splat.cx, &splat.cy, &splat.ax, &splat.ay, &splat.bx, &splat.by};
      *fields[field] = bad;
      const Draw draw = draw_of(64, 64, {splat});
      SnappedTriangle t;
      EXPECT_FALSE(snap_triangle(context_of(draw), 0, 0, 0, t)) << bad << " in field " << field;
    }
  }
}

// case R02
TEST(SnapTriangle, VerticesStayInTheGuardBandForBoxesOfAnySize) {
  for (const float half : {100.0F, 32767.0F, 40000.0F, 1e9F, 1e30F, std::numeric_limits<float>::max()}) {
    for (const float angle : {0.0F, 0.3F, 0.785398F, 1.5F}) {
      const float c = std::cos(angle) * half;
      const float s = std::sin(angle) * half;
      const Draw draw = draw_of(64, 64, {Splat{32, 32, c, s, -s, c, 3, 0, 1, 1, 1, 1}});
      const RenderContext context = context_of(draw);
      for (unsigned triangle = 0; triangle < 2; ++triangle) {
        SnappedTriangle t;
        ASSERT_TRUE(snap_triangle(context, 0, 0, triangle, t)) << half << " " << angle;
        for (unsigned i = 0; i < 3; ++i) {
          EXPECT_LE(std::abs(t.x[i]), 32768 * 256);
          EXPECT_LE(std::abs(t.y[i]), 32768 * 256);
        }
        EXPECT_NE(doubled_area(t), 0);
      }
    }
  }
}

TEST(CoveredBounds, AreTheSamplesBetweenTheVerticesClippedToTheViewport) {
  SnappedTriangle t;
  t.x = {128, 129, 640};  // 0.5, 0.50390625, 2.5 pixels
  t.y = {-2560, 5120, 127};
  const PixelRect bounds = covered_bounds(t, 8, 100, 15);
  EXPECT_EQ(bounds.x0, 0);
  EXPECT_EQ(bounds.x1, 3);
  EXPECT_EQ(bounds.y0, 0);
  EXPECT_EQ(bounds.y1, 15);
  t.x = {129, 140, 383};  // between the samples at 0.5 and 1.5
  EXPECT_TRUE(covered_bounds(t, 8, 100, 15).empty());
}

TEST(DoubledArea, OfTheLargestTriangleDoesNotOverflow) {
  SnappedTriangle t;
  const std::int32_t edge = 32768 * 4096 - 1;  // 12 sub-pixel bits
  t.x = {-edge, edge, -edge};
  t.y = {-edge, -edge, edge};
  EXPECT_EQ(doubled_area(t), 4LL * edge * edge);
}

}  // namespace
}  // namespace vrpipe
