// Statistics in the course of a run.
#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/observers.h>

#include "support/fidelities.h"
#include "support/foreign_memory.h"
#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::fidelities_with_time;
using testing::random_draw;
using testing::request_of;
using testing::run;

struct Sample {
  Cycle cycle;
  std::vector<Observers::Sampled> values;
};

/// What a run gives; `request` keeps none of it.
std::vector<Sample> sampled(RunRequest request, const Draw& draw, Cycle every, const std::vector<std::string>& names,
                            RunResult* result = nullptr) {
  std::vector<Sample> samples;
  request.observers = std::make_shared<Observers>();
  request.observers->on_statistics(every, names, [&](Cycle cycle, const std::vector<Observers::Sampled>& values) {
    samples.push_back({cycle, values});
  });
  RunResult done = run(request, draw);
  if (result != nullptr) *result = std::move(done);
  return samples;
}

std::vector<std::uint64_t> values_of(const std::vector<Sample>& samples) {
  std::vector<std::uint64_t> values;
  for (const Sample& sample : samples) {
    for (const Observers::Sampled& each : sample.values) values.push_back(each.value.value());
  }
  return values;
}

const std::vector<std::string> everything{"*.*", "*.*.*", "*.*.*.*"};

TEST(Sampling, ChangesNothing) {
  const Draw draw = random_draw(150, 90, 300, 9);
  for (const Fidelity fidelity : fidelities_with_time()) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      RunRequest request = request_of("het+qm", fidelity);
      request.termination = termination;
      const RunResult plain = run(request, draw);
      for (const Cycle every : {Cycle{1}, Cycle{7}, Cycle{64}, Cycle{1000}, never}) {
        SCOPED_TRACE(std::string(name_of(fidelity)) + " " + std::to_string(every));
        RunResult result;
        sampled(request, draw, every, everything, &result);
        EXPECT_EQ(result.result_hash, plain.result_hash);
        EXPECT_EQ(result.cycles, plain.cycles);
        EXPECT_EQ(result.kernel_events, plain.kernel_events);
        EXPECT_TRUE(testing::same_image(result.framebuffer.color, plain.framebuffer.color));
      }
    }
  }
}

TEST(Sampling, IsAtMultiplesOfTheIntervalAndAtTheEnd) {
  const Draw draw = random_draw(150, 90, 300, 9);
  for (const Fidelity fidelity : fidelities_with_time()) {
    const Cycle end = run(request_of("qm", fidelity), draw).cycles.value();
    for (const Cycle every : {Cycle{100}, end - 1, end, end + 1}) {
      std::vector<Cycle> expected;
      for (Cycle cycle = every; cycle < end; cycle += every) expected.push_back(cycle);
      expected.push_back(end);
      std::vector<Cycle> cycles;
      for (const Sample& sample : sampled(request_of("qm", fidelity), draw, every, {"crop.quads_blended"})) {
        cycles.push_back(sample.cycle);
      }
      EXPECT_EQ(cycles, expected) << name_of(fidelity) << " every " << every;
    }
  }
}

TEST(Sampling, EndsWithTheResult) {
  const Draw draw = random_draw(200, 120, 300, 2);
  for (const Fidelity fidelity : fidelities_with_time()) {
    RunResult result;
    const std::vector<Sample> samples =
        sampled(request_of("het+qm", fidelity, [](RunRequest& r) { r.platform = &platform_named("desktop"); }), draw,
                500, everything, &result);
    std::map<std::string, std::pair<std::optional<std::uint64_t>, std::optional<std::uint64_t>>> last;
    for (const Observers::Sampled& each : samples.back().values) last[each.name] = {each.value, each.denominator};
    unsigned of_one_component = 0;
    for (const StatisticReport& report : result.statistics) {
      const std::string statistic = report.name.substr(report.name.rfind('.'));
      EXPECT_EQ(last.at(report.name), std::make_pair(std::optional(report.value), report.denominator)) << report.name;
      for (const InstanceStatistic& instance : report.instances) {
        ++of_one_component;
        EXPECT_EQ(last.at(instance.path + statistic),
                  std::make_pair(std::optional(instance.value), instance.denominator))
            << instance.path << statistic;
      }
    }
    EXPECT_GT(result.statistics.size(), 50U);
    EXPECT_GT(of_one_component, 100U);
  }
}

