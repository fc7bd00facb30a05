// QRU at lt, where a bin comes in one piece, compared with cycle, where it comes beat by beat.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/tc.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::Bins;
using testing::cycles_of;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

const std::vector<unsigned> four_pairs{1, 1, 2, 2, 3, 3, 4, 4};

class QruTimedTest : public ::testing::Test {
 protected:
  QruTimedTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {}

  /// So many quads that pair as they come: a warp every eight.
  BinItem pairs(unsigned quads, TileId tile = {0, 0}) {
    std::vector<unsigned> positions;
    for (unsigned i = 0; i < quads; ++i) positions.push_back(four_pairs[i % 8]);
    return bins.at(tile, positions);
  }

  Draw draw;
  RenderContext context;
  Bins bins;
};

TEST_F(QruTimedTest, AWarpIsSeenTheLatencyAfterItsLastQuad) {
  for (const unsigned latency : {1U, 6U}) {
    Bench bench(Fidelity::lt, "qru", "pairing", context, {{"latency_cycles", std::to_string(latency)}});
    Source<BinItem>& in = bench.source<BinItem>("in_quads");
    Sink<Warp>& out = bench.sink<Warp>("out_warps");
    in.add(pairs(8), 10);
    bench.run();
    EXPECT_EQ(cycles_of(out), (std::vector<Cycle>{11 + latency}));
    EXPECT_EQ(out.records().at(0).item.merge_pairs, 0b1111);
  }
}

TEST_F(QruTimedTest, ExaminesItsQuadsPerCycle) {
  for (const unsigned rate : {1U, 2U, 4U, 8U}) {
    Bench bench(Fidelity::lt, "qru", "pairing", context,
                {{"quads_per_cycle", std::to_string(rate)}, {"latency_cycles", "4"}});
    Source<BinItem>& in = bench.source<BinItem>("in_quads", 64);
    Sink<Warp>& out = bench.sink<Warp>("out_warps", 64);
    in.add(pairs(128));
    bench.run();
    ASSERT_EQ(out.records().size(), 16U);
    for (std::size_t n = 0; n < 16; ++n) EXPECT_EQ(out.records()[n].cycle, (n + 1) * 8 / rate + 4) << rate;
    // Of the 8 / rate cycles of a warp the last launches it.
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), QruWork::launches), 16);
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), QruWork::quads), 16.0 * (8.0 / rate - 1));
  }
}

TEST_F(QruTimedTest, ALaunchEndsACycleHoweverManyQuadsItMayExamine) {
  Bench bench(Fidelity::lt, "qru", "pairing", context, {{"quads_per_cycle", "16"}, {"latency_cycles", "4"}});
  Source<BinItem>& in = bench.source<BinItem>("in_quads", 64);
  Sink<Warp>& out = bench.sink<Warp>("out_warps", 64);
  in.add(pairs(128));
  bench.run();
  ASSERT_EQ(out.records().size(), 16U);
  for (std::size_t n = 0; n < 16; ++n) EXPECT_EQ(out.records()[n].cycle, 1 + n + 4);
}

TEST_F(QruTimedTest, ABinWhoseBeatsComeLateIsExaminedAsTheyCome) {
  Bench bench(Fidelity::lt, "qru", "pairing", context, {{"quads_per_cycle", "8"}, {"latency_cycles", "4"}});
  Source<BinItem>& in = bench.source<BinItem>("in_quads", 64);
  Sink<Warp>& out = bench.sink<Warp>("out_warps", 64);
  in.add(pairs(32), {10, 40}, 4);
  bench.run();
  EXPECT_EQ(cycles_of(out), (std::vector<Cycle>{15, 25, 35, 45})) << "a beat, of a warp, every ten cycles from 11 on";
}

