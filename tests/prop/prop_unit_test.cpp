#include <algorithm>
#include <map>
#include <numeric>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/prop.h>
#include <vrpipe/testkit/bench.h>

#include "support/builders.h"
#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::beat_of;

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class PropUnitTest : public ::testing::Test {
 protected:
  PropUnitTest() : draw(testing::draw_of(256, 256)), context(testing::context_of(draw)) {}

  /// A shaded warp; quads are told apart by their first primitive, sequence * 8 + index.
  ShadedWarp* warp(std::uint32_t sequence, TileId tile, std::uint32_t tile_sequence, std::uint8_t count = 8) {
    ShadedWarp& made = pool_.take();
    made.tile = tile;
    made.sequence = sequence;
    made.tile_sequence = tile_sequence;
    made.count = count;
    made.slot = static_cast<std::uint16_t>(sequence);
    made.mark = Mark::none;
    for (unsigned i = 0; i < count; ++i) {
      made.position[i] = static_cast<std::uint8_t>(i);
      made.first_primitive[i] = made.last_primitive[i] = sequence * 8 + i;
      made.live[i] = all_lanes;
    }
    return &made;
  }
  const ShadedWarp* end(std::uint32_t warps) {
    ShadedWarp* const made = warp(warps, {}, 0, 0);
    made->mark = Mark::end_of_frame;
    made->slot = no_slot;
    return made;
  }

  Draw draw;
  RenderContext context;
  ShadedWarpPool pool_;
};

std::vector<std::uint32_t> quads_of(const Sink<ColorBeat>& sink) {
  std::vector<std::uint32_t> quads;
  for (const auto& record : sink.records()) {
    for (unsigned i = 0; i < record.item.count; ++i)
      quads.push_back(record.item.quads[i].warp->first_primitive[record.item.quads[i].index]);
  }
  return quads;
}

TEST_F(PropUnitTest, WithoutTestsBinsGoStraightToTheQru) {
  Bench bench("prop", "pre-rop", context, {{"latency_cycles", "4"}});
  Source<QuadBeat>& bins = bench.source<QuadBeat>("in_bins");
  Sink<QuadBeat>& survivors = bench.sink<QuadBeat>("out_survivors");
  Sink<QuadBeat>& test = bench.sink<QuadBeat>("out_test");
  bins.add(beat_of({0, 0}, {1, 2}), 10);
  bench.run();
  ASSERT_EQ(survivors.records().size(), 1U);
  EXPECT_EQ(survivors.records()[0].cycle, 11U + 4);
  EXPECT_TRUE(test.records().empty());
}

TEST_F(PropUnitTest, WithTestsBinsGoToZropAndWhatComesBackToTheQru) {
  testing::terminate_early(context);
  Bench bench("prop", "pre-rop", context, {{"latency_cycles", "4"}});
  Source<QuadBeat>& bins = bench.source<QuadBeat>("in_bins");
  Source<QuadBeat>& tested = bench.source<QuadBeat>("in_tested");
  Sink<QuadBeat>& survivors = bench.sink<QuadBeat>("out_survivors");
  Sink<QuadBeat>& test = bench.sink<QuadBeat>("out_test");
  bins.add(beat_of({0, 0}, {1, 2}), 10);
  tested.add(beat_of({0, 0}, {3}), 20);
  bench.run();
  ASSERT_EQ(test.records().size(), 1U);
  EXPECT_EQ(test.records()[0].cycle, 11U + 4);
  ASSERT_EQ(survivors.records().size(), 1U);
  EXPECT_EQ(survivors.records()[0].cycle, 21U + 4);
}

