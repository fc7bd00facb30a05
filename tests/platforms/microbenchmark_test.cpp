// Facts of the paper and of a real GPU that whole GPUs have to show.

#include <gtest/gtest.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::request_of;
using testing::run;

/// One-quad rectangles, one primitive each, in turn over screen tiles 32 pixels apart.
Draw rectangles_over_tiles(unsigned rectangles, unsigned tiles) {
  Draw draw = testing::draw_of(32 * 8, 32 * ((tiles + 7) / 8));
  for (unsigned i = 0; i < rectangles; ++i) {
    const unsigned tile = i % tiles;
    draw.triangles.push_back(
        testing::one_quad_triangle(static_cast<float>(tile % 8 * 32 + 4), static_cast<float>(tile / 8 * 32 + 6)));
    draw.splats.push_back(testing::flat_box(0, 0, 1, 1, 0.1F));
  }
  return draw;
}

// case T01
TEST(TileBinning, RectanglesOver32TilesShareWarps) {
  const RunResult result = run(request_of("baseline"), rectangles_over_tiles(320, 32));
  EXPECT_EQ(result.counts.quads_shaded, 320U);
  EXPECT_EQ(result.counts.fragments_shaded, 1280U);
  EXPECT_GE(result.counts.warps, 64U);
  EXPECT_LE(result.counts.warps, 67U);
}

// case T01
TEST(TileBinning, RectanglesOver33TilesGetAWarpEach) {
  const RunResult result = run(request_of("baseline"), rectangles_over_tiles(330, 33));
  EXPECT_EQ(result.counts.warps, 330U);
}

// case T01
TEST(TileBinning, TheBinAllocatedFirstGoesHoweverRecentlyUsed) {
  // 32 tiles, tile 0 again, tile 32, tile 0 once more: tile 0 went with two quads, so it comes a second time.
  Draw draw = testing::draw_of(32 * 8, 32 * 5);
  std::vector<unsigned> order;
  for (unsigned tile = 0; tile < 32; ++tile) order.push_back(tile);
  order.insert(order.end(), {0, 32, 0});
  for (const unsigned tile : order) {
    draw.triangles.push_back(
        testing::one_quad_triangle(static_cast<float>(tile % 8 * 32 + 4), static_cast<float>(tile / 8 * 32 + 6)));
    draw.splats.push_back(testing::flat_box(0, 0, 1, 1, 0.1F));
  }
  const RunResult result = run(request_of("baseline", Fidelity::functional), draw);
  EXPECT_EQ(result.counts.warps, 34U) << "least recently used would have given 33";
  EXPECT_EQ(testing::statistic(result, "tc.flushes_evicted"), 2U);
}

/// Layers of full coverage, one primitive each, over an image that the colour cache holds.
Draw layers(unsigned count) {
  Draw draw = testing::draw_of(32, 32, std::vector<Splat>(count, testing::flat_box(0, 0, 1, 1, 0.01F)));
  draw.triangles.assign(count, {{-1, 80, -1}, {-1, -1, 80}});
  return draw;
}

TEST(RopThroughput, IsTwoQuadsACycleOfRgba16fFourOfRgba8AndOneOfRgba32f) {
  const std::pair<ColorFormat, double> formats[] = {{ColorFormat::rgba8, 4},
                                                    {ColorFormat::rgba16f, 2},
                                                    {ColorFormat::rgba32f, 1}};
  const Draw draw = layers(300);
  for (const auto& [format, rate] : formats) {
    const RunResult result =
        run(request_of("baseline", Fidelity::cycle, [&, f = format](RunRequest& r) { r.format = f; }), draw);
    ASSERT_EQ(result.counts.quads_blended, 300U * 256);
    const double cycles = static_cast<double>(*result.cycles);
    const double per_cycle = static_cast<double>(result.counts.quads_blended) / cycles;
    EXPECT_LE(per_cycle, rate) << name_of(format);
    EXPECT_GE(per_cycle, 0.95 * rate) << name_of(format);
  }
}

TEST(RopThroughput, PartialQuadsCostAsMuchAsFullOnes) {
  // Long wedges over two rows of samples, and over one: as many quads, half the fragments.
  double per_quad[2];
  for (const bool full : {false, true}) {
    Draw draw = testing::draw_of(32, 32);
    for (unsigned i = 0; i < 4000; ++i) {
      const auto y = static_cast<float>(i % 16 * 2);
      const float height = full ? 1.6F : 0.6F;
      draw.triangles.push_back({{-1, -1, 4000}, {y + 0.2F, y + 0.2F + height, y + 0.2F + height / 2}});
      draw.splats.push_back(testing::flat_box(0, 0, 1, 1, 0.01F));
    }
    const RunResult result =
        run(request_of("baseline", Fidelity::cycle, [](RunRequest& r) { r.format = ColorFormat::rgba32f; }), draw);
    ASSERT_EQ(result.counts.quads_blended, 4000U * 16);
    ASSERT_EQ(result.counts.fragments_blended, 4000U * 16 * (full ? 4 : 2));
    per_quad[full] = static_cast<double>(*result.cycles) / static_cast<double>(result.counts.quads_blended);
  }
  EXPECT_NEAR(per_quad[0], per_quad[1], 0.01);
  EXPECT_NEAR(per_quad[1], 1.0, 0.03);
}

TEST(Storage, IsThatOfThePapersTable) {
  const StorageReport storage = quad_merging_storage(request_of("baseline"));
  EXPECT_EQ(storage.tgc_bytes, 24'832U);
  EXPECT_EQ(static_cast<double>(storage.tgc_bytes) / 1024, 24.25);
  EXPECT_EQ(storage.qru_bytes, 688U);
  EXPECT_NEAR(static_cast<double>(storage.tgc_bytes + storage.qru_bytes) / 1024, 24.92, 0.005);
}

TEST(Storage, FollowsTheConfiguredSizes) {
  const StorageReport half = quad_merging_storage(request_of("het+qm", Fidelity::cycle, [](RunRequest& r) {
    r.settings = {{"tgc", "bins", "64"}};
  }));
  EXPECT_EQ(half.tgc_bytes, 12'416U);
}

TEST(QuadMerging, HalvesTheBlendsOfAStackAndItsTime) {
  const Draw draw = layers(256);
  const RunResult baseline = run(request_of("baseline"), draw);
  const RunResult merged = run(request_of("qm"), draw);
  EXPECT_NEAR(static_cast<double>(merged.counts.quads_blended) / static_cast<double>(baseline.counts.quads_blended),
              0.5, 0.02);
  EXPECT_NEAR(static_cast<double>(*merged.cycles) / static_cast<double>(*baseline.cycles), 0.5, 0.1);
}

TEST(EarlyTermination, SavesTheTimeOfWhatLiesBehind) {
  Draw draw = testing::draw_of(64, 64, std::vector<Splat>(200, testing::flat_box(-4, -4, 70, 70, 0.5F)));
  const RunResult baseline = run(request_of("baseline"), draw);
  const RunResult het = run(request_of("het"), draw);
  EXPECT_LT(het.counts.fragments_blended * 2, baseline.counts.fragments_blended);
  EXPECT_LT(*het.cycles * 3, *baseline.cycles * 2);
}

}  // namespace
}  // namespace vrpipe
