#include <vrpipe/platforms/intervals.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

namespace vrpipe {

namespace {

class Recorder {
 public:
  explicit Recorder(Cycle every) : every_(every) {}

  void enter(const std::string& name, UnitState state, Cycle from) {
    Unit& unit = units_[name];
    charge(unit, from);
    unit.state = state;
  }

  void sample(const std::vector<Observers::Sampled>& values) {
    statistics_.resize(values.size());
    before_.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) add(values[i], before_[i], statistics_[i]);
  }

  /// What was counted. States after the end are not charged, and the end is known only now: the last interval has what
  /// the others leave of the run's cycles.
  IntervalReport report(const RunResult& result) {
    IntervalReport report;
    report.every = every_;
    const Cycle end = result.cycles.value_or(0);
    for (Cycle from = 0; from < end; from += std::min(every_, end - from)) report.from.push_back(from);
    const std::size_t intervals = report.from.size();
    for (const UnitReport& total : result.units) {
      Unit& unit = units_[total.name];
      charge(unit, end);
      unit.cycles.resize(intervals);
      UnitIntervals& intervals_of = report.units.emplace_back();
      intervals_of.name = total.name;
      for (unsigned state = 0; state < unit_states; ++state) {
        std::uint64_t left = total.cycles[state];
        for (std::size_t i = 0; i < intervals; ++i) {
          const std::uint64_t cycles = i + 1 == intervals ? left : unit.cycles[i][state];
          intervals_of.cycles[state].push_back(cycles);
          left -= cycles;
        }
      }
    }
    report.statistics = std::move(statistics_);
    for (StatisticIntervals& statistic : report.statistics) {
      statistic.values.resize(intervals);
      if (!statistic.denominators.empty()) statistic.denominators.resize(intervals);
    }
    return report;
  }

 private:
  struct Unit {
    UnitState state = UnitState::starved;
    Cycle since = 0;
    std::vector<std::array<std::uint64_t, unit_states>> cycles;  ///< by interval
  };

  void charge(Unit& unit, Cycle until) const {
    while (unit.since < until) {
      const std::size_t interval = unit.since / every_;
      const Cycle left = every_ - unit.since % every_;  // of this one
      const Cycle cycles = std::min(left, until - unit.since);
      if (interval >= unit.cycles.size()) unit.cycles.resize(interval + 1);
      unit.cycles[interval][static_cast<unsigned>(unit.state)] += cycles;
      unit.since += cycles;
    }
  }

  /// What was counted since the sample before; extremes are as they are.
  static void add(const Observers::Sampled& now, Observers::Sampled& before, StatisticIntervals& statistic) {
    statistic.name = now.name;
    statistic.kind = now.kind;
    const bool is_extreme = now.kind == "largest" || now.kind == "smallest";
    if (is_extreme || !now.value) {
      statistic.values.push_back(now.value);
    } else {
      statistic.values.emplace_back(*now.value - before.value.value_or(0));
    }
    if (now.denominator) statistic.denominators.push_back(*now.denominator - before.denominator.value_or(0));
    before = now;
  }

  const Cycle every_;
  std::map<std::string, Unit> units_;
  std::vector<StatisticIntervals> statistics_;
  std::vector<Observers::Sampled> before_;
};

}  // namespace

std::optional<double> StatisticIntervals::quotient(std::size_t interval) const {
  if (interval >= denominators.size() || denominators[interval] == 0 || !values[interval]) return std::nullopt;
  return static_cast<double>(*values[interval]) / static_cast<double>(denominators[interval]);
}

void record_intervals(Observers& observers, Cycle every, std::vector<std::string> names) {
  const auto recorder = std::make_shared<Recorder>(every);
  observers.on_statistics(every, std::move(names), [recorder](Cycle, const std::vector<Observers::Sampled>& values) {
    recorder->sample(values);
  });
  observers.on_states(
      [recorder](const std::string& unit, UnitState state, Cycle from) { recorder->enter(unit, state, from); });
  observers.on_end([recorder](RunResult& result) { result.intervals = recorder->report(result); });
}

}  // namespace vrpipe
