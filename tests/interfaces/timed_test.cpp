// Ports and resources of the fidelity lt.
#include <vrpipe/model/timed.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {
namespace {

class NoBehaviour : public Behaviour {};

/// What the units of this file have in common.
class Plain : public TimedUnit {
 public:
  Plain(const sc_core::sc_module_name& name, ClockDomain& domain) : TimedUnit(name, domain, {}) {}
  Behaviour& behaviour() override { return behaviour_; }

 private:
  NoBehaviour behaviour_;
};

/// Sends items, each in a cycle or as soon as there is room.
class Sender : public Plain {
 public:
  Sender(const sc_core::sc_module_name& name, ClockDomain& domain) : Plain(name, domain), out(*this, "out") {}
  TimedOut<int> out;
  std::vector<CycleInterval> at;     ///< of each item
  std::vector<unsigned> beats;       ///< of each item; 1 where there is none
  std::vector<bool> joins;           ///< of each item; false where there is none
  std::vector<bool> goes_beside;     ///< of each item: out of order; false where there is none
  std::vector<CycleInterval> taken;  ///< as known when it was sent

 private:
  Cycle tick(Cycle) override {
    while (sent_ < at.size()) {
      const CycleInterval when = at[sent_];
      if (sent_ < goes_beside.size() && goes_beside[sent_]) {
        out.send_beside(static_cast<int>(sent_++), when);
        continue;
      }
      const bool joins_last = sent_ < joins.size() && joins[sent_];
      const Cycle earliest = std::max(when.first, sent_ == 0 ? 0 : out.last() + (joins_last ? 0 : 1));
      taken.push_back(out.send(static_cast<int>(sent_), {earliest, earliest + (when.last - when.first)},
                               sent_ < beats.size() ? beats[sent_] : 1, joins_last));
      ++sent_;
    }
    return never;
  }
  std::size_t sent_ = 0;
};

/// Takes an item every so many cycles.
class Taker : public Plain {
 public:
  Taker(const sc_core::sc_module_name& name, ClockDomain& domain, Cycle cycles_per_item)
      : Plain(name, domain), in(*this, "in", [this, cycles_per_item](const int& item, CycleInterval visible) {
          const Cycle at = std::max(visible.first, free_at_);
          free_at_ = std::max(at + cycles_per_item, visible.last + 1);
          items.push_back(item);
          came.push_back(visible);
          left.push_back(at);
          return CycleInterval(at, std::max(at, visible.last));
        }) {}
  TimedIn<int> in;
  std::vector<int> items;
  std::vector<CycleInterval> came;  ///< visible
  std::vector<Cycle> left;          ///< the queue

