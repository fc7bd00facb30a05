// What ZROP tells Hi-Z: the farthest depth of each raster tile that a test has changed, against all pixels of it.
#include "zrop/hi_z_reports.h"

#include <algorithm>
#include <map>
#include <memory>
#include <tuple>

#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

#include "support/builders.h"
#include "zrop/zrop.h"

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

constexpr std::uint32_t reports_width = 60;  // the last raster tiles are cut
constexpr std::uint32_t reports_height = 44;
constexpr std::uint32_t reports_splats = 400;

using RasterTile = std::tuple<unsigned, unsigned>;  ///< column and row

class HiZReportsTest : public ::testing::Test {
 protected:
  HiZReportsTest()
      : draw(testing::draw_of(reports_width, reports_height, std::vector<Splat>(reports_splats))), context(of(draw)) {
    for (std::uint32_t i = 0; i < reports_splats; ++i) draw.splats[i].depth = testing::uniform(7, i, 0, 1);
  }
  static RenderContext of(const Draw& draw) {
    DrawState state;
    state.depth = {true, Compare::less, true};
    state.pruning_threshold = 0;  // nothing is discarded, so tests come before shading
    return testing::context_of(draw, state);
  }
  /// Up to 16 quads of a splat in a screen tile, of any coverage within the frame.
  static QuadBeat beat_of(std::uint32_t splat) {
    QuadBeat beat;
    beat.tile = {static_cast<std::uint16_t>(mix(splat) % 4), static_cast<std::uint16_t>(mix(splat + 1000) % 3)};
    for (unsigned position = 0; position < positions_per_tile && beat.count < QuadBeat::capacity; ++position) {
      const std::uint64_t random = mix(splat * 64ULL + position);
      const unsigned x = beat.tile.x * 16U + position % 8 * 2;
      const unsigned y = beat.tile.y * 16U + position / 8 * 2;
      if (random % 3 != 0 || x >= reports_width || y >= reports_height) continue;
      const auto coverage = static_cast<LaneMask>(1 + (random >> 8U) % 15);
      beat.quads[beat.count++] = {splat, static_cast<std::uint8_t>(position), coverage, 0, 0};
    }
    return beat;
  }
  /// Over the pixels in the frame.
  static std::map<RasterTile, std::uint32_t> farthest_of(const DepthStencilSurface& surface) {
    std::map<RasterTile, std::uint32_t> farthest;
    for (std::uint32_t y = 0; y < reports_height; ++y) {
      for (std::uint32_t x = 0; x < reports_width; ++x) {
        const TileId tile{static_cast<std::uint16_t>(x / 16), static_cast<std::uint16_t>(y / 16)};
        const DepthStencilQuad& quad = surface.quad(surface.grid().place(tile, y % 16 / 2 * 8 + x % 16 / 2));
        std::uint32_t& most = farthest[{x / 8, y / 8}];
        most = std::max(most, quad.depth[y % 2 * 2 + x % 2]);
      }
    }
    return farthest;
  }
  static RasterTile raster_tile_of(const HiZUpdate& update) {
    return {update.tile.x * 2U + update.part % 2U, update.tile.y * 2U + update.part / 2U};
  }
  /// What is stored in the end, by a functional model of its own.
  DepthStencilSurface stored() const {
    DepthStencilSurface surface(reports_width, reports_height);
    const DepthStencilRop::Parameters parameters;
    DepthStencilRop rop(parameters, context);
    rop.attach(surface);
    for (std::uint32_t splat = 0; splat < reports_splats; ++splat) {
      QuadBeat beat = beat_of(splat);
      rop.test(beat);
    }
    return surface;
  }

  Draw draw;
  RenderContext context;
};

