// When what ZROP has stored counts: from the cycle in which it comes, or, with strict termination, from a mark on.
#include <memory>

#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

#include "raster/raster.h"
#include "support/builders.h"

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

constexpr Cycle told_at = 500;
constexpr std::uint64_t quads_of_tile = 64;    // four raster tiles
constexpr std::uint64_t quads_of_others = 48;  // all but one

class HiZUnitTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  HiZUnitTest() : frame(16, 16) {
    Splat box = testing::flat_box(0, 0, 16, 16, 1);
    box.depth = 0.75F;
    const auto splats = testing::geometry_of(16, 16, {box});
    DrawState state;
    state.obb_padding = 0;
    state.depth = {true, Compare::less, true};
    frame.draw(splats, state);
    state.depth.write = false;
    frame.draw(splats, state);
    context = testing::context_of(frame);
  }
  /// Both triangles of the second draw's splat.
  void draw(Source<RasterJob>& in, Cycle at) const {
    for (unsigned triangle = 0; triangle < 2; ++triangle) {
      RasterJob job;
      job.primitive.splat = 1;
      job.primitive.draw = 1;
      job.primitive.triangle = static_cast<std::uint8_t>(triangle);
      ASSERT_EQ(cull_triangle(context, 1, 1, triangle, job.primitive.bounds), Culling::none);
      job.clip = job.primitive.bounds;
      in.add(job, at);
    }
  }
  static HiZUpdate first_raster_tile() {
    HiZUpdate update;
    update.farthest = store_depth(DepthFormat::d24, 0.25);
    return update;
  }
  static std::uint64_t fragments_in(const Sink<QuadBeat>& sink, Cycle from, Cycle until) {
    std::uint64_t fragments = 0;
    for (const auto& record : sink.records()) {
      if (record.cycle < from || record.cycle >= until) continue;
      for (unsigned i = 0; i < record.item.count; ++i) fragments += popcount(record.item.quads[i].coverage);
    }
    return fragments;
  }

  Frame frame;
  RenderContext context;
};
INSTANTIATE_TEST_SUITE_P(Raster, HiZUnitTest, ::testing::Values(Fidelity::lt, Fidelity::cycle),
                         [](const auto& fidelity) { return std::string(name_of(fidelity.param)); });

TEST_P(HiZUnitTest, AnUpdateCountsFromTheCycleInWhichItComes) {
  Bench bench(GetParam(), "raster", "tile-rasterizer", context);
  // At `lt` what comes later is known before, and does not count yet.
  Source<HiZUpdate>& told = bench.source<HiZUpdate>("in_hi_z");
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
  told.add(first_raster_tile(), told_at);
  draw(in, told_at - 100);
  draw(in, told_at + 100);
  bench.run();
  EXPECT_EQ(fragments_in(out, 0, told_at), 4 * quads_of_tile);
  EXPECT_EQ(fragments_in(out, told_at, never), 4 * quads_of_others);
  EXPECT_EQ(bench.behaviour<TileRasterizer>().hi_z_culled.value(), 1U) << "one triangle covers all of it";
}

TEST_P(HiZUnitTest, StrictlyWhatFollowsAMarkWaitsUntilItComesBack) {
  if (GetParam() == Fidelity::lt)
    return;  // there what a mark leads to happens while it is sent: tests of frames have it
  context.termination = Termination::strict;
  Bench bench(GetParam(), "raster", "tile-rasterizer", context);
  Source<HiZUpdate>& told = bench.source<HiZUpdate>("in_hi_z");
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
  RasterJob mark;
  mark.mark = Frame::mark_of(1);
  in.add(mark);
  draw(in, 10);
  told.add(first_raster_tile(), 20);
  HiZUpdate back;
  back.mark = mark.mark;
  told.add(back, told_at);
  bench.run();
  EXPECT_LT(out.records().front().cycle, 50U);
  EXPECT_EQ(out.records().front().item.mark, mark.mark);
  EXPECT_EQ(fragments_in(out, 0, told_at), 0U);
  EXPECT_EQ(fragments_in(out, told_at, never), 4 * quads_of_others);
}

TEST_P(HiZUnitTest, WhereNobodyTellsItNothingWaits) {
  context.termination = Termination::strict;
  Bench bench(GetParam(), "raster", "tile-rasterizer", context);
  Source<RasterJob>& in = bench.source<RasterJob>("in_jobs");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
  RasterJob mark;
  mark.mark = Frame::mark_of(1);
  in.add(mark);
  draw(in, 10);
  bench.run();
  EXPECT_EQ(fragments_in(out, 0, 200), 4 * quads_of_tile);
}

}  // namespace
}  // namespace vrpipe
