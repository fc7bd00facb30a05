// Tests of what a run is said to spend: by hand, on runs and tables made here.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>

#include "jobs/energy.h"
#include "output/energy_report.h"
#include "qru/qru.h"
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using tools::EnergyAmounts;
using tools::EnergyReport;
using tools::EnergyTable;
using tools::Range;

// 2 pJ a quad in SM, 4 a byte in L2, before scaling by 0.5, and 1 W: figures that double arithmetic holds exactly.
const char* const two_events = R"(
schema = "vrpipe.energies/1"
process = "8 nm"
[[node]]
name = "12 nm"
factor = { low = 0.25, nominal = 0.5, high = 1 }
voltage_ratio = 1
source = "s"
[[event]]
name = "lane"
unit = "SM"
count = "4 * sm.quads_shaded * sm.fragment_instructions"
node = "12 nm"
pj = { low = 2, nominal = 2, high = 2 }
source = "s"
meaning = "m"
[[event]]
name = "sector"
unit = "L2"
count = ["l2.color_bytes_read / 32", "l2.color_bytes_written / 32"]
node = "12 nm"
pj = { low = 4, nominal = 8, high = 16 }
source = "s"
meaning = "m"
[[power]]
name = "leakage"
count = "1"
watts = { low = 1, nominal = 2, high = 4 }
platforms = ["agx-orin-ideal-memory"]
source = "s"
meaning = "m"
)";

EnergyTable table_of(const std::string& text) { return tools::parse_energies(text, "table"); }

RunResult run_of(std::uint64_t quads, std::uint64_t bytes, std::uint64_t cycles) {
  RunResult run;
  run.request.platform = &platform_named("agx-orin-ideal-memory");
  run.request.variant = variant_named("baseline");
  run.cycles = cycles;
  run.counts.fragments_blended = 1000;
  const auto counter = [&](const std::string& name, std::uint64_t value) {
    StatisticReport report;
    report.name = name;
    report.kind = "counter";
    report.value = value;
    run.statistics.push_back(report);
  };
  counter("sm.quads_shaded", quads);
  counter("l2.color_bytes_read", bytes);
  counter("l2.color_bytes_written", bytes);
  run.parameters = {{"sm.fragment_instructions", "10"}};
  return run;
}

constexpr std::uint64_t cycles_per_millisecond = 612'000;  // of agx-orin-ideal-memory

void expect_range(const Range& range, double low, double nominal, double high) {
  EXPECT_DOUBLE_EQ(range.low, low);
  EXPECT_DOUBLE_EQ(range.nominal, nominal);
  EXPECT_DOUBLE_EQ(range.high, high);
}

void expect_ordered(const Range& range) {
  EXPECT_LE(range.low, range.nominal);
  EXPECT_LE(range.nominal, range.high);
}

TEST(Energy, IsCountsTimesEnergiesAndPowerTimesTime) {
  const EnergyTable table = table_of(two_events);
  const EnergyAmounts amounts = energy_amounts(run_of(1'000'000, 32'000'000, 3 * cycles_per_millisecond), table);
  const EnergyReport report = energy_report(amounts, table);
  ASSERT_EQ(report.units.size(), 2U);
  // 40 M lane instructions of 2 pJ, scaled by 0.25, 0.5, 1; 2 M sectors of 4, 8, 16 pJ likewise; 3 ms.
  EXPECT_EQ(report.units[0].unit, "SM");
  expect_range(report.units[0].millijoules, 0.02, 0.04, 0.08);
  expect_range(report.units[1].millijoules, 0.002, 0.008, 0.032);
  expect_range(report.moving, 0.022, 0.048, 0.112);
  expect_range(report.constant.value(), 3, 6, 12);
  expect_range(report.total.value(), 3.022, 6.048, 12.112);
  expect_range(report.watts.value(), 3.022 / 3, 2.016, 12.112 / 3);
  expect_range(report.picojoules_per_fragment.value(), 3.022e6, 6.048e6, 12.112e6);
}

TEST(Energy, SupplyEntersSquared) {
  std::string text = two_events;
  text.replace(text.find("voltage_ratio = 1"), 17, "voltage_ratio = 0.5");
  const EnergyTable table = table_of(text);
  const EnergyReport report = energy_report(energy_amounts(run_of(1'000'000, 0, 1), table), table);
  expect_range(report.units[0].millijoules, 0.005, 0.01, 0.02);
}

