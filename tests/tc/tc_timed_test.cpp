// TC at lt, where a flushed bin goes in one piece, compared with cycle, where it goes beat by beat.
#include <map>

#include <gtest/gtest.h>

#include "support/fidelities.h"
#include "tc/tc.h"
#include "tc/tc_tiles.h"

namespace vrpipe {
namespace {

using testing::beat_of;
using testing::end_beat;
using testing::numbers;
using testing::splats_of;
using testing::tile;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class TcTimedTest : public ::testing::Test {
 protected:
  TcTimedTest() : draw(testing::draw_of(640, 640)), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

/// TC with its ports.
struct TimedTcBench {
  TimedTcBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {},
               unsigned in_depth = 4, unsigned out_depth = 64)
      : bench(fidelity, "tc", "tile-coalescing", context, settings),
        in(bench.source<QuadBeat>("in_quads", in_depth)),
        out(bench.sink<BinItem>("out_bins", out_depth)) {}

  std::vector<std::uint32_t> splats() const {
    std::vector<std::uint32_t> all;
    for (const auto& record : out.records()) {
      if (record.item.mark == Mark::end_of_frame) continue;
      for (const std::uint32_t splat : splats_of(record.item)) all.push_back(splat);
    }
    return all;
  }

  Bench bench;
  Source<QuadBeat>& in;
  Sink<BinItem>& out;
};

TEST_F(TcTimedTest, AFullBinIsSeenFromTheCycleAfterItFilledPlusTheLatencyOnABeatACycle) {
  TimedTcBench tc(Fidelity::lt, context, {{"bin_quads", "64"}, {"latency_cycles", "4"}});
  for (unsigned i = 0; i < 4; ++i) tc.in.add(beat_of(tile(3), numbers(16), 16 * i), 10 + i);
  tc.bench.run();
  ASSERT_EQ(tc.out.records().size(), 1U);
  // The last quads are in hand at 14; the bin goes from 15 on, in four beats.
  EXPECT_EQ(tc.out.records()[0].cycle, 15U + 4);
  EXPECT_EQ(tc.out.records()[0].last, 18U + 4);
  EXPECT_EQ(tc.out.records()[0].item.tile, tile(3));
  EXPECT_EQ(splats_of(tc.out.records()[0].item), numbers(64));
}

// A rasteriser of a quad a cycle.
TEST_F(TcTimedTest, QuadsOfATileThatComeOneByOneMakeRoomForTheNextOneByOne) {
  TimedTcBench tc(Fidelity::lt, context, {}, 16);
  for (unsigned i = 0; i < 3; ++i) tc.in.add(beat_of(tile(0), numbers(16), 16 * i), {1, 16}, 16);
  tc.bench.run();
  EXPECT_EQ(tc.in.sent(), (std::vector<Cycle>{1, 17, 33}));
}

TEST_F(TcTimedTest, TakesItsQuadsPerCycleAndHandsBinsOnAtTheSameRate) {
  for (const unsigned rate : {4U, 8U, 16U}) {
    TimedTcBench tc(Fidelity::lt, context,
                    {{"quads_per_cycle", std::to_string(rate)}, {"bin_quads", "256"}, {"latency_cycles", "4"}}, 64,
                    256);
    for (unsigned i = 0; i < 64; ++i) tc.in.add(beat_of(tile(0), numbers(16), 16 * i));
    tc.bench.run();
    ASSERT_EQ(tc.out.records().size(), 4U);
    // All is at the port in cycle 1; bin n is full 256 / rate cycles after the one before, and takes as long to leave.
    for (std::size_t n = 0; n < 4; ++n) {
      EXPECT_EQ(tc.out.records()[n].cycle, (n + 1) * 256 / rate + 1 + 4) << rate;
      EXPECT_EQ(tc.out.records()[n].last, (n + 2) * 256 / rate + 4) << rate;
    }
    EXPECT_DOUBLE_EQ(testing::occupied(tc.bench.unit(), TcWork::quads), 1024.0 / rate);
    EXPECT_DOUBLE_EQ(testing::occupied(tc.bench.unit(), TcWork::beats), 1024.0 / rate);
  }
}

TEST_F(TcTimedTest, SmallBeatsShareACycle) {
  TimedTcBench tc(Fidelity::lt, context, {{"quads_per_cycle", "16"}, {"bin_quads", "64"}, {"latency_cycles", "4"}}, 64);
  for (unsigned i = 0; i < 64; ++i) tc.in.add(beat_of(tile(0), {i}, i));
  tc.bench.run();
  EXPECT_EQ(tc.out.records().at(0).cycle, 4U + 1 + 4) << "64 beats of one quad enter in four cycles";
}

TEST_F(TcTimedTest, ATileWithoutABinEvictsTheOldestInTheCycleOfItsQuads) {
  TimedTcBench tc(Fidelity::lt, context, {{"bins", "2"}, {"latency_cycles", "4"}});
  tc.in.add(beat_of(tile(0), {1, 2}, 0), 10);
  tc.in.add(beat_of(tile(1), {1}, 10), 20);
  tc.in.add(beat_of(tile(2), {1}, 20), 30);
  tc.bench.run();
  ASSERT_EQ(tc.bench.behaviour<TileCoalescing>().flushes_evicted.value(), 1U);
  EXPECT_EQ(tc.out.records().at(0).item.tile, tile(0));
  EXPECT_EQ(tc.out.records().at(0).cycle, 32U + 4) << "evicted at 31";
  EXPECT_EQ(splats_of(tc.out.records()[0].item), (std::vector<std::uint32_t>{0, 1}));
}

TEST_F(TcTimedTest, TheIdleTimeOutFiresExactlyItsCyclesAfterTheLastArrival) {
  for (const unsigned timeout : {1U, 150U, 151U}) {
    TimedTcBench tc(Fidelity::lt, context, {{"idle_timeout_cycles", std::to_string(timeout)}, {"latency_cycles", "4"}});
    tc.in.add(beat_of(tile(0), {1}), 10);
    tc.in.add(beat_of(tile(1), {1}), 1000);  // at lt it is what comes next that finds a bin's time out
    tc.in.add(end_beat(), 2000);
    tc.bench.run();
    ASSERT_EQ(tc.out.records().size(), 3U);
    // Arrives at 11, flushed at 11 + time-out, goes in the next cycle, seen the latency later.
    EXPECT_EQ(tc.out.records()[0].cycle, 11 + timeout + 1 + 4);
    EXPECT_EQ(tc.out.records()[1].cycle, 1001 + timeout + 1 + 4);
    EXPECT_EQ(tc.bench.behaviour<TileCoalescing>().flushes_timed_out.value(), 2U);
  }
}

TEST_F(TcTimedTest, BinsWhoseTimeIsOutGoOneACycle) {
  TimedTcBench tc(Fidelity::lt, context,
                  {{"idle_timeout_cycles", "20"}, {"latency_cycles", "4"}, {"flush_queue_bins", "16"}}, 16);
  for (unsigned i = 0; i < 5; ++i) tc.in.add(beat_of(tile(i), {1}, i), 10);
  tc.in.add(end_beat(), 1000);
  tc.bench.run();
  ASSERT_EQ(tc.out.records().size(), 6U);
  for (unsigned i = 0; i < 5; ++i) {
    EXPECT_EQ(tc.out.records()[i].item.tile, tile(i)) << "the oldest first";
    EXPECT_EQ(tc.out.records()[i].cycle, 11 + 20 + 1 + i + 4);
  }
}

TEST_F(TcTimedTest, AnArrivalInTheCycleOfTheTimeOutPutsItOff) {
  for (const Cycle gap : {149U, 150U, 151U}) {
    TimedTcBench tc(Fidelity::lt, context, {{"idle_timeout_cycles", "150"}});
    tc.in.add(beat_of(tile(0), {1}), 10);
    tc.in.add(beat_of(tile(0), {2}), 10 + gap);
    tc.in.add(end_beat(), 5000);
    tc.bench.run();
    EXPECT_EQ(tc.out.records().size(), gap <= 150 ? 2U : 3U) << gap;
    EXPECT_EQ(tc.splats().size(), 2U);
  }
}

TEST_F(TcTimedTest, InStrictTerminationABinWaitsForTheEndOfTheDraw) {
  context.termination = Termination::strict;
  TimedTcBench tc(Fidelity::lt, context, {{"idle_timeout_cycles", "150"}, {"latency_cycles", "4"}});
  tc.in.add(beat_of(tile(0), {1}));
  tc.in.add(end_beat(), 100'000);
  tc.bench.run();
  ASSERT_EQ(tc.out.records().size(), 2U);
  EXPECT_EQ(tc.out.records()[0].cycle, 100'001U + 2 + 4) << "the end takes a cycle of its own";
  EXPECT_TRUE(tc.out.records()[1].item.mark == Mark::end_of_frame);
  EXPECT_EQ(tc.out.records()[1].cycle, 100'001U + 3 + 4);
}

// case T05
TEST_F(TcTimedTest, TheEndOfAnEmptyDrawGoesThroughAlone) {
  TimedTcBench tc(Fidelity::lt, context);
  tc.in.add(end_beat());
  tc.bench.run();
  ASSERT_EQ(tc.out.records().size(), 1U);
  EXPECT_TRUE(tc.out.records()[0].item.mark == Mark::end_of_frame);
}

TEST_F(TcTimedTest, FlushedBinsThatNobodyTakesStopItAtTheQueuesDepth) {
  TimedTcBench tc(Fidelity::lt, context, {{"bin_quads", "16"}, {"flush_queue_bins", "3"}, {"latency_cycles", "1"}}, 1,
                  1);
  for (unsigned i = 0; i < 10; ++i) tc.in.add(beat_of(tile(0), numbers(16), 16 * i));
  tc.out.close(0, 1000);
  tc.bench.run();
  // As at cycle: one bin at the closed port, three in the queue, one at the input: the sixth waits.
  ASSERT_EQ(tc.in.sent().size(), 10U);
  EXPECT_LT(tc.in.sent()[4], 100U);
  EXPECT_GE(tc.in.sent()[5], 1000U);
  EXPECT_EQ(tc.splats(), numbers(160));
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(tc.out.records()[i].cycle, 1000 + 2 * i) << "one place";
  EXPECT_GT(testing::charged(tc.bench.unit(), UnitState::blocked, 1020), 900U);
}

/// Quads, tiles and the end, in the order in which they leave; at cycle of beats.
std::vector<std::uint64_t> contents(const Sink<BinItem>& sink) {
  std::vector<std::uint64_t> all;
  for (const auto& record : sink.records()) {
    if (record.item.mark == Mark::end_of_frame) {
      all.push_back(2'000'000);
      continue;
    }
    for (const std::uint32_t splat : splats_of(record.item)) all.push_back(splat);
    all.push_back(1'000'000 + record.item.tile.x);
  }
  return all;
}
std::vector<std::uint64_t> contents(const Sink<QuadBeat>& sink) {
  std::vector<std::uint64_t> all;
  for (const auto& record : sink.records()) {
    for (unsigned i = 0; i < record.item.count; ++i) all.push_back(record.item.quads[i].splat);
    if (record.item.last_of_bin) all.push_back(1'000'000 + record.item.tile.x);
    if (record.item.mark == Mark::end_of_frame) all.push_back(2'000'000);
  }
  return all;
}

void add_many(Source<QuadBeat>& in) {
  std::uint32_t next = 0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const std::vector<unsigned> positions(1 + mix(i) % 16, static_cast<unsigned>(mix(i + 1) % 64));
    in.add(beat_of(tile(static_cast<unsigned>(mix(i + 2) % 7)), positions, next));
    next += static_cast<std::uint32_t>(positions.size());
  }
  in.add(end_beat());
}

TEST_F(TcTimedTest, BinsAreThoseOfCycleUnderAnyStallsWithoutTimeOut) {
  context.termination = Termination::strict;
  const Bench::Settings settings{{"bins", "4"}, {"bin_quads", "24"}};
  std::vector<std::uint64_t> expected;
  {
    Bench cycle("tc", "tile-coalescing", context, settings);
    add_many(cycle.source<QuadBeat>("in_quads"));
    const Sink<QuadBeat>& out = cycle.sink<QuadBeat>("out_bins");
    cycle.run();
    expected = contents(out);
  }
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    TimedTcBench tc(Fidelity::lt, context, settings, static_cast<unsigned>(1 + seed % 10),
                    static_cast<unsigned>(1 + seed % 9));
    add_many(tc.in);
    tc.bench.stall_randomly(seed, seed == 0 ? 0 : 100);
    tc.bench.run();
    ASSERT_EQ(contents(tc.out), expected) << seed;
    ASSERT_TRUE(tc.bench.unit().idle()) << seed;
  }
}

TEST_F(TcTimedTest, WithRoomToSpareBinsLeaveWhenTheyDoAtCycle) {
  const Bench::Settings settings{{"bins", "4"}, {"bin_quads", "24"}, {"idle_timeout_cycles", "0"}};
  std::vector<Cycle> expected;  // of the last beat of each bin
  {
    Bench cycle("tc", "tile-coalescing", context, settings);
    add_many(cycle.source<QuadBeat>("in_quads"));
    const Sink<QuadBeat>& out = cycle.sink<QuadBeat>("out_bins", 64);
    cycle.run();
    for (const auto& record : out.records()) {
      if (record.item.last_of_bin || record.item.mark == Mark::end_of_frame) expected.push_back(record.cycle);
    }
  }
  TimedTcBench tc(Fidelity::lt, context, settings);
  add_many(tc.in);
  tc.bench.run();
  // The end of the frame takes a cycle of its own: the four bins that it flushes, and itself, are a cycle late.
  for (std::size_t i = expected.size() - 5; i < expected.size(); ++i) ++expected[i];
  std::vector<Cycle> got;
  for (const auto& record : tc.out.records()) got.push_back(record.last);
  EXPECT_EQ(got, expected);
}

TEST_F(TcTimedTest, WithTimeOutsStallsMayCutBinsButLoseNoQuad) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    TimedTcBench tc(Fidelity::lt, context, {{"idle_timeout_cycles", "3"}});
    for (unsigned i = 0; i < 200; ++i) tc.in.add(beat_of(tile(i % 5), {i % 64}, i));
    tc.in.add(end_beat());
    tc.bench.stall_randomly(seed, 150);
    tc.bench.run();
    ASSERT_EQ(tc.splats().size(), 200U);
    std::map<unsigned, std::uint32_t> last;
    for (const auto& record : tc.out.records()) {
      if (record.item.mark == Mark::end_of_frame) continue;
      for (const std::uint32_t splat : splats_of(record.item)) {
        ASSERT_GE(splat, last[record.item.tile.x]);
        last[record.item.tile.x] = splat;
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
