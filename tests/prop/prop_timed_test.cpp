// PROP at lt, where bins and warps go in one piece.
#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/prop.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::Bins;
using testing::cycles_of;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class PropTimedTest : public ::testing::Test {
 protected:
  PropTimedTest() : draw(testing::draw_of(256, 256)), context(testing::context_of(draw)) {}

  ShadedWarp* warp(std::uint32_t sequence, TileId tile = {0, 0}, std::uint32_t tile_sequence = ~0U,
                   std::uint8_t count = 8) {
    ShadedWarp& made = pool.take();
    made.tile = tile;
    made.sequence = sequence;
    made.tile_sequence = tile_sequence == ~0U ? sequence : tile_sequence;
    made.count = count;
    made.slot = static_cast<std::uint16_t>(sequence);
    made.mark = Mark::none;
    return &made;
  }
  const ShadedWarp* end(std::uint32_t warps) {
    ShadedWarp* const made = warp(warps, {0, 0}, 0, 0);
    made->mark = Mark::end_of_frame;
    made->slot = no_slot;
    return made;
  }

  Draw draw;
  RenderContext context;
  Bins bins;
  ShadedWarpPool pool;
};

/// The ways of shaded warps through PROP.
struct ColorBench {
  ColorBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {}, unsigned depth = 64,
             unsigned release_depth = 64)
      : bench(fidelity, "prop", "pre-rop", context, settings),
        shaded(bench.source<ShadedWarpItem>("in_shaded", 64)),
        color(bench.sink<ShadedWarpItem>("out_color", depth)),
        release(bench.sink<WarpRelease>("out_release", release_depth)) {}

  /// The numbers of the warps that went to CROP, ~0 for the end.
  std::vector<std::uint32_t> sequences() const {
    std::vector<std::uint32_t> all;
    for (const auto& record : color.records()) {
      all.push_back(record.item.warp->mark == Mark::end_of_frame ? ~0U : record.item.warp->sequence);
    }
    return all;
  }

  Bench bench;
  Source<ShadedWarpItem>& shaded;
  Sink<ShadedWarpItem>& color;
  Sink<WarpRelease>& release;
};

TEST_F(PropTimedTest, WithoutTestsBinsGoStraightToTheQru) {
  Bench bench(Fidelity::lt, "prop", "pre-rop", context, {{"latency_cycles", "4"}});
  Source<BinItem>& in = bench.source<BinItem>("in_bins", 8);
  Sink<BinItem>& survivors = bench.sink<BinItem>("out_survivors", 8);
  Sink<BinItem>& test = bench.sink<BinItem>("out_test");
  in.add(bins.at({0, 0}, {1, 2}), 10);
  bench.run();
  EXPECT_EQ(cycles_of(survivors), (std::vector<Cycle>{11 + 4}));
  EXPECT_TRUE(test.records().empty());
}

TEST_F(PropTimedTest, WithTestsBinsGoToZropAndWhatComesBackToTheQru) {
  testing::terminate_early(context);
  Bench bench(Fidelity::lt, "prop", "pre-rop", context, {{"latency_cycles", "4"}});
  Source<BinItem>& in = bench.source<BinItem>("in_bins", 8);
  Source<BinItem>& tested = bench.source<BinItem>("in_tested", 8);
  Sink<BinItem>& survivors = bench.sink<BinItem>("out_survivors", 8);
  Sink<BinItem>& test = bench.sink<BinItem>("out_test", 8);
  in.add(bins.at({0, 0}, {1, 2}), 10);
  tested.add(bins.at({0, 0}, {3}), 20);
  bench.run();
  EXPECT_EQ(cycles_of(test), (std::vector<Cycle>{11 + 4}));
  EXPECT_EQ(cycles_of(survivors), (std::vector<Cycle>{21 + 4}));
}

