#include <algorithm>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/testkit/bench.h>

#include "raster/raster_scene.h"

namespace vrpipe {
namespace {

using testing::marked;
using testing::quads_in;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class RasterUnitTest : public ::testing::Test, protected testing::RasterScene {};

TEST_F(RasterUnitTest, TheFirstQuadIsSeenTheSetUpLatencyAfterTheJob) {
  add_triangle(testing::one_quad_triangle(4, 4));
  Bench bench("raster", "tile-rasterizer", context);
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads");
  in.add(jobs()[0], 10);
  bench.run();
  ASSERT_EQ(out.records().size(), 1U);
  EXPECT_EQ(out.records()[0].cycle, 11U + 10) << "in hand at 11, latency 10";
}

TEST_F(RasterUnitTest, MakesItsFineTilesPerCycle) {
  add_full();
  for (const unsigned rate : {1U, 2U}) {
    Bench bench("raster", "tile-rasterizer", context,
                {{"fine_tiles_per_cycle", std::to_string(rate)},
                 {"quads_per_cycle", "16"},
                 {"coarse_tiles_per_cycle", "64"}});
    Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
    in.add(jobs()[0]);
    bench.run();
    // 256 raster tiles of 16 quads; 16 quads a cycle at most in either case.
    EXPECT_EQ(quads_in(out), 4096U);
    EXPECT_EQ(out.records().back().cycle - out.records().front().cycle + 1, 256U);
  }
}

TEST_F(RasterUnitTest, HandsOverItsQuadsPerCycle) {
  add_full();
  for (const unsigned rate : {1U, 4U, 8U, 16U}) {
    Bench bench("raster", "tile-rasterizer", context, {{"quads_per_cycle", std::to_string(rate)}});
    Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
    in.add(jobs()[0]);
    bench.run();
    EXPECT_EQ(quads_in(out), 4096U);
    EXPECT_EQ(out.records().back().cycle - out.records().front().cycle + 1, 4096U / rate);
    for (const auto& record : out.records()) EXPECT_LE(record.item.count, rate);
  }
}

TEST_F(RasterUnitTest, PrimitiveAndScreenTilePairsComeAtTheirInterval) {
  for (float x = 0; x < 128; x += 16) add_triangle(testing::one_quad_triangle(x + 4, 4));
  Bench bench("raster", "tile-rasterizer", context, {{"screen_tile_interval_cycles", "5"}});
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs", 16);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 16);
  for (const RasterJob& job : jobs()) in.add(job);
  bench.run();
  ASSERT_EQ(out.records().size(), 8U);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(out.records()[i].cycle, out.records()[0].cycle + 5 * i);
}

TEST_F(RasterUnitTest, SetUpsComeAtTheirInterval) {
  for (int i = 0; i < 8; ++i) add_triangle(testing::one_quad_triangle(4, 4));
  Bench bench("raster", "tile-rasterizer", context, {{"setup_interval_cycles", "7"}});
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs", 16);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 16);
  for (const RasterJob& job : jobs()) in.add(job);
  bench.run();
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(out.records()[i].cycle, out.records()[0].cycle + 7 * i);
}

TEST_F(RasterUnitTest, AnIntervalNeedNotBeOfWholeCycles) {
  for (float x = 0; x < 128; x += 16) add_triangle(testing::one_quad_triangle(x + 4, 4));
  for (const auto& [interval, half_cycles] : {std::pair{"2.5", 5U}, std::pair{"0.5", 1U}}) {
    for (const char* parameter : {"screen_tile_interval_cycles", "setup_interval_cycles"}) {
      // The other one, and what follows, in no one's way.
      const bool pairs = parameter[1] == 'c';
      Bench bench("raster", "tile-rasterizer", context,
                  {{pairs ? "setup_interval_cycles" : "screen_tile_interval_cycles", "0.001"},
                   {parameter, interval},
                   {"fine_tiles_per_cycle", "64"},
                   {"coarse_tiles_per_cycle", "1024"}});
      Source<RasterJob>& in = bench.source<RasterJob>("in_jobs", 16);
      Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 16);
      for (const RasterJob& job : jobs()) in.add(job);
      bench.run();
      ASSERT_EQ(out.records().size(), 8U);
      for (std::size_t i = 0; i < 8; ++i)
        EXPECT_EQ(out.records()[i].cycle, out.records()[0].cycle + half_cycles * i / 2) << parameter << " " << interval;
    }
  }
}

// case R07
TEST_F(RasterUnitTest, APrimitiveWithoutSamplesCostsItsCoarseTests) {
  // A sliver between samples whose bounds hold the whole diagonal: 256 raster tiles are tested.
  add_triangle({{0.7F, 128, 128}, {0.2F, 127.2F, 127.3F}});
  add_triangle(testing::one_quad_triangle(4, 4));
  for (const unsigned rate : {1U, 4U}) {
    Bench bench("raster", "tile-rasterizer", context, {{"coarse_tiles_per_cycle", std::to_string(rate)}});
    Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
    for (const RasterJob& job : jobs()) in.add(job);
    bench.run();
    ASSERT_FALSE(out.records().empty());
    EXPECT_GE(out.records().back().cycle, 256 / rate);
  }
}

TEST_F(RasterUnitTest, TheEndComesLast) {
  add_full();
  Bench bench("raster", "tile-rasterizer", context);
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 1);
  in.add(jobs()[0]);
  in.add(marked<RasterJob>());
  bench.run();
  EXPECT_TRUE(out.records().back().item.mark == Mark::end_of_frame);
  EXPECT_EQ(quads_in(out), 4096U);
  EXPECT_TRUE(bench.unit().idle());
}

