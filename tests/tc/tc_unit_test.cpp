#include <map>

#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

#include "support/builders.h"
#include "tc/tc.h"
#include "tc/tc_tiles.h"

namespace vrpipe {
namespace {

using testing::beat_of;
using testing::end_beat;
using testing::numbers;
using testing::tile;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class TcUnitTest : public ::testing::Test {
 protected:
  TcUnitTest() : draw(testing::draw_of(640, 640)), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

std::size_t quads_in(const Sink<QuadBeat>& sink) {
  std::size_t quads = 0;
  for (const auto& record : sink.records()) quads += record.item.count;
  return quads;
}

std::size_t bins_in(const Sink<QuadBeat>& sink) {
  std::size_t bins = 0;
  for (const auto& record : sink.records()) bins += record.item.last_of_bin;
  return bins;
}

TEST_F(TcUnitTest, TheIdleTimeOutFiresExactlyItsCyclesAfterTheLastArrival) {
  for (const unsigned timeout : {1U, 150U, 151U}) {
    Bench bench("tc", "tile-coalescing", context,
                {{"idle_timeout_cycles", std::to_string(timeout)}, {"latency_cycles", "4"}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins");
    in.add(beat_of(tile(0), {1}), 10);
    bench.run();
    ASSERT_EQ(out.records().size(), 1U);
    // Arrives at 11, flushed at 11 + time-out, sent in the next cycle, seen the latency later.
    EXPECT_EQ(out.records()[0].cycle, 11 + timeout + 1 + 4);
    EXPECT_EQ(bench.behaviour<TileCoalescing>().flushes_timed_out.value(), 1U);
  }
}

TEST_F(TcUnitTest, AnArrivalACycleBeforeTheTimeOutPutsItOff) {
  for (const Cycle gap : {149U, 150U, 151U}) {
    Bench bench("tc", "tile-coalescing", context);
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins");
    in.add(beat_of(tile(0), {1}), 10);
    in.add(beat_of(tile(0), {2}), 10 + gap);
    bench.run();
    // In the cycle of the time-out itself the quad still comes first: collecting goes before flushing.
    EXPECT_EQ(bins_in(out), gap <= 150 ? 1U : 2U) << gap;
    EXPECT_EQ(quads_in(out), 2U);
  }
}

TEST_F(TcUnitTest, WithoutATimeOutABinWaitsForTheEndOfTheDraw) {
  for (const bool strict : {false, true}) {
    RenderContext own = context;
    if (strict) own.termination = Termination::strict;
    Bench bench("tc", "tile-coalescing", own, {{"idle_timeout_cycles", strict ? "150" : "0"}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins");
    in.add(beat_of(tile(0), {1}));
    in.add(end_beat(), 100'000);
    bench.run();
    ASSERT_EQ(out.records().size(), 2U);
    EXPECT_GT(out.records()[0].cycle, 100'000U);
    EXPECT_TRUE(out.records()[1].item.mark == Mark::end_of_frame);
  }
}

// case T04
TEST_F(TcUnitTest, ABinThatFillsInTheCycleOfItsTimeOutIsFlushedOnceAsFull) {
  for (const Cycle gap : {149U, 150U}) {
    Bench bench("tc", "tile-coalescing", context, {{"bin_quads", "2"}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins");
    in.add(beat_of(tile(0), {1}), 10);
    in.add(beat_of(tile(0), {2}), 10 + gap);
    bench.run();
    EXPECT_EQ(bins_in(out), 1U);
    EXPECT_EQ(bench.behaviour<TileCoalescing>().flushes_full.value(), 1U);
    EXPECT_EQ(bench.behaviour<TileCoalescing>().flushes_timed_out.value(), 0U);
    EXPECT_EQ(bench.behaviour<TileCoalescing>().flushes.value(), 1U);
  }
}

TEST_F(TcUnitTest, TakesItsQuadsPerCycle) {
  for (const unsigned rate : {4U, 8U, 16U}) {
    Bench bench("tc", "tile-coalescing", context, {{"quads_per_cycle", std::to_string(rate)}, {"bin_quads", "1024"}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 64);
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins", 8);
    for (unsigned i = 0; i < 64; ++i) in.add(beat_of(tile(0), numbers(16), 16 * i));
    bench.run();
    ASSERT_GT(out.records().size(), 0U);
    // All is at the port in cycle 1; the last quad enters 1024 / rate cycles on, and the full bin leaves from there.
    EXPECT_EQ(out.records()[0].cycle, 1024 / rate + 1 + 4);
    EXPECT_EQ(out.records().back().cycle - out.records()[0].cycle + 1, 1024 / rate);
  }
}

TEST_F(TcUnitTest, SmallBeatsShareACycle) {
  Bench bench("tc", "tile-coalescing", context, {{"quads_per_cycle", "16"}, {"bin_quads", "64"}});
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 64);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins", 8);
  for (unsigned i = 0; i < 64; ++i) in.add(beat_of(tile(0), {i}, i));
  bench.run();
  EXPECT_EQ(out.records()[0].cycle, 4U + 1 + 4) << "64 beats of one quad enter in four cycles";
}

// case T05
TEST_F(TcUnitTest, TheEndOfAnEmptyDrawGoesThroughAlone) {
  Bench bench("tc", "tile-coalescing", context);
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins");
  in.add(end_beat());
  bench.run();
  ASSERT_EQ(out.records().size(), 1U);
  EXPECT_TRUE(out.records()[0].item.mark == Mark::end_of_frame);
  EXPECT_EQ(out.records()[0].item.count, 0);
}

TEST_F(TcUnitTest, FlushedBinsThatNobodyTakesStopItAtTheQueuesDepth) {
  Bench bench("tc", "tile-coalescing", context,
              {{"bin_quads", "16"}, {"flush_queue_bins", "3"}, {"latency_cycles", "1"}});
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 1);
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins", 1);
  for (unsigned i = 0; i < 10; ++i) in.add(beat_of(tile(0), numbers(16), 16 * i));
  out.close(0, 1000);
  bench.run();
  // One bin at the closed port, three in the queue, one at the input: the sixth waits.
  EXPECT_LT(in.sent()[4], 100U);
  EXPECT_GE(in.sent()[5], 1000U);
  EXPECT_EQ(quads_in(out), 160U);
}

TEST_F(TcUnitTest, BinsAreTheSameUnderAnyStallsWithoutTimeOut) {
  context.termination = Termination::strict;
  std::vector<std::uint64_t> expected;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Bench bench("tc", "tile-coalescing", context, {{"bins", "4"}, {"bin_quads", "24"}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", static_cast<unsigned>(1 + seed % 5));
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins", static_cast<unsigned>(1 + seed % 3));
    std::uint32_t next = 0;
    for (std::uint64_t i = 0; i < 200; ++i) {
      const std::vector<unsigned> positions(1 + mix(i) % 16, static_cast<unsigned>(mix(i + 1) % 64));
      in.add(beat_of(tile(static_cast<unsigned>(mix(i + 2) % 7)), positions, next));
      next += static_cast<std::uint32_t>(positions.size());
    }
    in.add(end_beat());
    if (seed > 0) bench.stall_randomly(seed, 100);
    if (seed > 0) bench.shuffle_ticks(seed);
    bench.run();
    std::vector<std::uint64_t> got;
    for (const auto& record : out.records()) {
      for (unsigned i = 0; i < record.item.count; ++i) got.push_back(record.item.quads[i].splat);
      if (record.item.last_of_bin) got.push_back(1'000'000 + record.item.tile.x);
      if (record.item.mark == Mark::end_of_frame) got.push_back(2'000'000);
    }
    if (seed == 0) expected = got;
    ASSERT_EQ(got, expected) << seed;
    ASSERT_TRUE(bench.unit().idle());
  }
}

TEST_F(TcUnitTest, WithTimeOutsStallsMayCutBinsButLoseNoQuad) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Bench bench("tc", "tile-coalescing", context, {{"idle_timeout_cycles", "3"}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_bins");
    for (unsigned i = 0; i < 200; ++i) in.add(beat_of(tile(i % 5), {i % 64}, i));
    in.add(end_beat());
    bench.stall_randomly(seed, 150);
    bench.run();
    ASSERT_EQ(quads_in(out), 200U);
    std::map<unsigned, std::uint32_t> last;
    for (const auto& record : out.records()) {
      for (unsigned i = 0; i < record.item.count; ++i) {
        ASSERT_GE(record.item.quads[i].splat, last[record.item.tile.x]);
        last[record.item.tile.x] = record.item.quads[i].splat;
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
