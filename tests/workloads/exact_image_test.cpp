#include <vrpipe/workloads/exact_image.h>

#include <cmath>
#include <cstring>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "support/reference_renderer.h"

namespace vrpipe::testing {
namespace {

/// Splats of all sizes, shapes and opacities, some of them beyond the image and some far larger than it.
Draw mixed_draw(std::uint32_t width, std::uint32_t height, unsigned splats) {
  std::mt19937 random(7);
  const auto uniform = [&] { return static_cast<float>(random()) / 4294967296.0F; };
  Draw draw;
  draw.width = width;
  draw.height = height;
  const auto across = static_cast<float>(width);
  const auto down = static_cast<float>(height);
  for (unsigned i = 0; i < splats; ++i) {
    const float opacity = 1.0F / 255 + uniform() * (1 - 1.0F / 255);
    const float r = std::sqrt(2 * std::log(255 * opacity));
    const float angle = 6.28F * uniform();
    const float sigma = std::exp(6 * uniform() - 1);
    const float other = sigma * std::exp(-4 * uniform());
    draw.splats.push_back({across * (1.4F * uniform() - 0.2F), down * (1.4F * uniform() - 0.2F),
                           sigma * r * std::cos(angle), sigma * r * std::sin(angle), -other * r * std::sin(angle),
                           other * r * std::cos(angle), r, 0, 2 * uniform(), uniform(), uniform(), opacity});
  }
  return draw;
}

void expect_agreement(const Draw& draw) {
  const ExactImage image = render_exactly(draw);
  const ReferenceImage oracle = render_reference(draw);
  ASSERT_EQ(image.rgba.size(), oracle.rgba.size());
  std::size_t compared = 0;
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    // A fragment at the pruning threshold may fall on either side.
    if (oracle.near_edge_per_pixel[i] > 0) continue;
    ++compared;
    for (std::size_t channel = 0; channel < 4; ++channel) {
      ASSERT_NEAR(image.rgba[i][channel], oracle.rgba[i][channel], 1e-12) << "pixel " << i << " channel " << channel;
    }
  }
  EXPECT_GT(compared, image.rgba.size() * 9 / 10);
}

TEST(ExactImage, AgreesWithTheOracleWithinDoubleRounding) {
  expect_agreement(mixed_draw(131, 77, 400));
  expect_agreement(mixed_draw(1, 1, 50));
}

TEST(ExactImage, IsTheSameBitForBitOnAnyNumberOfThreads) {
  const Draw draw = mixed_draw(90, 101, 300);
  const ExactImage one = render_exactly(draw, 1);
  for (const unsigned threads : {0U, 2U, 3U, 16U}) {
    const ExactImage other = render_exactly(draw, threads);
    EXPECT_EQ(std::memcmp(one.rgba.data(), other.rgba.data(), one.rgba.size() * sizeof one.rgba[0]), 0) << threads;
  }
}

TEST(ExactImage, OpaquePixelsTakeWhatComesBehind) {
  Draw draw;
  draw.width = draw.height = 1;
  const float r = std::sqrt(2 * std::log(255.0F));
  for (unsigned i = 0; i < 4; ++i) draw.splats.push_back({0.5F, 0.5F, r, 0, 0, r, r, 0, 1, 0, 0, 1});
  const std::array<double, 4> pixel = render_exactly(draw).at(0, 0);
  EXPECT_NEAR(pixel[3], 1 - 1e-8, 1e-14);
  EXPECT_NEAR(pixel[0], 1 - 1e-8, 1e-14);
  EXPECT_EQ(pixel[1], 0);
}

TEST(ExactImage, PrunesBelowOne255thAndNotAtIt) {
  Draw draw;
  draw.width = 2;
  draw.height = 1;
  // No extent, so only a sample on the centre; opacity 1/255 rounded to float is a little more than that.
  draw.splats.push_back({0.5F, 0.5F, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1.0F / 255});
  draw.splats.push_back({1.5F, 0.5F, 0, 0, 0, 0, 0, 0, 1, 1, 1, 0.999F / 255});
  const ExactImage image = render_exactly(draw);
  EXPECT_EQ(image.at(0, 0)[3], 1 - (1 - static_cast<double>(1.0F / 255)));
  EXPECT_EQ(image.at(1, 0)[3], 0);
}

TEST(ExactImage, OfNothingIsEmpty) {
  Draw draw;
  draw.width = 3;
  draw.height = 20;
  for (const auto& pixel : render_exactly(draw).rgba) EXPECT_EQ(pixel, (std::array<double, 4>{}));
}

TEST(ExactImage, RefusesTriangles) {
  Draw draw = mixed_draw(4, 4, 1);
  draw.triangles.resize(1);
  EXPECT_THROW(render_exactly(draw), std::invalid_argument);
  Draw mesh;
  mesh.width = mesh.height = 4;
  mesh.mesh.resize(1);
  EXPECT_THROW(render_exactly(mesh), std::invalid_argument);
}

}  // namespace
}  // namespace vrpipe::testing