TEST(Energy, TwiceTheTimeDoublesTheConstantPartAlone) {
  const EnergyTable table = table_of(two_events);
  const EnergyReport once = energy_report(energy_amounts(run_of(500, 320, 1000), table), table);
  const EnergyReport twice = energy_report(energy_amounts(run_of(500, 320, 2000), table), table);
  expect_range(twice.moving, once.moving.low, once.moving.nominal, once.moving.high);
  expect_range(twice.constant.value(), 2 * once.constant->low, 2 * once.constant->nominal, 2 * once.constant->high);
}

TEST(Energy, WithoutTimeTheConstantPartIsUnknown) {
  const EnergyTable table = table_of(two_events);
  RunResult run = run_of(500, 320, 0);
  run.cycles.reset();
  const EnergyAmounts amounts = energy_amounts(run, table);
  const EnergyReport report = energy_report(amounts, table);
  EXPECT_GT(report.moving.nominal, 0);
  EXPECT_FALSE(report.constant || report.total || report.watts || report.picojoules_per_fragment);
  EXPECT_FALSE(energy_ratio(amounts, amounts, table).has_value());
}

TEST(Energy, OfNothingHasNoRatio) {
  const EnergyTable table = table_of(two_events);
  RunResult nothing = run_of(0, 0, 100);
  nothing.counts = Counts();
  const EnergyAmounts none = energy_amounts(nothing, table), some = energy_amounts(run_of(500, 320, 1000), table);
  EXPECT_FALSE(energy_ratio(none, none, table).has_value()) << "as there is no speed-up";
  EXPECT_FALSE(energy_report(none, table).picojoules_per_fragment.has_value());
  EXPECT_TRUE(energy_ratio(some, some, table).has_value());
}

TEST(Energy, OfARunWithoutCounterIsSaidToBeLeftOut) {
  const EnergyTable table = table_of(two_events);
  RunResult run = run_of(500, 320, 1000);
  run.statistics.resize(1);
  EXPECT_EQ(energy_amounts(run, table).not_counted, std::vector<std::string>{"L2: sector"});
  run = run_of(500, 320, 1000);
  run.statistics.resize(2);
  EXPECT_TRUE(energy_amounts(run, table).not_counted.empty()) << "reads alone, where there are no writes";
}

void expect_at_least_of_a_silent_unit() {
  const Registrar<PairingQru, QruBehaviour> silent("qru", "silent", "of somebody else's, for runs by hand");
  std::string text = two_events;
  text.replace(text.find("\"4 * sm.quads_shaded * sm.fragment_instructions\""), 48,
               "[\"sm.quads_shaded\", \"qru.pairs\", \"qru.cache.sectors\"]");
  const EnergyTable table = table_of(text);
  RunResult run = run_of(500, 320, 1000);
  run.implementations = {{"qru", "pairing"}};
  const EnergyAmounts shipped = energy_amounts(run, table);
  EXPECT_TRUE(shipped.missing.empty()) << "what that does not count does not happen";
  run.implementations = {{"qru", "silent"}};
  const EnergyAmounts amounts = energy_amounts(run, table);
  EXPECT_EQ(amounts.missing, std::vector<std::string>{"qru.pairs of qru=silent"});
  EXPECT_EQ(amounts.events, shipped.events);
  EXPECT_FALSE(energy_ratio(shipped, amounts, table).has_value());
  EXPECT_FALSE(energy_ratio(amounts, shipped, table).has_value());
  EXPECT_TRUE(energy_report(amounts, table).total.has_value());
  EXPECT_FALSE(energy_report(amounts, table).quad_merging_share.has_value());
  const std::string said = tools::energy_text({run}, 0, table, {});
  EXPECT_NE(said.find("at least"), std::string::npos) << said;
  EXPECT_NE(said.find("do not count qru.pairs"), std::string::npos) << said;
}

// In a process of its own: others list what is registered.
TEST(Energy, OfAUnitThatDoesNotCountIsAtLeastWhatIsSaid) {
  EXPECT_EXIT(
      {
        expect_at_least_of_a_silent_unit();
        std::exit(HasFailure() ? 1 : 0);
      },
      ::testing::ExitedWithCode(0), "");
}