TEST_F(RasterUnitTest, ABlockedReceiverStopsItUntilACycleAfterItTakes) {
  add_full();
  Bench bench("raster", "tile-rasterizer", context, {{"setup_latency_cycles", "1"}});
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 2);
  in.add(jobs()[0]);
  out.close(0, 100);
  bench.run();
  EXPECT_EQ(out.records()[0].cycle, 100U);
  EXPECT_EQ(out.records()[1].cycle, 100U);
  EXPECT_EQ(out.records()[2].cycle, 102U);
}

TEST_F(RasterUnitTest, QuadsAndTheirOrderAreTheSameUnderAnyStalls) {
  draw = testing::random_draw(128, 128, 40, 9);
  const std::vector<RasterJob> all = jobs();
  std::vector<std::uint64_t> expected;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Bench bench("raster", "tile-rasterizer", context);
    Source<RasterJob>& in = bench.source<RasterJob>("in_jobs", static_cast<unsigned>(1 + seed % 4));
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", static_cast<unsigned>(1 + seed % 3));
    for (const RasterJob& job : all) in.add(job);
    in.add(marked<RasterJob>());
    if (seed > 0) bench.stall_randomly(seed, 80);
    bench.run();
    std::vector<std::uint64_t> quads;
    for (const auto& record : out.records()) {
      for (unsigned i = 0; i < record.item.count; ++i) {
        const Quad& quad = record.item.quads[i];
        const std::uint64_t triangle = quad.triangle;
        const std::uint64_t x = record.item.tile.x;
        const std::uint64_t y = record.item.tile.y;
        const std::uint64_t position = quad.position;
        quads.push_back((std::uint64_t{quad.splat} << 32U) | (triangle << 28U) | (x << 20U) | (y << 12U) |
                        (position << 4U) | quad.coverage);
      }
    }
    if (seed == 0) expected = quads;
    ASSERT_EQ(quads, expected) << seed;
    ASSERT_TRUE(bench.unit().idle());
  }
  EXPECT_GT(expected.size(), 1000U);
}

}  // namespace
}  // namespace vrpipe