TEST_F(PropUnitTest, MovesItsQuadsPerCycleEachWay) {
  testing::terminate_early(context);
  for (const unsigned rate : {8U, 16U}) {
    Bench bench("prop", "pre-rop", context, {{"quads_per_cycle", std::to_string(rate)}});
    Source<QuadBeat>& bins = bench.source<QuadBeat>("in_bins", 64);
    Source<QuadBeat>& tested = bench.source<QuadBeat>("in_tested", 64);
    Sink<QuadBeat>& survivors = bench.sink<QuadBeat>("out_survivors", 64);
    Sink<QuadBeat>& test = bench.sink<QuadBeat>("out_test", 64);
    for (unsigned i = 0; i < 40; ++i) {
      bins.add(beat_of({0, 0}, {1, 2, 3, 4, 5, 6, 7, 8}, 8 * i));
      tested.add(beat_of({0, 0}, {1, 2, 3, 4, 5, 6, 7, 8}, 8 * i));
    }
    bench.run();
    for (const Sink<QuadBeat>* sink : {&survivors, &test}) {
      ASSERT_EQ(sink->records().size(), 40U);
      EXPECT_EQ(sink->records().back().cycle - sink->records().front().cycle + 1, 40U * 8 / rate);
    }
  }
}

TEST_F(PropUnitTest, HandsItsColourQuadsPerCycleToCrop) {
  const std::pair<ColorFormat, unsigned> formats[] = {{ColorFormat::rgba8, 4},
                                                      {ColorFormat::rgba16f, 2},
                                                      {ColorFormat::rgba32f, 1}};
  for (const auto& [format, rate] : formats) {
    context.format = format;
    Bench bench("prop", "pre-rop", context, {{"latency_cycles", "4"}});
    Source<ShadedWarpItem>& shaded = bench.source<ShadedWarpItem>("in_shaded", 64);
    Sink<ColorBeat>& color = bench.sink<ColorBeat>("out_color", 64);
    for (std::uint32_t i = 0; i < 16; ++i) shaded.add({warp(i, {0, 0}, i)}, 10);
    bench.run();
    EXPECT_EQ(quads_of(color).size(), 128U);
    EXPECT_EQ(color.records().back().cycle - color.records().front().cycle + 1, 128 / rate);
    EXPECT_EQ(color.records().front().cycle, 12U + 4) << "collected at 11, sent at 12";
  }
}

TEST_F(PropUnitTest, ColourBytesThatAreNoWholeQuadsPassAtTheirRateExactly) {
  for (const unsigned bytes : {16U, 17U, 48U, 64U, 96U, 200U, 256U}) {
    for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
      context.format = format;
      const Rate rate = Rate::of_bytes(bytes, 4 * bytes_per_pixel(format));
      Bench bench("prop", "pre-rop", context, {{"color_bytes_per_cycle", std::to_string(bytes)}});
      Source<ShadedWarpItem>& shaded = bench.source<ShadedWarpItem>("in_shaded", 64);
      Sink<ColorBeat>& color = bench.sink<ColorBeat>("out_color", 64);
      // All wait for the first, so that the rate decides, and not the one warp a cycle that the link brings.
      for (std::uint32_t i = 1; i < 60; ++i) shaded.add({warp(i, {0, 0}, i)});
      shaded.add({warp(0, {0, 0}, 0)}, 100);
      bench.run();
      std::vector<Cycle> cycles;  // by quad
      for (const auto& record : color.records()) cycles.insert(cycles.end(), record.item.count, record.cycle);
      ASSERT_EQ(cycles.size(), 480U);
      constexpr std::size_t first = 100;
      for (std::size_t turns = 1; first + turns * rate.items < cycles.size(); ++turns) {
        ASSERT_EQ(cycles[first + turns * rate.items] - cycles[first], turns * rate.cycles)
            << bytes << " " << name_of(format);
      }
    }
  }
}

TEST_F(PropUnitTest, AtAFractionOfAQuadQuadsAndEmptyWarpsKeepTheWayToCropNoLongerThanThereIsTime) {
  for (const unsigned bytes : {17U, 39U, 48U, 96U}) {
    Bench bench("prop", "pre-rop", context, {{"color_bytes_per_cycle", std::to_string(bytes)}});
    Source<ShadedWarpItem>& shaded = bench.source<ShadedWarpItem>("in_shaded", 64);
    bench.sink<ColorBeat>("out_color", 64);
    Sink<WarpRelease>& release = bench.sink<WarpRelease>("out_release");
    // All wait for the first. Of three, one has a quad.
    for (std::uint32_t i = 1; i < 600; ++i) shaded.add({warp(i, {0, 0}, i, i % 3 == 0 ? 1 : 0)});
    shaded.add({warp(0, {0, 0}, 0)}, 1000);
    bench.run();
    // And the fraction of a quad that is kept of the cycles before these.
    const double cycles = static_cast<double>(release.records().back().cycle - 1001) + 31.0 / bytes;
    const double empty = testing::occupied(bench.unit(), PropWork::empty_warps);
    EXPECT_GT(empty, 0) << bytes;
    EXPECT_LE(testing::occupied(bench.unit(), PropWork::color) + empty, cycles) << bytes;
  }
}

