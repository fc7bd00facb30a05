// DRAW at a barrier: nothing behind it is issued before every GPC has come to it, and the rate begins anew.
#include <gtest/gtest.h>

#include <vrpipe/component/error.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::geometry_of;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

/// Sixteen splats, a draw that reads what they leave, and eight splats more; the barrier is at command 1.
RenderContext two_passes() {
  Frame frame(16, 16);
  frame.draw(geometry_of(16, 16, std::vector<Splat>(16)), {});
  frame.draw(geometry_of(16, 16, std::vector<Splat>(2)), testing::alpha_threshold_state());
  frame.draw(geometry_of(16, 16, std::vector<Splat>(8)), {});
  return testing::context_of(frame);
}

class DrawBarrierTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  static constexpr Mark barrier = static_cast<Mark>(2);

  /// A bench whose GPCs come to the barrier so long after one of them has seen it.
  struct DrawBench {
    DrawBench(Fidelity fidelity, const std::vector<Cycle>& delays, const Bench::Settings& settings)
        : bench(fidelity, "draw", "vertex-issue", two_passes(), settings, static_cast<unsigned>(delays.size())) {
      for (unsigned gpc = 0; gpc < delays.size(); ++gpc) {
        done.push_back(&bench.source<BlendsDone>("in_done_" + std::to_string(gpc)));
        warps.push_back(&bench.sink<VertexWarp>("out_vertices_" + std::to_string(gpc)));
        warps.back()->on_take([this, delays](const VertexWarp& warp, Cycle now) {
          if (warp.mark != barrier) return;
          for (unsigned each = 0; each < delays.size(); ++each) done[each]->add({barrier}, now + delays[each]);
        });
      }
    }
    Bench bench;
    std::vector<Sink<VertexWarp>*> warps;
    std::vector<Source<BlendsDone>*> done;
  };
};
INSTANTIATE_TEST_SUITE_P(Fidelities, DrawBarrierTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(DrawBarrierTest, WhatIsBehindItGoesOnceItIsPassedAndIsNotCaughtUp) {
  DrawBench draw(GetParam(), {300}, {{"warps_per_1024_cycles", "8"}});
  draw.bench.run();
  // Warps in 0 and 128, seen a cycle later, and the barrier behind them. The answer goes 300 cycles after that has come,
  // and is seen a cycle later, in 431: then the draw that waits, the mark of the next, and 128 cycles after the first its
  // warp; the end.
  EXPECT_EQ(testing::cycles_of(*draw.warps[0]), (std::vector<Cycle>{1, 129, 130, 432, 433, 560, 561}));
  EXPECT_TRUE(draw.bench.unit().idle());
  EXPECT_EQ(testing::charged(draw.bench.unit(), UnitState::busy, 561), 7U);
  EXPECT_EQ(draw.bench.unit().account().cycles(UnitState::latency), 561U - 7U);
}

TEST_P(DrawBarrierTest, AllGpcsHaveToComeToIt) {
  DrawBench draw(GetParam(), {300, 20, 700}, {{"warps_per_1024_cycles", "1024"}});
  draw.bench.run();
  // Warps to GPC 0 and 1, the barrier to GPC 2, seen in 3.
  EXPECT_EQ(draw.warps[2]->records().front().cycle, 3U);
  EXPECT_EQ(draw.warps[0]->records()[1].cycle, 3U + 700U + 2U);
}

TEST_P(DrawBarrierTest, StallsChangeNothingInTheOrder) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    DrawBench draw(GetParam(), {50}, {{"warps_per_1024_cycles", "1024"}});
    draw.bench.stall_randomly(seed, 96);
    draw.bench.run();
    ASSERT_EQ(draw.warps[0]->records().size(), 7U);
    EXPECT_GT(draw.warps[0]->records()[3].cycle, draw.warps[0]->records()[2].cycle + 50U);
    EXPECT_EQ(draw.warps[0]->records()[3].item.draw, 1U);
    EXPECT_EQ(draw.warps[0]->records()[5].item.draw, 2U);
    EXPECT_TRUE(draw.bench.unit().idle());
  }
}

// At lt all that the mark leads to is done when it has been sent.
TEST(DrawBarrier, AtLtAGpcThatDoesNotAnswerIsAFault) {
  Bench bench(Fidelity::lt, "draw", "vertex-issue", two_passes());
  bench.sink<VertexWarp>("out_vertices_0");
  EXPECT_THROW(bench.run(), SimulationFault);
}

}  // namespace
}  // namespace vrpipe
