#include <deque>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/memory/line_visits.h>

namespace vrpipe {
namespace {

constexpr unsigned half = 4;  ///< of eight sectors

LineVisits visited_by(bool comes_back, std::initializer_list<std::uint32_t> visits) {
  LineVisits line;
  line.begin(comes_back);
  LineVisits::Visit visit = 0;
  for (const std::uint32_t sectors : visits) {
    line.enter(visit++);
    line.ask(line.lacking(sectors));
  }
  line.enter(visit);
  return line;
}

TEST(LineVisits, StopForSectorsThatAreMissingInAHalfThatWasAskedFor) {
  const LineVisits line = visited_by(true, {0b0001});
  EXPECT_TRUE(line.stops(0b0010, half));
  EXPECT_TRUE(line.stops(0b0011, half));
  EXPECT_FALSE(line.stops(0b0001, half)) << "asked for already";
  EXPECT_FALSE(line.stops(0b0001'0000, half)) << "the other half";
  EXPECT_TRUE(line.stops(0b0001'1000, half));
}

TEST(LineVisits, DoNotStopForALineThatHasNotComeBack) { EXPECT_FALSE(visited_by(false, {0b0001}).stops(0b0010, half)); }

TEST(LineVisits, TakeSectorsOfAVisitTogether) {
  LineVisits line;
  line.begin(true);
  line.enter(7);
  EXPECT_TRUE(line.ask(line.lacking(0b0001))) << "the first of the visit";
  EXPECT_FALSE(line.enter(7));
  EXPECT_FALSE(line.stops(0b0010, half));
  EXPECT_FALSE(line.ask(line.lacking(0b0010)));
  EXPECT_EQ(line.lacking(0b0111), 0b0100U);
}

TEST(LineUses, OfOtherPartsDoNotHoldTheFirstVisit) {
  LineUses line;
  bool is_first = false;
  ASSERT_TRUE(line.begin(0b0010));
  ASSERT_TRUE(line.may_go(0, 0b0001, half));
  line.go(0b0001, 0b0010, is_first);
  EXPECT_FALSE(line.begin(0b0010));
  EXPECT_FALSE(line.begin(0b0110));
  EXPECT_TRUE(line.begin(0b1101));
}

TEST(LineUses, OfALineThatNeedNotStopAskForNothingAgain) {
  LineUses line;
  bool is_first = false;
  ASSERT_TRUE(line.begin(1));
  line.may_go(0, 0b0001, half);
  line.go(0b0001, 1, is_first);
  line.used(0, 1);
  ASSERT_TRUE(line.begin(1)) << "used in time, if after the first look";
  EXPECT_FALSE(line.comes_back());
  line.may_go(1, 0b0001, half);
  line.go(0b0001, 1, is_first);
  ASSERT_FALSE(line.begin(1));
  line.used(1, 1);
  ASSERT_TRUE(line.begin(1));
  EXPECT_TRUE(line.comes_back());
}

TEST(SecondLookStops, KeepFirstLooksBehindThem) {
  SecondLookStops stops;
  stops.add(10, 20);
  stops.add(21, 21);
  stops.add(21, 25);
  stops.add(40, 50);
  EXPECT_EQ(stops.first_look_from(9), 9U);
  EXPECT_EQ(stops.first_look_from(10), 10U) << "before the second look of its cycle";
  EXPECT_EQ(stops.first_look_from(11), 21U);
  EXPECT_EQ(stops.first_look_from(22), 26U);
  EXPECT_EQ(stops.first_look_from(60), 60U);
  stops.add(70, 80);
  EXPECT_EQ(stops.first_look_from(80), 81U);
}

/// What is looked at: a visit's sectors, and whether the line has come into its cache for that.
struct Look {
  LineVisits::Visit visit = 0;
  std::uint32_t sectors = 0;
  bool comes = false;
  Cycle first_look = 0;
};
constexpr Cycle trip = 50;
/// Of two sectors each.
std::uint32_t parts_of(std::uint32_t sectors) {
  std::uint32_t parts = 0;
  for (unsigned part = 0; part < 4; ++part) parts |= (sectors >> (2 * part) & 3U) != 0 ? 1U << part : 0U;
  return parts;
}

/// Cycles of the second looks, of which there is one a cycle, what they ask for again, and of lines that come back, for which
/// they wait. A use follows a trip later.
struct Outcome {
  std::vector<Cycle> looks;
  std::vector<std::uint32_t> again, awaited;
};

Outcome timed(const std::vector<Look>& all) {
  Outcome outcome;
  TimedLineUses line;
  Cycle at = 0;
  for (const Look& look : all) {
    if (look.comes) line.come(look.first_look, true);
    at = std::max(at, look.first_look + 1);
    const TimedLineUses::Look found = line.look_again(look.visit, look.sectors, parts_of(look.sectors), half, at);
    outcome.again.push_back(found.again);
    outcome.awaited.push_back(found.comes_back ? found.again : 0);
    outcome.looks.push_back(at);
    line.used(parts_of(look.sectors), at + trip);
    ++at;
  }
  return outcome;
}

Outcome cycle_by_cycle(const std::vector<Look>& all) {
  Outcome outcome;
  LineUses line;
  std::deque<std::pair<Cycle, std::size_t>> uses;
  bool has_come = false;
  bool asked_early = false;
  for (Cycle now = 0; outcome.looks.size() < all.size(); ++now) {
    const Look& look = all[outcome.looks.size()];
    for (; !uses.empty() && uses.front().first <= now; uses.pop_front()) {
      const Look& done = all[uses.front().second];
      line.used(done.visit, parts_of(done.sectors));
    }
    if (now <= look.first_look) continue;
    if (look.comes && !has_come) {
      if (!line.begin(parts_of(look.sectors))) continue;
      has_come = true;
      asked_early = !outcome.looks.empty() && outcome.looks.back() + trip > look.first_look;
    }
    if (!line.may_go(look.visit, look.sectors, half)) continue;
    bool is_first = false;
    const std::uint32_t lacking = line.go(look.sectors, parts_of(look.sectors), is_first);
    outcome.again.push_back(asked_early ? lacking : 0);
    outcome.awaited.push_back(line.comes_back() ? lacking : 0);
    uses.emplace_back(now + trip, outcome.looks.size());
    outcome.looks.push_back(now);
    has_come = false;
  }
  return outcome;
}

TEST(TimedLineUses, AreThoseOfCycle) {
  std::uint64_t draws = 20261126;
  const auto below = [&draws](unsigned n) { return static_cast<unsigned>(mix(draws++) % n); };
  unsigned stops = 0;
  for (unsigned round = 0; round < 300; ++round) {
    std::vector<Look> all;
    Cycle first_look = 0;
    for (unsigned i = 0; i < 30; ++i) {
      const bool comes = i == 0 || below(4) == 0;
      first_look += below(30);
      const bool goes_on = !comes && below(4) == 0;
      all.push_back({goes_on ? all.back().visit : i, 1U << below(8), comes, first_look});
    }
    const Outcome expected = cycle_by_cycle(all);
    const Outcome found = timed(all);
    ASSERT_EQ(found.looks, expected.looks) << round;
    ASSERT_EQ(found.again, expected.again) << round;
    ASSERT_EQ(found.awaited, expected.awaited) << round;
    for (std::size_t i = 1; i < all.size(); ++i)
      stops += expected.looks[i] > std::max(expected.looks[i - 1], all[i].first_look) + 1 ? 1U : 0U;
  }
  EXPECT_GT(stops, 500U);
}

}  // namespace
}  // namespace vrpipe
