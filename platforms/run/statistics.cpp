#include "run/statistics.h"

#include <algorithm>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/model/memory_unit.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

const StatisticReport* statistic_named(const std::vector<StatisticReport>& statistics, const std::string& name) {
  const auto found = std::find_if(statistics.begin(), statistics.end(),
                                  [&](const StatisticReport& statistic) { return statistic.name == name; });
  return found == statistics.end() ? nullptr : &*found;
}

std::optional<std::uint64_t> memory_bytes_moved(const std::vector<StatisticReport>& statistics,
                                                const std::string& memory) {
  std::optional<std::uint64_t> bytes;
  for (const StatisticReport& statistic : statistics) {
    if (statistic.name.rfind(memory + ".", 0) != 0) continue;
    for (const std::string ending : {"_bytes_read", "_bytes_written"}) {
      if (statistic.name.size() > ending.size() &&
          statistic.name.compare(statistic.name.size() - ending.size(), ending.size(), ending) == 0) {
        bytes = bytes.value_or(0) + statistic.value;
      }
    }
  }
  return bytes;
}

StatisticCollector::Gathered& StatisticCollector::gathered(const StatisticReport& declared, const std::string& kind,
                                                           const std::optional<Histogram::Buckets>& buckets) {
  // Two implementations in instances of a kind may mean different things by a name; they are not added up.
  const auto is_same = [&](const Gathered& other) {
    return other.report.kind == declared.kind && other.report.unit == declared.unit &&
           other.report.formula == declared.formula && other.buckets == buckets;
  };
  const auto [first, last] = index_.equal_range(declared.name);
  for (auto at = first; at != last; ++at) {
    if (is_same(gathered_[at->second])) return gathered_[at->second];
  }
  index_.emplace(declared.name, gathered_.size());
  Gathered& added = gathered_.emplace_back();
  added.report = declared;
  added.kind = kind;
  added.buckets = buckets;
  if (buckets) {
    added.counts.resize(buckets->count());
    added.report.histogram.emplace();
  }
  return added;
}

void StatisticCollector::add(const std::string& kind, const std::string& path, const StatisticSet& set) {
  paths_[kind].insert(path);
  add_set(kind, kind, path, set);
}

void StatisticCollector::add_set(const std::string& kind, const std::string& name, const std::string& path,
                                 const StatisticSet& set) {
  const auto declared = [&](const Statistic& statistic, const char* how, const std::string& formula = {}) {
    StatisticReport report;
    report.name = name + "." + statistic.name();
    report.unit = statistic.unit();
    report.meaning = statistic.meaning();
    report.kind = how;
    report.formula = formula;
    return report;
  };
  const auto take = [&](Gathered& into, std::uint64_t value, std::optional<std::uint64_t> denominator = {}) {
    for (const InstanceStatistic& other : into.report.instances) {
      if (other.path != path) continue;
      throw SimulationFault(path, 0, "its statistic " + into.report.name + " is declared twice");
    }
    const bool is_first = into.report.instances.empty();
    into.report.instances.push_back({path, value, denominator});
    std::uint64_t& total = into.report.value;
    if (into.report.kind == "largest") {
      total = std::max(total, value);
    } else if (into.report.kind == "smallest") {
      total = is_first ? value : std::min(total, value);
    } else {
      total += value;
    }
    if (denominator) into.report.denominator = into.report.denominator.value_or(0) + *denominator;
  };

  for (const Counter* counter : set.counters()) {
    if (!counter->is_left_out()) take(gathered(declared(*counter, "counter"), kind), counter->value());
  }
  for (const MinMax* min_max : set.min_max()) {
    if (!min_max->seen() && take_ != Take::all) continue;
    const char* const how = min_max->of() == MinMax::Of::largest ? "largest" : "smallest";
    take(gathered(declared(*min_max, how), kind), min_max->value());
  }
  for (const Histogram* histogram : set.histograms()) {
    if (histogram->is_left_out()) continue;
    Gathered& into = gathered(declared(*histogram, "histogram"), kind, histogram->buckets());
    take(into, histogram->sum(), histogram->count());
    for (std::size_t i = 0; i < into.counts.size(); ++i) into.counts[i] += histogram->counts()[i];
    HistogramReport& report = *into.report.histogram;
    if (histogram->count() == 0) continue;
    report.smallest = std::min(report.smallest.value_or(histogram->smallest()), histogram->smallest());
    report.largest = std::max(report.largest.value_or(0), histogram->largest());
  }
  for (const Ratio* ratio : set.ratios()) {
    take(gathered(declared(*ratio, "ratio", ratio->formula()), kind), ratio->numerator(), ratio->denominator());
  }
  for (const StatisticSet* part : set.parts()) {
    const std::string dotted = std::string(".") + part->part_name();
    if (part->counted() || take_ == Take::all) add_set(kind, name + dotted, path + dotted, *part);
  }
}

