// That the frames of the microbenchmarks do what they claim, in numbers that are known beforehand.
#include <vrpipe/workloads/microbench.h>

#include <cmath>
#include <cstring>
#include <set>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include "support/simulate.h"

namespace vrpipe::microbench {
namespace {

RunResult run(const FramePointer& frame, Fidelity fidelity = Fidelity::functional) {
  fresh_simulation();
  return simulate(testing::request_of("baseline", fidelity), *frame);
}

TEST(TileBinningFrames, ARoundHasAQuadInEachTile) {
  for (const unsigned tiles : {1U, 17U, 33U}) {
    const FramePointer frame = rounds_over_tiles(tiles, 10, {});
    EXPECT_EQ(frame->splats(), 10 * tiles);
    const RunResult result = run(frame);
    EXPECT_EQ(result.counts.primitives, 10 * tiles);
    EXPECT_EQ(result.counts.quads_shaded, 10 * tiles);
    EXPECT_EQ(result.counts.fragments_blended, 40 * tiles);
    EXPECT_EQ(testing::statistic(result, "raster.screen_tile_pairs"), 10 * tiles);
  }
}

TEST(TileBinningFrames, OfSeveralGpcsTheFirstHasAllTiles) {
  const auto is_first = [](TileId tile) { return (tile.x + tile.y) % 4 == 0; };
  const FramePointer frame = rounds_over_tiles(40, 1, {4, is_first});
  std::set<std::pair<unsigned, unsigned>> tiles;
  for (std::uint32_t i = 0; i < frame->splats(); ++i) {
    const Splat& splat = frame->draw_call(0).splat(i);
    const TileId tile{static_cast<std::uint16_t>(splat.cx / 16), static_cast<std::uint16_t>(splat.cy / 16)};
    EXPECT_TRUE(is_first(tile));
    tiles.emplace(tile.x, tile.y);
  }
  EXPECT_EQ(tiles.size(), 40U);
}

TEST(TileBinningFrames, APairHasTwoQuadsWhateverIsCulledBetween) {
  for (const unsigned culled : {0U, 1U, 100U}) {
    const RunResult result = run(pair_with_gap(culled));
    EXPECT_EQ(result.counts.primitives, 2U);
    EXPECT_EQ(result.counts.quads_blended, 2U);
    EXPECT_EQ(testing::statistic(result, "vpo.culled_outside"), culled);
  }
  EXPECT_EQ(run(pair_at_distance(14)).counts.warps, 1U);
  EXPECT_EQ(run(pair_at_distance(16)).counts.warps, 2U);
}

TEST(RopThroughputFrames, LayersCoverTheirSide) {
  for (const bool blend : {true, false}) {
    const RunResult result = run(stacked_layers(64, 3, blend));
    EXPECT_EQ(result.counts.primitives, 3U);
    EXPECT_EQ(result.counts.quads_blended, 3U * 32 * 32);
    EXPECT_EQ(result.counts.fragments_blended, 3U * 64 * 64);
    const float alpha = result.framebuffer.color.pixel(63, 63)[3];
    EXPECT_NEAR(alpha, blend ? 1 - 0.98F * 0.98F * 0.98F : 0.02F, 1e-4F);
  }
}

TEST(QuadCoverageFrames, TheStencilLetsSoManyPixelsOfEachQuadPass) {
  for (const LivePixels pixels : {LivePixels::four, LivePixels::three, LivePixels::two_horizontal,
                                  LivePixels::two_vertical, LivePixels::two_diagonal, LivePixels::one}) {
    const RunResult result = run(layers_through_stencil(pixels, 32, 5));
    EXPECT_EQ(result.counts.quads_blended, 5U * 16 * 16) << live_of(pixels);
    EXPECT_EQ(result.counts.fragments_blended, 5U * 16 * 16 * live_of(pixels));
  }
  const RunResult diagonal = run(layers_through_stencil(LivePixels::two_diagonal, 32, 1));
  EXPECT_EQ(diagonal.framebuffer.color.pixel(4, 4)[3] > 0, diagonal.framebuffer.color.pixel(5, 5)[3] > 0);
  EXPECT_NE(diagonal.framebuffer.color.pixel(4, 4)[3] > 0, diagonal.framebuffer.color.pixel(5, 4)[3] > 0);
}

TEST(QuadCoverageFrames, ShapesHaveTheQuadsThatTheySay) {
  for (const Shape& shape : shapes()) {
    const RunResult result = run(scattered(shape, 20));
    EXPECT_EQ(result.counts.quads_blended, 20 * shape.quads()) << shape.name;
    EXPECT_EQ(result.counts.fragments_blended, 20 * shape.width * shape.height) << shape.name;
    EXPECT_EQ(shape.quads() * shape.live_per_quad(), shape.width * shape.height) << shape.name;
  }
}

TEST(CropCacheFrames, ARectangleOfEachTileInTurn) {
  const FramePointer frame = rectangles_in_turn(5, 3, 8, 16, true, {});
  const RunResult result = run(frame);
  EXPECT_EQ(result.counts.quads_blended, 5U * 3 * 32);
  for (unsigned i = 0; i < 15; ++i) {
    EXPECT_EQ(frame->draw_call(0).splat(i).cx, static_cast<float>(16 * (i % 5) + 4));
  }
}

TEST(BlendOrderFrames, TheSequentialReferenceIsTheImageBitForBit) {
  const FramePointer frame = overlapping_layers(24, 48);
  for (const auto& [rounding, name] :
       {std::pair{BlendRounding::rne, "rne"}, {BlendRounding::rtz, "rtz"}, {BlendRounding::measured, "measured"}}) {
    for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
      fresh_simulation();
      const RunResult result = simulate(testing::request_of("baseline", Fidelity::functional,
                                                            [&, name = name](RunRequest& r) {
                                                              r.format = format;
                                                              r.settings = {{"state", "blend_rounding", name}};
                                                            }),
                                        *frame);
      const std::array<float, 4> expected = blended_in_order(*frame, format, rounding);
      const std::array<float, 4> pixel = result.framebuffer.color.pixel(17, 30);
      EXPECT_EQ(std::memcmp(pixel.data(), expected.data(), sizeof expected), 0) << name << " " << name_of(format);
    }
  }
}

TEST(RopLawFrames, BoxesAreBlendedWrittenOrKilled) {
  const std::vector<Box> boxes{{0, 0, 4, 2}, {8, 6, 2, 2}};
  const RunResult blended = run(boxes_in_turn(boxes, 5, BoxesAre::blended));
  EXPECT_EQ(blended.counts.quads_blended, 5U * 3);
  EXPECT_NEAR(blended.framebuffer.color.pixel(9, 7)[3], 1 - std::pow(0.98F, 5), 2e-3F);
  EXPECT_EQ(run(boxes_in_turn(boxes, 5, BoxesAre::unchanged)).framebuffer.color.pixel(0, 0)[3], 1);
  EXPECT_NEAR(run(boxes_in_turn(boxes, 5, BoxesAre::written)).framebuffer.color.pixel(0, 0)[3], 0.02F, 1e-4F);
  EXPECT_EQ(run(boxes_in_turn(boxes, 5, BoxesAre::killed)).counts.quads_depth_stencil_failed, 5U * 3);
  const RunResult stencil = run(boxes_in_turn(boxes, 5, BoxesAre::stencil_written));
  EXPECT_EQ(stencil.counts.quads_shaded, 0U);
  const DepthStencilSurface& surface = stencil.framebuffer.depth_stencil;
  EXPECT_EQ(surface.quad(surface.grid().place({0, 0}, 8 * 3 + 4)).stencil[3], 5U);
}

TEST(RopLawFrames, StripsAndQuadsOfTilesAreInTilesOfTheirOwn) {
  for (const auto& [width, height, tiles] : {std::tuple{16U, 2U, 1U}, {64U, 2U, 4U}, {2U, 64U, 4U}}) {
    const RunResult result = run(strips(width, height, 96, 2, BoxesAre::blended));
    EXPECT_EQ(result.counts.quads_blended, 2U * 96 * width * height / 4);
    EXPECT_EQ(testing::statistic(result, "raster.screen_tile_pairs"), 2U * 96 * tiles);
    EXPECT_NEAR(result.framebuffer.color.pixel(width - 1, height - 1)[3], 1 - 0.98F * 0.98F, 1e-3F)
        << "each once a round";
  }
  const FramePointer frame = boxes_of_tiles({{0, 0, 2, 2}, {4, 2, 2, 2}}, 40, 3, BoxesAre::blended, {});
  ASSERT_EQ(frame->splats(), 3U * 40 * 2);
  EXPECT_EQ(frame->draw_call(0).splat(1).cx, 5);
  EXPECT_EQ(frame->draw_call(0).splat(2).cx, 17) << "then the next tile";
}

TEST(RopLawFrames, SplatsInASquareHaveTheWarpsThatWereCounted) {
  // rmhot.json: 4x4 in 160x160, and anywhere.
  const auto warps = [](unsigned region) {
    fresh_simulation();
    return simulate(testing::request_of("baseline", Fidelity::functional,
                                        [](RunRequest& request) { request.platform = &platform_named("gh100-gpc"); }),
                    *equal_splats(4, 4, 0.02F, 40000, region, SplatsAre::blended))
        .counts.warps;
  };
  EXPECT_NEAR(static_cast<double>(warps(160)), 151263, 15);
  EXPECT_NEAR(static_cast<double>(warps(1024)), 167226, 15);
}

TEST(FrontEndFrames, NothingIsShaded) {
  const RunResult culled = run(small_primitives(Small::culled, 100));
  EXPECT_EQ(testing::statistic(culled, "vpo.culled_outside"), 100U);
  const RunResult rectangles = run(small_primitives(Small::rectangle, 100));
  EXPECT_EQ(rectangles.counts.primitives, 100U);
  EXPECT_EQ(rectangles.counts.quads_depth_stencil_failed, 100U);
  const RunResult splats = run(small_primitives(Small::two_triangles, 100));
  EXPECT_EQ(splats.counts.primitives, 200U);
  EXPECT_EQ(splats.counts.quads_shaded, 0U);
  EXPECT_EQ(splats.counts.fragments_depth_stencil_failed, 400U);
}

TEST(KillRateFrames, EachIsKilledWhereItSays) {
  constexpr unsigned quads = 16 * 32 * 32;
  const RunResult stencil = run(killed_rectangles(KilledBy::stencil, 64, 16, 256));
  EXPECT_EQ(stencil.counts.quads_depth_stencil_failed, quads);
  EXPECT_EQ(testing::statistic(stencil, "raster.screen_tile_pairs"), 16U * 16);
  const RunResult depth = run(killed_rectangles(KilledBy::depth, 64, 16, 256));
  EXPECT_EQ(depth.counts.quads_depth_stencil_failed, quads);
  EXPECT_EQ(testing::statistic(depth, "raster.hi_z_culled"), 0U);
  const RunResult hi_z = run(killed_rectangles(KilledBy::hi_z, 64, 16, 256));
  EXPECT_EQ(hi_z.counts.quads_rasterized, 0U);
  EXPECT_EQ(testing::statistic(hi_z, "raster.hi_z_culled"), 16U * 64);
  const RunResult shader = run(killed_rectangles(KilledBy::shader, 64, 16, 256));
  EXPECT_EQ(shader.counts.quads_pruned, quads);
  const RunResult across = run(killed_rectangles(KilledBy::stencil, 16, 256, 256, 8));
  EXPECT_EQ(testing::statistic(across, "raster.screen_tile_pairs"), 256U * 4);
}

}  // namespace
}  // namespace vrpipe::microbench