 private:
  Cycle free_at_ = 0;
};

/// A sender and a receiver, and a link between them.
struct TimedPair {
  TimedPair(bool recorded, unsigned depth, unsigned latency, Cycle cycles_per_item) {
    fresh_simulation();
    clock = std::make_unique<ClockDomain>("clock", 1000);
    sender = std::make_unique<Sender>("sender", *clock);
    taker = std::make_unique<Taker>("taker", *clock, cycles_per_item);
    LinkOptions options{depth, latency};
    if (recorded) options.observers = {&recorder};
    sender->out.connect(taker->in, options);
  }
  void run() {
    taker->in.open();
    do {
      clock->run(sc_core::sc_time(1, sc_core::SC_US));
    } while (sc_core::sc_pending_activity());
  }
  std::unique_ptr<ClockDomain> clock;
  std::unique_ptr<Sender> sender;
  std::unique_ptr<Taker> taker;
  LinkRecorder<int> recorder;
};

std::vector<Cycle> firsts(const std::vector<CycleInterval>& spans) {
  std::vector<Cycle> cycles;
  for (const CycleInterval& span : spans) cycles.push_back(span.first);
  return cycles;
}

/// Recorded, through the sockets; else the ends call each other.
class TimedLink : public ::testing::TestWithParam<bool> {};

TEST_P(TimedLink, AnItemOfCycleTThroughLatencyLIsVisibleAtTPlusL) {
  for (const unsigned latency : {1U, 2U, 7U}) {
    TimedPair pair(GetParam(), 4, latency, 1);
    pair.sender->at = {10, 25};
    pair.run();
    EXPECT_EQ(firsts(pair.taker->came), (std::vector<Cycle>{10 + latency, 25 + latency}));
  }
}

TEST_P(TimedLink, TheSendersPipelineAddsItsLatency) {
  fresh_simulation();
  ClockDomain clock("clock", 1000);
  Sender sender("sender", clock);
  Taker taker("taker", clock, 1);
  sender.out.set_pipeline({5, 2});
  sender.out.connect(taker.in, 4, 1);
  taker.in.open();
  sender.at = {10};
  clock.run(sc_core::sc_time(1, sc_core::SC_US));
  EXPECT_EQ(firsts(taker.came), (std::vector<Cycle>{16}));
}

TEST_P(TimedLink, BlockedAtTMinus1ReadyAtT) {
  // One place, an item every 10 cycles. An item that leaves the queue in cycle t makes room for one of cycle t + 1.
  TimedPair pair(GetParam(), 1, 1, 10);
  pair.sender->at = {0, 0, 0, 0};
  pair.run();
  EXPECT_EQ(pair.taker->left, (std::vector<Cycle>{1, 11, 21, 31}));
  EXPECT_EQ(firsts(pair.taker->came), (std::vector<Cycle>{1, 3, 13, 23}));
}

TEST_P(TimedLink, AQueueHoldsItsDepthAndNoMore) {
  TimedPair pair(GetParam(), 3, 1, 100);
  pair.sender->at = {0, 0, 0, 0, 0};
  pair.run();
  // Three places, and the place of an item is free once it has left.
  EXPECT_EQ(pair.taker->left, (std::vector<Cycle>{1, 101, 201, 301, 401}));
  EXPECT_LE(pair.taker->came[2].first, 3U);
  EXPECT_LE(pair.taker->came[3].first, 103U);
  EXPECT_GT(pair.taker->came[4].first, 101U);
}

TEST_P(TimedLink, ABatchTakesItsCyclesAndAsManyPlaces) {
  TimedPair pair(GetParam(), 8, 2, 1);
  pair.sender->at = {CycleInterval(10, 14), CycleInterval(15, 15)};
  pair.sender->beats = {5, 1};
  pair.run();
  ASSERT_EQ(pair.taker->came.size(), 2U);
  EXPECT_EQ(pair.taker->came[0].first, 12U);
  EXPECT_EQ(pair.taker->came[0].last, 16U);
  EXPECT_EQ(pair.taker->came[1].first, 17U);
}

// Of warps whose quads share a beat: the second begins in the cycle in which the first ends.
TEST_P(TimedLink, WhatJoinsTheItemBeforeTakesNothingOfALinksRate) {
  fresh_simulation();
  ClockDomain clock("clock", 1000);
  Sender sender("sender", clock);
  Taker taker("taker", clock, 1);
  LinkRecorder<int> recorder;
  LinkOptions options{16, 1};
  options.items_per_cycle = 1;
  if (GetParam()) options.observers = {&recorder};
  sender.out.connect(taker.in, options);
  taker.in.open();
  sender.at = {CycleInterval(10, 13), CycleInterval(13, 16), CycleInterval(17, 18)};
  sender.beats = {4, 3, 2};
  sender.joins = {false, true, false};
  clock.run(sc_core::sc_time(1, sc_core::SC_US));
  EXPECT_EQ(firsts(taker.came), (std::vector<Cycle>{11, 14, 18}));
  EXPECT_EQ(taker.came[1].last, 17U);
}

// As what is sent for a second look at a tag, long after the first looks of others that are sent later.
TEST_P(TimedLink, WhatGoesBesideTheQueueNeitherWaitsNorIsWaitedFor) {
  TimedPair pair(GetParam(), 2, 1, 1);
  pair.sender->at = {10, 500, 501, 12, 11};
  pair.sender->goes_beside = {false, true, true, false, true};
  pair.run();
  EXPECT_EQ(firsts(pair.taker->came), (std::vector<Cycle>{11, 501, 502, 13, 12}));
}

TEST_P(TimedLink, ABatchLargerThanTheQueuePassesAllTheSame) {
  TimedPair pair(GetParam(), 2, 1, 1);
  pair.sender->at = {CycleInterval(0, 15), CycleInterval(16, 31), CycleInterval(32, 32)};
  pair.sender->beats = {16, 16, 1};
  pair.run();
  EXPECT_EQ(pair.taker->items, (std::vector<int>{0, 1, 2}));
  EXPECT_GE(pair.taker->came[2].first, 33U);
}

TEST_P(TimedLink, ItemsComeInOrderEachOnceUnderAnyStallsAndLater) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Cycle unstalled = 0;
    for (const bool stalls : {false, true}) {
      TimedPair pair(GetParam(), static_cast<unsigned>(1 + seed % 5), static_cast<unsigned>(1 + seed % 3), 2);
      pair.sender->at.assign(100, 0);
      if (stalls) {
        pair.sender->out.stall_randomly(seed, 96);
        pair.taker->in.stall_randomly(seed + 1000, 96);
      }
      pair.run();
      ASSERT_EQ(pair.taker->items.size(), 100U) << seed;
      for (int i = 0; i < 100; ++i) ASSERT_EQ(pair.taker->items[static_cast<std::size_t>(i)], i) << seed;
      for (const CycleInterval& span : pair.taker->came) {
        ASSERT_FALSE(stalls && stall_at(seed + 1000, span.first, 96)) << "a stalled port shows nothing, seed " << seed;
      }
      if (!stalls) unstalled = pair.taker->left.back();
      ASSERT_GE(pair.taker->left.back(), unstalled) << seed;
    }
  }
}

