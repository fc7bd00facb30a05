#include "run/statistic_sampler.h"

#include <fnmatch.h>

#include <algorithm>
#include <utility>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {

/// Whether a name is one that is asked for, where `*` stands for text without a dot.
bool matches(std::string asked, std::string name) {
  // Of paths of files that is what fnmatch does.
  std::replace(asked.begin(), asked.end(), '.', '/');
  std::replace(name.begin(), name.end(), '.', '/');
  return fnmatch(asked.c_str(), name.c_str(), FNM_PATHNAME) == 0;
}

}  // namespace

void StatisticSampler::add(const std::string& name, const std::string& path, const StatisticSet& set) {
  for (const Counter* counter : set.counters()) {
    add_statistic(name, path, *counter, "counter", "", [counter] { return Value{counter->value(), {}}; });
  }
  for (const MinMax* min_max : set.min_max()) {
    const char* const kind = min_max->of() == MinMax::Of::largest ? "largest" : "smallest";
    add_statistic(name, path, *min_max, kind, "", [min_max] {
      return min_max->seen() ? Value{min_max->value(), {}} : Value{};
    });
  }
  for (const Histogram* histogram : set.histograms()) {
    add_statistic(name, path, *histogram, "histogram", "", [histogram] {
      return Value{histogram->sum(), histogram->count()};
    });
  }
  for (const Ratio* ratio : set.ratios()) {
    add_statistic(name, path, *ratio, "ratio", ratio->formula(), [ratio] {
      return Value{ratio->numerator(), ratio->denominator()};
    });
  }
  for (const StatisticSet* part : set.parts()) {
    const std::string dotted = std::string(".") + part->part_name();
    add(name + dotted, path + dotted, *part);
  }
}

void StatisticSampler::add_statistic(const std::string& name, const std::string& path, const Statistic& statistic,
                                     const std::string& kind, const std::string& formula,
                                     const std::function<Value()>& source) {
  const std::string described = std::string(statistic.unit()) + '\n' + formula;
  const auto add_to = [&](const std::string& full_name) {
    const auto found = std::find_if(known_.begin(), known_.end(), [&](const Known& known) {
      return known.name == full_name && known.kind == kind && known.described == described;
    });
    Known& known = found != known_.end() ? *found : known_.emplace_back(Known{full_name, kind, described, {}});
    known.sources.push_back(source);
  };
  add_to(name + '.' + statistic.name());
  if (path != name) add_to(path + '.' + statistic.name());
}

std::vector<std::string> StatisticSampler::names() const {
  std::vector<std::string> names;
  names.reserve(known_.size());
  for (const Known& known : known_) names.push_back(known.name);
  return names;
}

StatisticSampler::Value StatisticSampler::Known::value() const {
  Value total;
  for (const auto& source : sources) {
    const Value one = source();
    if (!one.value) continue;
    if (kind == "largest") {
      total.value = std::max(total.value.value_or(0), *one.value);
    } else if (kind == "smallest") {
      total.value = std::min(total.value.value_or(*one.value), *one.value);
    } else {
      total.value = total.value.value_or(0) + *one.value;
    }
    if (one.denominator) total.denominator = total.denominator.value_or(0) + *one.denominator;
  }
  return total;
}

void StatisticSampler::find(const Observers& observers) {
  for (const Observers::OnStatistics& asked : observers.of_statistics()) {
    Series& series = series_.emplace_back();
    series.asked = &asked;
    series.next = asked.every;
    for (const std::string& name : asked.names) {
      const std::size_t before = series.known.size();
      for (std::size_t i = 0; i < known_.size(); ++i) {
        if (matches(name, known_[i].name)) series.known.push_back(i);
      }
      if (series.known.size() > before) continue;
      throw UserError("cannot sample '" + name + "'", "statistics", "the platform has none of this name",
                      known_.empty() ? "it has none" : suggestion(name, this->names()));
    }
    for (const std::size_t i : series.known) series.given.push_back({known_[i].name, known_[i].kind, {}, {}});
  }
}

void StatisticSampler::watch(ClockDomain& clock) {
  clock_ = &clock;
  Cycle first = never;
  for (const Series& series : series_) first = std::min(first, series.next);
  if (first != never) clock.look_between_edges(first, [this](Cycle cycle) { return sample_until(cycle); });
}

Cycle StatisticSampler::sample_until(Cycle cycle) {
  Cycle next = never;
  for (Series& series : series_) {
    for (; series.next <= cycle; series.next += series.asked->every) take(series, series.next);
    give_before(series, clock_->frame_end().so_far());
    next = std::min(next, series.next);
  }
  return next;
}

void StatisticSampler::take(Series& series, Cycle cycle) const {
  Sample& sample = series.held.emplace_back(Sample{cycle, {}});
  for (const std::size_t i : series.known) sample.values.push_back(known_[i].value());
}

void StatisticSampler::give_before(Series& series, Cycle cycle) {
  for (; !series.held.empty() && series.held.front().cycle < cycle; series.held.pop_front()) {
    const Sample& sample = series.held.front();
    for (std::size_t i = 0; i < sample.values.size(); ++i) {
      series.given[i].value = sample.values[i].value;
      series.given[i].denominator = sample.values[i].denominator;
    }
    series.asked->see(sample.cycle, series.given);
  }
}

void StatisticSampler::finish(Cycle end) {
  for (Series& series : series_) {
    // At lt the clock rests before the draw ends.
    for (; series.next < end; series.next += series.asked->every) take(series, series.next);
    give_before(series, end);
    series.held.clear();
    take(series, end);
    give_before(series, end + 1);
  }
}

}  // namespace vrpipe
