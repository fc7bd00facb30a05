// A run seen from outside: links by several, queues, fragments, intervals, the end.
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/batch.h>
#include <vrpipe/platforms/intervals.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/observers.h>

#include "support/fidelities.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::fidelities_with_time;
using testing::random_draw;
using testing::request_of;
using testing::run;

RunRequest observed(const std::string& variant, Fidelity fidelity) {
  RunRequest request = request_of(variant, fidelity);
  request.observers = std::make_shared<Observers>();
  return request;
}

TEST(Observers, SeveralSeeOneLink) {
  const Draw draw = random_draw(80, 60, 100, 1);
  for (const Fidelity fidelity : fidelities()) {
    SCOPED_TRACE(name_of(fidelity));
    RunRequest request = observed("qm", fidelity);
    std::uint64_t first = 0, second = 0, others = 0;
    request.observers->on_link<Warp>("qru.warps", [&](const auto& passed) { first += passed.item.count; });
    request.observers->on_link<QuadBeat>("gpc0.raster.quads", [&](const auto& passed) { others += passed.item.count; });
    request.observers->on_link<Warp>("gpc0.qru.warps", [&](const auto& passed) { second += passed.item.count; });
    const RunResult result = run(request, draw);
    EXPECT_EQ(first, result.counts.quads_shaded);
    EXPECT_EQ(second, result.counts.quads_shaded);
    EXPECT_EQ(others, result.counts.quads_rasterized);
  }
}

TEST(Observers, ChangeNoDecisionOfWhatAFrameCallsFor) {
  const Draw draw = random_draw(40, 30, 20, 1);
  const auto active = [](const RunResult& result) {
    std::vector<std::string> names;
    for (const EffectReport& effect : result.effects) {
      if (!effect.omitted) names.push_back(effect.name);
    }
    return names;
  };
  for (const char* variant : {"baseline", "het+qm"}) {
    EXPECT_EQ(active(run(observed(variant, Fidelity::lt), draw)), active(run(request_of(variant, Fidelity::lt), draw)))
        << variant << ": units that are there to be looked at alone have nothing to do";
  }
}

TEST(Observers, SeePlacesOfAQueueTakenAndFree) {
  const Draw draw = random_draw(150, 90, 300, 9);
  for (const Fidelity fidelity : fidelities_with_time()) {
    SCOPED_TRACE(name_of(fidelity));
    const std::string plain = run(request_of("het+qm", fidelity), draw).result_hash;
    RunRequest request = observed("het+qm", fidelity);
    std::vector<std::pair<std::int64_t, Cycle>> changes;
    request.observers->on_link<QuadBeat>("raster.quads", {},
                                         [&](const std::string& link, std::int64_t places, Cycle at) {
                                           EXPECT_EQ(link, "gpc0.raster.quads");
                                           changes.emplace_back(places, at);
                                         });
    EXPECT_EQ(run(request, draw).result_hash, plain);
    if (fidelity == Fidelity::lt) {
      EXPECT_TRUE(changes.empty()) << "nothing waits in a queue";
      continue;
    }
    ASSERT_GT(changes.size(), 2U);
    EXPECT_EQ(changes[0].second, 0U);
    const std::int64_t depth = -changes[0].first;
    EXPECT_GT(depth, 1);
    std::int64_t taken = 0;
    for (std::size_t i = 1; i < changes.size(); ++i) {
      taken += changes[i].first;
      if (fidelity != Fidelity::cycle) continue;  // in the order of calls, not of cycles
      EXPECT_GE(taken, 0);
      EXPECT_LE(taken, depth);
      EXPECT_LE(changes[i - 1].second, changes[i].second);
    }
    EXPECT_EQ(taken, 0) << "at the end all are free";
  }
}

TEST(Observers, SeeWhatBecomesOfFragments) {
  const Draw draw = random_draw(200, 120, 400, 3);
  for (const Fidelity fidelity : fidelities()) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      for (const char* platform : {"agx-orin-ideal-memory", "desktop"}) {
        SCOPED_TRACE(std::string(name_of(fidelity)) + " " + name_of(termination) + " " + platform);
        RunRequest request = observed("het+qm", fidelity);
        request.termination = termination;
        request.platform = &platform_named(platform);
        const RunResult plain = run(request, draw);
        request.observers = std::make_shared<Observers>();
        std::map<FragmentFate, std::uint64_t> seen;
        request.observers->on_fragments([&](const Observers::Fragments& some) {
          EXPECT_NE(some.lanes, 0U);
          seen[some.fate] += static_cast<unsigned>(__builtin_popcount(some.lanes));
        });
        const RunResult result = run(request, draw);
        EXPECT_EQ(result.result_hash, plain.result_hash);
        const Counts& counts = result.counts;
        EXPECT_EQ(seen[FragmentFate::rasterized], counts.fragments_rasterized);
        EXPECT_EQ(seen[FragmentFate::terminated], counts.fragments_terminated + counts.fragments_dropped_late);
        EXPECT_EQ(seen[FragmentFate::merged], counts.fragments_merged);
        EXPECT_EQ(seen[FragmentFate::blended], counts.fragments_blended);
      }
    }
  }
}

