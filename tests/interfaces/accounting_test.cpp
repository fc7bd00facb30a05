#include <vrpipe/kernel/accounting.h>

#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {
namespace {

std::uint64_t sum(const StateAccount& account) {
  std::uint64_t total = 0;
  for (unsigned state = 0; state < unit_states; ++state) total += account.cycles(static_cast<UnitState>(state));
  return total;
}

TEST(FrameEnd, IsTheLatestOfWhatIsKnown) {
  FrameEnd end;
  EXPECT_EQ(end.so_far(), 0u);
  end.not_before(12);
  end.not_before(7);
  EXPECT_EQ(end.so_far(), 12u);
}

TEST(StateAccount, AStateHoldsUntilTheNextIsEntered) {
  const FrameEnd frame_end;
  StateAccount account(frame_end);
  account.enter(UnitState::busy, 10);
  account.enter(UnitState::busy, 12);
  account.enter(UnitState::blocked, 15);
  account.close(20);
  EXPECT_EQ(account.cycles(UnitState::starved), 10u);
  EXPECT_EQ(account.cycles(UnitState::busy), 5u);
  EXPECT_EQ(account.cycles(UnitState::blocked), 5u);
  EXPECT_EQ(sum(account), 20u);
}

TEST(StateAccount, WhatLiesBeyondTheEndIsNotCharged) {
  const FrameEnd frame_end;
  StateAccount account(frame_end);
  account.enter(UnitState::busy, 10);
  account.enter(UnitState::memory, 20);
  account.enter(UnitState::busy, 30);
  account.enter(UnitState::starved, 40);
  account.close(15);
  EXPECT_EQ(account.cycles(UnitState::starved), 10u);
  EXPECT_EQ(account.cycles(UnitState::busy), 5u);
  EXPECT_EQ(account.cycles(UnitState::memory), 0u);
}

TEST(StateAccount, ADrawOfNoCyclesChargesNone) {
  const FrameEnd frame_end;
  StateAccount account(frame_end);
  account.enter(UnitState::busy, 5);
  account.enter(UnitState::starved, 8);
  account.close(0);
  EXPECT_EQ(sum(account), 0u);
}

/// Charges every cycle by itself.
TEST(StateAccount, HoweverLongAUnitGoesOnAfterTheEndNothingOfItIsCharged) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    FrameEnd frame_end;
    StateAccount account(frame_end);
    std::vector<UnitState> states;  // by cycle
    UnitState state = UnitState::starved;
    const std::uint64_t changes = 100 + mix(seed) % 3000;
    // The end becomes known late, or never comes near.
    const Cycle known_late = mix(seed + 1) % 500;
    Cycle last_known = 0;
    for (std::uint64_t i = 0; i < changes; ++i) {
      state = static_cast<UnitState>(mix(seed ^ mix(i)) % unit_states);
      account.enter(state, states.size());
      states.insert(states.end(), mix(seed + i) % 5, state);
      if (i < changes / 2 && mix(i) % 3 == 0) {
        last_known = states.size() - std::min<Cycle>(states.size(), known_late);
        frame_end.not_before(last_known);
      }
    }
    const Cycle end = frame_end.so_far() + mix(seed) % 20;
    account.close(end);
    std::vector<std::uint64_t> expected(unit_states);
    for (Cycle cycle = 0; cycle < end; ++cycle) {
      ++expected[static_cast<unsigned>(cycle < states.size() ? states[cycle] : state)];
    }
    for (unsigned i = 0; i < unit_states; ++i) {
      ASSERT_EQ(account.cycles(static_cast<UnitState>(i)), expected[i]) << "seed " << seed << ", state " << i;
    }
  }
}

TEST(StateAccount, StatesHaveNames) {
  EXPECT_STREQ(name_of(UnitState::busy), "busy");
  EXPECT_STREQ(name_of(UnitState::starved), "starved");
  EXPECT_STREQ(name_of(UnitState::blocked), "blocked");
  EXPECT_STREQ(name_of(UnitState::memory), "memory");
  EXPECT_STREQ(name_of(UnitState::latency), "latency");
}

TEST(WorkTally, CountsWhatIsDoneBeforeTheEnd) {
  FrameEnd frame_end;
  WorkTally tally(frame_end);
  tally.add(3, 4);
  tally.add(5, 9);
  tally.add(7, 10);
  EXPECT_DOUBLE_EQ(tally.items(), 15);
  EXPECT_DOUBLE_EQ(tally.items(10), 8);
  EXPECT_DOUBLE_EQ(tally.items(0), 0);
}

TEST(WorkTally, WhatIsUnderWayAtTheEndCountsByItsShare) {
  const FrameEnd frame_end;
  WorkTally tally(frame_end);
  tally.add(1, 100, 1100);
  EXPECT_DOUBLE_EQ(tally.items(350), 0.25);
  EXPECT_DOUBLE_EQ(tally.items(2000), 1);
}

TEST(WorkTally, CountsTheSameWheneverTheEndBecomesKnown) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    FrameEnd frame_end;
    WorkTally tally(frame_end);
    std::vector<std::uint64_t> done(3000);
    for (Cycle at = 0; at < done.size(); ++at) {
      done[at] = mix(seed ^ mix(at)) % 4;
      if (done[at] > 0) tally.add(done[at], at);
      if (at < 1500 && mix(seed + at) % 7 == 0) frame_end.not_before(at - std::min<Cycle>(at, mix(at) % 300));
    }
    const Cycle end = frame_end.so_far() + mix(seed) % 100;
    double expected = 0;
    for (Cycle at = 0; at < end; ++at) expected += static_cast<double>(done[at]);
    ASSERT_DOUBLE_EQ(tally.items(end), expected) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
