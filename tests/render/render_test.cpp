#include "render/render.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/framebuffer.h>

#include "support/builders.h"
#include "support/reference_renderer.h"

namespace vrpipe {
namespace {

using testing::draw_of;
using testing::round_splat;

/// Every splat in every tile, so that nothing but the kernel decides.
template <class Kernel>
struct Rendered {
  explicit Rendered(const Draw& draw, const std::vector<std::pair<std::string, std::string>>& settings = {})
      : context(testing::context_of(draw)), framebuffer(*context.frame, ColorFormat::rgba32f) {
    typename Kernel::Parameters parameters;
    for (const auto& [name, value] : settings) parameters.set("render", name, value);
    kernel = std::make_unique<Kernel>(parameters, context);
    kernel->use_surfaces(framebuffer);
    std::vector<std::uint32_t> list(draw.splats.size());
    std::iota(list.begin(), list.end(), 0U);
    blocks.resize(ScreenTiling(draw.width, draw.height).tiles());
    for (std::size_t tile = 0; tile < blocks.size(); ++tile) {
      kernel->render(tile, list.data(), static_cast<std::uint32_t>(list.size()), blocks[tile]);
    }
    kernel->check_end();
  }
  std::array<float, 4> pixel(std::uint32_t x, std::uint32_t y) const { return framebuffer.color.pixel(x, y); }

  RenderContext context;
  Framebuffer framebuffer;
  std::unique_ptr<Kernel> kernel;
  std::vector<BlockWork> blocks;
};

/// What each pixel does, one after the other, in double precision.
struct PixelOracle {
  enum class Rule { none, before, after };
  std::uint64_t blended = 0, stopped = 0, iterations = 0, dead = 0, without_blending = 0;
  std::vector<std::array<double, 4>> image;

  PixelOracle(const Draw& draw, Rule rule, std::uint32_t warp_width) : image(std::size_t{draw.width} * draw.height) {
    const std::uint32_t warp_height = 32 / warp_width;
    const auto whole = [](std::uint32_t pixels, std::uint32_t of) { return (pixels + of - 1) / of * of; };
    for (std::uint32_t y = 0; y < whole(draw.height, 16); y += warp_height) {
      for (std::uint32_t x = 0; x < whole(draw.width, 16); x += warp_width) warp(draw, rule, x, y, warp_width);
    }
  }

