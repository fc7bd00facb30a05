#include "accelerator/accelerator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/framebuffer.h>

#include "support/builders.h"
#include "support/splat_shapes.h"

namespace vrpipe {
namespace {

using testing::draw_of;
using testing::splat_at;
using Settings = std::vector<std::pair<std::string, std::string>>;

template <class Accelerator>
struct Drawn {
  explicit Drawn(const Draw& draw, const Settings& settings = {}, std::optional<std::uint64_t> gaussians = {})
      : context(testing::context_of(draw)), framebuffer(*context.frame, ColorFormat::rgba32f) {
    typename Accelerator::Parameters parameters;
    for (const auto& [name, value] : settings) parameters.set("accelerator", name, value);
    unit = std::make_unique<Accelerator>(parameters, context);
    unit->use_surfaces(framebuffer);
    steps = unit->draw(gaussians);
  }
  AcceleratorStep::Part sum(AcceleratorStage stage) const {
    AcceleratorStep::Part all;
    for (const AcceleratorStep& step : steps) {
      all.items += step.of(stage).items;
      all.cycles += step.of(stage).cycles;
      all.bytes += step.of(stage).bytes;
    }
    return all;
  }

  RenderContext context;
  Framebuffer framebuffer;
  std::unique_ptr<Accelerator> unit;
  std::vector<AcceleratorStep> steps;
};

/// Tiles, sub-tiles and pixels one after the other, in double precision.
struct AcceleratorOracle {
  struct Shape {
    std::uint32_t tile, subtile, chunk;
    bool is_ellipse;
  };
  std::uint64_t pairs = 0, subtile_pairs = 0, drawn = 0, unblended = 0, blended = 0, chunks = 0, skipped = 0,
                sorted = 0, entries = 0, subtiles_terminated = 0, tiles_terminated = 0;
  std::vector<std::array<double, 4>> image;

  AcceleratorOracle(const Draw& of, const Shape& by) : image(std::size_t{of.width} * of.height), draw(of), shape(by) {
    for (std::uint32_t y = 0; y < draw.height; y += shape.tile) {
      for (std::uint32_t x = 0; x < draw.width; x += shape.tile) tile(x, y);
    }
  }

 private:
  struct Subtile {
    std::uint32_t x, y;
    std::uint64_t living;  ///< pixels
  };

  bool touches(const Splat& splat, std::uint32_t x, std::uint32_t y, std::uint32_t side) const {
    const double right = std::min(x + side, draw.width) - 0.5, bottom = std::min(y + side, draw.height) - 0.5;
    const auto corners =
        testing::in_axes(splat,
                         {testing::Point{x + 0.5, y + 0.5}, {right, y + 0.5}, {right, bottom}, {x + 0.5, bottom}});
    return shape.is_ellipse ? testing::distance_to(corners) <= 1 : testing::meets_square(corners);
  }

  void tile(std::uint32_t x0, std::uint32_t y0) {
    std::vector<Subtile> subtiles;
    for (std::uint32_t y = y0; y < std::min(y0 + shape.tile, draw.height); y += shape.subtile) {
      for (std::uint32_t x = x0; x < std::min(x0 + shape.tile, draw.width); x += shape.subtile) {
        subtiles.push_back({x, y,
                            std::uint64_t{std::min(x + shape.subtile, draw.width) - x} *
                                (std::min(y + shape.subtile, draw.height) - y)});
      }
    }
    std::vector<const Splat*> list;
    for (const Splat& splat : draw.splats) {
      if (touches(splat, x0, y0, shape.tile)) list.push_back(&splat);
    }
    pairs += list.size();
    chunks += (list.size() + shape.chunk - 1) / shape.chunk;
    std::size_t living = subtiles.size();
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (i % shape.chunk == 0) {
        if (living == 0)
          ++skipped;
        else
          sorted += std::min<std::size_t>(shape.chunk, list.size() - i);
      }
      if (living > 0) ++entries;
      for (Subtile& subtile : subtiles) {
        if (!touches(*list[i], subtile.x, subtile.y, shape.subtile)) continue;
        ++subtile_pairs;
        if (subtile.living == 0) continue;
        ++drawn;
        if (blend(*list[i], subtile) == 0) ++unblended;
        if (subtile.living > 0) continue;
        ++subtiles_terminated;
        --living;
      }
    }
    if (living == 0) ++tiles_terminated;
  }

