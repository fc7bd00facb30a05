#include <vrpipe/kernel/link.h>

#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

std::vector<Cycle> cycles_of(const Sink<int>& sink) {
  std::vector<Cycle> cycles;
  for (const auto& record : sink.records()) cycles.push_back(record.cycle);
  return cycles;
}

StreamIn<int>& clocked(Sink<int>& sink) { return dynamic_cast<StreamIn<int>&>(sink.in()); }

/// A sender and a receiver, and a link between them.
struct Pair {
  Pair(unsigned depth, unsigned latency) : source(bench.source<int>()), sink(bench.sink<int>()) {
    source.out().connect(sink.in(), depth, latency);
  }
  Bench bench;
  Source<int>& source;
  Sink<int>& sink;
};

TEST(Link, AnItemPushedAtTThroughLatencyLIsVisibleAtTPlusLAndNotBefore) {
  for (const unsigned latency : {1U, 2U, 7U}) {
    Pair pair(4, latency);
    pair.source.add(42, 10);
    // A look at every cycle: the sink is asked at t + L - 1 and must find nothing.
    std::vector<std::pair<Cycle, bool>> looks;
    struct Looker : Clocked {
      Cycle tick(Cycle now) override {
        looks->emplace_back(now, end->ready());
        return now < 30 ? now + 1 : never;
      }
      StreamIn<int>* end;
      std::vector<std::pair<Cycle, bool>>* looks;
    } looker;
    looker.end = &clocked(pair.sink);
    looker.looks = &looks;
    pair.bench.clock().attach(looker);
    pair.sink.close(0, 29);
    pair.bench.run();
    EXPECT_FALSE(looks[10 + latency - 1].second);
    EXPECT_TRUE(looks[10 + latency].second);
  }
}

TEST(Link, TheSendersPipelineAddsItsLatencyAndItsPlaces) {
  Bench bench;
  Source<int>& source = bench.source<int>();
  Sink<int>& sink = bench.sink<int>();
  source.out().set_pipeline({5, 2});
  source.out().connect(sink.in(), 4, 1);
  EXPECT_EQ(clocked(sink).depth(), 4u + 5 * 2);
  source.add(1, 10);
  bench.run();
  EXPECT_EQ(cycles_of(sink), (std::vector<Cycle>{16}));
}

TEST(Link, ACreditComesBackACycleAfterTheItemWasTaken) {
  Pair pair(1, 1);
  for (int i = 0; i < 4; ++i) pair.source.add(i);
  pair.bench.run();
  // Pushed at 0, taken at 1, the credit counts at 2.
  EXPECT_EQ(pair.source.sent(), (std::vector<Cycle>{0, 2, 4, 6}));
  EXPECT_EQ(cycles_of(pair.sink), (std::vector<Cycle>{1, 3, 5, 7}));
}

TEST(Link, TwoPlacesSustainAnItemACycle) {
  Pair pair(2, 1);
  pair.source.set_rate(1);
  pair.sink.set_rate(1);
  for (int i = 0; i < 10; ++i) pair.source.add(i);
  pair.bench.run();
  EXPECT_EQ(pair.source.sent().back(), 9u);
}

TEST(Link, AReceiverThatTakesNothingStopsTheSenderAtTheDepth) {
  Pair pair(3, 1);
  pair.sink.close(0, 100);
  for (int i = 0; i < 5; ++i) pair.source.add(i);
  pair.bench.run();
  EXPECT_EQ(pair.source.sent(), (std::vector<Cycle>{0, 0, 0, 101, 101}));
}

TEST(Link, ABlockedSenderSleepsUntilTheCreditWakesIt) {
  Pair pair(1, 1);
  pair.sink.close(0, 1'000'000);
  pair.source.add(1);
  pair.source.add(2);
  pair.bench.run();
  EXPECT_LT(pair.bench.clock().edges(), 12u);
}

TEST(Link, ItemsComeInOrderEachOnceUnderAnyStalls) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Pair pair(static_cast<unsigned>(1 + seed % 5), static_cast<unsigned>(1 + seed % 3));
    for (int i = 0; i < 200; ++i) pair.source.add(i);
    pair.bench.stall_randomly(seed, 96);
    pair.bench.run();
    ASSERT_EQ(pair.sink.records().size(), 200u) << seed;
    for (int i = 0; i < 200; ++i) ASSERT_EQ(pair.sink.records()[static_cast<std::size_t>(i)].item, i) << seed;
  }
}

TEST(Link, TheOrderInWhichTheEndsTickChangesNoCycle) {
  std::vector<Cycle> expected;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Pair pair(2, 2);
    for (int i = 0; i < 50; ++i) pair.source.add(i);
    pair.sink.close(20, 33);
    pair.bench.shuffle_ticks(seed);
    pair.bench.run();
    if (expected.empty()) expected = cycles_of(pair.sink);
    EXPECT_EQ(cycles_of(pair.sink), expected) << seed;
  }
}