TEST_F(PropUnitTest, BeatsWiderThanTheUnitTakeExactlyTheirShare) {
  for (const unsigned rate : {3U, 5U, 12U}) {
    Bench bench("prop", "pre-rop", context, {{"quads_per_cycle", std::to_string(rate)}});
    Source<QuadBeat>& bins = bench.source<QuadBeat>("in_bins", 64);
    Sink<QuadBeat>& survivors = bench.sink<QuadBeat>("out_survivors", 64);
    for (unsigned i = 0; i < 61; ++i) bins.add(beat_of({0, 0}, std::vector<unsigned>(16, 1), 16 * i));
    bench.run();
    ASSERT_EQ(survivors.records().size(), 61U);
    EXPECT_EQ(survivors.records().back().cycle - survivors.records().front().cycle, 60U * 16 / rate) << rate;
  }
}

TEST_F(PropUnitTest, ShadedOutOfOrderQuadsLeaveInTheOrderOfTheirTile) {
  for (const char* order : {"draw", "tile"}) {
    Bench bench("prop", "pre-rop", context, {{"order", order}});
    Source<ShadedWarpItem>& shaded = bench.source<ShadedWarpItem>("in_shaded", 64);
    Sink<ColorBeat>& color = bench.sink<ColorBeat>("out_color", 64);
    for (const std::uint32_t sequence : {3U, 1U, 2U, 0U}) shaded.add({warp(sequence, {0, 0}, sequence)});
    bench.run();
    std::vector<std::uint32_t> expected(32);
    std::iota(expected.begin(), expected.end(), 0U);
    EXPECT_EQ(quads_of(color), expected);
  }
}

TEST_F(PropUnitTest, InTileOrderAnotherTileDoesNotWait) {
  for (const bool tile_order : {true, false}) {
    Bench bench("prop", "pre-rop", context, {{"order", tile_order ? "tile" : "draw"}});
    Source<ShadedWarpItem>& shaded = bench.source<ShadedWarpItem>("in_shaded", 64);
    Sink<ColorBeat>& color = bench.sink<ColorBeat>("out_color", 64);
    shaded.add({warp(1, {1, 0}, 0)});        // of another tile
    shaded.add({warp(0, {0, 0}, 0)}, 1000);  // launched first, shaded late
    bench.run();
    EXPECT_EQ(quads_of(color).front(), tile_order ? 8U : 0U);
    EXPECT_EQ(color.records().front().cycle < 100, tile_order);
  }
}

TEST_F(PropUnitTest, AWarpIsReleasedWithItsLastQuad) {
  Bench bench("prop", "pre-rop", context);
  Source<ShadedWarpItem>& shaded = bench.source<ShadedWarpItem>("in_shaded");
  Sink<ColorBeat>& color = bench.sink<ColorBeat>("out_color");
  Sink<WarpRelease>& release = bench.sink<WarpRelease>("out_release");
  const ShadedWarp* const only = warp(0, {0, 0}, 0);
  shaded.add({only}, 10);
  bench.run();
  ASSERT_EQ(release.records().size(), 1U);
  EXPECT_EQ(release.records()[0].item.slot, 0);
  EXPECT_EQ(release.records()[0].cycle, 12U + 3 + 1) << "four beats from 12 on, then the link";
  EXPECT_EQ(color.records().size(), 4U);
  EXPECT_NE(&pool_.take(), only) << "CROP has yet to blend its quads";
}

