// RASTER at lt; what has one closed form at every fidelity is compared with cycle by it. At lt a raster
// tile goes in one piece, in the cycle of its last quad.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/slots/raster.h>

#include "raster/raster_scene.h"
#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::cycles_of;
using testing::marked;
using testing::quads_in;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class RasterTimedTest : public ::testing::TestWithParam<Fidelity>, protected testing::RasterScene {};

INSTANTIATE_TEST_SUITE_P(Fidelities, RasterTimedTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(RasterTimedTest, TheFirstQuadIsSeenTheSetUpLatencyAfterTheJob) {
  add_one_quad(4);
  for (const unsigned latency : {1U, 10U}) {
    Bench bench(GetParam(), "raster", "tile-rasterizer", context, {{"setup_latency_cycles", std::to_string(latency)}});
    Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads");
    in.add(jobs()[0], 10);
    bench.run();
    EXPECT_EQ(cycles_of(out), (std::vector<Cycle>{11 + latency})) << "in hand at 11";
  }
}

TEST_P(RasterTimedTest, HandsOverItsQuadsPerCycle) {
  add_full();
  for (const unsigned rate : {1U, 3U, 4U, 8U, 16U}) {
    Bench bench(GetParam(), "raster", "tile-rasterizer", context,
                {{"quads_per_cycle", std::to_string(rate)},
                 {"setup_latency_cycles", "10"},
                 {"coarse_tiles_per_cycle", "64"}});
    Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
    in.add(jobs()[0]);
    bench.run();
    EXPECT_EQ(quads_in(out), 4096U);
    EXPECT_EQ(out.records().back().last, (4096 + rate - 1) / rate + 10) << "from cycle 1 on, rate " << rate;
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), RasterWork::quads), 4096.0 / rate);
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), RasterWork::setup), 1);
  }
}

TEST_P(RasterTimedTest, MakesItsFineTilesPerCycle) {
  // Raster tiles of few quads each: a triangle a pixel high over 16 of them, in 8 screen tiles, one of which begins in a
  // cycle.
  add_triangle({{-1, 200, -1}, {3.9F, 4.6F, 5.3F}});
  for (const unsigned rate : {1U, 2U}) {
    Bench bench(GetParam(), "raster", "tile-rasterizer", context,
                {{"fine_tiles_per_cycle", std::to_string(rate)}, {"coarse_tiles_per_cycle", "64"}});
    Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
    in.add(jobs()[0]);
    bench.run();
    const std::size_t tiles = out.records().size();
    EXPECT_GE(tiles, 14U);
    EXPECT_EQ(out.records().back().cycle - out.records().front().cycle, (tiles - 1) / rate);
  }
}

TEST_P(RasterTimedTest, PrimitiveAndScreenTilePairsComeAtTheirInterval) {
  for (float x = 0; x < 128; x += 16) add_one_quad(x + 4);
  Bench bench(GetParam(), "raster", "tile-rasterizer", context,
              {{"screen_tile_interval_cycles", "5"}, {"setup_latency_cycles", "10"}});
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs", 16);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 16);
  for (const RasterJob& job : jobs()) in.add(job);
  bench.run();
  ASSERT_EQ(out.records().size(), 8U);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(out.records()[i].cycle, 1 + 5 * i + 10);
  EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), RasterWork::pairs), 8 * 5);
}

TEST_P(RasterTimedTest, SetUpsComeAtTheirInterval) {
  for (int i = 0; i < 8; ++i) add_one_quad(4);
  Bench bench(GetParam(), "raster", "tile-rasterizer", context,
              {{"setup_interval_cycles", "7"}, {"setup_latency_cycles", "10"}});
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs", 16);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 16);
  for (const RasterJob& job : jobs()) in.add(job);
  bench.run();
  ASSERT_EQ(out.records().size(), 8U);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(out.records()[i].cycle, 1 + 7 * i + 10);
  EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), RasterWork::setup), 8 * 7);
}

TEST_P(RasterTimedTest, SetUpsOfFilledRectanglesHaveAnIntervalOfTheirOwn) {
  for (int i = 0; i < 8; ++i) draw.splats.push_back(testing::flat_box(4, 6, 6, 8, 0.5F));
  context = testing::context_of(draw);
  testing::change_state(context, [](DrawState& state) { state.splat_extent = SplatExtent::fill_rectangle; });
  for (const FragmentShader shader : {FragmentShader::splat, FragmentShader::none}) {
    testing::change_state(context, [&](DrawState& state) { state.shader = shader; });
    for (const char* of_rectangles : {"5", "0"}) {
      Bench bench(GetParam(), "raster", "tile-rasterizer", context,
                  {{"setup_interval_cycles", "7"},
                   {"bare_setup_interval_cycles", "3"},
                   {"rectangle_setup_interval_cycles", of_rectangles}});
      Source<RasterJob>& in = bench.source<RasterJob>("in_jobs", 16);
      Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 16);
      for (const RasterJob& job : jobs()) in.add(job);
      bench.run();
      const unsigned interval = shader == FragmentShader::none ? 3 : *of_rectangles == '0' ? 7 : 5;
      ASSERT_EQ(out.records().size(), 8U);
      for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(out.records()[i].cycle, out.records()[0].cycle + interval * i);
      EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), RasterWork::rectangle_setup),
                       shader == FragmentShader::none ? 0 : 8 * interval);
    }
  }
}