TEST_F(PropTimedTest, MovesItsQuadsPerCycleEachWayAsTheyCome) {
  testing::terminate_early(context);
  for (const unsigned rate : {8U, 16U}) {
    Bench bench(Fidelity::lt, "prop", "pre-rop", context,
                {{"quads_per_cycle", std::to_string(rate)}, {"latency_cycles", "4"}});
    Source<BinItem>& in = bench.source<BinItem>("in_bins", 64);
    Source<BinItem>& tested = bench.source<BinItem>("in_tested", 64);
    Sink<BinItem>& survivors = bench.sink<BinItem>("out_survivors", 128);
    Sink<BinItem>& test = bench.sink<BinItem>("out_test", 128);
    for (unsigned i = 0; i < 10; ++i) {
      in.add(bins.at({0, 0}, testing::numbers(64), 64 * i), {0, 3}, 4);
      tested.add(bins.at({0, 0}, testing::numbers(64), 64 * i), {0, 3}, 4);
    }
    bench.run();
    for (const Sink<BinItem>* sink : {&survivors, &test}) {
      ASSERT_EQ(sink->records().size(), 10U);
      for (std::size_t n = 0; n < 10; ++n) {
        EXPECT_EQ(sink->records()[n].cycle, 1 + n * 64 / rate + 4) << rate;
        EXPECT_EQ(sink->records()[n].last, (n + 1) * 64 / rate + 4 - (16 / rate - 1))
            << "its last beat, whole, of " << rate;
      }
    }
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), PropWork::bins), 640.0 / rate);
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), PropWork::tested), 640.0 / rate);
  }
}

class PropPassage : public PropTimedTest, public ::testing::WithParamInterface<unsigned> {};

INSTANTIATE_TEST_SUITE_P(QuadsPerCycle, PropPassage, ::testing::Values(16U, 8U, 6U, 5U),
                         ::testing::PrintToStringParamName());

/// From the first, of whole beats, lt knows their width.
unsigned quads_of_bin(unsigned i) { return i == 0 ? 64 : static_cast<unsigned>(1 + mix(i) % 60); }

TEST_P(PropPassage, BinsOfAnySizePassInTheCyclesOfCycle) {
  const Bench::Settings settings{{"quads_per_cycle", std::to_string(GetParam())}, {"latency_cycles", "4"}};
  std::vector<Cycle> expected;  // of the last beat of each bin
  {
    Bench cycle("prop", "pre-rop", context, settings);
    Source<QuadBeat>& in = cycle.source<QuadBeat>("in_bins", 256);
    in.set_rate(1);
    for (unsigned i = 0; i < 30; ++i) {
      const unsigned quads = quads_of_bin(i);
      for (unsigned from = 0; from < quads; from += 16) {
        const std::vector<unsigned> part(std::min(16U, quads - from), 0);
        in.add(testing::beat_of({0, 0}, part, from, from + 16 >= quads), 3 * i);
      }
    }
    const Sink<QuadBeat>& out = cycle.sink<QuadBeat>("out_survivors", 256);
    cycle.run();
    for (const auto& record : out.records()) {
      if (record.item.last_of_bin) expected.push_back(record.cycle);
    }
  }
  Bench bench(Fidelity::lt, "prop", "pre-rop", context, settings);
  Source<BinItem>& in = bench.source<BinItem>("in_bins", 256);
  in.set_rate(1);
  const Sink<BinItem>& out = bench.sink<BinItem>("out_survivors", 256);
  for (unsigned i = 0; i < 30; ++i) {
    const unsigned quads = quads_of_bin(i);
    const unsigned beats = (quads + 15) / 16;
    BinItem bin = bins.at({0, 0}, std::vector<unsigned>(quads, 0));
    bin.beats = beats;
    in.add(bin, {3 * i, 3 * i + beats - 1}, beats);
  }
  bench.run();
  std::vector<Cycle> got;
  for (const auto& record : out.records()) got.push_back(record.last);
  EXPECT_EQ(got, expected);
}