TEST_F(HiZReportsTest, AreTheFarthestOfTheRasterTilesThatHaveChanged) {
  DepthStencilSurface surface(reports_width, reports_height);
  const DepthStencilRop::Parameters parameters;
  DepthStencilRop rop(parameters, context);
  rop.attach(surface);
  HiZReports reports(context);
  ASSERT_TRUE(reports.wanted(0));
  std::map<RasterTile, std::uint32_t> told = farthest_of(surface);
  std::uint64_t updates = 0;
  for (std::uint32_t splat = 0; splat < reports_splats; ++splat) {
    QuadBeat beat = beat_of(splat);
    const QuadBeat before = beat;
    const std::uint32_t changed = rop.test(beat);
    reports.changed(before, changed, surface, [&](const HiZUpdate& update) {
      EXPECT_EQ(update.tile, before.tile);
      const std::uint32_t farthest = farthest_of(surface).at(raster_tile_of(update));
      EXPECT_EQ(update.farthest, farthest);
      EXPECT_TRUE(updates == 0 || farthest <= told.at(raster_tile_of(update)));
      told[raster_tile_of(update)] = update.farthest;
      ++updates;
    });
    EXPECT_EQ(told, farthest_of(surface)) << "after splat " << splat;
  }
  EXPECT_GT(updates, 50U);
}

TEST_F(HiZReportsTest, NothingIsToldTwice) {
  DepthStencilSurface surface(reports_width, reports_height);
  HiZReports reports(context);
  const QuadBeat beat = testing::beat_of({1, 1}, {0, 4, 32, 36});
  unsigned updates = 0;
  const auto tell = [&](const HiZUpdate&) { ++updates; };
  reports.changed(beat, 0b1111, surface, tell);
  EXPECT_EQ(updates, 4U) << "one for each raster tile";
  reports.changed(beat, 0b1111, surface, tell);
  EXPECT_EQ(updates, 4U);
}

class HiZReportsOfUnit : public HiZReportsTest, public ::testing::WithParamInterface<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Zrop, HiZReportsOfUnit, ::testing::Values(0U, 64U, 200U),
                         [](const auto& stalls) { return "stalls_" + std::to_string(stalls.param); });

// Whatever the link takes, and when: tests do not wait for it, and what is told last is what is stored.
TEST_P(HiZReportsOfUnit, ComeInTheEndThoughTheLinkIsFull) {
  std::vector<Cycle> tested;
  for (const Cycle closed : {Cycle{0}, Cycle{1000}}) {
    Bench bench("zrop", "depth-stencil-rop", context);
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 64);
    Sink<HiZUpdate>& told = bench.sink<HiZUpdate>("out_hi_z", 1);
    if (closed > 0) told.close(0, closed);
    bench.stall_randomly(3, GetParam());
    for (std::uint32_t splat = 0; splat < reports_splats; ++splat) in.add(beat_of(splat));
    bench.run();
    std::map<RasterTile, std::uint32_t> last = farthest_of(DepthStencilSurface(reports_width, reports_height));
    for (const auto& record : told.records()) {
      EXPECT_GE(record.cycle, closed);
      std::uint32_t& known = last.at(raster_tile_of(record.item));
      EXPECT_LE(record.item.farthest, known);
      known = record.item.farthest;
    }
    EXPECT_EQ(last, farthest_of(stored()));
    tested.push_back(out.records().back().cycle);
  }
  EXPECT_EQ(tested[0], tested[1]);
}

TEST_F(HiZReportsTest, AnUpdateIsSentWhenItsTestIsDone) {
  Bench bench("zrop", "depth-stencil-rop", context, {{"latency_cycles", "20"}});
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
  Sink<HiZUpdate>& told = bench.sink<HiZUpdate>("out_hi_z");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads");
  QuadBeat covering = testing::beat_of({0, 0}, {0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27});
  for (unsigned i = 0; i < covering.count; ++i) covering.quads[i].splat = 0;
  in.add(covering, 10);
  bench.run();
  ASSERT_EQ(told.records().size(), 1U);
  EXPECT_EQ(told.records()[0].cycle, out.records()[0].cycle);
  EXPECT_EQ(told.records()[0].item.farthest, store_depth(DepthFormat::d24, static_cast<double>(draw.splats[0].depth)));
}

}  // namespace
}  // namespace vrpipe