// Two warps are launched of each beat, which takes two cycles: a burst waits for one another at QRU, not on the link.
TEST_F(QruTimedTest, BeatsOfALinkOfFewPlacesAndALongLatencyComeInBursts) {
  Bench bench(Fidelity::lt, "qru", "pairing", context, {{"quads_per_cycle", "16"}, {"latency_cycles", "4"}});
  Source<BinItem>& in = bench.source<BinItem>("in_quads", 2, 40);
  Sink<Warp>& out = bench.sink<Warp>("out_warps", 64);
  in.add(pairs(64), {0, 3}, 4);
  bench.run();
  // Two beats are there in 40 and 41; the third has its place when the first has left in 41, the fourth when the second has.
  EXPECT_EQ(cycles_of(out), (std::vector<Cycle>{44, 45, 46, 47, 86, 87, 88, 89}));
}

TEST_F(QruTimedTest, LeftOversOfABinGoOneACycleBeforeTheNext) {
  Bench bench(Fidelity::lt, "qru", "pairing", context, {{"quads_per_cycle", "8"}, {"latency_cycles", "1"}});
  Source<BinItem>& in = bench.source<BinItem>("in_quads", 64);
  Sink<Warp>& out = bench.sink<Warp>("out_warps", 64);
  in.add(bins.at({0, 0}, testing::numbers(32)), {0, 3}, 4);  // none pairs
  in.add(bins.at({1, 0}, testing::numbers(8), 100));
  bench.run();
  ASSERT_EQ(out.records().size(), 5U);
  // Examined in cycles 1 to 4; in the last of them nothing more comes, so that the first goes in it.
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(out.records()[i].cycle, 4 + i + 1);
    EXPECT_EQ(out.records()[i].item.tile, (TileId{0, 0}));
  }
  EXPECT_EQ(out.records()[4].item.tile, (TileId{1, 0}));
  EXPECT_EQ(out.records()[4].cycle, out.records()[3].cycle + 1);
}

TEST_F(QruTimedTest, TheEndCarriesTheNumberOfWarpsAndBinsGoBackToTc) {
  for (const char* implementation : {"pairing", "pass-through"}) {
    Bench bench(Fidelity::lt, "qru", implementation, context);
    Source<BinItem>& in = bench.source<BinItem>("in_quads");
    Sink<Warp>& out = bench.sink<Warp>("out_warps");
    std::vector<BinItem> all;
    for (unsigned i = 0; i < 7; ++i) all.push_back(bins.at({0, 0}, testing::numbers(8), 8 * i));
    for (const BinItem& bin : all) in.add(bin);
    in.add(Bins::end());
    bench.run();
    ASSERT_EQ(out.records().size(), 8U);
    EXPECT_TRUE(out.records()[7].item.mark == Mark::end_of_frame);
    EXPECT_EQ(out.records()[7].item.sequence, 7U);
    for (const BinItem& bin : all) EXPECT_FALSE(bin.storage->in_use);
    EXPECT_TRUE(bench.unit().idle());
  }
}

// case M13
TEST_F(QruTimedTest, ABinThatDiedInTheTestsLaunchesNothing) {
  Bench bench(Fidelity::lt, "qru", "pairing", context);
  Source<BinItem>& in = bench.source<BinItem>("in_quads");
  Sink<Warp>& out = bench.sink<Warp>("out_warps");
  in.add(bins.of({0, 0}, {}));
  in.add(Bins::end());
  bench.run();
  ASSERT_EQ(out.records().size(), 1U);
  EXPECT_EQ(out.records()[0].item.sequence, 0U);
}

TEST_F(QruTimedTest, ABlockedReceiverStopsItUntilACycleAfterItTakes) {
  Bench bench(Fidelity::lt, "qru", "pairing", context, {{"quads_per_cycle", "8"}, {"latency_cycles", "1"}});
  Source<BinItem>& in = bench.source<BinItem>("in_quads", 16);
  Sink<Warp>& out = bench.sink<Warp>("out_warps", 1);
  for (unsigned i = 0; i < 3; ++i) in.add(pairs(8));
  in.add(Bins::end(), 100);
  out.close(0, 40);
  bench.run();
  EXPECT_EQ(cycles_of(out), (std::vector<Cycle>{40, 42, 44, 102}));
  EXPECT_EQ(testing::charged(bench.unit(), UnitState::blocked, 102), 40U) << "cycles 2 to 40, and 42";
}