TEST(Energy, AUnitThatPassesThroughSpendsNothing) {
  std::string text = two_events;
  text.replace(text.find("\"4 * sm.quads_shaded * sm.fragment_instructions\""), 48, "\"qru.quads\"");
  const EnergyTable table = table_of(text);
  RunResult run = run_of(500, 0, 1000);
  run.statistics[0].name = "qru.quads";
  for (const auto& [name, events] : {std::pair{"pairing", 500.0}, std::pair{"pass-through", 0.0}}) {
    run.implementations = {{"qru", name}};
    EXPECT_EQ(energy_amounts(run, table).events[0], events) << name;
  }
  EXPECT_TRUE(energy_amounts(run, table).not_counted.empty());
}

TEST(Energy, ARunToItselfIsOneWhateverFiguresAre) {
  const EnergyTable& table = tools::shipped_energies();
  RunResult run = run_of(123'457, 7'654'321, 999'983);
  const EnergyAmounts amounts = energy_amounts(run, table);
  const Range ratio = energy_ratio(amounts, amounts, table).value();
  EXPECT_EQ(ratio.low, 1.0);
  EXPECT_EQ(ratio.nominal, 1.0);
  EXPECT_EQ(ratio.high, 1.0);
}

/// Every combination of low and high.
Range ratio_by_trying(const EnergyAmounts& baseline, const EnergyAmounts& run, const EnergyTable& table) {
  const std::size_t events = table.events.size(), terms = events + table.powers.size();
  Range range{INFINITY, 0, 0};
  for (std::uint64_t high = 0; high < std::uint64_t{1} << terms; ++high) {
    double before = 0, after = 0;
    for (std::size_t i = 0; i < terms; ++i) {
      const bool is_event = i < events;
      const Range each = is_event ? table.events[i].picojoules[0] * 1e-12 : table.powers[i - events].watts;
      const double value = (high >> i & 1) != 0 ? each.high : each.low;
      before += value * (is_event ? baseline.events[i] : baseline.powers[i - events] * *baseline.seconds);
      after += value * (is_event ? run.events[i] : run.powers[i - events] * *run.seconds);
    }
    range.low = std::min(range.low, before / after);
    range.high = std::max(range.high, before / after);
  }
  return range;
}