TEST(Sampling, CountersNeverFall) {
  const Draw draw = random_draw(150, 90, 300, 9);
  for (const Fidelity fidelity : fidelities_with_time()) {
    std::map<std::string, std::uint64_t> before;
    unsigned rises = 0;
    for (const Sample& sample : sampled(request_of("het+qm", fidelity), draw, 50, everything)) {
      for (const Observers::Sampled& each : sample.values) {
        if (each.kind != "counter") continue;
        EXPECT_GE(*each.value, before[each.name]) << each.name << " at cycle " << sample.cycle;
        rises += *each.value > before[each.name] ? 1 : 0;
        before[each.name] = *each.value;
      }
    }
    EXPECT_GT(rises, 500U) << name_of(fidelity);
  }
}

// A warp of 8 splats goes every 64 cycles, the first in cycle 0; the next one is fetched when it has gone.
TEST(Sampling, HasWhatEarlierCyclesCountedAndNothingOfItsOwn) {
  const Draw draw = testing::draw_of(16, 16, std::vector<Splat>(160, testing::round_splat(8, 8, 1, 0.5F)));
  const RunRequest request = request_of("baseline", Fidelity::cycle, [](RunRequest& r) {
    r.settings = {{"draw", "warps_per_1024_cycles", "16"}};
  });
  for (const Sample& sample : sampled(request, draw, 1, {"draw.splats"})) {
    const std::uint64_t fetched = 1 + (sample.cycle + 63) / 64;
    ASSERT_EQ(sample.values[0].value, std::min<std::uint64_t>(8 * fetched, 160)) << "at cycle " << sample.cycle;
  }
}

TEST(Sampling, DoesNotDependOnTheOrderInWhichUnitsTick) {
  const Draw draw = random_draw(100, 60, 100, 9);
  RunRequest request = request_of("het+qm");
  const std::vector<std::string> names{"*.quads*", "l2.*"};
  const std::vector<std::uint64_t> expected = values_of(sampled(request, draw, 3, names));
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    request.tick_order_seed = seed;
    EXPECT_EQ(values_of(sampled(request, draw, 3, names)), expected);
  }
}

TEST(Sampling, TwoIntervalsSeeTheSame) {
  const Draw draw = random_draw(100, 60, 100, 9);
  RunRequest request = request_of("qm");
  request.observers = std::make_shared<Observers>();
  std::map<Cycle, std::uint64_t> often;
  std::map<Cycle, std::uint64_t> seldom;
  const auto into = [](std::map<Cycle, std::uint64_t>& samples) {
    return [&samples](Cycle cycle, const std::vector<Observers::Sampled>& values) {
      samples[cycle] = values[0].value.value();
    };
  };
  request.observers->on_statistics(10, {"crop.quads_blended"}, into(often));
  request.observers->on_statistics(30, {"crop.quads_blended"}, into(seldom));
  run(request, draw);
  EXPECT_GT(seldom.size(), 20U);
  for (const auto& [cycle, value] : seldom) EXPECT_EQ(value, often.at(cycle)) << "at cycle " << cycle;
}

TEST(Sampling, NamesAStatisticOfAllComponentsOrOfOne) {
  const Draw draw = random_draw(200, 120, 300, 2);
  const RunRequest request =
      request_of("baseline", Fidelity::lt, [](RunRequest& r) { r.platform = &platform_named("desktop"); });
  const std::vector<Sample> samples =
      sampled(request, draw, 100, {"crop.quads_blended", "gpc1.crop.quads_blended", "gpc*.crop.quads_blended"});
  std::vector<std::string> names;
  for (const Observers::Sampled& each : samples.front().values) names.push_back(each.name);
  std::vector<std::string> expected{"crop.quads_blended", "gpc1.crop.quads_blended"};
  for (unsigned gpc = 0; gpc < request.platform->gpcs; ++gpc) {
    expected.push_back("gpc" + std::to_string(gpc) + ".crop.quads_blended");
  }
  ASSERT_EQ(names, expected);
  for (const Sample& sample : samples) {
    std::uint64_t sum = 0;
    for (std::size_t i = 2; i < sample.values.size(); ++i) sum += *sample.values[i].value;
    EXPECT_EQ(sum, sample.values[0].value);
    EXPECT_EQ(sample.values[1].value, sample.values[3].value);
  }
}