TEST(Link, APushWithoutACreditIsAFault) {
  struct Rude : sc_core::sc_module, Clocked, PortOwner {
    Rude(const sc_core::sc_module_name& name, ClockDomain& domain)
        : sc_module(name), PortOwner({&domain, domain.attach(*this)}), out(*this, "out") {}
    Cycle tick(Cycle) override {
      out.push(1);
      out.push(2);
      return never;
    }
    StreamOut<int> out;
  };
  Bench bench;
  Sink<int>& sink = bench.sink<int>();
  Rude rude("rude", bench.clock());
  rude.out.connect(sink.in(), 1, 1);
  EXPECT_THROW(bench.run(), SimulationFault);
}

TEST(Link, EndsOfDifferentItemsAndEndsInUseAreRefused) {
  Bench bench;
  Source<int>& source = bench.source<int>();
  Sink<float>& other = bench.sink<float>();
  Sink<int>& sink = bench.sink<int>();
  EXPECT_THROW(source.out().connect(other.in(), 4, 1), UserError);
  source.out().connect(sink.in(), 4, 1);
  Source<int>& second = bench.source<int>();
  EXPECT_THROW(second.out().connect(sink.in(), 4, 1), UserError);
  EXPECT_THROW(source.out().connect(bench.sink<int>().in(), 4, 1), UserError);
}

TEST(Link, AStubbedOutputSwallowsAndAStubbedInputStaysEmpty) {
  Bench bench;
  Source<int>& source = bench.source<int>();
  Sink<int>& sink = bench.sink<int>();
  for (int i = 0; i < 1000; ++i) source.add(i);
  bench.run();  // stubs both
  EXPECT_TRUE(source.done());
  EXPECT_EQ(source.out().transferred(), 1000u);
  EXPECT_TRUE(sink.records().empty());
}

TEST(LinkRecorder, SeesEveryTransferWithItsCycleAndChangesNothing) {
  std::vector<Cycle> plain;
  for (const bool recorded : {false, true}) {
    Bench bench;
    Source<int>& source = bench.source<int>();
    Sink<int>& sink = bench.sink<int>();
    LinkRecorder<int> recorder;
    LinkOptions options{3, 2};
    if (recorded) options.observers = {&recorder};
    source.out().connect(sink.in(), options);
    for (int i = 0; i < 40; ++i) source.add(i);
    sink.close(5, 17);
    bench.run();
    if (!recorded) {
      plain = cycles_of(sink);
      continue;
    }
    EXPECT_EQ(cycles_of(sink), plain);
    ASSERT_EQ(recorder.records().size(), 40u);
    for (std::size_t i = 0; i < 40; ++i) {
      EXPECT_EQ(recorder.records()[i].item, static_cast<int>(i));
      EXPECT_EQ(recorder.records()[i].cycle, source.sent()[i]);
    }
  }
}

// Recorded, items and credits pass the sockets; not recorded, the ends call each other.
TEST(LinkRecorder, ChangesNoCycleUnderAnyStalls) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    std::vector<Cycle> cycles[2];
    for (const bool recorded : {false, true}) {
      Bench bench;
      Source<int>& source = bench.source<int>();
      Sink<int>& sink = bench.sink<int>();
      LinkRecorder<int> recorder;
      LinkOptions options{static_cast<unsigned>(1 + seed % 4), static_cast<unsigned>(1 + seed % 3)};
      if (recorded) options.observers = {&recorder};
      source.out().connect(sink.in(), options);
      for (int i = 0; i < 60; ++i) source.add(i);
      bench.stall_randomly(seed, 80);
      bench.run();
      cycles[recorded ? 1 : 0] = cycles_of(sink);
    }
    ASSERT_EQ(cycles[0].size(), 60u);
    ASSERT_EQ(cycles[0], cycles[1]) << seed;
  }
}

TEST(LinkRecorder, OfOtherItemsIsRefused) {
  Bench bench;
  Source<int>& source = bench.source<int>();
  Sink<int>& sink = bench.sink<int>();
  LinkRecorder<char> recorder;
  LinkOptions options;
  options.observers = {&recorder};
  EXPECT_THROW(source.out().connect(sink.in(), options), UserError);
}

TEST(Link, PassesNoMoreItemsInACycleThanItsRate) {
  for (const unsigned rate : {1U, 3U}) {
    Bench bench;
    Source<int>& source = bench.source<int>();
    Sink<int>& sink = bench.sink<int>();
    LinkOptions options{8, 1};
    options.items_per_cycle = rate;
    source.out().connect(sink.in(), options);
    for (int i = 0; i < 30; ++i) source.add(i);
    bench.run();
    ASSERT_EQ(sink.records().size(), 30U);
    for (unsigned i = 0; i < 30; ++i) EXPECT_EQ(source.sent()[i], source.sent()[0] + i / rate) << rate;
  }
}

}  // namespace
}  // namespace vrpipe