/// Numbers, pairs and quads of all warps, in the order of their launch.
std::vector<std::uint32_t> contents(const Sink<Warp>& sink) {
  std::vector<std::uint32_t> all;
  for (const auto& record : sink.records()) {
    const Warp& warp = record.item;
    all.insert(all.end(),
               {warp.sequence, warp.tile_sequence, warp.merge_pairs, warp.tile.x, warp.mark == Mark::end_of_frame});
    for (unsigned i = 0; i < warp.count; ++i) all.push_back(warp.quads[i].splat);
  }
  return all;
}

/// Bins of 0 to 79 quads, some of which pair, for a QRU of any fidelity.
class ManyBins {
 public:
  ManyBins() {
    for (std::uint64_t bin = 0; bin < positions_.size(); ++bin) {
      for (std::uint64_t q = 0; q < mix(bin) % 80; ++q)
        positions_[bin].push_back(static_cast<unsigned>(mix(200 * bin + q) % 30));
    }
  }
  void add_to(Source<QuadBeat>& in) const {
    in.set_rate(1);
    for (std::size_t bin = 0; bin < positions_.size(); ++bin) {
      const std::size_t quads = positions_[bin].size();
      for (std::size_t from = 0; from == 0 || from < quads; from += 16) {
        const std::size_t to = std::min(from + 16, quads);
        const std::vector<unsigned> part(&positions_[bin][from], &positions_[bin][to]);
        in.add(testing::beat_of(tile_of(bin), part, static_cast<std::uint32_t>(1000 * bin + from), to == quads));
      }
    }
    in.add(testing::end_beat());
  }
  void add_to(Source<BinItem>& in, Bins& bins) const {
    for (std::size_t bin = 0; bin < positions_.size(); ++bin) {
      const auto beats = static_cast<unsigned>(std::max<std::size_t>((positions_[bin].size() + 15) / 16, 1));
      in.add(bins.at(tile_of(bin), positions_[bin], static_cast<std::uint32_t>(1000 * bin)), {0, beats - 1}, beats);
    }
    in.add(Bins::end());
  }

 private:
  static TileId tile_of(std::size_t bin) { return {static_cast<std::uint16_t>(bin / 5), 0}; }
  std::vector<std::vector<unsigned>> positions_ = std::vector<std::vector<unsigned>>(20);
};

TEST_F(QruTimedTest, WithRoomToSpareWarpsLeaveWhenTheyDoAtCycle) {
  for (const char* implementation : {"pairing", "pass-through"}) {
    Bench cycle("qru", implementation, context);
    ManyBins().add_to(cycle.source<QuadBeat>("in_quads", 128));
    const Sink<Warp>& expected = cycle.sink<Warp>("out_warps", 256);
    cycle.run();
    const std::vector<Cycle> cycles = cycles_of(expected);
    Bench bench(Fidelity::lt, "qru", implementation, context);
    ManyBins().add_to(bench.source<BinItem>("in_quads", 128), bins);
    const Sink<Warp>& out = bench.sink<Warp>("out_warps", 256);
    bench.run();
    EXPECT_EQ(cycles_of(out), cycles) << implementation;
  }
}

TEST_F(QruTimedTest, WarpsAreThoseOfCycleUnderAnyStalls) {
  for (const char* implementation : {"pairing", "pass-through"}) {
    std::vector<std::uint32_t> expected;
    {
      Bench cycle("qru", implementation, context);
      ManyBins().add_to(cycle.source<QuadBeat>("in_quads"));
      const Sink<Warp>& out = cycle.sink<Warp>("out_warps");
      cycle.run();
      expected = contents(out);
    }
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      Bench bench(Fidelity::lt, "qru", implementation, context);
      Source<BinItem>& in = bench.source<BinItem>("in_quads", static_cast<unsigned>(1 + seed % 10));
      Sink<Warp>& out = bench.sink<Warp>("out_warps", static_cast<unsigned>(1 + seed % 9));
      ManyBins().add_to(in, bins);
      bench.stall_randomly(seed, seed == 0 ? 0 : 100);
      bench.run();
      ASSERT_EQ(contents(out), expected) << seed;
      ASSERT_TRUE(bench.unit().idle()) << seed;
    }
  }
}

}  // namespace
}  // namespace vrpipe