TEST_F(PropTimedTest, ABinThatComesSlowlyTakesAsLongToPass) {
  Bench bench(Fidelity::lt, "prop", "pre-rop", context, {{"quads_per_cycle", "16"}, {"latency_cycles", "4"}});
  Source<BinItem>& in = bench.source<BinItem>("in_bins", 8);
  Sink<BinItem>& survivors = bench.sink<BinItem>("out_survivors", 8);
  in.add(bins.at({0, 0}, testing::numbers(64)), {10, 40}, 4);
  bench.run();
  ASSERT_EQ(survivors.records().size(), 1U);
  EXPECT_EQ(survivors.records()[0].cycle, 11U + 4);
  EXPECT_EQ(survivors.records()[0].last, 41U + 4);
}

TEST_F(PropTimedTest, HandsItsColourQuadsPerCycleToCrop) {
  const std::pair<ColorFormat, unsigned> formats[] = {{ColorFormat::rgba8, 4},
                                                      {ColorFormat::rgba16f, 2},
                                                      {ColorFormat::rgba32f, 1}};
  for (const auto& [format, rate] : formats) {
    context.format = format;
    ColorBench prop(Fidelity::lt, context, {{"latency_cycles", "4"}}, 256);
    for (std::uint32_t i = 0; i < 16; ++i) prop.shaded.add({warp(i)}, 10);
    prop.bench.run();
    ASSERT_EQ(prop.color.records().size(), 16U);
    // Collected at 11, sent from 12 on.
    for (std::size_t n = 0; n < 16; ++n) {
      EXPECT_EQ(prop.color.records()[n].cycle, 12 + n * 8 / rate + 4);
      EXPECT_EQ(prop.color.records()[n].last, 11 + (n + 1) * 8 / rate + 4);
    }
    EXPECT_DOUBLE_EQ(testing::occupied(prop.bench.unit(), PropWork::color), 128.0 / rate);
    const Cycle ended = 12 + 128 / rate;
    EXPECT_EQ(testing::charged(prop.bench.unit(), UnitState::busy, ended), 128 / rate);
  }
}

TEST_F(PropTimedTest, ColourBytesThatAreNoWholeQuadsPassAtTheirRateExactly) {
  for (const unsigned bytes : {16U, 17U, 48U, 64U, 96U, 200U, 256U}) {
    for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
      context.format = format;
      const Rate rate = Rate::of_bytes(bytes, 4 * bytes_per_pixel(format));
      ColorBench prop(Fidelity::lt, context,
                      {{"color_bytes_per_cycle", std::to_string(bytes)}, {"latency_cycles", "4"}}, 4096);
      // All wait for the first, so that the rate decides.
      for (std::uint32_t i = 1; i < 60; ++i) prop.shaded.add({warp(i)});
      prop.shaded.add({warp(0)}, 100);
      prop.bench.run();
      ASSERT_EQ(prop.color.records().size(), 60U);
      EXPECT_EQ(prop.color.records()[0].cycle, 102U + 4);
      const Cycle cycles = (480 * rate.cycles + rate.items - 1) / rate.items;
      EXPECT_EQ(prop.color.records()[59].last, 101 + cycles + 4) << bytes << " " << name_of(format);
    }
  }
}

TEST_F(PropTimedTest, AtAFractionOfAQuadQuadsAndEmptyWarpsKeepTheWayToCropNoLongerThanThereIsTime) {
  for (const unsigned bytes : {17U, 39U, 48U, 96U}) {
    ColorBench prop(Fidelity::lt, context, {{"color_bytes_per_cycle", std::to_string(bytes)}}, 4096, 4096);
    for (std::uint32_t i = 1; i < 600; ++i) prop.shaded.add({warp(i, {0, 0}, i, i % 3 == 0 ? 1 : 0)});
    prop.shaded.add({warp(0)}, 1000);
    prop.bench.run();
    const auto cycles = static_cast<double>(prop.release.records().back().cycle - 1001);
    const double empty = testing::occupied(prop.bench.unit(), PropWork::empty_warps);
    EXPECT_GT(empty, 0) << bytes;
    EXPECT_LE(testing::occupied(prop.bench.unit(), PropWork::color) + empty, cycles) << bytes;
  }
}

