#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

#include "support/builders.h"
#include "tgc/tgc_items.h"

namespace vrpipe {
namespace {

using testing::item_in;
using testing::marked;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class TgcUnitTest : public ::testing::Test {
 protected:
  TgcUnitTest() : draw(testing::draw_of(1024, 1024)), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

TEST_F(TgcUnitTest, AFlushedPrimitiveIsSeenItsLatencyAfterTheDecision) {
  Bench bench("tgc", "tile-grid-coalescing", context, {{"bin_primitives", "1"}, {"latency_cycles", "7"}});
  Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives");
  Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs");
  in.add(item_in(0, {0, 0, 4, 4}), 10);
  bench.run();
  ASSERT_EQ(out.records().size(), 1U);
  // In hand and decided at 11, read out at 12 at the earliest, the pipeline of 7 from there.
  EXPECT_EQ(out.records()[0].cycle, 12U + 7);
}

TEST_F(TgcUnitTest, AFlushIsReadOutOnePrimitiveACycleInOrder) {
  Bench bench("tgc", "tile-grid-coalescing", context);
  Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", 32);
  Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs", 32);
  for (std::uint32_t i = 0; i < 16; ++i) in.add(item_in(i, {0, 0, 4, 4}));
  bench.run();
  ASSERT_EQ(out.records().size(), 16U);
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(out.records()[i].item.primitive.splat, i);
    EXPECT_EQ(out.records()[i].cycle, out.records()[0].cycle + i);
  }
}

TEST_F(TgcUnitTest, TakesItsEntriesPerCycle) {
  for (const unsigned rate : {1U, 2U, 8U}) {
    Bench bench("tgc", "tile-grid-coalescing", context,
                {{"entries_per_cycle", std::to_string(rate)}, {"bin_primitives", "32"}});
    Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", 64);
    Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs", 64);
    for (std::uint32_t i = 0; i < 32; ++i) in.add(item_in(i, {0, 0, 4, 4}));
    bench.run();
    // All 32 are in hand at cycle 1; the last enters in cycle 32 / rate, the read-out starts in the next.
    EXPECT_EQ(out.records()[0].cycle, 32 / rate + 1 + 4);
  }
}

TEST_F(TgcUnitTest, PassingThroughTakesTwoPrimitivesInAndOneJobOutACycle) {
  Bench bench("tgc", "pass-through", context);
  Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", 16);
  Sink<RasterJob>& out = bench.sink<RasterJob>("out_jobs", 16);
  for (std::uint32_t i = 0; i < 16; ++i) in.add(item_in(i, {0, 0, 4, 4}));
  in.add(marked<PrimitiveItem>());
  bench.run();
  ASSERT_EQ(out.records().size(), 17U);
  EXPECT_EQ(out.records()[15].cycle - out.records()[0].cycle, 15U);
  EXPECT_TRUE(out.records()[16].item.mark == Mark::end_of_frame);
}

// case T05
TEST_F(TgcUnitTest, TheEndFlushesAllBinsAndComesLast) {
  for (const unsigned bins : {0U, 1U, 128U}) {
    Bench bench("tgc", "tile-grid-coalescing", context);
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

TEST_F(TgcUnitTest, FlushesAreTheSameUnderAnyStalls) {
  std::vector<std::uint32_t> expected;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Bench bench("tgc", "tile-grid-coalescing", context, {{"bins", "4"}, {"bin_primitives", "3"}});
    Source<PrimitiveItem>& in = bench.source<PrimitiveItem>("in_primitives", static_cast<unsigned>(1 + seed % 4));
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
  }
}

}  // namespace
}  // namespace vrpipe