std::vector<StatisticReport> StatisticCollector::reports() const {
  std::vector<StatisticReport> reports;
  for (const Gathered& each : gathered_) {
    StatisticReport& report = reports.emplace_back(each.report);
    if (paths_.at(each.kind).size() == 1) report.instances.clear();
    if (!each.buckets) continue;
    const Histogram::Buckets& buckets = *each.buckets;
    for (std::uint32_t i = 0; i < buckets.count(); ++i) {
      const std::uint64_t last = buckets.last(i);
      // The ends where nothing was seen say nothing.
      if (!report.histogram->smallest || last < *report.histogram->smallest ||
          buckets.first(i) > *report.histogram->largest) {
        continue;
      }
      std::optional<std::uint64_t> to;
      if (i + 1 < buckets.count()) to = last;
      report.histogram->buckets.push_back({buckets.first(i), to, each.counts[i]});
    }
  }
  return reports;
}

std::optional<double> StatisticReport::quotient() const {
  if (denominator.value_or(0) == 0) return std::nullopt;
  return static_cast<double>(value) / static_cast<double>(*denominator);
}

std::optional<double> InstanceStatistic::quotient() const {
  if (denominator.value_or(0) == 0) return std::nullopt;
  return static_cast<double>(value) / static_cast<double>(*denominator);
}

std::vector<StatisticReport> list_statistics(const ParameterListing& listing) {
  StatisticCollector collector(StatisticCollector::Take::all);
  // Timing models are modules; so their names are not in the way of a simulation's.
  fresh_simulation();
  {
    ClockDomain clock("clock", 1000);
    if (Registry::instance().has_slot(listing.unit)) {
      RenderContext context;
      context.frame = std::make_shared<Frame>(1, 1);
      const Implementation& implementation = Registry::instance().find(listing.unit, listing.implementation);
      const auto make = [&] { return implementation.make_behaviour(*listing.parameters, context); };
      collector.add(listing.unit, "functional", make()->unit());
      if (Registry::instance().slot(listing.unit).is_outside_pipeline) {
        // Kernels have no modules.
      } else if (Registry::instance().slot(listing.unit).is_memory) {
        for (const bool is_clocked : {false, true}) {
          const auto memory = memory_unit_maker(listing.unit)("memory", clock, make(), {{0}, false, is_clocked});
          collector.add(listing.unit, is_clocked ? "cycle" : "timed", memory->statistics());
        }
      } else {
        collector.add(listing.unit, "untimed", *untimed_unit_maker(listing.unit)("untimed", make(), context, 1));
        collector.add(listing.unit, "timed", *timed_unit_maker(listing.unit)("timed", clock, make(), context, 1));
        collector.add(listing.unit, "cycle", *unit_maker(listing.unit)("cycle", clock, make(), context, 1));
      }
    }
  }
  fresh_simulation();
  return collector.reports();
}

}  // namespace vrpipe
