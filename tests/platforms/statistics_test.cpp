#include <algorithm>
#include <map>
#include <numeric>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/memory/cache_statistics.h>

#include "run/statistics.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::draw_of;
using testing::request_of;
using testing::run;
using testing::statistic;

const StatisticReport& report_of(const std::vector<StatisticReport>& reports, const std::string& name) {
  const auto found =
      std::find_if(reports.begin(), reports.end(), [&](const StatisticReport& report) { return report.name == name; });
  if (found == reports.end()) throw std::out_of_range(name);
  return *found;
}

struct Memory : StatisticSet {
  Counter reads{*this, "reads", "accesses", "taken"};
  Counter hits{*this, "hits", "accesses", "found"};
  Ratio hit_rate{*this, hits, reads, "hit_rate", "hits per access", "of reads"};
  MinMax longest{*this, MinMax::Of::largest, "longest", "cycles", "of waits"};
  MinMax shortest{*this, MinMax::Of::smallest, "shortest", "cycles", "of waits"};
  Histogram waits{*this, Histogram::Buckets::linear(10, 10), "waits", "cycles", "until served"};
  SectoredCacheStatistics cache{*this, "cache"};

  void wait(std::uint64_t cycles) {
    ++reads;
    longest.see(cycles);
    shortest.see(cycles);
    waits.see(cycles);
  }
};

TEST(StatisticCollector, AddsUpComponentsOfAKind) {
  Memory one;
  Memory other;
  one.wait(25);
  one.wait(38);
  ++one.hits;
  other.wait(5);
  StatisticCollector collector;
  collector.add("memory", "gpc0.memory", one);
  collector.add("memory", "gpc1.memory", other);
  const std::vector<StatisticReport> reports = collector.reports();
  ASSERT_EQ(reports.size(), 6U) << "of the cache nothing: it was not used";

  const StatisticReport& reads = report_of(reports, "memory.reads");
  EXPECT_EQ(reads.kind, "counter");
  EXPECT_EQ(reads.value, 3U);
  EXPECT_FALSE(reads.quotient());
  ASSERT_EQ(reads.instances.size(), 2U);
  EXPECT_EQ(reads.instances[0].path, "gpc0.memory");
  EXPECT_EQ(reads.instances[0].value, 2U);
  EXPECT_EQ(reads.instances[1].value, 1U);
  EXPECT_EQ(report_of(reports, "memory.longest").value, 38U);
  EXPECT_EQ(report_of(reports, "memory.shortest").value, 5U);

  const StatisticReport& rate = report_of(reports, "memory.hit_rate");
  EXPECT_EQ(rate.formula, "hits / reads");
  EXPECT_DOUBLE_EQ(rate.quotient().value(), 1.0 / 3);
  EXPECT_DOUBLE_EQ(rate.instances[0].quotient().value(), 0.5);
  EXPECT_DOUBLE_EQ(rate.instances[1].quotient().value(), 0);

  const StatisticReport& waits = report_of(reports, "memory.waits");
  EXPECT_EQ(waits.value, 68U);
  EXPECT_EQ(waits.denominator, 3U);
  EXPECT_EQ(waits.histogram->smallest, 5U);
  EXPECT_EQ(waits.histogram->largest, 38U);
  std::vector<std::uint64_t> counts;
  for (const HistogramBucket& bucket : waits.histogram->buckets) {
    EXPECT_EQ(bucket.from, 10 * counts.size());
    EXPECT_EQ(bucket.to, bucket.from + 9);
    counts.push_back(bucket.count);
  }
  EXPECT_EQ(counts, (std::vector<std::uint64_t>{1, 0, 1, 1})) << "up to the largest value";
}

TEST(StatisticCollector, OfASingleComponentTheValueSaysAll) {
  Memory memory;
  memory.wait(1000);
  StatisticCollector collector;
  collector.add("memory", "memory", memory);
  const std::vector<StatisticReport> reports = collector.reports();
  for (const StatisticReport& report : reports) EXPECT_TRUE(report.instances.empty());
  ASSERT_EQ(report_of(reports, "memory.waits").histogram->buckets.size(), 1U);
  EXPECT_EQ(report_of(reports, "memory.waits").histogram->buckets[0].from, 90U);
  EXPECT_FALSE(report_of(reports, "memory.waits").histogram->buckets[0].to) << "the last has no end";
}