TEST(Sampling, WhatSawNothingHasNoValueYet) {
  const std::vector<Sample> samples = sampled(request_of("baseline"), random_draw(100, 60, 100, 9), 1,
                                              {"raster.widest_edge", "tc.quads_per_flush", "crop.cache.line_hit_rate"});
  const std::vector<Observers::Sampled>& first = samples.front().values;
  EXPECT_FALSE(first[0].value);
  EXPECT_EQ(first[1].denominator, 0U);
  EXPECT_FALSE(first[1].quotient());
  EXPECT_FALSE(first[2].quotient());
  const std::vector<Observers::Sampled>& last = samples.back().values;
  EXPECT_GT(last[0].value, 0U);
  EXPECT_GT(last[1].quotient(), 1.0);
  EXPECT_GT(last[2].quotient(), 0.1);
}

TEST(Sampling, OfWhatIsNotThereIsRefusedBeforeTheRun) {
  const auto refusal = [](Fidelity fidelity, const std::string& name) {
    RunRequest request = request_of("baseline", fidelity);
    request.observers = std::make_shared<Observers>();
    request.observers->on_statistics(100, {name}, [](Cycle, const auto&) {});
    const std::string before = testing::refusal_of([&] { check_configuration(request); });
    EXPECT_EQ(testing::refusal_of([&] { run(request, random_draw(16, 16, 10, 9)); }), before);
    return before;
  };
  const auto expect_in = [](const std::string& part, const std::string& text) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  EXPECT_EQ(refusal(Fidelity::cycle, "crop.quads_blended"), "none");
  expect_in("did you mean crop.quads_blended?", refusal(Fidelity::cycle, "crop.quads_blendet"));
  expect_in("did you mean gpc0.crop.quads_blended?", refusal(Fidelity::lt, "gpc1.crop.quads_blended"));
  expect_in("'dram.*'", refusal(Fidelity::lt, "dram.*"));
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::bound}) {
    expect_in("use lt or cycle", refusal(fidelity, "crop.quads_blended"));
  }
  EXPECT_THROW(Observers().on_statistics(0, {"crop.quads_blended"}, [](Cycle, const auto&) {}), UserError);
}

TEST(Sampling, TakesTheNamesThatAreListed) {
  const RunRequest request =
      request_of("het+qm", Fidelity::cycle, [](RunRequest& r) { r.platform = &platform_named("desktop"); });
  const std::vector<std::string> listed = sampled_statistics(request);
  EXPECT_NE(std::find(listed.begin(), listed.end(), "gpc1.crop.cache.sector_hits"), listed.end());
  const std::vector<Sample> samples = sampled(request, random_draw(32, 32, 10, 9), never, listed);
  EXPECT_EQ(samples.back().values.size(), listed.size());
  EXPECT_TRUE(sampled_statistics(request_of("het+qm", Fidelity::bound)).empty());
}

TEST(Sampling, WhatAnObserverThrowsEndsTheRun) {
  struct Enough {};
  RunRequest request = request_of("baseline");
  request.observers = std::make_shared<Observers>();
  request.observers->on_statistics(100, {"crop.quads_blended"}, [](Cycle, const auto&) { throw Enough(); });
  EXPECT_THROW(run(request, random_draw(100, 60, 100, 9)), Enough);
}

TEST(Sampling, ChangesNothingBesideAMemoryWithItsOwnTime) {
  const Draw draw = random_draw(64, 64, 300, 7);
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.wire = [wire = platform.wire](Netlist& netlist) {
    wire(netlist);
    netlist.replace_memory("l2", [](const std::string& name, unsigned) {
      const auto ns = [](double nanoseconds) { return sc_core::sc_time(nanoseconds, sc_core::SC_NS); };
      auto dram = std::make_unique<foreign::Dram>(name.c_str(), ns(1), ns(40), ns(70));
      tlm::tlm_base_target_socket_b<32>* const socket = &dram->socket;
      return ForeignMemory{std::move(dram), {socket}};
    });
  };
  const RunRequest request = request_of("het", Fidelity::cycle, [&](RunRequest& r) { r.platform = &platform; });
  RunResult result;
  sampled(request, draw, 10, everything, &result);
  EXPECT_EQ(result.result_hash, run(request, draw).result_hash);
}

TEST(Sampling, KeepsNoDeadlockAlive) {
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.wire = [wire = platform.wire](Netlist& netlist) {
    wire(netlist);
    netlist.disconnect("gpc0.prop.out_release");  // the SMs run out of room for warps
  };
  const RunRequest request = request_of("het", Fidelity::cycle, [&](RunRequest& r) {
    r.platform = &platform;
    r.settings = {{"sm", "cores", "1"}};
  });
  EXPECT_THROW(sampled(request, random_draw(64, 64, 300, 7), 10, everything), SimulationFault);
}

}  // namespace
}  // namespace vrpipe
