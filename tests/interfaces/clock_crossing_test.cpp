// Cycles of one clock in those of another.

#include <cstdint>
#include <initializer_list>

#include <gtest/gtest.h>

#include <vrpipe/kernel/clock_crossing.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {
namespace {

using Numbers = std::initializer_list<std::uint64_t>;

TEST(ClockCrossing, OfOneClockCyclesAreTheSame) {
  fresh_simulation();
  const ClockDomain domain("clock", 1634);
  for (const std::uint64_t period : Numbers{0, 1634}) {
    const ClockCrossing crossing(domain, period);
    for (const Cycle cycle : {Cycle{0}, Cycle{1}, Cycle{7}, Cycle{1} << 60}) {
      EXPECT_EQ(crossing.edge_of(cycle), cycle);
      EXPECT_EQ(crossing.over_by(cycle), cycle);
      EXPECT_EQ(crossing.cycle_of(cycle), cycle);
      EXPECT_EQ(crossing.after(cycle), cycle + 1);
    }
    EXPECT_EQ(crossing.ratio(), 1);
  }
}

TEST(ClockCrossing, MeetsEachEdgeInTheFirstCycleThatIsNotBeforeIt) {
  for (const std::uint64_t period : Numbers{1, 588, 1000, 1634, 1'000'000'000}) {
    fresh_simulation();
    const ClockDomain domain("clock", period);
    for (const std::uint64_t other : Numbers{1, 1250, 1634, 3267, 999'999'937}) {
      const std::uint64_t delay = 12345;
      const ClockCrossing crossing(domain, other, delay);
      for (std::uint64_t i = 0; i < 200; ++i) {
        // Far on as well, where products take nearly all of 64 bits.
        for (const std::uint64_t cycle : Numbers{i, 8'000'000'000 + i}) {
          const std::uint64_t at = cycle * period;
          const Cycle edge = crossing.edge_of(cycle);
          EXPECT_GE(edge * other, at);
          EXPECT_LT(edge * other, at + other);
          EXPECT_EQ(crossing.over_by(cycle), at / other);
        }
        const std::uint64_t at = i * other;
        const Cycle cycle = crossing.cycle_of(i);
        EXPECT_GE(cycle * period, at);
        EXPECT_LT(cycle * period, at + period);
        EXPECT_EQ(crossing.after(i), at / period + 1);
        EXPECT_EQ(crossing.seen(i), (at + delay + period - 1) / period);
      }
      EXPECT_EQ(crossing.after(never), never);
    }
  }
}

}  // namespace
}  // namespace vrpipe
