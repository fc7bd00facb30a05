#include "binning/binning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/builders.h"
#include "support/splat_shapes.h"

namespace vrpipe {
namespace {

using testing::distance_to;
using testing::draw_of;
using testing::in_axes;
using testing::meets_square;
using testing::Point;
using testing::round_splat;
using testing::splat_at;

struct Binned {
  explicit Binned(const Draw& draw, const char* shape = "obb") : context(testing::context_of(draw)) {
    PairBinning::Parameters parameters;
    parameters.set("binning", "lists", shape);
    binning = std::make_unique<PairBinning>(parameters, context);
    lists = binning->make_lists();
    binning->count(lists);
  }
  std::vector<std::uint32_t> of(std::size_t tile) const {
    return {lists.of(tile), lists.of(tile) + lists.length(tile)};
  }
  bool has(std::size_t tile, std::uint32_t splat) const {
    const std::vector<std::uint32_t> all = of(tile);
    return std::find(all.begin(), all.end(), splat) != all.end();
  }
  RenderContext context;
  std::unique_ptr<PairBinning> binning;
  TileLists lists;
};

/// Of the samples of a tile's pixels, in an image of whole tiles.
std::array<Point, 4> corners_of_tile(std::size_t tile, std::size_t tiles_x) {
  const double x = 16.0 * static_cast<double>(tile % tiles_x) + 0.5;
  const double y = 16.0 * static_cast<double>(tile / tiles_x) + 0.5;
  return {Point{x, y}, {x + 15, y}, {x + 15, y + 15}, {x, y + 15}};
}

constexpr std::uint32_t width = 96, height = 80;
constexpr std::size_t tiles_x = 6, tiles = 30;

Draw large_splats() { return testing::large_splats(width, height, 400, 5); }

TEST(Binning, AnOrientedBoxIsListedWhereItMeetsTheSamplesOfATile) {
  const Draw draw = large_splats();
  const Binned binned(draw, "obb");
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    for (std::uint32_t splat = 0; splat < draw.splats.size(); ++splat) {
      const bool meets = meets_square(in_axes(draw.splats[splat], corners_of_tile(tile, tiles_x)));
      EXPECT_EQ(binned.has(tile, splat), meets) << tile << ' ' << splat;
    }
  }
}

TEST(Binning, AnEllipseIsListedWhereItMeetsTheSamplesOfATile) {
  const Draw draw = large_splats();
  const Binned binned(draw, "ellipse");
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    for (std::uint32_t splat = 0; splat < draw.splats.size(); ++splat) {
      const double distance = distance_to(in_axes(draw.splats[splat], corners_of_tile(tile, tiles_x)));
      EXPECT_EQ(binned.has(tile, splat), distance <= 1) << tile << ' ' << splat << ' ' << distance;
    }
  }
}

TEST(Binning, AnAxisAlignedBoxIsListedWhereItHasASample) {
  const Draw draw = testing::random_draw(width, height, 400, 7);
  const Binned binned(draw, "box");
  for (std::uint32_t number = 0; number < draw.splats.size(); ++number) {
    const Splat& splat = draw.splats[number];
    const double half_width = std::hypot(double{splat.ax}, double{splat.bx});
    const double half_height = std::hypot(double{splat.ay}, double{splat.by});
    std::vector<bool> expected(tiles, false);
    for (std::uint32_t y = 0; y < height; ++y) {
      for (std::uint32_t x = 0; x < width; ++x) {
        if (std::fabs(x + 0.5 - splat.cx) <= half_width && std::fabs(y + 0.5 - splat.cy) <= half_height)
          expected[y / 16 * tiles_x + x / 16] = true;
      }
    }
    for (std::size_t tile = 0; tile < tiles; ++tile) EXPECT_EQ(binned.has(tile, number), expected[tile]) << number;
  }
}

