// DRAW at lt; what has one closed form at every fidelity is compared with cycle by it.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/draw.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::cycles_of;
using testkit::Bench;
using testkit::Sink;

class DrawTimedTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  DrawTimedTest() : draw(testing::draw_of(16, 16, std::vector<Splat>(40))), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

INSTANTIATE_TEST_SUITE_P(Fidelities, DrawTimedTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(DrawTimedTest, WarpNGoesInCycle1024NOverItsRateAndTheEndAfterTheLast) {
  for (const unsigned rate : {1U, 88U, 256U, 300U, 1000U, 1024U}) {
    Bench bench(GetParam(), "draw", "vertex-issue", context, {{"warps_per_1024_cycles", std::to_string(rate)}});
    Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0");
    bench.run();
    ASSERT_EQ(warps.records().size(), 6U);
    for (std::size_t i = 0; i < 5; ++i) {
      EXPECT_EQ(warps.records()[i].cycle, 1024 * i / rate + 1) << "seen a link later, rate " << rate;
      EXPECT_EQ(warps.records()[i].item.first_splat, 8 * i);
      EXPECT_EQ(warps.records()[i].item.splats, 8U);
    }
    EXPECT_TRUE(warps.records()[5].item.mark == Mark::end_of_frame);
    EXPECT_EQ(warps.records()[5].cycle, warps.records()[4].cycle + 1);
    EXPECT_TRUE(bench.unit().idle());
  }
}

TEST_P(DrawTimedTest, AnIntervalIsBusyWithItsWarpAndLatencyAfterThat) {
  Bench bench(GetParam(), "draw", "vertex-issue", context, {{"warps_per_1024_cycles", "256"}});
  bench.sink<VertexWarp>("out_vertices_0");
  bench.run();
  EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), DrawWork::warps), 5 * 4) << "until the next could go";
  EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), DrawWork::warps, 18), 18);
  EXPECT_EQ(testing::charged(bench.unit(), UnitState::busy, 18), 6U) << "five warps and the end";
  EXPECT_EQ(bench.unit().account().cycles(UnitState::latency), 4U * 3);
}

// case Z01
TEST_P(DrawTimedTest, AnEmptyDrawIsOnlyItsEnd) {
  draw.splats.clear();
  context = testing::context_of(draw);
  Bench bench(GetParam(), "draw", "vertex-issue", context);
  Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0");
  bench.run();
  ASSERT_EQ(warps.records().size(), 1U);
  EXPECT_TRUE(warps.records()[0].item.mark == Mark::end_of_frame);
  EXPECT_EQ(warps.records()[0].cycle, 1U);
}

TEST_P(DrawTimedTest, GpcsGetWarpsInTurnAndEachAnEnd) {
  Bench bench(GetParam(), "draw", "vertex-issue", context, {{"warps_per_1024_cycles", "1024"}}, 3);
  const Sink<VertexWarp>* sinks[3];
  for (unsigned gpc = 0; gpc < 3; ++gpc) sinks[gpc] = &bench.sink<VertexWarp>("out_vertices_" + std::to_string(gpc));
  bench.run();
  // Warps 0 to 4 go to GPCs 0, 1, 2, 0, 1, and the ends to 2, 0, 1.
  EXPECT_EQ(cycles_of(*sinks[0]), (std::vector<Cycle>{1, 4, 7}));
  EXPECT_EQ(cycles_of(*sinks[1]), (std::vector<Cycle>{2, 5, 8}));
  EXPECT_EQ(cycles_of(*sinks[2]), (std::vector<Cycle>{3, 6}));
  for (const auto* sink : sinks) EXPECT_TRUE(sink->records().back().item.mark == Mark::end_of_frame);
}

TEST_P(DrawTimedTest, AFullReceiverBlocksItUntilACycleAfterItTakes) {
  Bench bench(GetParam(), "draw", "vertex-issue", context, {{"warps_per_1024_cycles", "1024"}});
  Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0", 2);
  warps.close(0, 50);
  bench.run();
  // Two wait, their places are free from 51 on, and a warp a cycle goes.
  EXPECT_EQ(cycles_of(warps), (std::vector<Cycle>{50, 50, 52, 53, 54, 55}));
  EXPECT_EQ(testing::charged(bench.unit(), UnitState::blocked, 55), 49U) << "cycles 2 to 50";
}

TEST_P(DrawTimedTest, OneGpcThatTakesNothingHoldsUpTheOthers) {
  Bench bench(GetParam(), "draw", "vertex-issue", context, {{"warps_per_1024_cycles", "1024"}}, 2);
  Sink<VertexWarp>& open = bench.sink<VertexWarp>("out_vertices_0", 8);
  Sink<VertexWarp>& closed = bench.sink<VertexWarp>("out_vertices_1", 1);
  closed.close(0, 100);
  bench.run();
  // Warp 3 waits for the place of warp 1, warp 4 for warp 3.
  EXPECT_EQ(cycles_of(open), (std::vector<Cycle>{1, 3, 103, 105}));
  EXPECT_EQ(cycles_of(closed), (std::vector<Cycle>{100, 102, 104}));
}

TEST_P(DrawTimedTest, StallsLoseAndAddNothing) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Bench bench(GetParam(), "draw", "vertex-issue", context, {{"warps_per_1024_cycles", "1024"}});
    Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0", static_cast<unsigned>(1 + seed % 10));
    bench.stall_randomly(seed, 100);
    bench.run();
    ASSERT_EQ(warps.records().size(), 6U) << seed;
    for (std::size_t i = 0; i < 5; ++i) ASSERT_EQ(warps.records()[i].item.first_splat, 8 * i) << seed;
    ASSERT_TRUE(warps.records()[5].item.mark == Mark::end_of_frame) << seed;
    ASSERT_TRUE(bench.unit().idle()) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
