#include <vrpipe/kernel/clock_domain.h>

#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {
namespace {

/// Ticks when its script says so, and keeps the cycles.
class Ticker : public Clocked {
 public:
  Ticker(ClockDomain& domain, std::vector<Cycle> wanted) : wanted_(std::move(wanted)), handle(domain.attach(*this)) {}
  Cycle tick(Cycle now) override {
    ticks.push_back(now);
    if (action) action(now);
    while (!wanted_.empty() && wanted_.front() <= now) wanted_.erase(wanted_.begin());
    return wanted_.empty() ? never : wanted_.front();
  }
  std::vector<Cycle> ticks;
  std::function<void(Cycle)> action;

 private:
  std::vector<Cycle> wanted_;

 public:
  unsigned handle;
};

class ClockDomainTest : public ::testing::Test {
 protected:
  ClockDomainTest() {
    fresh_simulation();
    clock = std::make_unique<ClockDomain>("clock", 1634);
  }
  std::unique_ptr<ClockDomain> clock;
};

TEST_F(ClockDomainTest, TicksEveryUnitAtCycle0AndThenWhenItAsks) {
  Ticker a(*clock, {3, 4, 100});
  Ticker b(*clock, {4});
  sc_core::sc_start();
  EXPECT_EQ(a.ticks, (std::vector<Cycle>{0, 3, 4, 100}));
  EXPECT_EQ(b.ticks, (std::vector<Cycle>{0, 4}));
}

TEST_F(ClockDomainTest, CyclesInWhichAllSleepCostNothing) {
  Ticker a(*clock, {1'000'000'000});
  sc_core::sc_start();
  EXPECT_EQ(clock->edges(), 2u);
  EXPECT_EQ(clock->now(), 1'000'000'000u);
}

TEST_F(ClockDomainTest, SeveralCyclesOfAnActivationAreTheSameCycles) {
  for (const unsigned cycles : {1U, 4U}) {
    fresh_simulation();
    ClockDomain domain("clock", 1000);
    domain.set_cycles_per_activation(cycles);
    Ticker a(domain, {1, 2, 3, 4, 9});
    Ticker b(domain, {2, 100});
    sc_core::sc_start();
    EXPECT_EQ(a.ticks, (std::vector<Cycle>{0, 1, 2, 3, 4, 9}));
    EXPECT_EQ(b.ticks, (std::vector<Cycle>{0, 2, 100}));
    EXPECT_EQ(domain.edges(), 7U);
    EXPECT_EQ(domain.activations(), cycles == 1 ? 7U : 4U) << "0 to 3, 4, 9 and 100";
  }
}

TEST_F(ClockDomainTest, LooksBetweenEdgesAndChangesNone) {
  for (const unsigned cycles : {1U, 4U, 64U}) {
    fresh_simulation();
    ClockDomain domain("clock", 1000);
    domain.set_cycles_per_activation(cycles);
    Ticker a(domain, {1, 2, 3, 4, 9, 100});
    std::vector<std::size_t> edges_before;  // those of cycles 2, 4, 6, ...
    domain.look_between_edges(2, [&](Cycle cycle) {
      while (2 * (edges_before.size() + 1) <= cycle) edges_before.push_back(a.ticks.size());
      return 2 * (edges_before.size() + 1);
    });
    sc_core::sc_start();
    EXPECT_EQ(a.ticks, (std::vector<Cycle>{0, 1, 2, 3, 4, 9, 100}));
    EXPECT_EQ(domain.activations(), cycles == 1 ? 7U : cycles == 4 ? 4U : 2U);
    ASSERT_GE(edges_before.size(), 50U);
    EXPECT_EQ((std::vector<std::size_t>(edges_before.begin(), edges_before.begin() + 5)),
              (std::vector<std::size_t>{2, 4, 5, 5, 6}));
    EXPECT_EQ(edges_before[49], 6U) << "that of cycle 100 is to come";
  }
}

// case T08
TEST_F(ClockDomainTest, TimeIsAWholeNumberOfPeriodsHoweverLongItRuns) {
  Ticker a(*clock, {125'000, 1'000'000'000'000});
  sc_core::sc_start();
  EXPECT_EQ(a.ticks.back(), 1'000'000'000'000u);
  EXPECT_EQ(sc_core::sc_time_stamp(), sc_core::sc_time::from_value(1'000'000'000'000ULL * clock->period().value()));
}

TEST_F(ClockDomainTest, AWakeUpInACycleIsForALaterOneWhoeverTicksFirst) {
  for (const bool waker_first : {true, false}) {
    fresh_simulation();
    ClockDomain domain("clock", 1000);
    Ticker waker(domain, {10});
    Ticker sleeper(domain, {});
    waker.action = [&](Cycle now) {
      if (now == 10) domain.wake(sleeper.handle, 11);
    };
    domain.set_tick_order(waker_first ? std::vector<unsigned>{0, 1} : std::vector<unsigned>{1, 0});
    sc_core::sc_start();
    EXPECT_EQ(sleeper.ticks, (std::vector<Cycle>{0, 11}));
  }
}

TEST_F(ClockDomainTest, AWakeUpOfAUnitThatTicksInTheSameCycleIsKept) {
  for (const bool waker_first : {true, false}) {
    fresh_simulation();
    ClockDomain domain("clock", 1000);
    Ticker waker(domain, {10});
    Ticker other(domain, {10});
    waker.action = [&](Cycle now) {
      if (now == 10) domain.wake(other.handle, 11);
    };
    domain.set_tick_order(waker_first ? std::vector<unsigned>{0, 1} : std::vector<unsigned>{1, 0});
    sc_core::sc_start();
    EXPECT_EQ(other.ticks, (std::vector<Cycle>{0, 10, 11}));
  }
}

TEST_F(ClockDomainTest, WakeUpsAreKeptAmongManyUnits) {
  // The first wakes all others each cycle, also those that tick in it themselves.
  std::vector<std::unique_ptr<Ticker>> tickers;
  tickers.push_back(std::make_unique<Ticker>(*clock, std::vector<Cycle>{1, 2, 3, 4}));
  for (unsigned i = 1; i < 300; ++i) tickers.push_back(std::make_unique<Ticker>(*clock, std::vector<Cycle>{}));
  tickers[0]->action = [&](Cycle now) {
    for (unsigned i = 1; i < 300 && now < 4; ++i) clock->wake(tickers[i]->handle, now + 1);
  };
  sc_core::sc_start();
  for (const auto& ticker : tickers) {
    ASSERT_EQ(ticker->ticks, (std::vector<Cycle>{0, 1, 2, 3, 4})) << "unit " << ticker->handle;
  }
}

TEST_F(ClockDomainTest, TheEarliestOfSeveralWakeUpsCounts) {
  Ticker waker(*clock, {});
  Ticker sleeper(*clock, {50});
  waker.action = [&](Cycle) {
    clock->wake(sleeper.handle, 30);
    clock->wake(sleeper.handle, 20);
    clock->wake(sleeper.handle, 40);
  };
  sc_core::sc_start();
  EXPECT_EQ(sleeper.ticks, (std::vector<Cycle>{0, 20, 50}));
}

TEST_F(ClockDomainTest, OnlyAPermutationIsATickOrder) {
  Ticker a(*clock, {});
  Ticker b(*clock, {});
  EXPECT_THROW(clock->set_tick_order({0}), SimulationFault);
  EXPECT_THROW(clock->set_tick_order({0, 0}), SimulationFault);
  EXPECT_THROW(clock->set_tick_order({0, 2}), SimulationFault);
  EXPECT_NO_THROW(clock->set_tick_order({1, 0}));
}

TEST_F(ClockDomainTest, FinishEndsAfterTheCycle) {
  Ticker a(*clock, {1, 2, 3, 4});
  a.action = [&](Cycle now) {
    if (now == 2) clock->finish();
  };
  sc_core::sc_start();
  EXPECT_EQ(a.ticks.back(), 2u);
  EXPECT_TRUE(clock->finished());
}

/// A timer that never ends.
struct Timer : sc_core::sc_module {
  explicit Timer(const sc_core::sc_module_name& name) : sc_module(name) { SC_METHOD(tick); }
  SC_HAS_PROCESS(Timer);
  void tick() {
    ++ticks;
    next_trigger(7, sc_core::SC_NS);
  }
  unsigned ticks = 0;
};

TEST_F(ClockDomainTest, IsAtRestOnceNobodyWantsAnEdgeWhateverElseHasTime) {
  Ticker a(*clock, {1, 2, 100});
  Timer timer("timer");
  EXPECT_FALSE(clock->run_to_rest(sc_core::sc_time(50 * 1634, sc_core::SC_PS)));
  EXPECT_TRUE(clock->run_to_rest(sc_core::sc_time(1, sc_core::SC_SEC)));
  EXPECT_EQ(a.ticks, (std::vector<Cycle>{0, 1, 2, 100}));
  EXPECT_EQ(sc_core::sc_time_stamp(), sc_core::sc_time(100 * 1634, sc_core::SC_PS)) << "it is not waited for";
  EXPECT_EQ(timer.ticks, 1U + 100 * 1634 / 7000);
  EXPECT_TRUE(clock->run_to_rest(sc_core::sc_time(1, sc_core::SC_SEC)));
}

TEST_F(ClockDomainTest, IsNotAtRestWhileAnAnswerIsAwaited) {
  Ticker a(*clock, {10});
  a.action = [&](Cycle now) {
    if (now == 10) clock->await_answer();
  };
  Timer timer("timer");
  EXPECT_FALSE(clock->run_to_rest(sc_core::sc_time(1, sc_core::SC_US)));
  clock->answered();
  EXPECT_TRUE(clock->run_to_rest(sc_core::sc_time(1, sc_core::SC_US)));
}

TEST_F(ClockDomainTest, WhatAUnitThrowsEndsTheRunThoughTimersGoOn) {
  Ticker a(*clock, {3});
  a.action = [&](Cycle now) {
    if (now == 3) throw SimulationFault("a", now, "thrown");
  };
  Timer timer("timer");
  EXPECT_THROW(clock->run_to_rest(sc_core::sc_time(1, sc_core::SC_SEC)), SimulationFault);
  EXPECT_LE(sc_core::sc_time_stamp(), sc_core::sc_time(1, sc_core::SC_US));
}

TEST_F(ClockDomainTest, AskingForAnEdgeInThePastStopsAtOnce) {
  Ticker other(*clock, {4, 5, 6, 7, 8});
  struct Late : sc_core::sc_module, Clocked {
    Late(const sc_core::sc_module_name& name, ClockDomain& domain) : sc_module(name) { domain.attach(*this); }
    Cycle tick(Cycle now) override { return now == 0 ? 5 : now; }
  } late("late", *clock);
  clock->set_cycles_per_activation(64);
  try {
    clock->run(sc_core::sc_time(1, sc_core::SC_SEC));
    FAIL() << "nothing was thrown";
  } catch (const SimulationFault& fault) {
    EXPECT_STREQ(fault.what(), "late at cycle 5: it asked for an edge in the past");
  }
  EXPECT_EQ(other.ticks.back(), 5U);
}

TEST_F(ClockDomainTest, AWakeUpInThePastIsAFault) {
  Ticker waker(*clock, {3});
  Ticker sleeper(*clock, {});
  waker.action = [&](Cycle now) {
    if (now == 3) clock->wake(sleeper.handle, 3);
  };
  EXPECT_THROW(clock->run(sc_core::sc_time(1, sc_core::SC_SEC)), SimulationFault);
}

/// A module with time of its own, as a third-party memory is.
struct Outsider : sc_core::sc_module {
  Outsider(const sc_core::sc_module_name& name, sc_core::sc_time at, std::function<void()> act)
      : sc_module(name), at_(at), act_(std::move(act)) {
    SC_THREAD(run);
  }
  SC_HAS_PROCESS(Outsider);
  void run() {
    wait(at_);
    act_();
  }
  sc_core::sc_time at_;
  std::function<void()> act_;
};

TEST_F(ClockDomainTest, AWakeUpFromOutsideTheClockReachesAUnitWhileAllSleep) {
  Ticker sleeper(*clock, {});
  Outsider outsider("outsider", sc_core::sc_time(50.5 * 1634, sc_core::SC_PS), [&] { clock->wake(sleeper.handle, 0); });
  sc_core::sc_start();
  EXPECT_EQ(sleeper.ticks, (std::vector<Cycle>{0, 51})) << "the first edge after it";
}

TEST_F(ClockDomainTest, AWakeUpFromOutsideTheClockComesBeforeAnEdgeAlreadyPlanned) {
  Ticker busy(*clock, {1000});
  Ticker sleeper(*clock, {});
  Outsider outsider("outsider", sc_core::sc_time(50.0 * 1634, sc_core::SC_PS),
                    [&] { clock->wake(sleeper.handle, 60); });
  sc_core::sc_start();
  EXPECT_EQ(sleeper.ticks, (std::vector<Cycle>{0, 60}));
  EXPECT_EQ(busy.ticks, (std::vector<Cycle>{0, 1000}));
}

}  // namespace
}  // namespace vrpipe