TEST(StatisticCollector, WhatSawNothingHasNoQuotient) {
  const Memory memory;
  StatisticCollector collector;
  collector.add("memory", "memory", memory);
  const std::vector<StatisticReport> reports = collector.reports();
  ASSERT_EQ(reports.size(), 4U) << "nor extremes";
  EXPECT_FALSE(report_of(reports, "memory.hit_rate").quotient());
  EXPECT_FALSE(report_of(reports, "memory.waits").quotient());
  EXPECT_FALSE(report_of(reports, "memory.waits").histogram->smallest);
  EXPECT_TRUE(report_of(reports, "memory.waits").histogram->buckets.empty());
  StatisticCollector all(StatisticCollector::Take::all);
  all.add("memory", "memory", memory);
  const StatisticSet& cache = memory.cache;
  EXPECT_EQ(all.reports().size(), 4U + 2U + cache.counters().size() + cache.min_max().size() +
                                      cache.histograms().size() + cache.ratios().size());
}

TEST(StatisticCollector, APartCountsWhereItWasUsed) {
  Memory one;
  const Memory other;
  ++one.cache.line_hits;
  StatisticCollector collector;
  collector.add("memory", "gpc0.memory", one);
  collector.add("memory", "gpc1.memory", other);
  const std::vector<StatisticReport> reports = collector.reports();
  const StatisticReport& hits = report_of(reports, "memory.cache.line_hits");
  ASSERT_EQ(hits.instances.size(), 1U);
  EXPECT_EQ(hits.instances[0].path, "gpc0.memory.cache");
}

TEST(StatisticCollector, DifferentThingsOfOneNameAreNotAddedUp) {
  struct Other : StatisticSet {
    Counter reads{*this, "reads", "bytes", "taken"};
    Histogram waits{*this, Histogram::Buckets::log2(), "waits", "cycles", "until served"};
  } other;
  other.reads += 64;
  Memory memory;
  memory.wait(1);
  StatisticCollector collector;
  collector.add("memory", "gpc0.memory", memory);
  collector.add("memory", "gpc1.memory", other);
  std::map<std::string, unsigned> times;
  for (const StatisticReport& report : collector.reports()) ++times[report.name];
  EXPECT_EQ(times["memory.reads"], 2U);
  EXPECT_EQ(times["memory.waits"], 2U);
}

TEST(StatisticCollector, TwoSetsOfAComponentHaveDifferentNames) {
  struct TimingModel : StatisticSet {
    Counter reads{*this, "reads", "accesses", "taken"};
  };
  const Memory memory;
  const TimingModel timing;
  StatisticCollector collector;
  collector.add("memory", "gpc0.memory", memory);
  EXPECT_THROW(collector.add("memory", "gpc0.memory", timing), SimulationFault);
}

TEST(Statistics, OfSeveralGpcsAddUpAtEveryFidelity) {
  const Draw draw = testing::random_draw(200, 120, 300, 2);
  for (const Fidelity fidelity : fidelities()) {
    SCOPED_TRACE(name_of(fidelity));
    const RunResult result =
        run(request_of("het+qm", fidelity, [](RunRequest& r) { r.platform = &platform_named("desktop"); }), draw);
    const unsigned gpcs = result.request.platform->gpcs;
    ASSERT_GT(gpcs, 1U);
    unsigned summed = 0;
    for (const StatisticReport& report : result.statistics) {
      const bool front_end = report.name.rfind("draw.", 0) == 0 || report.name.rfind("wdx.", 0) == 0;
      EXPECT_EQ(report.instances.empty(), front_end || report.name.rfind("l2.", 0) == 0) << report.name;
      if (report.instances.empty() || report.kind == "largest" || report.kind == "smallest") continue;
      std::uint64_t value = 0;
      std::uint64_t denominator = 0;
      for (const InstanceStatistic& instance : report.instances) {
        EXPECT_EQ(instance.path.rfind("gpc", 0), 0U) << instance.path;
        value += instance.value;
        denominator += instance.denominator.value_or(0);
      }
      EXPECT_EQ(value, report.value) << report.name;
      EXPECT_EQ(denominator, report.denominator.value_or(0)) << report.name;
      summed += report.kind == "histogram" ? 0 : 1;
    }
    EXPECT_GT(summed, 20U);
    EXPECT_EQ(report_of(result.statistics, "crop.quads_blended").instances.size(), gpcs);
    EXPECT_EQ(statistic(result, "crop.quads_blended"), result.counts.quads_blended);
  }
}