  std::uint64_t blend(const Splat& splat, Subtile& subtile) {
    std::uint64_t in = 0;
    for (std::uint32_t y = subtile.y; y < std::min(subtile.y + shape.subtile, draw.height); ++y) {
      for (std::uint32_t x = subtile.x; x < std::min(subtile.x + shape.subtile, draw.width); ++x) {
        std::array<double, 4>& pixel = image[std::size_t{y} * draw.width + x];
        if (stopped.count({x, y}) != 0) continue;
        const testing::Point at = testing::in_axes(splat, {testing::Point{x + 0.5, y + 0.5}, {}, {}, {}})[0];
        const double distance = (at.x * at.x + at.y * at.y) * splat.r * splat.r;
        const double alpha = std::fmin(0.99, splat.opacity * std::exp(-distance / 2));
        if (alpha < 1.0 / 255) continue;
        const double before = 1 - pixel[3];
        if (before * (1 - alpha) < 1e-4) {
          stopped.insert({x, y});
          --subtile.living;
          continue;
        }
        const std::array<double, 3> color{splat.red, splat.green, splat.blue};
        for (unsigned c = 0; c < 3; ++c) pixel[c] += before * alpha * color[c];
        pixel[3] = 1 - before * (1 - alpha);
        ++in;
      }
    }
    blended += in;
    return in;
  }

  const Draw& draw;
  const Shape shape;
  std::set<std::pair<std::uint32_t, std::uint32_t>> stopped;
};

template <class Accelerator>
void expect_as(const AcceleratorOracle& oracle, const Drawn<Accelerator>& drawn) {
  const Accelerator& unit = *drawn.unit;
  EXPECT_EQ(unit.pairs.value(), oracle.pairs);
  EXPECT_EQ(unit.subtile_pairs.value(), oracle.subtile_pairs);
  EXPECT_EQ(unit.subtile_pairs_drawn.value(), oracle.drawn);
  EXPECT_EQ(unit.subtile_pairs_unblended.value(), oracle.unblended);
  EXPECT_EQ(unit.fragments_blended.value(), oracle.blended);
  EXPECT_EQ(unit.chunks.value(), oracle.chunks);
  EXPECT_EQ(unit.chunks_skipped.value(), oracle.skipped);
  EXPECT_EQ(unit.entries_sorted.value(), oracle.sorted);
  EXPECT_EQ(unit.entries_drawn.value(), oracle.entries);
  EXPECT_EQ(unit.subtiles_terminated.value(), oracle.subtiles_terminated);
  EXPECT_EQ(unit.tiles_terminated.value(), oracle.tiles_terminated);
  const ColorSurface& color = drawn.framebuffer.color;
  double most = 0;
  for (std::uint32_t y = 0; y < color.height(); ++y) {
    for (std::uint32_t x = 0; x < color.width(); ++x) {
      for (unsigned c = 0; c < 4; ++c) {
        const double expected = oracle.image[std::size_t{y} * color.width() + x][c];
        most = std::fmax(most, std::fabs(expected - double{color.pixel(x, y)[c]}));
      }
    }
  }
  EXPECT_LT(most, 1e-5);
}

/// Round enough for single precision to tell what double does, and so many that some of the tiles terminate.
Draw crowd_of(std::uint32_t width, std::uint32_t height, std::uint32_t splats, std::uint64_t seed) {
  Draw draw = draw_of(width, height);
  for (std::uint32_t i = 0; i < splats; ++i) {
    const auto number = [&](std::uint64_t index, float low, float high) {
      return testing::uniform(seed, 8 * std::uint64_t{i} + index, low, high);
    };
    const bool is_large = i % 8 == 0;
    const float sigma = number(0, 1, 5) * (is_large ? 3.0F : 1.0F);
    draw.splats.push_back(splat_at(number(1, -5, 1.2F * static_cast<float>(width)),
                                   number(2, -5, static_cast<float>(height) + 5), sigma, sigma * number(3, 0.4F, 1),
                                   number(4, 0, 6.2F), number(5, is_large ? 0.9F : 0.05F, 1), number(6, 0, 1),
                                   number(7, 0, 1)));
  }
  return draw;
}

TEST(Accelerator, CountsAreThoseOfEveryPixel) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    // Sides that are no multiples of a tile's.
    const Draw draw = crowd_of(70, 45, 900, seed);
    const AcceleratorOracle oracle(draw, {16, 8, 32, false});
    EXPECT_GT(oracle.skipped, 0U);
    EXPECT_GT(oracle.subtiles_terminated, 0U);
    EXPECT_LT(oracle.tiles_terminated, 15U) << "some go on to the end";
    expect_as(oracle, Drawn<Gscore>(draw, {{"chunk_entries", "32"}}));
  }
}