TEST(Observers, AreToldOfTheEndWithTheResult) {
  const Draw draw = random_draw(80, 60, 100, 1);
  for (const Fidelity fidelity : fidelities()) {
    RunRequest request = observed("het", fidelity);
    std::vector<std::string> hashes;
    request.observers->on_end([&](const RunResult& result) { hashes.push_back(result.result_hash); });
    EXPECT_EQ(hashes, std::vector<std::string>());
    const std::string hash = run(request, draw).result_hash;
    EXPECT_EQ(hashes, std::vector<std::string>{hash});
  }
}

TEST(Intervals, SumToTheRun) {
  const Draw draw = random_draw(200, 120, 300, 2);
  for (const Fidelity fidelity : fidelities_with_time()) {
    const std::string plain =
        run(request_of("het+qm", fidelity, [](RunRequest& r) { r.platform = &platform_named("desktop"); }), draw)
            .result_hash;
    for (const Cycle every : {Cycle{1}, Cycle{77}, Cycle{500}, Cycle{1000000}}) {
      SCOPED_TRACE(std::string(name_of(fidelity)) + " " + std::to_string(every));
      RunRequest request = observed("het+qm", fidelity);
      request.platform = &platform_named("desktop");
      record_intervals(*request.observers, every, {"*.*"});
      const RunResult result = run(request, draw);
      EXPECT_EQ(result.result_hash, plain);
      const IntervalReport& intervals = result.intervals.value();
      const std::size_t count = intervals.from.size();
      EXPECT_EQ(count, (result.cycles.value() + every - 1) / every);
      ASSERT_EQ(intervals.units.size(), result.units.size());
      for (std::size_t unit = 0; unit < result.units.size(); ++unit) {
        EXPECT_EQ(intervals.units[unit].name, result.units[unit].name);
        for (std::size_t i = 0; i < count; ++i) {
          std::uint64_t cycles = 0;
          for (const auto& of_state : intervals.units[unit].cycles) cycles += of_state[i];
          EXPECT_EQ(cycles, std::min(every, result.cycles.value() - intervals.from[i]));
        }
        for (unsigned state = 0; state < unit_states; ++state) {
          const std::vector<std::uint64_t>& of_state = intervals.units[unit].cycles[state];
          EXPECT_EQ(std::accumulate(of_state.begin(), of_state.end(), std::uint64_t{0}),
                    result.units[unit].cycles[state]);
        }
      }
      std::map<std::string, const StatisticReport*> reports;
      for (const StatisticReport& report : result.statistics) reports[report.name] = &report;
      for (const StatisticIntervals& statistic : intervals.statistics) {
        ASSERT_EQ(statistic.values.size(), count);
        const auto report = reports.find(statistic.name);
        if (report == reports.end()) continue;
        std::uint64_t sum = 0;
        for (const auto& value : statistic.values) sum += value.value_or(0);
        const bool is_extreme = statistic.kind == "largest" || statistic.kind == "smallest";
        EXPECT_EQ(is_extreme ? statistic.values.back().value_or(0) : sum, report->second->value) << statistic.name;
        if (!report->second->denominator) continue;
        EXPECT_EQ(std::accumulate(statistic.denominators.begin(), statistic.denominators.end(), std::uint64_t{0}),
                  *report->second->denominator);
      }
    }
  }
}

TEST(Intervals, WantTimeAndALength) {
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::bound}) {
    RunRequest request = observed("het", fidelity);
    record_intervals(*request.observers, 100, {"crop.quads_blended"});
    EXPECT_THROW(run(request, random_draw(20, 20, 5, 1)), UserError);
  }
  Observers observers;
  EXPECT_THROW(record_intervals(observers, 0, {"crop.quads_blended"}), UserError);
}

}  // namespace
}  // namespace vrpipe