TEST_F(PropTimedTest, ShadedOutOfOrderWarpsLeaveInTheOrderOfTheirTile) {
  for (const char* order : {"draw", "tile"}) {
    ColorBench prop(Fidelity::lt, context, {{"order", order}});
    for (const std::uint32_t sequence : {3U, 1U, 2U, 0U}) prop.shaded.add({warp(sequence)});
    prop.bench.run();
    EXPECT_EQ(prop.sequences(), (std::vector<std::uint32_t>{0, 1, 2, 3}));
  }
}

TEST_F(PropTimedTest, InTileOrderAnotherTileDoesNotWait) {
  for (const bool tile_order : {true, false}) {
    ColorBench prop(Fidelity::lt, context, {{"order", tile_order ? "tile" : "draw"}, {"latency_cycles", "4"}});
    prop.shaded.add({warp(1, {1, 0}, 0)});        // of another tile
    prop.shaded.add({warp(0, {0, 0}, 0)}, 1000);  // launched first, shaded late
    prop.bench.run();
    ASSERT_EQ(prop.color.records().size(), 2U);
    EXPECT_EQ(prop.sequences().front(), tile_order ? 1U : 0U);
    EXPECT_EQ(prop.color.records().front().cycle, (tile_order ? 2U : 1002U) + 4);
  }
}

TEST_F(PropTimedTest, OfTheWarpsThatWaitForTheWayToCropTheOldestGoesFirst) {
  ColorBench prop(Fidelity::lt, context, {{"latency_cycles", "1"}}, 4);
  prop.color.close(0, 300);
  prop.shaded.add({warp(0, {0, 0}, 0)});      // its four beats are all that CROP takes
  prop.shaded.add({warp(2, {1, 0}, 0)}, 10);  // comes before an older one
  prop.shaded.add({warp(1, {2, 0}, 0)}, 20);
  prop.shaded.add({warp(3, {3, 0}, 0)}, 400);
  prop.bench.run();
  EXPECT_EQ(prop.sequences(), (std::vector<std::uint32_t>{0, 1, 2, 3}));
}

TEST_F(PropTimedTest, AWarpIsReleasedWithItsLastQuad) {
  ColorBench prop(Fidelity::lt, context, {{"latency_cycles", "4"}});
  const ShadedWarp* const only = warp(7, {0, 0}, 0);
  prop.shaded.add({only}, 10);
  prop.bench.run();
  EXPECT_EQ(cycles_of(prop.release), (std::vector<Cycle>{12 + 3 + 1})) << "four beats from 12 on, then the link";
  EXPECT_EQ(prop.release.records().at(0).item.slot, 7);
  EXPECT_NE(&pool.take(), only) << "CROP has yet to blend its quads";
}

TEST_F(PropTimedTest, AWarpBeginsToLeaveOnceItsReleaseHasRoom) {
  ColorBench prop(Fidelity::lt, context, {{"latency_cycles", "4"}}, 64, 1);
  prop.release.close(0, 500);
  for (std::uint32_t i = 0; i < 3; ++i) prop.shaded.add({warp(i)});
  prop.bench.run();
  // The release of the first waits at the closed port until 500, that of the second comes after 504.
  EXPECT_EQ(cycles_of(prop.color), (std::vector<Cycle>{2 + 4, 501 + 4, 506 + 4}));
}

TEST_F(PropTimedTest, AWarpWithoutSurvivorsIsReleasedAndPassedOverInACycle) {
  ColorBench prop(Fidelity::lt, context, {{"latency_cycles", "4"}});
  const ShadedWarp* const empty = warp(0, {0, 0}, 0, 0);
  prop.shaded.add({empty});
  prop.shaded.add({warp(1, {0, 0}, 1, 2)});
  prop.bench.run();
  EXPECT_EQ(prop.sequences(), (std::vector<std::uint32_t>{1}));
  EXPECT_EQ(cycles_of(prop.color), (std::vector<Cycle>{3 + 4})) << "2 goes to the empty one";
  EXPECT_EQ(cycles_of(prop.release), (std::vector<Cycle>{2 + 1, 3 + 1}));
  EXPECT_DOUBLE_EQ(testing::occupied(prop.bench.unit(), PropWork::empty_warps), 1);
  EXPECT_EQ(&pool.take(), empty) << "nobody else needs it";
}