TEST(Statistics, OfTheColourCacheMeanTheSameAtEveryFidelity) {
  const Draw draw = testing::random_draw(200, 120, 400, 2);
  for (const char* variant : {"baseline", "het+qm"}) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      for (const Fidelity fidelity : fidelities()) {
        SCOPED_TRACE(std::string(variant) + name_of(fidelity));
        RunRequest request = request_of(variant, fidelity);
        request.termination = termination;
        request.settings = {{"crop", "cache_bytes", "4096"}};
        const RunResult result = run(request, draw);
        const bool has_cache =
            std::any_of(result.statistics.begin(), result.statistics.end(),
                        [](const StatisticReport& report) { return report.name.rfind("crop.cache.", 0) == 0; });
        ASSERT_EQ(has_cache, fidelity != Fidelity::functional);
        if (!has_cache) continue;
        const auto of_cache = [&](const std::string& name) { return statistic(result, "crop.cache." + name); };
        const Counts& counts = result.counts;
        const std::uint64_t quads = counts.quads_blended + counts.quads_dropped_late;
        EXPECT_EQ(of_cache("line_accesses"), quads);
        EXPECT_EQ(of_cache("line_hits") + of_cache("line_misses"), quads);
        EXPECT_EQ(of_cache("sector_accesses"), quads) << "of RGBA16F a quad has one sector";
        EXPECT_EQ(of_cache("sector_hits") + of_cache("sector_misses"), quads);
        EXPECT_EQ(of_cache("bytes_filled"), 32 * of_cache("sector_misses"));
        EXPECT_EQ(of_cache("bytes_written_back"), 32 * of_cache("sectors_written_back"));
        EXPECT_EQ(of_cache("line_misses") - of_cache("lines_evicted"), 4096U / 128) << "the cache is full at the end";
        EXPECT_LE(of_cache("sectors_written_back"), of_cache("sector_misses"));
        if (fidelity != Fidelity::bound) {
          EXPECT_EQ(of_cache("bytes_filled"), statistic(result, "l2.color_bytes_read"));
          // At cycle the line evicted last may not be on its way yet.
          const std::uint64_t unsent = of_cache("bytes_written_back") - statistic(result, "l2.color_bytes_written");
          EXPECT_LE(unsent, fidelity == Fidelity::cycle ? 128U : 0U);
        }
        const double rate = report_of(result.statistics, "crop.cache.sector_hit_rate").quotient().value();
        EXPECT_DOUBLE_EQ(rate, static_cast<double>(of_cache("sector_hits")) / static_cast<double>(quads));
      }
    }
  }
}

// Every quad is looked up in the same order where there is one tile at a time, with or without time.
TEST(Statistics, OfTheColourCacheAreTheSameWhereTheOrderIs) {
  const Draw draw = testing::random_draw(16, 16, 400, 2);
  std::map<std::string, std::uint64_t> expected;
  for (const Fidelity fidelity : {Fidelity::bound, Fidelity::lt, Fidelity::cycle}) {
    const RunResult result = run(request_of("baseline", fidelity), draw);
    for (const StatisticReport& report : result.statistics) {
      if (report.name.rfind("crop.cache.", 0) != 0 || report.name == "crop.cache.sector_hits_on_their_way") continue;
      if (report.kind == "histogram") continue;  // of what takes time
      const auto [at, is_first] = expected.emplace(report.name, report.value);
      EXPECT_EQ(report.value, at->second) << report.name << " at " << name_of(fidelity);
    }
  }
  EXPECT_EQ(expected.size(), 14U + 3U + 1U) << "counters, ratios and the most lines held";
  EXPECT_EQ(expected.at("crop.cache.sector_misses"), 64U);
}

TEST(Statistics, HistogramsCountWhatCountersDo) {
  const Draw draw = testing::random_draw(200, 120, 400, 2);
  for (const char* variant : {"baseline", "qm"}) {
    for (const Fidelity fidelity : fidelities()) {
      const RunResult result = run(request_of(variant, fidelity), draw);
      const auto check = [&](const char* histogram, const char* count, const char* sum) {
        const StatisticReport& report = report_of(result.statistics, histogram);
        EXPECT_EQ(report.denominator.value(), statistic(result, count)) << histogram;
        EXPECT_EQ(report.value, statistic(result, sum)) << histogram;
      };
      check("qru.quads_per_warp", "qru.warps", "qru.quads");
      check("tc.quads_per_flush", "tc.flushes", "tc.quads");
      if (result.request.variant.quad_merging) check("tgc.primitives_per_flush", "tgc.flushes", "tgc.entries");
    }
  }
}

TEST(Statistics, ListsAreCompleteForEveryUnit) {
  for (const char* variant : {"baseline", "het+qm"}) {
    const RunResult result = run(request_of(variant), testing::random_draw(100, 60, 200, 2));
    std::map<std::string, std::string> listed;
    for (const ParameterListing& listing : list_parameters(nullptr)) {
      const std::pair<std::string, std::string> unit{listing.unit, listing.implementation};
      const auto& used = result.implementations;
      if (unit.first != "l2" && std::find(used.begin(), used.end(), unit) == used.end()) continue;
      for (const StatisticReport& report : list_statistics(listing)) listed[report.name] = report.meaning;
    }
    for (const StatisticReport& report : result.statistics) EXPECT_EQ(listed[report.name], report.meaning);
  }
}

}  // namespace
}  // namespace vrpipe