TEST(Energy, RatiosReachFromTheLeastToTheGreatestOverAllFigures) {
  const EnergyTable table = table_of(two_events);
  const EnergyAmounts baseline = energy_amounts(run_of(9'000'000, 640'000'000, 2000), table);
  struct Case {
    std::uint64_t quads, bytes, cycles;
  };
  for (const Case& each : {Case{3'000'000, 640'000'000, 1000}, Case{12'000'000, 64'000, 1500}, Case{9'000'000, 0, 4000},
                           Case{0, 640'000'000, 2000}}) {
    const EnergyAmounts run = energy_amounts(run_of(each.quads, each.bytes, each.cycles), table);
    const Range ratio = energy_ratio(baseline, run, table).value(), tried = ratio_by_trying(baseline, run, table);
    EXPECT_DOUBLE_EQ(ratio.low, tried.low);
    EXPECT_DOUBLE_EQ(ratio.high, tried.high);
    expect_ordered(ratio);
  }
}

TEST(Energy, PowerFoundForAnotherPlatformIsNamed) {
  const EnergyTable table = table_of(two_events);
  EXPECT_TRUE(powers_of_other_platforms(table, platform_named("agx-orin-ideal-memory")).empty());
  EXPECT_EQ(powers_of_other_platforms(table, platform_named("desktop")), std::vector<std::string>{"leakage"});
}

/// With a power of each active core, and GPUs of another process.
EnergyTable table_with_active_cores() {
  std::string text = two_events;
  const std::size_t events = text.find("[[event]]");
  text.insert(events, R"(
[[other_process]]
name = "4N"
platforms = ["gh100-gpc"]
leaves_out = "idle power"
[[other_process.node]]
name = "12 nm"
factor = { low = 0.125, nominal = 0.25, high = 0.5 }
voltage_ratio = 1
source = "s"
)");
  text.replace(text.find("\"4 * sm.quads_shaded * sm.fragment_instructions\""), 48,
               "[\"sm.quads_shaded\", \"kernel.lane_instructions\"]");
  text.replace(text.find("\"l2.color_bytes_written / 32\""), 29, "\"kernel.bytes / 32\", \"kernel.dram_bytes\"");
  return table_of(text + R"(
[[power]]
name = "core"
cycles = ["sm.fragments.core_cycles", "kernel.core_cycles"]
watts = { low = 1, nominal = 2, high = 4 }
platforms = ["gh100-gpc"]
source = "s"
meaning = "m"
)");
}

constexpr std::uint64_t cycles_of_a_gh100_millisecond = 1'980'000;

RunResult run_on_gh100(std::uint64_t milliseconds) {
  RunResult run = run_of(0, 0, milliseconds * cycles_of_a_gh100_millisecond);
  run.request.platform = &platform_named("gh100-gpc");
  StatisticReport active;
  active.name = "sm.fragments.core_cycles";
  active.kind = "counter";
  active.value = 3 * *run.cycles;
  run.statistics.push_back(active);
  return run;
}

TEST(Energy, PowerOfWhatIsActiveIsForAsLong) {
  const EnergyTable table = table_with_active_cores();
  RunResult run = run_on_gh100(8);
  // Three cores of 1, 2, 4 W, in the mean, for 8 ms; what was found for the other platform is not taken.
  const EnergyAmounts amounts = energy_amounts(run, table);
  EXPECT_EQ(amounts.powers, (std::vector<double>{0, 3}));
  EXPECT_TRUE(powers_of_other_platforms(table, *run.request.platform).empty());
  expect_range(energy_report(amounts, table).constant.value(), 24, 48, 96);
  run.statistics.back().value = 0;
  expect_range(energy_report(energy_amounts(run, table), table).constant.value(), 0, 0, 0);
}

TEST(Energy, WithoutActiveCyclesItIsAtLeastTheRest) {
  const EnergyTable table = table_with_active_cores();
  RunResult run = run_on_gh100(8);
  const EnergyAmounts with = energy_amounts(run, table);
  run.statistics.pop_back();
  const EnergyAmounts without = energy_amounts(run, table);
  EXPECT_EQ(without.missing, std::vector<std::string>{"cycles of core"});
  EXPECT_FALSE(energy_ratio(with, without, table).has_value());
  run.cycles.reset();
  EXPECT_TRUE(energy_amounts(run, table).missing.empty()) << "without time there is no power at all";
}

TEST(Energy, OfAnEventIsThatOfTheProcessOfThePlatform) {
  const EnergyTable table = table_with_active_cores();
  RunResult run = run_on_gh100(1);
  run.statistics[0].value = 1'000'000'000;
  expect_range(energy_report(energy_amounts(run, table), table).moving, 0.25, 0.5, 1);
  RunResult elsewhere = run_of(1'000'000'000, 0, 3 * cycles_per_millisecond);
  const EnergyAmounts on_orin = energy_amounts(elsewhere, table);
  expect_range(energy_report(on_orin, table).moving, 0.5, 1, 2);
  EXPECT_EQ(on_orin.powers[1], 0);
  EXPECT_FALSE(energy_ratio(on_orin, energy_amounts(run, table), table).has_value()) << "of two processes";
  EXPECT_EQ(powers_of_other_platforms(table, platform_named("desktop")), std::vector<std::string>{"leakage"})
      << "of its process";
}

KernelReport kernel_of(double instructions, std::uint64_t bytes, std::uint64_t milliseconds) {
  KernelReport kernel;
  kernel.name = "k";
  kernel.bytes = bytes;
  kernel.cycles = milliseconds * cycles_of_a_gh100_millisecond;
  kernel.warp_instructions = instructions / 32;
  kernel.lane_instructions = instructions;
  kernel.core_cycles = 2 * static_cast<double>(*kernel.cycles);
  return kernel;
}

TEST(Energy, OfAKernelIsOfItsInstructionsBytesAndActiveCores) {
  const EnergyTable table = table_with_active_cores();
  const RunResult machine = run_on_gh100(1);
  const KernelReport kernel = kernel_of(1e9, 32'000'000'000, 5);
  const EnergyAmounts amounts = energy_amounts(kernel, machine, table);
  // No DRAM: of its bytes there are sectors alone. Two cores, for 5 ms.
  EXPECT_EQ(amounts.events, (std::vector<double>{1e9, 1e9}));
  EXPECT_EQ(amounts.powers, (std::vector<double>{0, 2}));
  const EnergyReport report = energy_report(amounts, table);
  expect_range(report.moving, 0.25 + 0.5, 0.5 + 2, 1 + 8);
  expect_range(report.constant.value(), 10, 20, 40);
  RunResult with_dram = machine;
  with_dram.parameters.emplace_back("dram.channels", "1");
  EXPECT_EQ(energy_amounts(kernel, with_dram, table).events[1], 33e9);
  KernelReport silent = kernel;
  silent.warp_instructions.reset();
  EXPECT_EQ(energy_amounts(silent, machine, table).missing, std::vector<std::string>{"warp instructions of k"});
}

TEST(Energy, OfKernelsOneAfterTheOtherIsTheirSum) {
  const EnergyTable table = table_with_active_cores();
  const RunResult machine = run_on_gh100(1);
  EnergyAmounts both = energy_amounts(kernel_of(1e9, 0, 1), machine, table);
  KernelReport idle = kernel_of(3e9, 32'000'000'000, 3);
  idle.core_cycles = 0;
  const Range first = energy_report(both, table).total.value();
  const EnergyAmounts next = energy_amounts(idle, machine, table);
  const Range second = energy_report(next, table).total.value();
  both += next;
  EXPECT_DOUBLE_EQ(both.seconds.value(), 4e-3);
  expect_range(energy_report(both, table).total.value(), first.low + second.low, first.nominal + second.nominal,
               first.high + second.high);
  KernelReport untimed = idle;
  untimed.cycles.reset();
  both += energy_amounts(untimed, machine, table);
  EXPECT_FALSE(energy_report(both, table).total.has_value());
}

TEST(Energy, OfBytesOfADramIsTheTables) {
  const EnergyTable table = table_with_active_cores();
  const EnergyReport report = energy_report(tools::energy_amounts_of_dram(1'000'000'000, table), table);
  expect_range(report.moving, 1, 4, 16);
  EXPECT_FALSE(report.total.has_value());
}

TEST(Energy, TheShippedTableCountsWhatPlatformsHave) {
  for (const Platform& platform : platforms()) check_energy_names(tools::shipped_energies(), platform);
}

// The shipped table on runs of every platform and variant.

RunResult simulated(const Platform& platform, const Variant& variant, bool reads_statistics) {
  RunRequest request;
  request.platform = &platform;
  request.variant = variant;
  request.fidelity = Fidelity::lt;
  request.reads_statistics = reads_statistics;
  fresh_simulation();
  return simulate(request, tiny_draw());
}

TEST(Energy, OfEveryPlatformIsCompleteAndSumsUp) {
  const EnergyTable& table = tools::shipped_energies();
  for (const Platform& platform : platforms()) {
    for (const char* name : {"baseline", "het+qm"}) {
      SCOPED_TRACE(platform.name + " " + name);
      const RunResult run = simulated(platform, variant_named(name), true);
      const EnergyAmounts amounts = energy_amounts(run, table);
      const EnergyReport report = energy_report(amounts, table);
      Range sum;
      for (const tools::UnitEnergy& unit : report.units) {
        expect_ordered(unit.millijoules);
        sum += unit.millijoules;
        const bool extends = unit.unit == "TGC" || unit.unit == "QRU";
        const bool always = unit.unit == "SM lanes" || unit.unit == "registers" || unit.unit == "L2" ||
                            unit.unit == "crossbar" || unit.unit == "CROP" || unit.unit == "TC" ||
                            unit.unit == "raster";
        if (extends || always) {
          EXPECT_EQ(unit.millijoules.nominal > 0, always || std::string(name) == "het+qm") << unit.unit;
        }
      }
      EXPECT_DOUBLE_EQ(report.moving.nominal, sum.nominal);
      EXPECT_DOUBLE_EQ(report.total->nominal, report.moving.nominal + report.constant->nominal);
      expect_ordered(report.total.value());
      expect_ordered(report.quad_merging_share.value());
    }
  }
}

TEST(Energy, WithMemoryNothingIsLeftOutButOtherWaysToIt) {
  const RunResult run = simulated(platform_named("agx-orin"), variant_named("het+qm"), true);
  EXPECT_TRUE(energy_amounts(run, tools::shipped_energies()).not_counted.empty());
}

TEST(Energy, DoesNotDependOnWhetherStatisticsAreFollowed) {
  for (const char* platform : {"agx-orin-ideal-memory", "agx-orin-lpddr5"}) {
    const Variant& variant = variant_named("het+qm");
    const auto amounts = [&](bool reads) {
      return energy_amounts(simulated(platform_named(platform), variant, reads), tools::shipped_energies());
    };
    const EnergyAmounts with = amounts(true), without = amounts(false);
    EXPECT_EQ(with.events, without.events);
    EXPECT_EQ(with.powers, without.powers);
    EXPECT_EQ(with.not_counted, without.not_counted);
  }
}

}  // namespace
}  // namespace vrpipe::testing
