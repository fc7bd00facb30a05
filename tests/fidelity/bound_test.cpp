// No run is faster than the bound, also where a price is paid for what nobody waits for, or where `cycle` flushes its bins
// at other times than the run that the bound counts.
#include <vrpipe/platforms/simulation.h>

#include "support/mixed_frames.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

RunRequest with(const char* variant, const std::vector<Setting>& settings) {
  RunRequest request = request_of(variant, Fidelity::bound);
  request.settings = settings;
  return request;
}

/// Cycles of the bound as a share of those of `cycle`.
template <class Scene>
double share_of_cycle(RunRequest request, const Scene& scene) {
  request.fidelity = Fidelity::bound;
  const auto bound = static_cast<double>(*run(request, scene).cycles);
  request.fidelity = Fidelity::cycle;
  return bound / static_cast<double>(*run(request, scene).cycles);
}

const Setting prices[] = {{"prop", "quads_per_cycle", "1"},
                          {"zrop", "block_cycles", "100"},
                          {"zrop", "half_block_cycles", "100"},
                          {"sm", "warp_launch_cycles", "1000"},
                          {"sm", "visit_launch_cycles", "1000"}};

// Quads of eight primitives are tested, and handed over, in one go, and are on their way as it begins.
TEST(Bound, WaitsForNoPriceOfTheLastQuads) {
  for (const Setting& price : prices) {
    for (const unsigned splats : {1U, 8U, 16U, 24U}) {
      const Draw draw = draw_of(2, 2, std::vector<Splat>(splats, flat_box(0, 0, 2, 2, 0.05F)));
      for (const char* variant : {"het", "het+qm"})
        EXPECT_LE(share_of_cycle(with(variant, {price}), draw), 1)
            << price.parameter << " " << variant << " " << splats;
    }
  }
}

TEST(Bound, IsCloseWhereAPriceIsAllThatCounts) {
  const Draw draw = random_draw(96, 80, 400, 1);
  for (const Setting& price : prices) {
    RunRequest request = with("het", {price});
    request.termination = Termination::strict;  // in which no bin times out
    EXPECT_GT(share_of_cycle(request, draw), 0.94) << price.parameter;
  }
}

// Whose quads are more than are on their way at a time.
TEST(Bound, WaitsForNoIntervalOfTheLastVertexWarp) {
  const Draw draw = draw_of(8, 8, std::vector<Splat>(14, flat_box(0, 0, 8, 8, 0.05F)));
  const RunRequest request = with("baseline", {{"draw", "warps_per_1024_cycles", "1"},
                                               {"sm", "cores", "2"},
                                               {"sm", "warps_per_core", "4"},
                                               {"crop", "input_quads", "8"}});
  EXPECT_LE(share_of_cycle(request, draw), 1);
}

// Splats and filled rectangles in turn, whose warps are due at rates that are no whole numbers of cycles.
TEST(Bound, KnowsTheRateOfFilledRectangles) {
  DrawState rectangles;
  rectangles.splat_extent = SplatExtent::fill_rectangle;
  Frame frame(8, 8);
  for (unsigned pair = 0; pair < 20; ++pair) {
    for (const DrawState& state : {DrawState(), rectangles})
      frame.draw(geometry_of(8, 8, std::vector<Splat>(24, flat_box(0, 0, 8, 8, 0.05F))), state);
  }
  for (const char* rate : {"3", "7", "300"}) {
    const double share = share_of_cycle(with("baseline", {{"draw", "warps_per_1024_cycles", "5"},
                                                          {"draw", "rectangle_warps_per_1024_cycles", rate}}),
                                        frame);
    EXPECT_LE(share, 1) << rate;
    EXPECT_GT(share, 0.9) << rate << ": all but what nobody waits for at the end of a draw";
  }
}

// Merged with quads of the next primitive, a primitive's would come to the SMs in several visits.
// Updates of the last phase come while ZROP is still at the blocks of the one before it.
TEST(Bound, UpdatesHideBesideTestsOfEarlierPhases) {
  const Draw draw = draw_of(100, 100, std::vector<Splat>(2, flat_box(0, 0, 100, 100, 0.99F)));
  EXPECT_LE(share_of_cycle(with("het", {{"zrop", "half_block_cycles", "100"}}), draw), 1);
}

TEST(Bound, VisitsAreAsFewAsInBinsThatTimeOut) {
  const Draw draw = draw_of(16, 16, std::vector<Splat>(64, flat_box(0, 0, 16, 16, 0.05F)));
  const RunRequest request =
      with("qm", {{"sm", "visit_launch_cycles", "100"}, {"raster", "setup_interval_cycles", "400"}});
  EXPECT_LE(share_of_cycle(request, draw), 1);
}

// Told earlier, by bins that time out, Hi-Z hides more.
TEST(Bound, HiZHidesAsMuchAsInBinsThatTimeOut) {
  RunRequest request = with("het", {{"raster", "screen_tile_interval_cycles", "1000"}, {"raster", "hi_z_bits", "2"}});
  request.format = ColorFormat::rgba32f;
  EXPECT_LE(share_of_cycle(request, mixed_frame(331876, request)), 1);
  request.settings = {{"prop", "quads_per_cycle", "1"}};
  for (const std::uint64_t seed : {432200U, 942808U}) EXPECT_LE(share_of_cycle(request, mixed_frame(seed, request)), 1);
}

// What a small L2 misses once more follows from the order of accesses.
TEST(Bound, ADramMovesNoMoreThanInAnyOrder) {
  RunRequest request = with("baseline", {{"l2", "banks", "40"}, {"l2", "bytes", "81920"}, {"dram", "channels", "1"}});
  request.platform = &platform_named("agx-orin");
  for (const std::uint64_t seed : {565696U, 2U, 5U, 23U})
    EXPECT_LE(share_of_cycle(request, mixed_frame(seed, request)), 1) << seed;
}

}  // namespace
}  // namespace vrpipe