TEST_P(TimedLink, AStubbedOutputSwallows) {
  fresh_simulation();
  ClockDomain clock("clock", 1000);
  Sender sender("sender", clock);
  sender.out.stub();
  sender.at.assign(1000, 0);
  clock.run(sc_core::sc_time(10, sc_core::SC_US));
  EXPECT_EQ(sender.out.transferred(), 1000U);
  EXPECT_TRUE(sender.idle());
}

INSTANTIATE_TEST_SUITE_P(Ways, TimedLink, ::testing::Bool(),
                         [](const auto& way) { return way.param ? "recorded" : "direct"; });

TEST(IssuePort, TakesSoManyACycleInOrder) {
  IssuePort lane(4);
  EXPECT_EQ(lane.take(10, 2), 10U);
  EXPECT_EQ(lane.take(10, 2), 10U);
  EXPECT_EQ(lane.take(10, 1), 11U);
  EXPECT_EQ(lane.take(5, 4), 12U) << "what does not fit goes in the next cycle";
  EXPECT_EQ(lane.take(5, 9), 13U) << "wider than a cycle: three of them";
  EXPECT_EQ(lane.take(5, 1), 16U);
  lane.hold(20);
  EXPECT_EQ(lane.take(0, 1), 20U);
}

TEST(ThroughputPort, PartsOfAnItemMayGoInNeighbouringCycles) {
  ThroughputPort flow(4);
  const auto taken = [&](Cycle earliest, unsigned parts) {
    const CycleInterval span = flow.take(earliest, parts);
    return std::pair(span.first, span.last);
  };
  EXPECT_EQ(taken(10, 3), (std::pair<Cycle, Cycle>(10, 10)));
  EXPECT_EQ(taken(10, 3), (std::pair<Cycle, Cycle>(10, 11)));
  EXPECT_EQ(flow.next(), 11U);
  EXPECT_EQ(taken(0, 2), (std::pair<Cycle, Cycle>(11, 11)));
  EXPECT_EQ(flow.next(), 12U);
  EXPECT_EQ(taken(0, 100), (std::pair<Cycle, Cycle>(12, 36)));
  EXPECT_EQ(taken(50, 0), (std::pair<Cycle, Cycle>(50, 50))) << "nothing takes nothing";
}

TEST(SlotPool, PlacesAreFreeWhenTheirTimeIsOver) {
  SlotPool pool(4);
  pool.take(2, 100);
  pool.take(2, 100);
  EXPECT_EQ(pool.free_from(50, 1), 100U);
  EXPECT_EQ(pool.free_from(150, 4), 150U);
  pool.take(4, {200, 206});
  EXPECT_EQ(pool.free_from(150, 2), 202U) << "those of one item one after the other";
}

TEST(SlotPool, WhatIsTakenLaterMayBeFreeEarlier) {
  SlotPool pool(2);
  pool.take(1, 433);
  pool.take(1, 242);
  EXPECT_EQ(pool.free_from(10, 1), 242U);
  EXPECT_EQ(pool.free_from(10, 2), 433U);
}

TEST(SlotPool, SaysHowManyAreFree) {
  SlotPool pool(4);
  pool.take(1, 100);
  pool.take(2, 200);
  EXPECT_EQ(pool.free_at(99, 4), 1U);
  EXPECT_EQ(pool.free_at(100, 4), 2U);
  EXPECT_EQ(pool.free_at(100, 1), 1U) << "no more than are asked for";
  EXPECT_EQ(pool.free_at(200, 9), 4U) << "nor than there are";
}

TEST(CycleInterval, SpreadsPartsEvenly) {
  const CycleInterval dense(10, 13);
  EXPECT_EQ(dense.of_part(0, 4), 10U);
  EXPECT_EQ(dense.of_part(2, 4), 12U);
  const CycleInterval sparse(10, 40);
  EXPECT_EQ(sparse.of_part(1, 4), 20U);
  EXPECT_EQ(sparse.of_part(3, 4), 40U);
  EXPECT_EQ(CycleInterval(7).of_part(3, 4), 7U);
}

}  // namespace
}  // namespace vrpipe
