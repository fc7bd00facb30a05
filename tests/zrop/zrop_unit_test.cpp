#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

#include "support/builders.h"
#include "zrop/signals.h"
#include "zrop/zrop.h"

namespace vrpipe {
namespace {

using testing::beat_of;
using testing::end_beat;
using testing::numbers;
using testing::signals;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class ZropUnitTest : public ::testing::Test {
 protected:
  ZropUnitTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {
    testing::terminate_early(context);
  }
  Draw draw;
  RenderContext context;
};

TEST_F(ZropUnitTest, ATestTakesItsLatency) {
  Bench bench("zrop", "depth-stencil-rop", context, {{"latency_cycles", "8"}});
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads");
  in.add(beat_of({0, 0}, {1}), 10);
  bench.run();
  ASSERT_EQ(out.records().size(), 1U);
  EXPECT_EQ(out.records()[0].cycle, 11U + 8);
}

TEST_F(ZropUnitTest, TestsItsQuadsPerCycle) {
  for (const unsigned rate : {4U, 8U, 16U}) {
    Bench bench("zrop", "depth-stencil-rop", context, {{"quads_per_cycle", std::to_string(rate)}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 32);
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 32);
    for (unsigned i = 0; i < 32; ++i) in.add(beat_of({0, 0}, numbers(16), 16 * i));
    bench.run();
    ASSERT_EQ(out.records().size(), 32U);
    EXPECT_EQ(out.records().back().cycle - out.records().front().cycle, 31 * 16 / rate);
  }
}

TEST_F(ZropUnitTest, ATestSeesAnUpdateOfTheCycleBeforeAndNotOfItsOwn) {
  // The update is applied in cycle 21 and keeps the test from the z-cache in it.
  for (const Cycle pushed : {19U, 20U, 21U}) {
    Bench bench("zrop", "depth-stencil-rop", context, {{"latency_cycles", "1"}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
    Source<TerminationBeat>& updates = bench.source<TerminationBeat>("in_terminations");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads");
    in.add(beat_of({0, 0}, {7}), pushed);  // in hand a cycle later
    updates.add(signals({7}), 20);
    bench.run();
    EXPECT_EQ(out.records().size(), pushed == 19 ? 1U : 0U) << pushed;
    if (pushed == 19) {
      EXPECT_EQ(out.records()[0].cycle, 21U) << "tested in 20, before the update";
    }
  }
}

TEST_F(ZropUnitTest, ACycleWithAnUpdateTestsNothing) {
  for (const unsigned updates_at_once : {0U, 1U, 3U}) {
    Bench bench("zrop", "depth-stencil-rop", context, {{"latency_cycles", "1"}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 8);
    Source<TerminationBeat>& updates = bench.source<TerminationBeat>("in_terminations");
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 8);
    for (unsigned i = 0; i < 6; ++i) in.add(beat_of({0, 0}, numbers(16), 16 * i));
    if (updates_at_once == 1) updates.add(signals({60}), 2);
    if (updates_at_once == 3) updates.add(signals({60, 61, 62}), 2);
    bench.run();
    ASSERT_EQ(out.records().size(), 6U);
    // One signal a cycle, from cycle 3 on; a beat in each other cycle from 1 on.
    EXPECT_EQ(out.records()[1].cycle, 3U);
    EXPECT_EQ(out.records()[2].cycle, 4U + updates_at_once);
    EXPECT_EQ(out.records()[5].cycle, 7U + updates_at_once);
  }
}

TEST_F(ZropUnitTest, AnUpdateThatComesDuringAWideTestIsAppliedThen) {
  // Both beats are there from cycle 11 on, and the first is tested until 26; the update has been on its way since before.
  const auto cycle_of_second = [&](bool updates) {
    Bench bench("zrop", "depth-stencil-rop", context, {{"latency_cycles", "1"}, {"quads_per_cycle", "1"}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 8);
    Source<TerminationBeat>& terminations = bench.source<TerminationBeat>("in_terminations", 4, 10);
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 8);
    in.add(beat_of({0, 0}, numbers(16)), 10);
    in.add(beat_of({0, 0}, {1}, 16), 10);
    if (updates) terminations.add(signals({60}), 8);
    bench.run();
    return out.records().back().cycle;
  };
  EXPECT_EQ(cycle_of_second(true), cycle_of_second(false));
}

TEST_F(ZropUnitTest, AppliesItsUpdatesPerCycle) {
  Bench bench("zrop", "depth-stencil-rop", context, {{"latency_cycles", "1"}, {"updates_per_cycle", "4"}});
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 8);
  Source<TerminationBeat>& updates = bench.source<TerminationBeat>("in_terminations");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 8);
  for (unsigned i = 0; i < 3; ++i) in.add(beat_of({0, 0}, numbers(16), 16 * i));
  updates.add(signals({60, 61, 62, 63}), 1);
  bench.run();
  EXPECT_EQ(out.records()[1].cycle, 4U) << "one cycle for four signals";
  EXPECT_EQ(bench.behaviour<DepthStencilRop>().termination_updates.value(), 4U);
}

TEST_F(ZropUnitTest, ADeadBeatStaysButForTheMarkThatClosesItsBin) {
  Bench bench("zrop", "depth-stencil-rop", context);
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
  Source<TerminationBeat>& updates = bench.source<TerminationBeat>("in_terminations");
  Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads");
  updates.add(signals({1, 2}));
  in.add(beat_of({0, 0}, {1, 2}), 100);
  in.add(beat_of({0, 0}, {1, 2}, 2, true));
  in.add(end_beat());
  bench.run();
  ASSERT_EQ(out.records().size(), 2U);
  EXPECT_TRUE(out.records()[0].item.last_of_bin);
  EXPECT_EQ(out.records()[0].item.count, 0);
  EXPECT_TRUE(out.records()[1].item.mark == Mark::end_of_frame);
  EXPECT_TRUE(bench.unit().idle());
}

// case H05
TEST_F(ZropUnitTest, NoUpdateIsLostUnderAnyStallsAndEveryQuadIsAccountedFor) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Bench bench("zrop", "depth-stencil-rop", context);
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", static_cast<unsigned>(1 + seed % 3));
    Source<TerminationBeat>& updates =
        bench.source<TerminationBeat>("in_terminations", static_cast<unsigned>(1 + seed % 4));
    Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", static_cast<unsigned>(1 + seed % 5));
    for (unsigned i = 0; i < 60; ++i) {
      in.add(beat_of({0, 0}, {i, (i + 1) % 64, (i + 2) % 64}, 3 * i));
      updates.add(signals({i, (7 * i) % 64}, static_cast<LaneMask>(1U << i % 4)));
    }
    in.add(beat_of({0, 0}, {0}, 500), 50'000);  // after everything
    bench.stall_randomly(seed, 110);
    bench.shuffle_ticks(seed + 1);
    bench.run();
    const auto& zrop = bench.behaviour<DepthStencilRop>();
    std::size_t survivors = 0;
    for (const auto& record : out.records()) survivors += record.item.count;
    ASSERT_EQ(zrop.quads_tested.value(), 181U);
    ASSERT_EQ(survivors + zrop.quads_terminated.value(), 181U);
    ASSERT_EQ(zrop.termination_updates.value(), 120U);
    ASSERT_EQ(out.records().back().item.quads[0].coverage, 0b1110) << "position 0 was signalled with lane 0 alone";
  }
}

}  // namespace
}  // namespace vrpipe