 private:
  void warp(const Draw& draw, Rule rule, std::uint32_t x0, std::uint32_t y0, std::uint32_t warp_width) {
    std::vector<std::uint64_t> looks(32, 0);
    std::vector<bool> blends(draw.splats.size(), false);
    for (std::uint32_t lane = 0; lane < 32; ++lane) {
      const std::uint32_t x = x0 + lane % warp_width, y = y0 + lane / warp_width;
      if (x >= draw.width || y >= draw.height) continue;
      std::array<double, 4>& pixel = image[std::size_t{y} * draw.width + x];
      double transmittance = 1;
      bool alive = true;
      for (std::size_t i = 0; i < draw.splats.size() && alive; ++i) {
        ++looks[lane];
        const Splat& splat = draw.splats[i];
        const double dx = x + 0.5 - splat.cx, dy = y + 0.5 - splat.cy;
        const double r = splat.r;
        const double a = std::hypot(splat.ax, splat.ay), b = std::hypot(splat.bx, splat.by);
        const double u = (dx * splat.ax + dy * splat.ay) / (a * a) * r,
                     v = (dx * splat.bx + dy * splat.by) / (b * b) * r;
        const double alpha = std::fmin(0.99, splat.opacity * std::exp(-(u * u + v * v) / 2));
        if (alpha < 1.0 / 255) continue;
        const double next = transmittance * (1 - alpha);
        if (rule == Rule::before && next < 1e-4) {
          ++stopped;
          alive = false;
          continue;
        }
        pixel[0] += splat.red * alpha * transmittance;
        pixel[1] += splat.green * alpha * transmittance;
        pixel[2] += splat.blue * alpha * transmittance;
        transmittance = next;
        ++blended;
        blends[i] = true;
        if (rule == Rule::after && 1 - transmittance >= 0.996) alive = false;
      }
      pixel[3] = 1 - transmittance;
    }
    const std::uint64_t most = *std::max_element(looks.begin(), looks.end());
    iterations += most;
    for (const std::uint64_t of_lane : looks) dead += most - of_lane;
    for (std::size_t i = 0; i < most; ++i) without_blending += blends[i] ? 0U : 1U;
  }
};

/// Of many layers, so that pixels stop at different splats; not a whole number of tiles.
Draw layered() {
  Draw draw = testing::random_draw(70, 45, 500, 3);
  for (Splat& splat : draw.splats) splat.r = std::max(splat.r, 1.0F);
  return draw;
}

template <class Kernel>
void expect_as_pixel_by_pixel(PixelOracle::Rule rule) {
  const Draw draw = layered();
  for (const std::uint32_t warp_width : {16U, 8U}) {
    const Rendered<Kernel> rendered(draw, {{"warp_pixels", warp_width == 16 ? "16x2" : "8x4"}});
    const PixelOracle oracle(draw, rule, warp_width);
    const Kernel& kernel = *rendered.kernel;
    // Single precision may decide otherwise where alpha or transmittance are at a threshold.
    const auto near = [](const Counter& counter, std::uint64_t expected, double share) {
      EXPECT_NEAR(static_cast<double>(counter.value()), static_cast<double>(expected),
                  share * static_cast<double>(expected) + 2)
          << counter.name();
    };
    near(kernel.lanes_blending, oracle.blended, 1e-4);
    near(kernel.lanes_stopping, oracle.stopped, 1e-2);
    near(kernel.warp_iterations, oracle.iterations, 1e-3);
    near(kernel.lanes_dead, oracle.dead, 1e-3);
    near(kernel.iterations_without_blending, oracle.without_blending, 1e-3);
    for (std::uint32_t y = 0; y < draw.height; ++y) {
      for (std::uint32_t x = 0; x < draw.width; ++x) {
        for (unsigned channel = 0; channel < 4; ++channel) {
          EXPECT_NEAR(static_cast<double>(rendered.pixel(x, y)[channel]),
                      oracle.image[std::size_t{y} * draw.width + x][channel], 5e-3);
        }
      }
    }
  }
}

TEST(RenderKernel, WithoutTerminationBlendsWhatEveryPixelSees) {
  expect_as_pixel_by_pixel<EndlessKernel>(PixelOracle::Rule::none);
}
TEST(RenderKernel, ThePublishedOneStopsBeforeTheSplatThatWouldLeaveTooLittle) {
  expect_as_pixel_by_pixel<PublishedKernel>(PixelOracle::Rule::before);
}
TEST(RenderKernel, WithTheHardwaresRuleStopsBehindTheSplatThatReachesTheThreshold) {
  expect_as_pixel_by_pixel<ThresholdKernel>(PixelOracle::Rule::after);
}

TEST(RenderKernel, GivesTheImageOfTheReference) {
  const Draw draw = layered();
  const testing::ReferenceImage reference = testing::render_reference(draw);
  const Rendered<EndlessKernel> rendered(draw);
  EXPECT_NEAR(static_cast<double>(rendered.kernel->lanes_blending.value()),
              static_cast<double>(reference.fragments_blended), 3);
  for (std::uint32_t y = 0; y < draw.height; ++y) {
    for (std::uint32_t x = 0; x < draw.width; ++x) {
      for (unsigned channel = 0; channel < 4; ++channel) {
        EXPECT_NEAR(static_cast<double>(rendered.pixel(x, y)[channel]), reference.at(x, y)[channel], 5e-3);
      }
    }
  }
}

/// As many large, flat layers; each takes `alpha` of what is behind it, at every pixel alike.
Draw layers(unsigned count, float alpha) {
  return draw_of(16, 16, std::vector<Splat>(count, round_splat(8, 8, 1e5F, alpha)));
}

TEST(RenderKernel, WarpsIssueForTheFarthestThatALaneGoes) {
  // 0.9 four times leaves 1e-4 in double precision, in single a little more or less: the threshold is between.
  const Rendered<PublishedKernel> rendered(layers(10, 0.9F), {{"least_transmittance", "0.0005"},
                                                              {"blending_instructions", "50"},
                                                              {"stopping_instructions", "40"},
                                                              {"batch_instructions", "7"}});
  ASSERT_EQ(rendered.blocks.front().warps, 8U);
  ASSERT_EQ(rendered.blocks.front().instructions.size(), 8U);
  for (const std::uint64_t instructions : rendered.blocks.front().instructions) {
    EXPECT_EQ(instructions, 1000U * (3 * 50 + 40 + 7));
  }
  EXPECT_EQ(rendered.blocks.front().lane_instructions, 256 * 1000U * (3 * 50 + 40 + 7));
  EXPECT_EQ(rendered.kernel->lanes_stopping.value(), 256U);
  EXPECT_EQ(rendered.kernel->lanes_blending.value(), 3 * 256U);
}

TEST(RenderKernel, AWarpIsPrunedWhereNoLaneReachesAlpha) {
  // Seen by the pixels of the first warp alone: rows 0 and 1.
  const Rendered<EndlessKernel> rendered(draw_of(16, 16, {round_splat(7.5F, 0.5F, 0.2F, 0.9F)}),
                                         {{"blending_instructions", "50"},
                                          {"pruned_instructions", "30"},
                                          {"batch_instructions", "0"}});
  std::vector<std::uint64_t> expected(8, 30'000);
  expected[0] = 50'000;
  EXPECT_EQ(rendered.blocks.front().instructions, expected);
  EXPECT_EQ(rendered.kernel->iterations_without_blending.value(), 7U);
  const std::uint64_t blending = rendered.kernel->lanes_blending.value();
  EXPECT_EQ(rendered.blocks.front().lane_instructions, 1000 * (50 * blending + 30 * (256 - blending)));
}

TEST(RenderKernel, ABlockEndsWithTheBatchInWhichItsLastPixelStops) {
  // 600 layers are three batches; all pixels stop in the first, and no warp fetches another.
  const Rendered<ThresholdKernel> stopping(layers(600, 0.5F));
  EXPECT_EQ(stopping.blocks.front().batches(), 1U);
  EXPECT_EQ(stopping.kernel->batches.value(), 8U);
  EXPECT_EQ(Rendered<EndlessKernel>(layers(600, 0.5F)).blocks.front().batches(), 3U);
}

TEST(RenderKernel, WarpsThatAreDoneFetchBatchesWithTheOthers) {
  // The upper eight rows are covered, the lower eight see nothing and never stop.
  Draw draw = layers(600, 0.5F);
  for (Splat& splat : draw.splats) splat = testing::splat_at(8, 0, 1e5F, 3.0F, 0, 0.99F);
  const Rendered<ThresholdKernel> rendered(draw);
  EXPECT_EQ(rendered.blocks.front().batches(), 3U);
  EXPECT_EQ(rendered.kernel->batches.value(), 24U);
  EXPECT_GE(rendered.kernel->batches_of_dead_warps.value(), 8U);
  EXPECT_EQ(rendered.kernel->batches_of_dead_warps.value() % 2, 0U);
}

TEST(RenderKernel, PixelsBeyondTheImageAreDeadFromTheBeginning) {
  const Rendered<EndlessKernel> rendered(draw_of(8, 2, {round_splat(4, 1, 50, 0.5F)}));
  EXPECT_EQ(rendered.kernel->warp_iterations.value(), 1U);
  EXPECT_EQ(rendered.kernel->lanes_blending.value(), 16U);
  EXPECT_EQ(rendered.kernel->lanes_dead.value(), 16U);
}

TEST(RenderKernel, ATileWithoutSplatsIssuesNothing) {
  const Rendered<PublishedKernel> rendered(draw_of(32, 16));
  for (const BlockWork& block : rendered.blocks) EXPECT_TRUE(block.instructions.empty());
  EXPECT_EQ(rendered.pixel(3, 3), (std::array<float, 4>{}));
}

TEST(RenderKernel, WhatHasNoAreaIsPruned) {
  Splat line = round_splat(8, 8, 3, 0.5F);
  line.bx = line.by = 0;
  const Rendered<EndlessKernel> rendered(draw_of(16, 16, {line}));
  EXPECT_EQ(rendered.kernel->lanes_blending.value(), 0U);
}

}  // namespace
}  // namespace vrpipe
