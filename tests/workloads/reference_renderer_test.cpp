#include "../support/reference_renderer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/builders.h"

namespace vrpipe::testing {
namespace {

/// A round splat of `sigma` pixels whose box ends where alpha is 1/255.
Splat grey_splat(float x, float y, float sigma, float opacity, float grey = 1) {
  const float r = std::sqrt(2 * std::log(255 * opacity));
  return {x, y, sigma * r, 0, 0, sigma * r, r, 0, grey, grey, grey, opacity};
}

// Z03
TEST(ReferenceRenderer, OneSplatIsItsClosedFormAtEveryPixel) {
  const ReferenceImage image = render_reference(draw_of(40, 30, {grey_splat(17.3f, 12.8f, 3, 0.8f, 0.5f)}));
  for (std::uint32_t y = 0; y < 30; ++y) {
    for (std::uint32_t x = 0; x < 40; ++x) {
      const double dx = x + 0.5 - 17.3f, dy = y + 0.5 - 12.8f;
      double alpha = 0.8f * std::exp(-(dx * dx + dy * dy) / 18);
      if (alpha < 1.0 / 255) alpha = 0;
      EXPECT_NEAR(image.at(x, y)[3], alpha, 1e-6);
      EXPECT_NEAR(image.at(x, y)[0], 0.5 * alpha, 1e-6);
    }
  }
}

// Z04
TEST(ReferenceRenderer, EqualSplatsFillUpAsAPower) {
  const ReferenceImage image =
      render_reference(draw_of(1, 1, std::vector<Splat>(20, grey_splat(0.5f, 0.5f, 2, 0.25f))));
  EXPECT_NEAR(image.at(0, 0)[3], 1 - std::pow(0.75, 20), 1e-12);
  EXPECT_EQ(image.fragments_blended, 20u);
}

TEST(ReferenceRenderer, AlphaIsCappedAt099) {
  EXPECT_EQ(render_reference(draw_of(1, 1, {grey_splat(0.5f, 0.5f, 2, 1.0f)})).at(0, 0)[3], 0.99);
}

TEST(ReferenceRenderer, ATerminatedPixelTakesNothingMore) {
  const std::vector<Splat> splats = {grey_splat(0.5f, 0.5f, 2, 1), grey_splat(0.5f, 0.5f, 2, 1),
                                     grey_splat(0.5f, 0.5f, 2, 1)};
  ReferenceOptions options;
  options.termination_threshold = 0.996;
  const ReferenceImage image = render_reference(draw_of(1, 1, splats), options);
  EXPECT_EQ(image.fragments_blended, 2u);
  EXPECT_NEAR(image.at(0, 0)[3], 0.9999, 1e-12);
}

// O08: the corners of a box hold 1 - pi/4 of its fragments.
TEST(ReferenceRenderer, CornersOfTheBoxArePruned) {
  Splat turned = grey_splat(300, 300, 60, 0.9f);
  const float c = 0.8f, s = 0.6f, extent = turned.ax;
  turned.ax = c * extent;
  turned.ay = s * extent;
  turned.bx = -s * extent;
  turned.by = c * extent;
  for (const Splat& splat : {grey_splat(300, 300, 60, 0.9f), turned}) {
    const ReferenceImage image = render_reference(draw_of(600, 600, {splat}));
    EXPECT_NEAR(1 - static_cast<double>(image.fragments_blended) / static_cast<double>(image.fragments_covered),
                1 - 3.14159265 / 4, 0.002);
    EXPECT_NEAR(static_cast<double>(image.fragments_covered), 4 * extent * extent, 0.01 * 4 * extent * extent);
  }
}

TEST(ReferenceRenderer, ASplatWithoutExtentCoversOnlyASampleAtItsCentre) {
  Splat point = grey_splat(2.5f, 1.5f, 0, 0.5f);
  point.opacity = 1.0f / 255;
  point.r = 0;
  EXPECT_EQ(render_reference(draw_of(4, 4, {point})).fragments_blended, 1u);
  EXPECT_EQ(render_reference(draw_of(4, 4, {point})).fragments_near_prune_edge, 1u);
  point.cx = 2.6f;
  EXPECT_EQ(render_reference(draw_of(4, 4, {point})).fragments_covered, 0u);
}

TEST(ReferenceRenderer, TheRunningBoundHoldsForARoundingBlender) {
  std::vector<Splat> splats;
  for (int i = 0; i < 300; ++i)
    splats.push_back(grey_splat(0.5f, 0.5f, 2, 0.01f + 0.0007f * static_cast<float>(i), i % 3 ? 0.9f : 0.1f));
  const Draw draw = draw_of(1, 1, splats);
  ReferenceOptions options;
  options.bound_format = ColorFormat::rgba8;
  const ReferenceImage eight = render_reference(draw, options);
  options.bound_format = ColorFormat::rgba16f;
  const ReferenceImage half = render_reference(draw, options);
  const auto to_unorm8 = [](double v) { return std::floor(v * 255 + 0.5) / 255; };
  const auto to_half = [](double v) {  // round to nearest even at 11 bits
    int exponent = 0;
    std::frexp(v, &exponent);
    const double unit = std::ldexp(1.0, std::max(exponent - 1, -14) - 10);
    return std::nearbyint(v / unit) * unit;
  };
  const auto check = [&](const ReferenceImage& image, const auto& round) {
    double a = 0, c = 0;
    for (const Splat& s : splats) {
      const double alpha = s.opacity;
      c = round(c + (1 - a) * alpha * s.red);
      a = round(a + (1 - a) * alpha);
    }
    EXPECT_LE(std::fabs(a - image.at(0, 0)[3]), image.bound[0].alpha);
    EXPECT_LE(std::fabs(c - image.at(0, 0)[0]), image.bound[0].color);
    EXPECT_LT(image.bound[0].alpha, 0.5);
  };
  check(eight, to_unorm8);
  check(half, to_half);
  EXPECT_LT(half.bound[0].alpha, eight.bound[0].alpha);
}

TEST(ReferenceRenderer, TrianglesAreRefused) {
  Draw draw = draw_of(1, 1, {grey_splat(0, 0, 1, 0.5f)});
  draw.triangles.resize(1);
  EXPECT_THROW(render_reference(draw), std::invalid_argument);
}

}  // namespace
}  // namespace vrpipe::testing
