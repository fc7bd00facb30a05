// TGC at lt; what has one closed form at every fidelity is compared with cycle by it.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/tgc.h>

#include "support/fidelities.h"
#include "tgc/tgc_items.h"

namespace vrpipe {
namespace {

using testing::cycles_of;
using testing::item_in;
using testing::marked;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class TgcTimedTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  TgcTimedTest() : draw(testing::draw_of(1024, 1024)), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

INSTANTIATE_TEST_SUITE_P(Fidelities, TgcTimedTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(TgcTimedTest, AFlushedPrimitiveIsSeenItsLatencyAfterTheDecision) {
  Bench bench(GetParam(), "tgc", "tile-grid-coalescing", context, {{"bin_primitives", "1"}, {"latency_cycles", "7"}});
  Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives");
  Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs");
  in.add(item_in(0, {0, 0, 4, 4}), 10);
  bench.run();
  EXPECT_EQ(cycles_of(out), (std::vector<Cycle>{12 + 7})) << "in hand and decided at 11, read out from 12 on";
}

TEST_P(TgcTimedTest, TakesItsEntriesPerCycleAndReadsOutOnePrimitiveACycle) {
  for (const unsigned rate : {1U, 2U, 8U}) {
    Bench bench(GetParam(), "tgc", "tile-grid-coalescing", context,
                {{"entries_per_cycle", std::to_string(rate)}, {"bin_primitives", "32"}, {"latency_cycles", "4"}});
    Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", 64);
    Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs", 64);
    for (std::uint32_t i = 0; i < 32; ++i) in.add(item_in(i, {0, 0, 4, 4}));
    bench.run();
    ASSERT_EQ(out.records().size(), 32U);
    // All 32 are in hand at cycle 1; the last enters in cycle 32 / rate, the read-out starts in the next.
    for (std::size_t i = 0; i < 32; ++i) {
      EXPECT_EQ(out.records()[i].cycle, 32 / rate + 1 + i + 4) << rate;
      EXPECT_EQ(out.records()[i].item.primitive.splat, i);
    }
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), TgcWork::entries), 32.0 / rate);
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), TgcWork::primitives), 32);
  }
}

TEST_P(TgcTimedTest, BinsFillWhileAnotherIsReadOut) {
  Bench bench(GetParam(), "tgc", "tile-grid-coalescing", context,
              {{"entries_per_cycle", "1"}, {"bin_primitives", "16"}, {"latency_cycles", "1"}});
  Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", 128);
  Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs", 128);
  for (std::uint32_t i = 0; i < 64; ++i) in.add(item_in(i, {0, 0, 4, 4}));
  bench.run();
  ASSERT_EQ(out.records().size(), 64U);
  for (std::size_t i = 0; i < 64; ++i) EXPECT_EQ(out.records()[i].cycle, 16 + 1 + i + 1) << "without a gap";
}

TEST_P(TgcTimedTest, PassingThroughHandsOnOneJobACycle) {
  Bench bench(GetParam(), "tgc", "pass-through", context);
  Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", 32);
  Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs", 32);
  for (std::uint32_t i = 0; i < 16; ++i) in.add(item_in(i, {0, 0, 4, 4}));
  in.add(marked<PrimitiveItem>());
  bench.run();
  ASSERT_EQ(out.records().size(), 17U);
  for (std::size_t i = 1; i < 16; ++i) EXPECT_EQ(out.records()[i].cycle, out.records()[0].cycle + i);
  EXPECT_TRUE(out.records()[16].item.mark == Mark::end_of_frame);
}

// case T05
TEST_P(TgcTimedTest, TheEndFlushesAllBinsAndComesLast) {
  for (const unsigned bins : {0U, 1U, 128U}) {
    Bench bench(GetParam(), "tgc", "tile-grid-coalescing", context);
    Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives");
    Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs");
    for (std::uint32_t i = 0; i < bins; ++i) {
      const auto x = static_cast<std::int32_t>(i % 16 * 64);
      const auto y = static_cast<std::int32_t>(i / 16 * 64);
      in.add(item_in(i, {x, y, x + 1, y + 1}));
    }
    in.add(marked<PrimitiveItem>());
    bench.run();
    ASSERT_EQ(out.records().size(), bins + 1);
    for (std::uint32_t i = 0; i < bins; ++i) EXPECT_EQ(out.records()[i].item.primitive.splat, i);
    EXPECT_TRUE(out.records()[bins].item.mark == Mark::end_of_frame);
    EXPECT_TRUE(bench.unit().idle());
  }
}

TEST_P(TgcTimedTest, BinsThatTheEndFlushesFollowOneAnotherWithoutAGap) {
  Bench bench(GetParam(), "tgc", "tile-grid-coalescing", context, {{"latency_cycles", "4"}});
  Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", 32);
  Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs", 32);
  for (std::int32_t i = 0; i < 10; ++i) in.add(item_in(static_cast<std::uint32_t>(i), {64 * i, 0, 64 * i + 1, 1}));
  in.add(marked<PrimitiveItem>(), 100);
  bench.run();
  ASSERT_EQ(out.records().size(), 11U);
  // The end is in hand at 101, and the first bin is read out from 102 on. At lt the end takes a cycle of its own.
  const Cycle first = GetParam() == Fidelity::cycle ? 102 : 103;
  for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(out.records()[i].cycle, first + i + 4);
}

TEST_P(TgcTimedTest, AFullReceiverStopsItUntilACycleAfterItTakes) {
  Bench bench(GetParam(), "tgc", "tile-grid-coalescing", context, {{"bin_primitives", "4"}, {"latency_cycles", "1"}});
  Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", 64);
  Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs", 2);
  out.close(0, 100);
  for (std::uint32_t i = 0; i < 16; ++i) in.add(item_in(i, {0, 0, 4, 4}));
  bench.run();
  ASSERT_EQ(out.records().size(), 16U);
  EXPECT_EQ(out.records()[1].cycle, 100U);
  EXPECT_EQ(out.records()[2].cycle, 102U);
  for (std::size_t i = 3; i < 16; ++i) EXPECT_EQ(out.records()[i].cycle, 100 + i);
  EXPECT_GT(testing::charged(bench.unit(), UnitState::blocked, 116), 80U);
}

TEST_P(TgcTimedTest, FlushesAreTheSameUnderAnyStalls) {
  std::vector<std::uint32_t> expected;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    // What is to come out is what cycle makes of it undisturbed.
    Bench bench(seed == 0 ? Fidelity::cycle : GetParam(), "tgc", "tile-grid-coalescing", context,
                {{"bins", "4"}, {"bin_primitives", "3"}});
    Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", static_cast<unsigned>(1 + seed % 10));
    Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs", static_cast<unsigned>(1 + seed % 7));
    for (std::uint32_t i = 0; i < 100; ++i) {
      const auto x = static_cast<std::int32_t>(mix(i) % 500);
      in.add(item_in(i, {x, 30, x + 70, 66}));
    }
    in.add(marked<PrimitiveItem>());
    if (seed > 0) bench.stall_randomly(seed, 100);
    bench.run();
    std::vector<std::uint32_t> jobs;
    for (const auto& record : out.records()) {
      jobs.push_back(record.item.mark == Mark::end_of_frame
                         ? ~0U
                         : record.item.primitive.splat << 8U |
                               static_cast<std::uint32_t>(record.item.clip.x0 / 64 + 16 * (record.item.clip.y0 / 64)));
    }
    if (seed == 0) expected = jobs;
    ASSERT_EQ(jobs, expected) << seed;
    ASSERT_TRUE(bench.unit().idle()) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