TEST(Binning, ThePublishedSquareIsThreeSigmasOfTheLongerAxisRoundedUp) {
  // Longer axis 4: a radius of 12 about (23.5, 39.5) in pixels whose samples are at whole numbers, upper edges excluded.
  const Binned binned(draw_of(width, height, {splat_at(24, 40, 1, 4, 0.3F, 0.02F)}), "three_sigma");
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    const std::size_t x = tile % tiles_x, y = tile / tiles_x;
    const bool expected = x * 16 <= 35 && x * 16 + 15 >= 11 && y * 16 <= 51 && y * 16 + 15 >= 27;
    EXPECT_EQ(binned.has(tile, 0), expected) << tile;
  }
}

TEST(Binning, EachShapeListsWhatTheTighterOnesList) {
  const Draw draw = testing::random_draw(width, height, 300, 9);
  const Binned box(draw, "box"), oriented(draw, "obb"), ellipse(draw, "ellipse");
  EXPECT_LT(ellipse.binning->pairs.value(), oriented.binning->pairs.value());
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    for (const std::uint32_t splat : ellipse.of(tile)) EXPECT_TRUE(oriented.has(tile, splat) && box.has(tile, splat));
  }
}

TEST(Binning, ListsAreInDrawOrder) {
  const Binned binned(testing::random_draw(width, height, 300, 11));
  std::size_t pairs = 0, empty = 0;
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    const std::vector<std::uint32_t> list = binned.of(tile);
    EXPECT_TRUE(std::is_sorted(list.begin(), list.end()));
    pairs += list.size();
    empty += list.empty() ? 1U : 0U;
  }
  EXPECT_EQ(binned.binning->pairs.value(), pairs);
  EXPECT_EQ(binned.binning->empty_tiles.value(), empty);
  EXPECT_EQ(binned.binning->list_lengths.count(), tiles);
}

TEST(Binning, WhatHasNoAreaOrIsNotFiniteIsInNoList) {
  Splat line = round_splat(24, 24, 3, 0.5F);
  line.bx = line.by = 0;
  Splat broken = round_splat(24, 24, 3, 0.5F);
  broken.cx = std::numeric_limits<float>::quiet_NaN();
  Splat faint = round_splat(24, 24, 3, 0.5F);
  faint.r = 0;
  for (const char* shape : {"three_sigma", "box", "obb", "ellipse"}) {
    const Binned binned(draw_of(48, 48, {line, broken, faint, round_splat(24, 24, 1, 0.5F)}), shape);
    EXPECT_EQ(binned.binning->splats_without_area.value(), 3U);
    EXPECT_EQ(binned.binning->splats_listed.value(), 1U);
    for (const std::uint32_t splat : binned.lists.splats) EXPECT_EQ(splat, 3U);
  }
}

TEST(Binning, SplatsFarOutsideOrFarLargerThanTheImageAreClipped) {
  for (const char* shape : {"three_sigma", "box", "obb", "ellipse"}) {
    const Binned binned(draw_of(50, 40,
                                {round_splat(1e9F, 0, 3, 0.5F), round_splat(0, -1e9F, 3, 0.5F),
                                 round_splat(20, 20, 1e6F, 0.5F)}),
                        shape);
    EXPECT_EQ(binned.lists.splats, std::vector<std::uint32_t>(12, 2U)) << shape;
  }
}

TEST(Binning, TheSortMovesPairsOncePerDigit) {
  // 12 bits of 2500 tiles and 32 of depth: six digits of 8, each of which reads and writes 12 bytes; keys read for the histogram.
  const Binned binned(draw_of(800, 800, {round_splat(400, 400, 20, 0.5F)}));
  const std::uint64_t pairs = binned.binning->pairs.value();
  const std::vector<KernelWork> kernels = binned.binning->kernels();
  ASSERT_EQ(kernels.size(), 5U);
  EXPECT_STREQ(kernels[3].name, "sort");
  EXPECT_EQ(kernels[3].items, pairs);
  EXPECT_EQ(kernels[3].bytes, 152 * pairs);
  EXPECT_DOUBLE_EQ(kernels[3].sm_cycles, 9.25 * static_cast<double>(pairs));
  EXPECT_DOUBLE_EQ(kernels[3].warp_instructions.value(), 4 * 0.71 * kernels[3].sm_cycles);
}

}  // namespace
}  // namespace vrpipe