TEST_F(PropTimedTest, TheEndWaitsForAllWarpsOfTheDraw) {
  ColorBench prop(Fidelity::lt, context);
  prop.shaded.add({end(2)});
  prop.shaded.add({warp(1, {3, 0}, 0)}, 500);
  prop.shaded.add({warp(0, {0, 0}, 0)}, 1000);
  prop.bench.run();
  EXPECT_EQ(prop.sequences(), (std::vector<std::uint32_t>{1, 0, ~0U})) << "in the order of their tiles";
  EXPECT_GT(prop.color.records().back().cycle, 1000U);
  EXPECT_EQ(prop.release.records().back().item.slot, no_slot);
  EXPECT_TRUE(prop.bench.unit().idle());
}

TEST_F(PropTimedTest, ACropThatTakesNothingStopsIt) {
  ColorBench prop(Fidelity::lt, context, {{"latency_cycles", "1"}}, 8);
  prop.color.close(0, 300);
  for (std::uint32_t i = 0; i < 6; ++i) prop.shaded.add({warp(i)});
  prop.shaded.add({end(6)});
  prop.bench.run();
  EXPECT_EQ(prop.sequences(), (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, ~0U}));
  ASSERT_EQ(prop.release.records().size(), 7U);
  // Two warps of four beats fit.
  EXPECT_LT(prop.release.records()[1].cycle, 20U);
  EXPECT_GT(prop.release.records()[2].cycle, 300U);
  EXPECT_GT(testing::charged(prop.bench.unit(), UnitState::blocked, 350), 280U);
}

// case M06
TEST_F(PropTimedTest, OrderHoldsPerTileUnderAnyArrivalAndStalls) {
  for (const char* order : {"draw", "tile"}) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      ColorBench prop(Fidelity::lt, context, {{"order", order}}, static_cast<unsigned>(1 + seed % 12),
                      static_cast<unsigned>(1 + seed % 9));
      std::vector<const ShadedWarp*> all;
      std::map<unsigned, std::uint32_t> in_tile;
      std::size_t not_empty = 0;
      for (std::uint32_t i = 0; i < 80; ++i) {
        const auto column = static_cast<std::uint16_t>(mix(seed + i) % 5);
        all.push_back(warp(i, {column, 0}, in_tile[column]++, static_cast<std::uint8_t>(mix(seed * 3 + i) % 9)));
        not_empty += all.back()->count > 0 ? 1 : 0;
      }
      // Within a window of 24 any order.
      for (std::size_t i = 0; i < all.size(); ++i)
        std::swap(all[i], all[std::min(all.size() - 1, i + mix(seed * 7 + i) % 24)]);
      for (const ShadedWarp* w : all) prop.shaded.add({w});
      prop.shaded.add({end(80)});
      prop.bench.stall_randomly(seed, 100);
      prop.bench.run();
      const std::vector<std::uint32_t> got = prop.sequences();
      ASSERT_EQ(got.size(), not_empty + 1) << seed;
      ASSERT_EQ(got.back(), ~0U) << seed;
      ASSERT_TRUE(std::string(order) == "tile" || std::is_sorted(got.begin(), got.end())) << seed;
      std::map<unsigned, std::uint32_t> next;
      for (const auto& record : prop.color.records()) {
        if (record.item.warp->mark == Mark::end_of_frame) continue;
        std::uint32_t& least = next[record.item.warp->tile.x];
        ASSERT_GE(record.item.warp->tile_sequence, least) << seed;
        least = record.item.warp->tile_sequence + 1;
      }
      ASSERT_EQ(prop.release.records().size(), 81U) << seed;
      ASSERT_TRUE(prop.bench.unit().idle()) << seed;
    }
  }
}

}  // namespace
}  // namespace vrpipe
