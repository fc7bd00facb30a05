#include <vrpipe/kernel/rate.h>

#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {
namespace {

TEST(Rate, IsARatioInLowestTerms) {
  EXPECT_EQ(Rate::of_bytes(64, 32), (Rate{2, 1}));
  EXPECT_EQ(Rate::of_bytes(48, 32), (Rate{3, 2}));
  EXPECT_EQ(Rate::of_bytes(16, 64), (Rate{1, 4}));
  EXPECT_EQ(Rate::of_bytes(17, 64), (Rate{17, 64}));
  EXPECT_DOUBLE_EQ(Rate::of_bytes(48, 32).per_cycle(), 1.5);
  EXPECT_EQ(Rate::of_bytes(48, 32).most_in_a_cycle(), 2u);
  EXPECT_EQ(Rate::of_bytes(16, 64).most_in_a_cycle(), 1u);
}

/// Items that a limit lets through in so many cycles, if there are always enough.
std::uint64_t passed(Rate rate, Cycle cycles) {
  RateLimit limit(rate);
  std::uint64_t sum = 0;
  for (Cycle now = 0; now < cycles; ++now) {
    const std::uint32_t count = limit.allowance(now);
    EXPECT_LE(count, rate.most_in_a_cycle());
    limit.take(count);
    sum += count;
  }
  return sum;
}

TEST(RateLimit, LetsExactlyItsRateThrough) {
  for (std::uint32_t bytes = 16; bytes <= 256; ++bytes) {
    for (const std::uint32_t item : {16u, 32u, 64u}) {
      const Rate rate = Rate::of_bytes(bytes, item);
      ASSERT_EQ(passed(rate, 1000), 1000ULL * bytes / item) << bytes << " of " << item;
    }
  }
}

TEST(RateLimit, UnusedCyclesAreLostAndFractionsKept) {
  RateLimit limit(Rate{3, 2});
  EXPECT_EQ(limit.allowance(0), 1u);
  limit.take(1);
  EXPECT_EQ(limit.allowance(1), 2u);
  limit.take(2);
  EXPECT_EQ(limit.allowance(2), 1u);
  EXPECT_EQ(limit.allowance(900), 2u);
  limit.take(2);
  EXPECT_EQ(limit.allowance(900), 0u);
  EXPECT_EQ(limit.allowance(901), 1u);
}

TEST(RateLimit, WhatGoesAndWhatIsLostIsNoMoreThanTheTimeThatThereIs) {
  for (const Rate rate : {Rate{39, 32}, Rate{3, 2}, Rate{17, 64}, Rate{4, 1}}) {
    RateLimit told(rate), untold(rate);
    std::uint64_t parts = 0;
    for (Cycle now = 0; now < 3000; ++now) {
      const std::uint32_t count = told.allowance(now);
      ASSERT_EQ(count, untold.allowance(now)) << "the fraction is kept either way";
      const bool goes = mix(now) % 3 == 0;
      parts += goes ? std::uint64_t{count} * rate.cycles : told.lose_rest();
      if (goes) {
        told.take(count);
        untold.take(count);
      }
      ASSERT_LE(parts, (now + 1) * rate.items);
      ASSERT_GE(parts + rate.cycles, (now + 1) * rate.items + 1);
    }
  }
}

TEST(BatchLimit, BatchesThatFitShareACycle) {
  BatchLimit limit(16);
  EXPECT_TRUE(limit.allows(10, 5));
  limit.take(10);
  EXPECT_FALSE(limit.allows(7, 5));
  EXPECT_TRUE(limit.allows(6, 5));
  limit.take(6);
  EXPECT_FALSE(limit.allows(1, 5));
  EXPECT_EQ(limit.next(5), 6u);
  EXPECT_TRUE(limit.allows(16, 6));
}

TEST(BatchLimit, WideBatchesPassAtTheRateExactly) {
  for (std::uint32_t rate = 1; rate <= 16; ++rate) {
    BatchLimit limit(rate);
    Cycle now = 0;
    constexpr unsigned batches = 600;
    for (unsigned i = 0; i < batches; ++i) {
      while (!limit.allows(16, now)) ++now;
      limit.take(16);
      EXPECT_EQ(limit.next(now) > now, true);
    }
    // The last batch begins when those before it are through.
    EXPECT_EQ(now, (batches - 1) * 16ULL / rate) << rate;
  }
}

TEST(BatchLimit, NextIsTheFirstCycleThatAllowsABatch) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const auto rate = static_cast<std::uint32_t>(1 + mix(seed) % 16);
    BatchLimit limit(rate);
    Cycle now = 0;
    for (unsigned i = 0; i < 50; ++i) {
      const auto width = static_cast<std::uint32_t>(1 + mix(seed ^ i) % 16);
      if (!limit.allows(width, now)) {
        now = limit.next(now);
        ASSERT_TRUE(limit.allows(width, now)) << "seed " << seed;
      }
      limit.take(width);
    }
  }
}

TEST(BatchLimit, SaysWhenABatchMayGoAsItLetsItThroughCycleByCycle) {
  BatchLimit asked(8);
  BatchLimit tried(8);
  Cycle now = 0;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto items = static_cast<std::uint32_t>(1 + mix(i) % 20);
    const Cycle earliest = now + mix(i + 7000) % 3;
    for (now = earliest; !tried.allows(items, now);) ++now;
    tried.take(items);
    ASSERT_EQ(asked.free_from(items, earliest), now) << i;
    asked.take(items);
  }
}

TEST(BatchLimit, AWholeCycleIsOneInWhichNothingBegins) {
  BatchLimit limit(8);
  limit.take(20);  // of cycles 0 and 1, and half of 2
  EXPECT_EQ(limit.next_free(), 2U);
  EXPECT_EQ(limit.take_cycle(1), 2U);
  EXPECT_EQ(limit.take_cycle(2), 3U);
  EXPECT_EQ(limit.free_from(8, 0), 4U);
  limit.hold(9);
  EXPECT_EQ(limit.free_from(1, 5), 9U);
}

}  // namespace
}  // namespace vrpipe