TEST(Accelerator, OtherSidesMasksAndFlowsAreCountedAsWell) {
  const Draw draw = crowd_of(90, 50, 900, 4);
  expect_as(AcceleratorOracle(draw, {16, 4, 20, true}), Drawn<Flicker>(draw, {{"chunk_entries", "20"}}));
  expect_as(AcceleratorOracle(draw, {128, 8, 64, true}), Drawn<Gcc>(draw, {{"chunk_entries", "64"}}));
  expect_as(AcceleratorOracle(draw, {32, 16, 256, false}),
            Drawn<Gscore>(draw, {{"tile_side_pixels", "32"}, {"subtile_side_pixels", "16"}}));
}

/// As many, each of one alpha all over an image of a tile.
Draw stack_of(std::uint32_t splats, float alpha) {
  return draw_of(16, 16, std::vector<Splat>(splats, splat_at(8, 8, 1e5F, 1e5F, 0, alpha)));
}

TEST(Accelerator, AStackOfSplatsHasAClosedForm) {
  // 0.2^5 is above 1e-4 and 0.2^6 below: five are blended, and the sixth ends all.
  const Drawn<Gscore> drawn(stack_of(600, 0.8F), {}, 1000);
  const Gscore& unit = *drawn.unit;
  EXPECT_EQ(unit.pairs.value(), 600U);
  EXPECT_EQ(unit.tile_tests.value(), 600U);
  EXPECT_EQ(unit.subtile_pairs.value(), 2400U);
  EXPECT_EQ(unit.subtile_pairs_drawn.value(), 6U * 4);
  EXPECT_EQ(unit.fragments_blended.value(), 5U * 256);
  EXPECT_EQ(unit.entries_drawn.value(), 6U);
  EXPECT_EQ(unit.entries_sorted.value(), 256U);
  EXPECT_EQ(unit.chunks.value(), 3U);
  EXPECT_EQ(unit.chunks_skipped.value(), 2U);
  EXPECT_EQ(unit.gaussians_converted.value(), 600U);
  ASSERT_EQ(drawn.steps.size(), 2U) << "all Gaussians, and the chunk that is drawn";
  const AcceleratorStep::Part converted = drawn.sum(AcceleratorStage::conversion);
  EXPECT_EQ(converted.items, 1000U);
  EXPECT_EQ(converted.cycles, (1000U + 600) / 4);
  EXPECT_EQ(converted.bytes, 600U * 232 + 400U * 12 + 600U * 28);
  const AcceleratorStep::Part sorted = drawn.sum(AcceleratorStage::sorting);
  EXPECT_EQ(sorted.items, 256U);
  EXPECT_EQ(sorted.cycles, 600U / 8 + 256U * 4 * 4 / 64) << "a quick pass, and four rounds of 16 entries in 4 cycles";
  EXPECT_EQ(sorted.bytes, 600U * 28);
  const AcceleratorStep::Part rendered = drawn.sum(AcceleratorStage::rendering);
  EXPECT_EQ(rendered.items, 24U);
  EXPECT_EQ(rendered.cycles, 6U * 64 / 16) << "a core has a sub-tile";
  EXPECT_EQ(rendered.bytes, 256U * 4);
}