TEST_F(PropUnitTest, AWarpWithoutSurvivorsIsReleasedAndPassedOver) {
  Bench bench("prop", "pre-rop", context);
  Source<ShadedWarpItem>& shaded = bench.source<ShadedWarpItem>("in_shaded");
  Sink<ColorBeat>& color = bench.sink<ColorBeat>("out_color");
  Sink<WarpRelease>& release = bench.sink<WarpRelease>("out_release");
  const ShadedWarp* const empty = warp(0, {0, 0}, 0, 0);
  shaded.add({empty});
  shaded.add({warp(1, {0, 0}, 1, 2)});
  bench.run();
  EXPECT_EQ(quads_of(color), (std::vector<std::uint32_t>{8, 9}));
  EXPECT_EQ(release.records().size(), 2U);
  EXPECT_EQ(&pool_.take(), empty) << "nobody else needs it";
}

TEST_F(PropUnitTest, TheEndWaitsForAllWarpsOfTheDraw) {
  Bench bench("prop", "pre-rop", context);
  Source<ShadedWarpItem>& shaded = bench.source<ShadedWarpItem>("in_shaded");
  Sink<ColorBeat>& color = bench.sink<ColorBeat>("out_color");
  shaded.add({end(2)});
  shaded.add({warp(1, {3, 0}, 0)}, 500);
  shaded.add({warp(0, {0, 0}, 0)}, 1000);
  bench.run();
  EXPECT_TRUE(color.records().back().item.mark == Mark::end_of_frame);
  EXPECT_GT(color.records().back().cycle, 1000U);
  EXPECT_EQ(quads_of(color).size(), 16U);
  EXPECT_TRUE(bench.unit().idle());
}

// case M06
TEST_F(PropUnitTest, OrderHoldsPerTileUnderAnyArrivalAndStalls) {
  for (const char* order : {"draw", "tile"}) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      Bench bench("prop", "pre-rop", context, {{"order", order}});
      Source<ShadedWarpItem>& shaded = bench.source<ShadedWarpItem>("in_shaded", static_cast<unsigned>(1 + seed % 8));
      Sink<ColorBeat>& color = bench.sink<ColorBeat>("out_color", static_cast<unsigned>(1 + seed % 3));
      Sink<WarpRelease>& release = bench.sink<WarpRelease>("out_release");
      std::vector<const ShadedWarp*> all;
      std::map<unsigned, std::uint32_t> in_tile;
      for (std::uint32_t i = 0; i < 80; ++i) {
        const auto column = static_cast<std::uint16_t>(mix(seed + i) % 5);
        all.push_back(warp(i, {column, 0}, in_tile[column]++, static_cast<std::uint8_t>(mix(seed * 3 + i) % 9)));
      }
      std::size_t quads = 0;
      for (const ShadedWarp* w : all) quads += w->count;
      // Within a window of 24 any order.
      for (std::size_t i = 0; i < all.size(); ++i)
        std::swap(all[i], all[std::min(all.size() - 1, i + mix(seed * 7 + i) % 24)]);
      for (const ShadedWarp* w : all) shaded.add({w});
      shaded.add({end(80)});
      bench.stall_randomly(seed, 100);
      bench.run();
      const std::vector<std::uint32_t> got = quads_of(color);
      ASSERT_EQ(got.size(), quads) << seed;
      ASSERT_TRUE(std::string(order) == "tile" || std::is_sorted(got.begin(), got.end())) << seed;
      std::map<unsigned, std::uint32_t> last;
      for (const auto& record : color.records()) {
        for (unsigned i = 0; i < record.item.count; ++i) {
          const ColorQuad& quad = record.item.quads[i];
          const std::uint32_t primitive = quad.warp->first_primitive[quad.index];
          const unsigned column = quad.warp->tile.x;
          ASSERT_TRUE(last.count(column) == 0 || last[column] < primitive) << seed;
          last[column] = primitive;
        }
      }
      ASSERT_EQ(release.records().size(), 81U) << seed;
      ASSERT_TRUE(bench.unit().idle());
    }
  }
}

}  // namespace
}  // namespace vrpipe
