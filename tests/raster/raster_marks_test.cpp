// RASTER in a frame of several draws: quads and marks keep the order of jobs.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/geometry.h>

#include "raster/raster.h"
#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

constexpr std::uint32_t splats_of_draw = 5;
constexpr DrawIndex marked_draws = 8;

class RasterMarksTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  RasterMarksTest() {
    std::vector<Splat> splats;
    for (std::uint32_t i = 0; i < splats_of_draw; ++i) {
      const float side = i % 2 == 0 ? 40 : 2;
      splats.push_back(testing::flat_box(0, 0, side, side, 0.5F));
    }
    const auto geometry = testing::geometry_of(64, 64, splats);
    Frame frame(64, 64);
    for (DrawIndex draw = 0; draw < marked_draws; ++draw) {
      frame.draw(geometry, {});
      frame.clear({true, true});
    }
    context = testing::context_of(frame);
  }
  RasterJob job_of(DrawIndex draw, std::uint32_t splat, unsigned triangle) const {
    RasterJob job;
    job.primitive.draw = draw;
    job.primitive.splat = splat;
    job.primitive.triangle = static_cast<std::uint8_t>(triangle);
    SnappedTriangle snapped;
    EXPECT_TRUE(snap_triangle(context, draw, splat, triangle, snapped));
    job.primitive.bounds = covered_bounds(snapped, context.precision.subpixel_bits, 64, 64);
    job.clip = job.primitive.bounds;
    return job;
  }
  void add_frame(Source<RasterJob>& in) const {
    for (DrawIndex draw = 0; draw < marked_draws; ++draw) {
      for (std::uint32_t i = 0; i < splats_of_draw; ++i) {
        for (const unsigned triangle : {0U, 1U}) in.add(job_of(draw, splats_of_draw * draw + i, triangle));
      }
      in.add(testing::marked<RasterJob>(Frame::mark_of(2 * draw + 1)));
    }
    in.add(testing::marked<RasterJob>());
  }
  RenderContext context;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, RasterMarksTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(RasterMarksTest, AMarkComesBehindTheQuadsOfTheJobsBeforeItUnderAnyStalls) {
  for (const unsigned stalls : {0U, 64U, 160U}) {
    for (const char* rate : {"1", "3", "16"}) {
      Bench bench(GetParam(), "raster", "tile-rasterizer", context, {{"quads_per_cycle", rate}});
      Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
      Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 2);
      add_frame(in);
      out.close(100, 500);
      bench.stall_randomly(7, stalls);
      bench.run();
      DrawIndex draw = 0;
      for (const auto& record : out.records()) {
        const QuadBeat& beat = record.item;
        for (unsigned i = 0; i < beat.count; ++i) {
          ASSERT_EQ(beat.quads[i].draw, draw);
          ASSERT_EQ(beat.quads[i].splat / splats_of_draw, draw);
        }
        if (beat.mark == Mark::none || beat.mark == Mark::end_of_frame) continue;
        ASSERT_EQ(beat.count, 0);
        ASSERT_EQ(beat.mark, Frame::mark_of(2 * std::size_t{draw} + 1));
        ++draw;
      }
      EXPECT_EQ(draw, marked_draws);
      EXPECT_EQ(out.records().back().item.mark, Mark::end_of_frame);
      EXPECT_TRUE(bench.unit().idle());
    }
  }
}

TEST_P(RasterMarksTest, CountsForTheDrawOfThePrimitive) {
  Bench bench(GetParam(), "raster", "tile-rasterizer", context);
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
  for (const unsigned triangle : {0U, 1U}) in.add(job_of(3, 3 * splats_of_draw + 1, triangle));  // a box of 2x2 pixels
  for (const unsigned triangle : {0U, 1U}) in.add(job_of(6, 6 * splats_of_draw, triangle));      // of 40x40
  bench.run();
  const auto& raster = bench.behaviour<TileRasterizer>();
  ASSERT_EQ(raster.fragments_rasterized.of_draw().size(), std::size_t{marked_draws});
  EXPECT_EQ(raster.fragments_rasterized.of_draw()[3], 4U);
  EXPECT_EQ(raster.fragments_rasterized.of_draw()[6], 1600U);
  EXPECT_EQ(raster.fragments_rasterized.value(), 1604U);
  EXPECT_GT(out.records().size(), 0U);
}

}  // namespace
}  // namespace vrpipe
