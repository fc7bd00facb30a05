#include <vrpipe/accounting.h>

#include <numeric>

#include <gtest/gtest.h>

#include <vrpipe/random.h>

namespace vrpipe {
namespace {

std::uint64_t sum(const StateAccount& account) {
  std::uint64_t total = 0;
  for (unsigned state = 0; state < unit_states; ++state) total += account.cycles(static_cast<UnitState>(state));
  return total;
}

TEST(StateAccount, AStateHoldsUntilTheNextIsEntered) {
  StateAccount account;
  account.enter(UnitState::busy, 10);
  account.enter(UnitState::busy, 12);
  account.enter(UnitState::blocked, 15);
  account.close(20);
  EXPECT_EQ(account.cycles(UnitState::starved), 10u);
  EXPECT_EQ(account.cycles(UnitState::busy), 5u);
  EXPECT_EQ(account.cycles(UnitState::blocked), 5u);
  EXPECT_EQ(sum(account), 20u);
}

TEST(StateAccount, WhatLiesBeyondTheEndIsTakenBack) {
  StateAccount account;
  account.enter(UnitState::busy, 10);
  account.enter(UnitState::memory, 20);
  account.enter(UnitState::busy, 30);
  account.enter(UnitState::starved, 40);
  account.close(15);
  EXPECT_EQ(account.cycles(UnitState::starved), 10u);
  EXPECT_EQ(account.cycles(UnitState::busy), 5u);
  EXPECT_EQ(account.cycles(UnitState::memory), 0u);
}

TEST(StateAccount, TakingBackGoesNotBeyondTheStart) {
  StateAccount account;
  account.enter(UnitState::busy, 5);
  account.enter(UnitState::starved, 8);
  account.close(0);
  EXPECT_EQ(sum(account), 0u);
}

TEST(StateAccount, AnyHistorySumsToTheEnd) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    StateAccount account;
    Cycle now = 0;
    for (std::uint64_t i = 0; i < 500; ++i) {
      account.enter(static_cast<UnitState>(mix(seed ^ mix(i)) % unit_states), now);
      now += mix(seed + i) % 5;
    }
    const Cycle end = now - mix(seed) % 20;
    account.close(end);
    ASSERT_EQ(sum(account), end) << seed;
  }
}

TEST(StateAccount, StatesHaveNames) {
  EXPECT_STREQ(name_of(UnitState::busy), "busy");
  EXPECT_STREQ(name_of(UnitState::starved), "starved");
  EXPECT_STREQ(name_of(UnitState::blocked), "blocked");
  EXPECT_STREQ(name_of(UnitState::memory), "memory");
  EXPECT_STREQ(name_of(UnitState::latency), "latency");
}

}  // namespace
}  // namespace vrpipe
