#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/draw.h>
#include <vrpipe/testkit/bench.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;

class DrawUnitTest : public ::testing::Test {
 protected:
  DrawUnitTest() : draw(testing::draw_of(16, 16, std::vector<Splat>(40))), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

TEST_F(DrawUnitTest, IssuesAtItsRateAndEndsTheDraw) {
  Bench bench("draw", "vertex-issue", context, {{"warps_per_1024_cycles", "256"}});
  Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0");
  bench.run();
  ASSERT_EQ(warps.records().size(), 6U);
  // One warp in four cycles, seen a cycle later.
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(warps.records()[i].cycle, 4 * i + 1);
    EXPECT_EQ(warps.records()[i].item.first_splat, 8 * i);
  }
  EXPECT_TRUE(warps.records()[5].item.mark == Mark::end_of_frame);
  EXPECT_TRUE(bench.unit().idle());
  // Until the next could go, each keeps the unit.
  EXPECT_EQ(bench.unit().occupancy().items(DrawWork::warps), 20U);
  EXPECT_DOUBLE_EQ(bench.unit().occupancy().parts(18)[0].cycles, 18);
}

TEST_F(DrawUnitTest, TheDefaultRateIs88WarpsIn1024Cycles) {
  draw.splats.resize(8 * 88 + 1);
  context = testing::context_of(draw);
  Bench bench("draw", "vertex-issue", context);
  Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0");
  bench.run();
  EXPECT_EQ(warps.records()[88].cycle, 1025U);
}

// case Z01
TEST_F(DrawUnitTest, AnEmptyDrawIsOnlyItsEnd) {
  draw.splats.clear();
  context = testing::context_of(draw);
  Bench bench("draw", "vertex-issue", context);
  Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0");
  bench.run();
  ASSERT_EQ(warps.records().size(), 1U);
  EXPECT_TRUE(warps.records()[0].item.mark == Mark::end_of_frame);
}

TEST_F(DrawUnitTest, GpcsGetWarpsInTurnAndEachAnEnd) {
  Bench bench("draw", "vertex-issue", context, {}, 3);
  Sink<VertexWarp>* sinks[3];
  for (unsigned gpc = 0; gpc < 3; ++gpc) sinks[gpc] = &bench.sink<VertexWarp>("out_vertices_" + std::to_string(gpc));
  bench.run();
  const std::uint32_t expected[3][2] = {{0, 24}, {8, 32}, {16, 0}};
  for (unsigned gpc = 0; gpc < 3; ++gpc) {
    const std::size_t warps = gpc == 2 ? 1 : 2;
    ASSERT_EQ(sinks[gpc]->records().size(), warps + 1);
    for (std::size_t i = 0; i < warps; ++i) EXPECT_EQ(sinks[gpc]->records()[i].item.first_splat, expected[gpc][i]);
    EXPECT_TRUE(sinks[gpc]->records().back().item.mark == Mark::end_of_frame);
  }
}

TEST_F(DrawUnitTest, AFullReceiverBlocksItUntilACycleAfterItTakes) {
  Bench bench("draw", "vertex-issue", context, {{"warps_per_1024_cycles", "1024"}});
  Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0", 2);
  warps.close(0, 50);
  bench.run();
  // Two waited, their credits come back in 51, a third is seen in 52.
  EXPECT_EQ(warps.records()[1].cycle, 50U);
  EXPECT_EQ(warps.records()[2].cycle, 52U);
  bench.unit().close_account(53);
  EXPECT_EQ(bench.unit().account().cycles(UnitState::blocked), 49U);
}

TEST_F(DrawUnitTest, StallsLoseAndAddNothing) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Bench bench("draw", "vertex-issue", context, {{"warps_per_1024_cycles", "1024"}});
    Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0", static_cast<unsigned>(1 + seed % 3));
    bench.stall_randomly(seed, 100);
    bench.run();
    ASSERT_EQ(warps.records().size(), 6U) << seed;
    for (std::size_t i = 0; i < 5; ++i) ASSERT_EQ(warps.records()[i].item.first_splat, 8 * i) << seed;
    ASSERT_TRUE(warps.records()[5].item.mark == Mark::end_of_frame) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
