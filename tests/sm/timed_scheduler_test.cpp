#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "sm/timed_scheduler.h"
#include "support/random_choices.h"

namespace vrpipe {
namespace {

struct ReadyWarp {
  Cycle ready;
  Cycle cycles;
};

/// First come, first served, of all at once: when each begins, in the order of coming.
std::vector<Cycle> served(std::vector<ReadyWarp> warps) {
  std::stable_sort(warps.begin(), warps.end(),
                   [](const ReadyWarp& a, const ReadyWarp& b) { return a.ready < b.ready; });
  std::vector<Cycle> begins;
  Cycle free_at = 0;
  for (const ReadyWarp& warp : warps) {
    begins.push_back(std::max(free_at, warp.ready));
    free_at = begins.back() + warp.cycles;
  }
  return begins;
}

TEST(TimedScheduler, IssuesInTheOrderOfTimeAsAQueue) {
  TimedScheduler scheduler;
  EXPECT_EQ(scheduler.put(10, 5, 0), 10U);
  EXPECT_EQ(scheduler.put(12, 5, 0), 15U);
  EXPECT_EQ(scheduler.put(30, 5, 0), 30U);
}

TEST(TimedScheduler, WhoComesLaterWithAnEarlierCycleTakesAGap) {
  TimedScheduler scheduler;
  scheduler.put(10, 5, 0);
  scheduler.put(100, 5, 0);
  EXPECT_EQ(scheduler.put(12, 20, 0), 15U);
  EXPECT_EQ(scheduler.put(101, 1, 0), 105U) << "nobody was put off";
}

TEST(TimedScheduler, WhoComesLaterWithAnEarlierCyclePutsOffTheOthers) {
  TimedScheduler scheduler;
  scheduler.put(10, 5, 0);
  scheduler.put(20, 5, 0);
  EXPECT_EQ(scheduler.put(10, 50, 0), 15U) << "behind those that were ready as early";
  EXPECT_EQ(scheduler.put(21, 1, 0), 70U);
}

TEST(TimedScheduler, WhatIsForgottenStillGoesFirst) {
  TimedScheduler scheduler;
  scheduler.put(10, 100, 0);
  scheduler.put(50, 5, 50);
  scheduler.put(200, 5, 50);
  EXPECT_EQ(scheduler.put(60, 5, 50), 115U);
}

TEST(TimedScheduler, WhoIsLateGetsHisTurnAndThoseWhoComeNextPayForIt) {
  TimedScheduler scheduler;
  scheduler.put(10, 5, 0);
  scheduler.put(100, 5, 0);
  EXPECT_EQ(scheduler.put_late(12, 90), 15U);
  EXPECT_EQ(scheduler.put(101, 1, 0), 195U);
  EXPECT_EQ(scheduler.put_late(400, 20), 400U) << "not late at all";
}

TEST(TimedScheduler, WhoIsLateTakesAGapOfHisSize) {
  TimedScheduler scheduler;
  scheduler.put(10, 5, 0);
  scheduler.put(100, 5, 0);
  EXPECT_EQ(scheduler.put_late(12, 85), 15U);
  EXPECT_EQ(scheduler.put(101, 1, 0), 105U);
}

TEST(TimedScheduler, IsFirstComeFirstServedWhateverTheOrderOfCalls) {
  testing::Dice dice(1);
  for (int round = 0; round < 300; ++round) {
    TimedScheduler scheduler;
    std::vector<ReadyWarp> warps;
    for (int i = 0; i < 30; ++i) {
      warps.push_back({dice.below(200), 1 + dice.below(9)});
      const Cycle begin = scheduler.put(warps.back().ready, warps.back().cycles, 0);
      const auto before =
          static_cast<std::size_t>(std::count_if(warps.begin(), warps.end() - 1, [&](const ReadyWarp& other) {
            return other.ready <= warps.back().ready;
          }));
      EXPECT_EQ(begin, served(warps)[before]);
    }
  }
}

}  // namespace
}  // namespace vrpipe
