// ZROP at lt, where a bin goes in one piece.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/tc.h>

#include "support/fidelities.h"
#include "zrop/signals.h"
#include "zrop/zrop.h"

namespace vrpipe {
namespace {

using testing::Bins;
using testing::cycles_of;
using testing::signals;
using testing::splats_of;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class ZropTimedTest : public ::testing::Test {
 protected:
  ZropTimedTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {
    testing::terminate_early(context);
  }
  Draw draw;
  RenderContext context;
  Bins bins;
};

/// ZROP with its ports; updates of a cycle are there before the bins of it.
struct TimedZropBench {
  TimedZropBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {},
                 unsigned depth = 64)
      : bench(fidelity, "zrop", "depth-stencil-rop", context, settings),
        updates(bench.source<TerminationBeat>("in_terminations")),
        in(bench.source<BinItem>("in_quads", depth)),
        out(bench.sink<BinItem>("out_quads", depth)) {}
  Bench bench;
  Source<TerminationBeat>& updates;
  Source<BinItem>& in;
  Sink<BinItem>& out;
};

TEST_F(ZropTimedTest, ATestTakesItsLatency) {
  for (const unsigned latency : {1U, 8U}) {
    TimedZropBench zrop(Fidelity::lt, context, {{"latency_cycles", std::to_string(latency)}});
    zrop.in.add(bins.at({0, 0}, {1}), 10);
    zrop.bench.run();
    EXPECT_EQ(cycles_of(zrop.out), (std::vector<Cycle>{11 + latency}));
  }
}

TEST_F(ZropTimedTest, TestsItsQuadsPerCycle) {
  for (const unsigned rate : {4U, 8U, 16U}) {
    TimedZropBench zrop(Fidelity::lt, context, {{"quads_per_cycle", std::to_string(rate)}, {"latency_cycles", "8"}},
                        512);
    for (unsigned i = 0; i < 8; ++i) zrop.in.add(bins.at({0, 0}, testing::numbers(64), 64 * i), {0, 3}, 4);
    zrop.bench.run();
    ASSERT_EQ(zrop.out.records().size(), 8U);
    for (std::size_t n = 0; n < 8; ++n) {
      EXPECT_EQ(zrop.out.records()[n].cycle, 1 + n * 64 / rate + 8) << rate;
      // As at cycle a beat of 16 goes whole, and the unit is taken after that.
      EXPECT_EQ(zrop.out.records()[n].last, (n + 1) * 64 / rate + 8 - (16 / rate - 1)) << rate;
    }
    EXPECT_DOUBLE_EQ(testing::occupied(zrop.bench.unit(), ZropWork::tests), 512.0 / rate);
    EXPECT_EQ(testing::charged(zrop.bench.unit(), UnitState::busy, 513), 512 / rate);
  }
}

TEST_F(ZropTimedTest, BinsOfAnySizeAreTestedInTheCyclesOfCycle) {
  // Beats as wide as the unit.
  for (const unsigned rate : {8U, 16U}) {
    const Bench::Settings settings{{"quads_per_cycle", std::to_string(rate)}, {"latency_cycles", "8"}};
    std::vector<Cycle> expected;  // of the last beat of each bin
    {
      Bench cycle("zrop", "depth-stencil-rop", context, settings);
      Source<QuadBeat>& in = cycle.source<QuadBeat>("in_quads", 128);
      in.set_rate(1);
      for (unsigned i = 0; i < 30; ++i) {
        const auto quads = static_cast<unsigned>(1 + mix(i) % 60);
        for (unsigned from = 0; from < quads; from += rate) {
          const std::vector<unsigned> part(std::min(rate, quads - from), 0);
          in.add(testing::beat_of({0, 0}, part, from, from + rate >= quads), 3 * i);
        }
      }
      const Sink<QuadBeat>& out = cycle.sink<QuadBeat>("out_quads", 256);
      cycle.run();
      for (const auto& record : out.records()) {
        if (record.item.last_of_bin) expected.push_back(record.cycle);
      }
    }
    TimedZropBench zrop(Fidelity::lt, context, settings, 128);
    zrop.in.set_rate(1);
    for (unsigned i = 0; i < 30; ++i) {
      const auto quads = static_cast<unsigned>(1 + mix(i) % 60);
      const unsigned beats = (quads + rate - 1) / rate;
      BinItem bin = bins.at({0, 0}, std::vector<unsigned>(quads, 0));
      bin.beats = beats;
      zrop.in.add(bin, {3 * i, 3 * i + beats - 1}, beats);
    }
    zrop.bench.run();
    std::vector<Cycle> got;
    for (const auto& record : zrop.out.records()) got.push_back(record.last);
    EXPECT_EQ(got, expected) << rate;
  }
}

TEST_F(ZropTimedTest, ATestSeesAnUpdateOfTheCycleBeforeAndNotOfItsOwn) {
  // The update is applied in cycle 21 and keeps the test from the z-cache in it.
  for (const Cycle pushed : {19U, 20U, 21U}) {
    TimedZropBench zrop(Fidelity::lt, context, {{"latency_cycles", "1"}}, 4);
    zrop.in.add(bins.at({0, 0}, {7}), pushed);  // in hand a cycle later
    zrop.updates.add(signals({7}), 20);
    zrop.bench.run();
    ASSERT_EQ(zrop.out.records().size(), 1U) << "what is left of a bin passes, be it nothing";
    EXPECT_EQ(zrop.out.records()[0].item.quads, pushed == 19 ? 1U : 0U) << pushed;
    EXPECT_EQ(zrop.out.records()[0].cycle, pushed == 19 ? 21U : 23U) << "tested in 20 or in 22";
  }
}

TEST_F(ZropTimedTest, AnUpdateOfABinsCyclesComesTooLateForIt) {
  // Sixteen quads a cycle from 11 on; position 40 is tested in 13.
  for (const Cycle pushed : {11U, 12U, 13U}) {
    TimedZropBench zrop(Fidelity::lt, context, {{"quads_per_cycle", "16"}});
    zrop.updates.add(signals({40}), pushed);  // applied a cycle later
    zrop.in.add(bins.at({0, 0}, testing::numbers(64)), {10, 13}, 4);
    zrop.in.add(bins.at({0, 0}, {40}, 64), 100);
    zrop.bench.run();
    ASSERT_EQ(zrop.out.records().size(), 2U);
    EXPECT_EQ(zrop.out.records()[0].item.quads, 64U) << "later than the call that brings the bin: " << pushed;
    EXPECT_EQ(zrop.out.records()[1].item.quads, 0U);
  }
}

TEST_F(ZropTimedTest, ACycleWithAnUpdateTestsNothing) {
  for (const unsigned updates_at_once : {0U, 1U, 3U}) {
    TimedZropBench zrop(Fidelity::lt, context, {{"latency_cycles", "1"}, {"updates_per_cycle", "1"}}, 4);
    for (unsigned i = 0; i < 6; ++i) zrop.in.add(bins.at({0, 0}, testing::numbers(16), 16 * i), i);
    if (updates_at_once == 1) zrop.updates.add(signals({60}), 2);
    if (updates_at_once == 3) zrop.updates.add(signals({60, 61, 62}), 2);
    zrop.bench.run();
    ASSERT_EQ(zrop.out.records().size(), 6U);
    // One signal a cycle, from cycle 3 on; a bin in each other cycle from 1 on.
    EXPECT_EQ(zrop.out.records()[1].cycle, 3U);
    EXPECT_EQ(zrop.out.records()[2].cycle, 4U + updates_at_once);
    EXPECT_EQ(zrop.out.records()[5].cycle, 7U + updates_at_once);
    EXPECT_DOUBLE_EQ(testing::occupied(zrop.bench.unit(), ZropWork::tests), 6);
    EXPECT_DOUBLE_EQ(testing::occupied(zrop.bench.unit(), ZropWork::updates), updates_at_once);
  }
}

TEST_F(ZropTimedTest, AppliesItsUpdatesPerCycle) {
  TimedZropBench zrop(Fidelity::lt, context, {{"latency_cycles", "1"}, {"updates_per_cycle", "4"}}, 4);
  for (unsigned i = 0; i < 3; ++i) zrop.in.add(bins.at({0, 0}, testing::numbers(16), 16 * i), i);
  zrop.updates.add(signals({60, 61, 62, 63}), 1);
  zrop.bench.run();
  EXPECT_EQ(cycles_of(zrop.out), (std::vector<Cycle>{2, 4, 5})) << "one cycle for four signals";
  EXPECT_EQ(zrop.bench.behaviour<DepthStencilRop>().termination_updates.value(), 4U);
}

TEST_F(ZropTimedTest, UpdatesAfterTheLastTestAreCountedWithTheDraw) {
  TimedZropBench zrop(Fidelity::lt, context);
  zrop.in.add(bins.at({0, 0}, {1}));
  zrop.updates.add(signals({1, 2}), 50);
  zrop.bench.run();
  zrop.bench.unit().close_account(60);
  EXPECT_EQ(zrop.bench.behaviour<DepthStencilRop>().termination_updates.value(), 2U);
}

TEST_F(ZropTimedTest, SurvivorsKeepTheirOrderAndTheDeadAreTakenOut) {
  TimedZropBench zrop(Fidelity::lt, context);
  zrop.updates.add(signals({1, 3}));
  zrop.updates.add(signals({4}, 0b0011));
  zrop.in.add(bins.at({0, 0}, {0, 1, 2, 3, 4, 5}, 100), 50);
  zrop.bench.run();
  ASSERT_EQ(zrop.out.records().size(), 1U);
  EXPECT_EQ(splats_of(zrop.out.records()[0].item), (std::vector<std::uint32_t>{100, 102, 104, 105}));
  EXPECT_EQ(zrop.out.records()[0].item.storage->flush.quads[2].coverage, 0b1100);
}

TEST_F(ZropTimedTest, WhatIsLeftOfABinTakesItsOwnBeats) {
  // Of four cycles of tests the second and third leave nothing.
  TimedZropBench zrop(Fidelity::lt, context, {{"quads_per_cycle", "16"}, {"latency_cycles", "8"}});
  for (unsigned i = 16; i < 48; i += 4) zrop.updates.add(signals({i, i + 1, i + 2, i + 3}));
  zrop.in.add(bins.at({0, 0}, testing::numbers(64)), {100, 103}, 4);
  zrop.in.add(Bins::end());
  zrop.bench.run();
  ASSERT_EQ(zrop.out.records().size(), 2U);
  EXPECT_EQ(zrop.out.records()[0].item.quads, 32U);
  EXPECT_EQ(zrop.out.records()[0].cycle, 101U + 8);
  EXPECT_EQ(zrop.out.records()[0].last, 104U + 8);
  EXPECT_TRUE(zrop.out.records()[1].item.mark == Mark::end_of_frame);
  EXPECT_EQ(zrop.out.records()[1].cycle, 105U + 8);
  EXPECT_TRUE(zrop.bench.unit().idle());
}

TEST_F(ZropTimedTest, AReceiverThatTakesNothingStopsIt) {
  TimedZropBench zrop(Fidelity::lt, context, {{"latency_cycles", "1"}, {"quads_per_cycle", "16"}}, 2);
  zrop.out.close(0, 200);
  for (unsigned i = 0; i < 5; ++i) zrop.in.add(bins.at({0, 0}, testing::numbers(16), 16 * i));
  zrop.in.add(Bins::end());
  zrop.bench.run();
  ASSERT_EQ(zrop.out.records().size(), 6U);
  for (unsigned i = 0; i < 5; ++i) EXPECT_EQ(splats_of(zrop.out.records()[i].item).at(0), 16 * i);
  EXPECT_GT(testing::charged(zrop.bench.unit(), UnitState::blocked, 210), 180U);
}

// case H05
TEST_F(ZropTimedTest, NoUpdateIsLostUnderAnyStallsAndEveryQuadIsAccountedFor) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    TimedZropBench zrop(Fidelity::lt, context, {}, static_cast<unsigned>(1 + seed % 10));
    for (unsigned i = 0; i < 60; ++i) {
      zrop.in.add(bins.at({0, 0}, {i, (i + 1) % 64, (i + 2) % 64}, 3 * i));
      zrop.updates.add(signals({i, (7 * i) % 64}, static_cast<LaneMask>(1U << i % 4)));
    }
    zrop.in.add(bins.at({0, 0}, {0}, 500), 50'000);  // after everything
    zrop.bench.stall_randomly(seed, 110);
    zrop.bench.run();
    const auto& behaviour = zrop.bench.behaviour<DepthStencilRop>();
    std::size_t survivors = 0;
    for (const auto& record : zrop.out.records()) survivors += record.item.quads;
    ASSERT_EQ(zrop.out.records().size(), 61U) << seed;
    ASSERT_EQ(behaviour.quads_tested.value(), 181U);
    ASSERT_EQ(survivors + behaviour.quads_terminated.value(), 181U);
    ASSERT_EQ(behaviour.termination_updates.value(), 120U);
    ASSERT_EQ(zrop.out.records().back().item.storage->flush.quads[0].coverage, 0b1110)
        << "position 0 was signalled with lane 0 alone";
  }
}

}  // namespace
}  // namespace vrpipe