TEST(Accelerator, WithoutTerminationEveryChunkIsDrawn) {
  const Drawn<Gscore> drawn(stack_of(600, 0.8F), {{"least_transmittance", "0"}});
  EXPECT_EQ(drawn.unit->chunks_skipped.value(), 0U);
  EXPECT_EQ(drawn.unit->subtile_pairs_drawn.value(), 2400U);
  ASSERT_EQ(drawn.steps.size(), 3U);
  EXPECT_EQ(drawn.sum(AcceleratorStage::conversion).bytes, 0U) << "a draw list is converted already";
  // Chunks of 256, 256 and 88, of 16 entries in runs that double.
  EXPECT_EQ(drawn.sum(AcceleratorStage::sorting).cycles, 600U / 8 + 64 + 64 + (88U * 3 * 4 + 63) / 64);
  EXPECT_EQ(drawn.sum(AcceleratorStage::rendering).cycles, 600U * 4);
}

TEST(Accelerator, AListThatDoesNotFitIsReadAndWrittenByEveryQuickPass) {
  const Draw draw = stack_of(600, 0.8F);
  const Settings settings{{"sram_kilobytes", "32"}, {"chunk_entries", "64"}, {"quick_ways", "2"}};
  const Drawn<Gscore> drawn(draw, settings);  // 16800 bytes, and half of the SRAM is 16384
  EXPECT_EQ(drawn.unit->lists_spilled.value(), 1U);
  EXPECT_EQ(drawn.sum(AcceleratorStage::sorting).bytes, 600U * 28 * 2 * 4);
  EXPECT_EQ(drawn.sum(AcceleratorStage::sorting).cycles, 600U * 4 / 8 + 64U * 2 * 4 / 64);
  Settings larger = settings;
  larger.front().second = "33";
  EXPECT_EQ(Drawn<Gscore>(draw, larger).unit->lists_spilled.value(), 0U);
}

TEST(Accelerator, SubTilesOfOneCoreWaitForOneAnother) {
  const Draw draw = stack_of(10, 0.1F);
  const auto cycles = [&](const char* cores, const char* units) {
    return Drawn<Gscore>(draw, {{"volume_cores", cores}, {"volume_units", units}})
        .sum(AcceleratorStage::rendering)
        .cycles;
  };
  EXPECT_EQ(cycles("4", "16"), 10U * 4);
  EXPECT_EQ(cycles("1", "64"), 10U * 4 * 1);
  EXPECT_EQ(cycles("1", "16"), 10U * 4 * 4);
  EXPECT_EQ(cycles("3", "16"), 10U * 2 * 4) << "two of four have the same";
  EXPECT_EQ(cycles("4", "48"), 10U * 2) << "64 pixels are two turns of 48";
}

TEST(Accelerator, AFlowByGaussiansConvertsWhatItDraws) {
  const Drawn<Gcc> drawn(stack_of(600, 0.8F), {}, 1000);
  EXPECT_EQ(drawn.unit->gaussians_converted.value(), 256U) << "a chunk; the others are skipped";
  ASSERT_EQ(drawn.steps.size(), 2U);
  EXPECT_EQ(drawn.steps[0].of(AcceleratorStage::conversion).bytes, 1000U * 12 + 600U * 8);
  EXPECT_EQ(drawn.steps[0].of(AcceleratorStage::conversion).cycles, 1000U / 4);
  EXPECT_EQ(drawn.steps[1].of(AcceleratorStage::conversion).bytes, 256U * 232);
  EXPECT_EQ(drawn.steps[1].of(AcceleratorStage::conversion).cycles, 256U * 2 / 4);
}

TEST(Accelerator, AnEmptyFrameIsWritten) {
  const Drawn<Gscore> drawn(draw_of(20, 20), {}, 0);
  EXPECT_EQ(drawn.unit->chunks.value(), 0U);
  EXPECT_EQ(drawn.sum(AcceleratorStage::rendering).bytes, 400U * 4);
  EXPECT_EQ(drawn.sum(AcceleratorStage::rendering).cycles, 0U);
}

TEST(Accelerator, SubTilesDivideTiles) {
  for (const auto& [tile, subtile] : {std::pair{"16", "12"}, {"16", "32"}, {"18", "6"}}) {
    try {
      Drawn<Gscore>(draw_of(16, 16), {{"tile_side_pixels", tile}, {"subtile_side_pixels", subtile}});
      FAIL() << "nothing thrown";
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("accelerator.subtile_side_pixels"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace vrpipe
