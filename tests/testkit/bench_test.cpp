// The testbench kit: sources and sinks keep the contract of links in the same way at every fidelity with time.
#include <vrpipe/testkit/bench.h>

#include <vector>

#include <gtest/gtest.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::cycles_of;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

using Cycles = std::vector<Cycle>;

/// A source and a sink, and a link between them.
struct Pair {
  Pair(Fidelity fidelity, unsigned depth, unsigned latency = 1)
      : bench(fidelity), source(bench.source<int>()), sink(bench.sink<int>()) {
    source.out().connect(sink.in(), depth, latency);
  }
  void add(int items) {
    for (int i = 0; i < items; ++i) source.add(i);
  }
  Bench bench;
  Source<int>& source;
  Sink<int>& sink;
};

class BenchTest : public ::testing::TestWithParam<Fidelity> {};

INSTANTIATE_TEST_SUITE_P(Fidelities, BenchTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(BenchTest, AnItemGoesInItsCycleAndIsTakenTheLinksLatencyLater) {
  for (const unsigned latency : {1U, 2U, 7U}) {
    Pair pair(GetParam(), 4, latency);
    pair.source.add(1, 10);
    pair.source.add(2, 25);
    pair.bench.run();
    EXPECT_EQ(pair.source.sent(), (Cycles{10, 25}));
    EXPECT_EQ(cycles_of(pair.sink), (Cycles{10 + latency, 25 + latency}));
    EXPECT_TRUE(pair.source.done());
  }
}

TEST_P(BenchTest, APlaceThatIsFreedInACycleIsFilledInTheNext) {
  Pair pair(GetParam(), 1);
  pair.add(4);
  pair.bench.run();
  EXPECT_EQ(pair.source.sent(), (Cycles{0, 2, 4, 6}));
  EXPECT_EQ(cycles_of(pair.sink), (Cycles{1, 3, 5, 7}));
}

TEST_P(BenchTest, ASourceSendsAtItsRate) {
  Pair pair(GetParam(), 16);
  pair.source.set_rate(2);
  pair.add(6);
  pair.bench.run();
  EXPECT_EQ(pair.source.sent(), (Cycles{0, 0, 1, 1, 2, 2}));
}

TEST_P(BenchTest, ASinkTakesAtItsRate) {
  Pair pair(GetParam(), 16);
  pair.sink.set_rate(2);
  pair.add(6);
  pair.bench.run();
  EXPECT_EQ(cycles_of(pair.sink), (Cycles{1, 1, 2, 2, 3, 3}));
}

TEST_P(BenchTest, AClosedSinkStopsTheSourceAtTheDepth) {
  Pair pair(GetParam(), 3);
  pair.sink.close(50, 100);
  pair.sink.close(0, 50);
  pair.add(5);
  pair.bench.run();
  EXPECT_EQ(pair.source.sent(), (Cycles{0, 0, 0, 101, 101}));
  EXPECT_EQ(cycles_of(pair.sink), (Cycles{100, 100, 100, 102, 102}));
}

TEST_P(BenchTest, ASinkThatIsClosedForGoodLeavesWhatDoesNotFitWithTheSource) {
  Pair pair(GetParam(), 3);
  pair.sink.close(0);
  pair.add(5);
  if (GetParam() == Fidelity::lt) {
    EXPECT_THROW(pair.bench.run(), SimulationFault) << "a blocking call has to return";
    return;
  }
  pair.bench.run();
  EXPECT_EQ(pair.source.sent(), (Cycles{0, 0, 0}));
  EXPECT_TRUE(pair.sink.records().empty());
  EXPECT_FALSE(pair.source.done());
}

TEST_P(BenchTest, WhatIsTakenCanBeAnswered) {
  Pair there(GetParam(), 4);
  Source<int>& answers = there.bench.source<int>();
  Sink<int>& back = there.bench.sink<int>();
  answers.out().connect(back.in(), 4, 1);
  there.sink.on_take([&](int item, Cycle now) { answers.add(-item, now + 5); });
  there.source.add(1, 10);
  there.source.add(2, 100);
  there.bench.run();
  EXPECT_EQ(answers.sent(), (Cycles{16, 106}));
  EXPECT_EQ(cycles_of(back), (Cycles{17, 107}));
  EXPECT_EQ(back.records()[1].item, -2);
}

TEST_P(BenchTest, ItemsComeInOrderEachOnceUnderAnyStallsAndNoEarlier) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Cycles expected;
    for (const unsigned per_256 : {0U, 96U}) {
      Pair pair(GetParam(), static_cast<unsigned>(1 + seed % 9), static_cast<unsigned>(1 + seed % 3));
      pair.sink.close(20, 40);
      pair.add(100);
      pair.bench.stall_randomly(seed, per_256);
      pair.bench.run();
      ASSERT_EQ(pair.sink.records().size(), 100U) << seed;
      for (std::size_t i = 0; i < 100; ++i) {
        ASSERT_EQ(pair.sink.records()[i].item, static_cast<int>(i)) << seed;
        ASSERT_FALSE(20 <= pair.sink.records()[i].cycle && pair.sink.records()[i].cycle < 40)
            << "closed, seed " << seed;
        if (per_256 != 0) {
          ASSERT_GE(pair.sink.records()[i].cycle, expected[i]) << seed;
        }
      }
      expected = cycles_of(pair.sink);
    }
  }
}

TEST(TimedBenchTest, ABatchTakesTheLinkForItsBeats) {
  Pair pair(Fidelity::lt, 8, 2);
  pair.source.add(1, {10, 14}, 5);
  pair.source.add(2);
  pair.bench.run();
  EXPECT_EQ(pair.source.sent(), (Cycles{10, 15}));
  ASSERT_EQ(pair.sink.records().size(), 2U);
  EXPECT_EQ(pair.sink.records()[0].cycle, 12U);
  EXPECT_EQ(pair.sink.records()[0].last, 16U);
  EXPECT_EQ(pair.sink.records()[1].cycle, 17U);
  EXPECT_EQ(pair.sink.records()[1].last, 17U);
}

TEST(TimedBenchTest, ABatchThatGoesLateTakesAsLong) {
  Pair pair(Fidelity::lt, 4);
  pair.sink.close(0, 100);
  pair.source.add(1, {0, 3}, 4);
  pair.source.add(2, {10, 19}, 4);
  pair.bench.run();
  EXPECT_EQ(pair.sink.records()[0].cycle, 100U);
  EXPECT_EQ(pair.source.sent()[1], 101U);
  EXPECT_EQ(pair.sink.records()[1].cycle, 102U);
  EXPECT_EQ(pair.sink.records()[1].last, 102U + 9);
}

TEST(BenchTest, AtCycleThereAreNoBatches) {
  Pair pair(Fidelity::cycle, 4);
  EXPECT_THROW(pair.source.add(1, {0, 3}, 4), SimulationFault);
}

TEST(BenchTest, WithoutTimeThereIsNoBench) {
  EXPECT_THROW(Bench{Fidelity::functional}, UserError);
  EXPECT_THROW(Bench{Fidelity::bound}, UserError);
}

}  // namespace
}  // namespace vrpipe