TEST_P(RasterTimedTest, SetUpsWithoutAttributesHaveAnIntervalOfTheirOwn) {
  for (int i = 0; i < 8; ++i) add_one_quad(4);
  for (const FragmentShader shader : {FragmentShader::none, FragmentShader::alpha_threshold, FragmentShader::splat}) {
    testing::change_state(context, [&](DrawState& drawn) { drawn.shader = shader; });
    for (const char* bare : {"3", "0"}) {
      Bench bench(GetParam(), "raster", "tile-rasterizer", context,
                  {{"setup_interval_cycles", "7"}, {"bare_setup_interval_cycles", bare}});
      Source<RasterJob>& in = bench.source<RasterJob>("in_jobs", 16);
      Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 16);
      for (const RasterJob& job : jobs()) in.add(job);
      bench.run();
      const bool reads = shader == FragmentShader::splat;
      const unsigned interval = reads || *bare == '0' ? 7 : 3;
      ASSERT_EQ(out.records().size(), 8U);
      for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(out.records()[i].cycle, out.records()[0].cycle + interval * i);
      EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), RasterWork::setup), reads ? 8 * interval : 0);
      EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), RasterWork::bare_setup), reads ? 0 : 8 * interval);
    }
  }
}

// case R07
TEST_P(RasterTimedTest, APrimitiveWithoutSamplesCostsItsCoarseTests) {
  // A sliver between samples whose bounds hold the whole diagonal: 256 raster tiles are tested, then one.
  add_triangle({{0.7F, 128, 128}, {0.2F, 127.2F, 127.3F}});
  add_one_quad(4);
  for (const unsigned rate : {1U, 4U, 16U}) {
    Bench bench(GetParam(), "raster", "tile-rasterizer", context,
                {{"coarse_tiles_per_cycle", std::to_string(rate)}, {"setup_latency_cycles", "10"}});
    Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
    for (const RasterJob& job : jobs()) in.add(job);
    bench.run();
    EXPECT_EQ(cycles_of(out), (std::vector<Cycle>{256 / rate + 1 + 10})) << rate;
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), RasterWork::coarse), 257.0 / rate);
  }
}

TEST_P(RasterTimedTest, TheEndComesLast) {
  add_full();
  Bench bench(GetParam(), "raster", "tile-rasterizer", context);
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 1);
  in.add(jobs()[0]);
  in.add(marked<RasterJob>());
  bench.run();
  EXPECT_TRUE(out.records().back().item.mark == Mark::end_of_frame);
  EXPECT_EQ(quads_in(out), 4096U);
  EXPECT_TRUE(bench.unit().idle());
}

TEST_P(RasterTimedTest, ABlockedReceiverStopsItUntilACycleAfterItTakes) {
  add_full();
  Bench bench(GetParam(), "raster", "tile-rasterizer", context, {{"setup_latency_cycles", "1"}});
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 4);
  in.add(jobs()[0]);
  out.close(0, 100);
  bench.run();
  ASSERT_EQ(out.records().size(), 256U);
  EXPECT_EQ(out.records()[3].cycle, 100U);
  EXPECT_EQ(out.records()[4].cycle, 102U);
  // At lt the tile that waited goes beside the next, which was made meanwhile.
  for (std::size_t i = 5; i < 256; ++i) {
    ASSERT_LE(out.records()[i].cycle, 98 + i);
    ASSERT_GE(out.records()[i].cycle, GetParam() == Fidelity::lt ? 97 + i : 98 + i);
  }
  EXPECT_EQ(testing::charged(bench.unit(), UnitState::blocked, 356), 96U) << "cycles 5 to 100";
}

TEST_P(RasterTimedTest, QuadsAndTheirOrderAreTheSameUnderAnyStalls) {
  draw = testing::random_draw(128, 128, 40, 9);
  const std::vector<RasterJob> all = jobs();
  std::vector<std::uint64_t> expected;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    // What is to come out is what cycle makes of it undisturbed.
    Bench bench(seed == 0 ? Fidelity::cycle : GetParam(), "raster", "tile-rasterizer", context);
    Source<RasterJob>& in = bench.source<RasterJob>("in_jobs", static_cast<unsigned>(1 + seed % 10));
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", static_cast<unsigned>(1 + seed % 9));
    for (const RasterJob& job : all) in.add(job);
    in.add(marked<RasterJob>());
    if (seed > 0) bench.stall_randomly(seed, 80);
    bench.run();
    std::vector<std::uint64_t> quads;
    for (const auto& record : out.records()) {
      for (unsigned i = 0; i < record.item.count; ++i) {
        const Quad& quad = record.item.quads[i];
        std::uint64_t word = quad.splat;
        for (const unsigned part : {unsigned{quad.triangle}, unsigned{record.item.tile.x}, unsigned{record.item.tile.y},
                                    unsigned{quad.position}, unsigned{quad.coverage}}) {
          word = word << 6U | part;
        }
        quads.push_back(word);
      }
    }
    if (seed == 0) expected = quads;
    ASSERT_EQ(quads, expected) << seed;
    ASSERT_TRUE(bench.unit().idle()) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
