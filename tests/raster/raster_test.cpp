#include "raster/raster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "support/builders.h"
#include "support/coverage.h"

namespace vrpipe {
namespace {

using testing::context_of;
using testing::Coverage;
using testing::draw_of;
using testing::flat_box;
using testing::rasterize;

RenderContext unpadded(const Draw& draw) {
  RenderContext context = context_of(draw);
  testing::change_state(context, [&](DrawState& drawn) { drawn.obb_padding = 0; });
  return context;
}

Coverage cover(const Draw& draw) { return rasterize(unpadded(draw)); }

void expect_all_once(const Coverage& coverage, const std::string& what) {
  const auto wrong =
      std::count_if(coverage.times.begin(), coverage.times.end(), [](unsigned times) { return times != 1; });
  EXPECT_EQ(wrong, 0) << what;
}

Draw triangles_of(std::uint32_t width, std::uint32_t height, std::vector<ScreenTriangle> triangles) {
  Draw draw = draw_of(width, height, std::vector<Splat>(triangles.size()));
  draw.triangles = std::move(triangles);
  return draw;
}

// case R01
TEST(TileRasterizer, ABoxFarLargerThanTheScreenCoversEverySampleOnce) {
  for (const float half : {100.0F, 128.0F, 181.0F, 1000.0F, 32700.0F}) {
    for (const float angle : {0.0F, 0.4F, 0.785398F}) {
      const float c = std::cos(angle) * half;
      const float s = std::sin(angle) * half;
      const Draw draw = draw_of(64, 64, {Splat{32.3F, 31.9F, c, s, -s, c, 3, 0, 1, 1, 1, 1}});
      expect_all_once(cover(draw), std::to_string(half) + " at " + std::to_string(angle));
    }
  }
}

// case R02
TEST(TileRasterizer, ABoxBeyondTheGuardBandCoversEverySampleOnce) {
  for (const float half : {32769.0F, 40000.0F, 1e9F, 1e20F, std::numeric_limits<float>::max()}) {
    const Draw draw = draw_of(64, 64, {Splat{32, 32, half, 0, 0, half, 3, 0, 1, 1, 1, 1}});
    expect_all_once(cover(draw), std::to_string(half));
  }
}

// case R02
TEST(TileRasterizer, AnEdgeOfABoxBeyondTheGuardBandStaysWhereItIs) {
  // The right edge crosses the screen, the far corners are 80000 pixels away; so for each side and turned by 90 degrees.
  for (const float angle : {0.1F, 0.5F, 1.0F}) {
    const float c = std::cos(angle);
    const float s = std::sin(angle);
    constexpr float half = 40000;
    const float cx = 31.7F - c * half;
    const float cy = 32.2F - s * half;
    const Draw draw = draw_of(64, 64, {Splat{cx, cy, c * half, s * half, -s * half, c * half, 3, 0, 1, 1, 1, 1}});
    const Coverage coverage = cover(draw);
    const double length = std::hypot(static_cast<double>(c * half), static_cast<double>(s * half));
    for (std::uint32_t y = 0; y < 64; ++y) {
      for (std::uint32_t x = 0; x < 64; ++x) {
        const double along = ((x + 0.5 - static_cast<double>(cx)) * static_cast<double>(c * half) +
                              (y + 0.5 - static_cast<double>(cy)) * static_cast<double>(s * half)) /
                             length;
        if (std::fabs(along - length) < 0.01) continue;
        EXPECT_EQ(coverage.at(x, y), along < length ? 1U : 0U) << x << "," << y << " at " << angle;
      }
    }
  }
}

TEST(TileRasterizer, AFilledRectangleCoversTheSamplesFromItsLeftAndTopEdgeOn) {
  for (unsigned i = 0; i < 200; ++i) {
    const auto at = [&](unsigned k) { return std::round(testing::uniform(17, 8 * i + k, -6, 40) * 4) / 4; };
    const float x0 = at(0), y0 = at(1);
    const float x1 = x0 + std::fabs(at(2)), y1 = y0 + std::fabs(at(3));
    const Draw draw = draw_of(48, 32, {flat_box(x0, y0, x1, y1, 0.5F)});
    RenderContext context = unpadded(draw);
    testing::change_state(context, [](DrawState& state) { state.splat_extent = SplatExtent::fill_rectangle; });
    const Coverage coverage = rasterize(context);
    std::uint64_t quads = 0;
    for (std::uint32_t y = 0; y < 32; ++y) {
      for (std::uint32_t x = 0; x < 48; ++x) {
        const float sx = static_cast<float>(x) + 0.5F;
        const float sy = static_cast<float>(y) + 0.5F;
        ASSERT_EQ(coverage.at(x, y), x0 <= sx && sx < x1 && y0 <= sy && sy < y1 ? 1U : 0U)
            << i << ": " << x << "," << y;
        if (x % 2 == 0 && y % 2 == 0) {
          const bool any =
              coverage.at(x, y) + coverage.at(x + 1, y) + coverage.at(x, y + 1) + coverage.at(x + 1, y + 1);
          quads += any ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(coverage.quads, quads);
  }
}

TEST(TileRasterizer, AFilledRectangleOfTwoByTwoIsOneQuad) {
  const Draw draw = draw_of(32, 32, {flat_box(4, 6, 6, 8, 0.5F)});
  RenderContext context = context_of(draw);
  testing::change_state(context, [](DrawState& state) { state.splat_extent = SplatExtent::fill_rectangle; });
  const Coverage coverage = rasterize(context);
  EXPECT_EQ(coverage.quads, 1U);
  EXPECT_EQ(coverage.fragments, 4U);
}

// case R03
TEST(TileRasterizer, QuadsOfARasterTileComeByRowsOrByItsHalves) {
  const Draw draw = draw_of(16, 16, {flat_box(0, 0, 16, 16, 0.5F)});
  const RenderContext context = unpadded(draw);
  for (const char* by_halves : {"off", "on"}) {
    TileRasterizer::Parameters parameters;
    parameters.set("raster", "half_tile_order", by_halves);
    TileRasterizer raster(parameters, context);
    const PrimitiveAssembly::Parameters vpo_parameters;
    PrimitiveAssembly vpo(vpo_parameters, context);
    std::array<Primitive, 2> primitives;
    std::set<unsigned> positions;
    const unsigned count = vpo.assemble(0, 0, primitives);
    for (unsigned triangle = 0; triangle < count; ++triangle) {
      raster.begin(primitives[triangle], primitives[triangle].bounds);
      QuadBeat tile;
      unsigned tests = 0;
      bool new_tile = false;
      while (raster.next(tile, tests, new_tile)) {
        unsigned last = 0;
        for (unsigned i = 0; i < tile.count; ++i) {
          const unsigned position = tile.quads[i].position;
          positions.insert(position);
          const unsigned half = by_halves == std::string("on") ? position / 2 % 2 : 0;
          const unsigned place = half * 1000 + position;
          EXPECT_TRUE(i == 0 || last < place) << by_halves << ' ' << position;
          last = place;
        }
      }
    }
    EXPECT_EQ(positions.size(), positions_per_tile);
  }
}

TEST(TileRasterizer, ASquareOnSampleCentresHasItsTopAndLeftSamplesOnly) {
  const Coverage coverage = cover(draw_of(16, 16, {flat_box(4.5F, 4.5F, 8.5F, 8.5F, 0.5F)}));
  EXPECT_EQ(coverage.fragments, 16U);
  for (std::uint32_t y = 0; y < 16; ++y) {
    for (std::uint32_t x = 0; x < 16; ++x) EXPECT_EQ(coverage.at(x, y), x >= 4 && x < 8 && y >= 4 && y < 8 ? 1U : 0U);
  }
}

// case R04
TEST(TileRasterizer, ADiagonalThroughSampleCentresGivesEachSampleToOneTriangle) {
  for (int i = 1; i < 40; ++i) {
    const auto size = static_cast<float>(i);
    const Coverage coverage = cover(draw_of(64, 64, {flat_box(2.5F, 3.5F, 2.5F + size, 3.5F + size, 0.5F)}));
    EXPECT_EQ(coverage.fragments, static_cast<std::uint64_t>(i) * static_cast<std::uint64_t>(i));
    EXPECT_EQ(*std::max_element(coverage.times.begin(), coverage.times.end()), 1U);
  }
}

// case R04
TEST(TileRasterizer, TheTwoTrianglesOfASplatNeverShareASample) {
  const Draw all = testing::random_draw(64, 64, 400, 11);
  for (const Splat& splat : all.splats) {
    const Coverage coverage = rasterize(context_of(draw_of(64, 64, {splat})));
    ASSERT_LE(*std::max_element(coverage.times.begin(), coverage.times.end()), 1U);
  }
}

// case R05
TEST(TileRasterizer, AbuttingBoxesTileThePlane) {
  Draw draw = draw_of(64, 64);
  const float cuts[] = {0, 7.3F, 7.5F, 20.25F, 41.123F, 64};
  for (unsigned i = 0; i < 5; ++i) {
    for (unsigned j = 0; j < 5; ++j) {
      // As pairs of explicit triangles, so that neighbours snap the very same vertices.
      const float x0 = cuts[i], x1 = cuts[i + 1], y0 = cuts[j], y1 = cuts[j + 1];
      draw.triangles.push_back({{x0, x1, x0}, {y0, y0, y1}});
      draw.triangles.push_back({{x1, x1, x0}, {y0, y1, y1}});
    }
  }
  draw.splats.resize(draw.triangles.size());
  expect_all_once(cover(draw), "tiling");
}

// case R05
TEST(TileRasterizer, AFanOfTrianglesAroundASampleCoversItOnce) {
  Draw draw = draw_of(32, 32);
  const double pi = std::acos(-1.0);
  for (int i = 0; i < 13; ++i) {
    const auto corner = [&](int k) {
      return std::pair{static_cast<float>(16.5 + 100 * std::cos(2 * pi * k / 13)),
                       static_cast<float>(16.5 + 100 * std::sin(2 * pi * k / 13))};
    };
    const auto [x0, y0] = corner(i);
    const auto [x1, y1] = corner((i + 1) % 13);
    draw.triangles.push_back({{16.5F, x0, x1}, {16.5F, y0, y1}});
  }
  draw.splats.resize(draw.triangles.size());
  expect_all_once(cover(draw), "fan");
}

// case R06
TEST(TileRasterizer, MovedByWholePixelsTheSameSamplesAreCovered) {
  for (const auto& [dx, dy] : {std::pair{64.0F, 128.0F}, {1.0F, 0.0F}, {0.0F, 3.0F}}) {
    Draw here = draw_of(256, 256);
    Draw there = draw_of(256, 256);
    for (std::uint64_t i = 0; i < 60; ++i) {
      ScreenTriangle triangle;
      ScreenTriangle moved;
      for (unsigned v = 0; v < 3; ++v) {
        // Multiples of 1/256, so that adding loses nothing.
        triangle.x[v] = std::floor(testing::uniform(i, v, 0, 100) * 256) / 256;
        triangle.y[v] = std::floor(testing::uniform(i, 9 + v, 0, 100) * 256) / 256;
        moved.x[v] = triangle.x[v] + dx;
        moved.y[v] = triangle.y[v] + dy;
      }
      here.triangles.push_back(triangle);
      there.triangles.push_back(moved);
    }
    here.splats.resize(60);
    there.splats.resize(60);
    const Coverage a = cover(here);
    const Coverage b = cover(there);
    const auto x0 = static_cast<std::uint32_t>(dx);
    const auto y0 = static_cast<std::uint32_t>(dy);
    for (std::uint32_t y = 0; y < 110; ++y) {
      for (std::uint32_t x = 0; x < 110; ++x) ASSERT_EQ(a.at(x, y), b.at(x + x0, y + y0));
    }
    EXPECT_EQ(a.fragments, b.fragments);
    if (x0 % 16 == 0 && y0 % 16 == 0) {
      EXPECT_EQ(a.quads, b.quads);
    }
  }
}

// case R07
TEST(TileRasterizer, ABoxOf0Point6PixelsHits36PercentOfItsPlaces) {
  constexpr unsigned places = 20'000;
  unsigned hits = 0;
  for (unsigned i = 0; i < places; ++i) {
    const float x = 8 + testing::uniform(21, 2ULL * i, 0, 1);
    const float y = 8 + testing::uniform(21, 2ULL * i + 1, 0, 1);
    hits += cover(draw_of(16, 16, {flat_box(x - 0.3F, y - 0.3F, x + 0.3F, y + 0.3F, 0.5F)})).fragments > 0;
  }
  const double expected = 0.36 * places;
  EXPECT_NEAR(hits, expected, 3.5 * std::sqrt(expected * 0.64) + 0.01 * expected);
}

// case R09
TEST(TileRasterizer, FewerSubpixelBitsMoveEdgesByLessThanAStep) {
  for (const unsigned bits : {4U, 8U, 12U}) {
    for (std::uint64_t i = 0; i < 60; ++i) {
      ScreenTriangle t;
      for (unsigned v = 0; v < 3; ++v) {
        t.x[v] = testing::uniform(i, 20 + v, 0, 64);
        t.y[v] = testing::uniform(i, 30 + v, 0, 64);
      }
      const Draw draw = triangles_of(64, 64, {t});
      RenderContext context = unpadded(draw);
      context.precision.subpixel_bits = bits;
      const Coverage coverage = rasterize(context);
      for (std::uint32_t y = 0; y < 64; ++y) {
        for (std::uint32_t x = 0; x < 64; ++x) {
          // Signed distance to the nearest edge of the unsnapped triangle, in double.
          double inside = HUGE_VAL;
          double area = 0;
          for (unsigned v = 0; v < 3; ++v) {
            const unsigned w = (v + 1) % 3;
            area += static_cast<double>(t.x[v]) * static_cast<double>(t.y[w]) -
                    static_cast<double>(t.x[w]) * static_cast<double>(t.y[v]);
          }
          for (unsigned v = 0; v < 3; ++v) {
            const unsigned w = (v + 1) % 3;
            const double ex = static_cast<double>(t.x[w]) - static_cast<double>(t.x[v]);
            const double ey = static_cast<double>(t.y[w]) - static_cast<double>(t.y[v]);
            const double d =
                (ex * (y + 0.5 - static_cast<double>(t.y[v])) - ey * (x + 0.5 - static_cast<double>(t.x[v]))) /
                std::hypot(ex, ey);
            inside = std::fmin(inside, area > 0 ? d : -d);
          }
          if (std::fabs(inside) <= 1.5 / (1 << bits)) continue;
          // Far outside one edge may still be near another's extension: only clear cases count.
          ASSERT_EQ(coverage.at(x, y), inside > 0 ? 1U : 0U) << bits << " bits, triangle " << i;
        }
      }
    }
  }
}

// case R10
TEST(TileRasterizer, AtTheImagesEdgeThereIsNoSampleOutside) {
  for (const std::uint32_t width : {1U, 2U, 15U, 16U, 17U, 63U, 64U, 65U}) {
    for (const std::uint32_t height : {1U, 2U, 15U, 16U, 17U, 65U}) {
      const Draw draw = testing::random_draw(width, height, 30, width * 100 + height);
      const RenderContext context = context_of(draw);
      const Coverage coverage = rasterize(context);  // .at() throws outside
      const Coverage exact = testing::cover_exactly(context);
      ASSERT_EQ(coverage.times, exact.times) << width << "x" << height;
      ASSERT_EQ(coverage.quads, exact.quads) << width << "x" << height;
    }
  }
}

// case R10
TEST(TileRasterizer, APaperSizedImageIsCoveredToItsLastTile) {
  const Coverage coverage = cover(draw_of(1552, 1040, {Splat{776, 520, 900, 0, 0, 700, 3, 0, 1, 1, 1, 1}}));
  expect_all_once(coverage, "1552x1040");
}

// case R11
TEST(TileRasterizer, AnImageOfOnePixelIsOneQuadWithOneSample) {
  const Coverage coverage = cover(draw_of(1, 1, {Splat{0.3F, 0.6F, 5, 0, 0, 5, 3, 0, 1, 1, 1, 1}}));
  EXPECT_EQ(coverage.quads, 1U);
  EXPECT_EQ(coverage.fragments, 1U);
}

// case R12
TEST(TileRasterizer, TheLastPixelOfTheLargestImageIsReached) {
  const Draw draw = draw_of(16384, 16384, {flat_box(16383.1F, 16383.1F, 16383.9F, 16383.9F, 0.5F)});
  const RenderContext context = unpadded(draw);
  const PrimitiveAssembly::Parameters vpo_parameters;
  const TileRasterizer::Parameters raster_parameters;
  PrimitiveAssembly vpo(vpo_parameters, context);
  TileRasterizer raster(raster_parameters, context);
  std::array<Primitive, 2> primitives;
  const unsigned count = vpo.assemble(0, 0, primitives);
  QuadBeat beat;
  unsigned tests = 0;
  bool new_screen_tile = false;
  for (unsigned i = 0; i < count; ++i) {
    raster.begin(primitives[i], primitives[i].bounds);
    while (raster.next(beat, tests, new_screen_tile)) {
      EXPECT_EQ(beat.tile, (TileId{1023, 1023}));
      EXPECT_EQ(beat.quads[0].position, 63);
      EXPECT_EQ(beat.quads[0].coverage, 0b1000);
    }
  }
  EXPECT_EQ(raster.fragments_rasterized.value(), 1U);
}

// case R13
TEST(TileRasterizer, ThinDiagonalsThroughTileCornersAreCoveredExactly) {
  std::vector<ScreenTriangle> slivers;
  for (int k = 0; k < 16; ++k) {
    const float x = static_cast<float>(k * 8);
    slivers.push_back({{x, x + 130, x + 130.3F}, {0, 130, 130}});
    slivers.push_back({{x, x - 130, x - 129.7F}, {0, 130, 130}});
    slivers.push_back({{0, 128, 128}, {x, x + 0.02F, x + 0.6F}});
    slivers.push_back({{x - 0.01F, x + 0.01F, x}, {0, 0, 128}});
  }
  for (const ScreenTriangle& sliver : slivers) {
    const Draw draw = triangles_of(128, 128, {sliver});
    const RenderContext context = unpadded(draw);
    ASSERT_EQ(rasterize(context).times, testing::cover_exactly(context).times);
  }
}

// case R13
TEST(TileRasterizer, RandomTrianglesOfEverySizeAreCoveredExactly) {
  for (std::uint64_t i = 0; i < 400; ++i) {
    const float spread = i % 4 == 0 ? 20.0F : i % 4 == 1 ? 200.0F : i % 4 == 2 ? 3000.0F : 32000.0F;
    ScreenTriangle t;
    for (unsigned v = 0; v < 3; ++v) {
      t.x[v] = 32 + testing::uniform(i, 40 + v, -spread, spread);
      t.y[v] = 32 + testing::uniform(i, 50 + v, -spread, spread);
      if (i % 3 == 0) {  // vertices on samples
        t.x[v] = std::floor(t.x[v]) + 0.5F;
        t.y[v] = std::floor(t.y[v]) + 0.5F;
      }
    }
    const Draw draw = triangles_of(64, 64, {t});
    for (const unsigned bits : {4U, 8U, 12U}) {
      RenderContext context = unpadded(draw);
      context.precision.subpixel_bits = bits;
      const Coverage got = rasterize(context);
      const Coverage want = testing::cover_exactly(context);
      ASSERT_EQ(got.times, want.times) << i << " at " << bits << " bits";
      ASSERT_EQ(got.quads, want.quads);
    }
  }
}

// case R01
TEST(TileRasterizer, EdgesJustShortOfNeeding64BitsAreCoveredExactlyAndWithoutOverflow) {
  for (int i = 0; i < 150; ++i) {
    const float s = 300.0F + 8.0F * static_cast<float>(i);
    const float turn = 0.17F * static_cast<float>(i);
    ScreenTriangle t;
    for (unsigned v = 0; v < 3; ++v) {
      t.x[v] = 32 + s * std::cos(turn + 2.0944F * static_cast<float>(v));
      t.y[v] = 32 + s * std::sin(turn + 2.0944F * static_cast<float>(v));
    }
    for (const float shift : {0.0F, 0.5F * s - 20.0F}) {  // the screen within, and an edge across it
      ScreenTriangle moved = t;
      for (float& x : moved.x) x += shift;
      const Draw draw = triangles_of(64, 64, {moved});
      ASSERT_EQ(rasterize(unpadded(draw)).times, testing::cover_exactly(unpadded(draw)).times) << s;
    }
  }
}

TEST(TileRasterizer, AClipCutsAtItsPixelsAndClipsThatTileTheScreenLoseNothing) {
  const Draw draw = testing::random_draw(128, 128, 60, 5);
  const RenderContext context = context_of(draw);
  Coverage sum = rasterize(context, {0, 0, 0, 0});
  EXPECT_EQ(sum.fragments, 0U);
  for (std::int32_t y = 0; y < 128; y += 64) {
    for (std::int32_t x = 0; x < 128; x += 64) {
      const Coverage part = rasterize(context, {x, y, x + 64, y + 64});
      for (std::size_t i = 0; i < sum.times.size(); ++i) sum.times[i] += part.times[i];
    }
  }
  EXPECT_EQ(sum.times, rasterize(context).times);
}

TEST(TileRasterizer, GpcsShareTheSamplesOutAmongThem) {
  const Draw draw = testing::random_draw(128, 128, 60, 6);
  RenderContext context = context_of(draw);
  const Coverage whole = rasterize(context);
  std::vector<unsigned> sum(whole.times.size());
  for (unsigned gpc = 0; gpc < 4; ++gpc) {
    context.placement = testing::placement_of(4, gpc, 128, 128);
    const Coverage part = rasterize(context);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += part.times[i];
      const TileId tile{static_cast<std::uint16_t>(i % 128 / 16), static_cast<std::uint16_t>(i / 128 / 16)};
      if (part.times[i] > 0) {
        ASSERT_EQ((tile.x + tile.y) % 4U, gpc);
      }
    }
  }
  EXPECT_EQ(sum, whole.times);
}

// case O03
TEST(TileRasterizer, ABoxWithoutExtentCoversASampleOnItsCentreWhenPaddedAndNothingElse) {
  for (const float x : {3.5F, 3.52F}) {
    const Draw draw = draw_of(16, 16, {Splat{x, 3.5F, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1.0F / 255.0F}});
    EXPECT_EQ(rasterize(context_of(draw)).fragments, x == 3.5F ? 1U : 0U);
    EXPECT_EQ(rasterize(unpadded(draw)).fragments, 0U);
  }
}

// case O04
TEST(TileRasterizer, ABoxJustAboveOne255thCoversASampleOnItsCentre) {
  const Draw draw = draw_of(16, 16, {testing::round_splat(3.5F, 3.5F, 0.55F, std::nextafter(1.0F / 255.0F, 1.0F))});
  EXPECT_EQ(rasterize(context_of(draw)).fragments, 1U);
}

// case O07
TEST(TileRasterizer, BoxesThinnerThanASubpixelCoverNoSampleTwice) {
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const float angle = testing::uniform(i, 60, 0, 6.2F);
    const float c = std::cos(angle) * 20;
    const float s = std::sin(angle) * 20;
    const float thin = testing::uniform(i, 61, 0, 0.5F / 256) / 20;
    const Draw draw = draw_of(64, 64,
                              {Splat{testing::uniform(i, 62, 10, 50), testing::uniform(i, 63, 10, 50), c, s, -s * thin,
                                     c * thin, 3, 0, 1, 1, 1, 1}});
    for (const RenderContext& context : {context_of(draw), unpadded(draw)}) {
      const Coverage coverage = rasterize(context);
      ASSERT_LE(*std::max_element(coverage.times.begin(), coverage.times.end()), 1U);
      ASSERT_EQ(coverage.times, testing::cover_exactly(context).times);
    }
  }
}

// case O10
TEST(TileRasterizer, WithPaddingNoSampleInsideABoxIsLost) {
  const Draw all = testing::random_draw(64, 64, 500, 77);
  for (const Splat& splat : all.splats) {
    if (splat.r == 0) continue;
    const Draw draw = draw_of(64, 64, {splat});
    const Coverage coverage = rasterize(context_of(draw));
    for (std::uint32_t y = 0; y < 64; ++y) {
      for (std::uint32_t x = 0; x < 64; ++x) {
        const double dx = x + 0.5 - static_cast<double>(splat.cx);
        const double dy = y + 0.5 - static_cast<double>(splat.cy);
        const double a = static_cast<double>(splat.ax) * static_cast<double>(splat.ax) +
                         static_cast<double>(splat.ay) * static_cast<double>(splat.ay);
        const double b = static_cast<double>(splat.bx) * static_cast<double>(splat.bx) +
                         static_cast<double>(splat.by) * static_cast<double>(splat.by);
        const double u = (dx * static_cast<double>(splat.ax) + dy * static_cast<double>(splat.ay)) / a;
        const double v = (dx * static_cast<double>(splat.bx) + dy * static_cast<double>(splat.by)) / b;
        if (std::fabs(u) <= 1 && std::fabs(v) <= 1) {
          ASSERT_EQ(coverage.at(x, y), 1U);
        }
      }
    }
  }
}

// case Q07
TEST(TileRasterizer, AnAlignedEvenRectangleHasOnlyFullQuadsButOnItsDiagonal) {
  Draw draw = draw_of(64, 64, std::vector<Splat>(1));
  // One triangle twice the rectangle covers it without a diagonal.
  draw.triangles = {{{8, 8 + 32, 8}, {8, 8, 8 + 32}}};
  const RenderContext context = unpadded(draw);
  const Coverage coverage = rasterize(context, {8, 8, 24, 24});
  EXPECT_EQ(coverage.fragments, 256U);
  EXPECT_EQ(coverage.quads, 64U);
  const Coverage random = rasterize(context_of(testing::random_draw(64, 64, 100, 3)));
  EXPECT_GE(4 * random.quads, random.fragments);
}

TEST(TileRasterizer, TheOneQuadTriangleOfTheMicrobenchmarksIsOneFullQuad) {
  const Coverage coverage = cover(triangles_of(64, 64, {testing::one_quad_triangle(6, 8)}));
  EXPECT_EQ(coverage.quads, 1U);
  EXPECT_EQ(coverage.fragments, 4U);
  EXPECT_EQ(coverage.at(6, 8), 1U);
  EXPECT_EQ(coverage.at(7, 9), 1U);
}

}  // namespace
}  // namespace vrpipe
