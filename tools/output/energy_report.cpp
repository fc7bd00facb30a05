#include "output/energy_report.h"

#include <algorithm>
#include <functional>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>

#include "jobs/paper_rows.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

constexpr std::size_t line_width = 100;

std::string ratio_of_energies(double value) { return fmt::format("{:.2f}x", value); }

/// Words between commas, broken between them.
std::string broken_at_commas(const std::string& text) {
  std::string all;
  for (const std::string& line : wrapped(text, line_width - 2)) all += (all.empty() ? "" : "  ") + line + "\n";
  return all;
}

/// Of each run.
struct Spent {
  std::vector<EnergyAmounts> amounts;
  std::vector<EnergyReport> reports;
};

class SpentTable {
 public:
  SpentTable(const std::vector<RunResult>& runs, const Spent& spent) : spent_(spent), table_(heading(runs)) {}

  using Cell = std::function<std::string(std::size_t)>;
  void row(const std::string& label, const Cell& cell, bool emphasised = false) {
    std::vector<std::string> cells{label};
    for (std::size_t i = 0; i < spent_.reports.size(); ++i) cells.push_back(cell(i));
    table_.row(std::move(cells), emphasised);
  }
  /// A quantity of the report, and its range below; left out where no run has it.
  void range(const std::string& label, std::optional<Range> EnergyReport::*what, double scale) {
    const auto has = [&](const EnergyReport& report) { return (report.*what).has_value(); };
    if (std::none_of(spent_.reports.begin(), spent_.reports.end(), has)) return;
    both(
        label, [&](std::size_t i) { return spent_.reports[i].*what; }, scale);
  }
  void both(const std::string& label, const std::function<std::optional<Range>(std::size_t)>& value, double scale) {
    const auto cell = [&](std::size_t i, const std::function<std::string(const Range&)>& show) {
      const std::optional<Range> range = value(i);
      return range ? show(*range * scale) : std::string("-");
    };
    row(label, [&](std::size_t i) {
      if (!spent_.amounts[i].is_known) return std::string("-");
      const std::string at_least = spent_.amounts[i].missing.empty() ? "" : "at least ";
      return cell(i, [&](const Range& range) { return at_least + three_digits(range.nominal); });
    });
    row("  low to high",
        [&](std::size_t i) { return spent_.amounts[i].is_known ? cell(i, between) : std::string("-"); });
  }
  std::string text(const TextStyle& style) const { return table_.text(style); }

 private:
  static std::vector<std::string> heading(const std::vector<RunResult>& runs) {
    std::vector<std::string> cells{"energy, mJ"};
    for (const RunResult& run : runs) cells.push_back(name_of(run.request));
    return cells;
  }
  const Spent& spent_;
  TextTable table_;
};

Spent spent_by(const std::vector<RunResult>& runs, const EnergyTable& table) {
  Spent spent;
  for (const RunResult& run : runs) {
    spent.amounts.push_back(energy_amounts(run, table));
    spent.reports.push_back(energy_report(spent.amounts.back(), table));
  }
  return spent;
}

void add_ratio(SpentTable& rows, const RunRequest& baseline, const EnergyAmounts& of_baseline, const Spent& spent,
               const EnergyTable& table) {
  std::vector<std::optional<Range>> ratios;
  for (const EnergyAmounts& amounts : spent.amounts) {
    ratios.push_back(energy_ratio(of_baseline, amounts, table));
  }
  const auto cell = [&](std::size_t i, const std::string& text) { return ratios[i] ? text : std::string("-"); };
  rows.row(
      "energy efficiency over " + name_of(baseline),
      [&](std::size_t i) { return cell(i, ratios[i] ? ratio_of_energies(ratios[i]->nominal) : ""); }, true);
  rows.row("  low to high", [&](std::size_t i) {
    return cell(i, ratios[i] ? fmt::format("{:.2f} to {:.2f}x", ratios[i]->low, ratios[i]->high) : "");
  });
}

/// Of what the sums leave out.
std::string left_out_text(const std::vector<RunResult>& runs, const Spent& spent, const EnergyTable& table) {
  std::string text;
  // What only some runs are without, as ZROP's tests are without termination, does not happen in those.
  std::vector<std::string> names = spent.amounts.front().not_counted;
  for (const EnergyAmounts& amounts : spent.amounts) {
    const std::vector<std::string>& others = amounts.not_counted;
    const auto is_counted = [&](const std::string& name) {
      return std::find(others.begin(), others.end(), name) == others.end();
    };
    names.erase(std::remove_if(names.begin(), names.end(), is_counted), names.end());
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!spent.amounts[i].is_known) text += fmt::format("what {} spends is not known\n", name_of(runs[i].request));
    if (spent.amounts[i].missing.empty() || !spent.amounts[i].is_known) continue;
    text += broken_at_commas(
        fmt::format("{} spends more than is said here, by nobody knows how much: its units do not count {}",
                    name_of(runs[i].request), printable(fmt::format("{}", fmt::join(spent.amounts[i].missing, ", ")))));
  }
  if (!names.empty()) {
    text += broken_at_commas("energy of what is not simulated here is left out: " +
                             fmt::format("{}", fmt::join(names, ", ")));
  }
  if (!spent.amounts.front().seconds) {
    text += "energy of constant power is unknown, since there is no time, and so are totals\n";
  } else if (const Platform& platform = *runs.front().request.platform;
             !powers_of_other_platforms(table, platform).empty()) {
    text += broken_at_commas(fmt::format("constant power ({}) was not found for {}: take totals and ratios as examples",
                                         fmt::join(powers_of_other_platforms(table, platform), ", "), platform.name));
  }
  return text;
}

}  // namespace

std::string three_digits(double value) {
  if (value == 0) return "0";
  if (value >= 99.95) return fmt::format("{:.0f}", value);
  if (value >= 9.995) return fmt::format("{:.1f}", value);
  if (value >= 0.9995) return fmt::format("{:.2f}", value);
  return value >= 0.001 ? fmt::format("{:.3f}", value) : fmt::format("{:.1g}", value);
}

std::string between(const Range& range) { return three_digits(range.low) + " to " + three_digits(range.high); }

Json range_json(const Range& range) { return {{"low", range.low}, {"nominal", range.nominal}, {"high", range.high}}; }
Json range_json(const std::optional<Range>& range) { return range ? range_json(*range) : Json(); }

std::string energy_text(const std::vector<RunResult>& runs, std::size_t baseline, const EnergyTable& table,
                        const TextStyle& style) {
  const Spent spent = spent_by(runs, table);
  SpentTable rows(runs, spent);
  for (std::size_t unit = 0; unit < spent.reports.front().units.size(); ++unit) {
    const auto of = [&](const EnergyReport& report) { return report.units[unit].millijoules.nominal; };
    const auto spends = [&](const EnergyReport& report) { return of(report) > 0; };
    if (std::none_of(spent.reports.begin(), spent.reports.end(), spends)) continue;
    rows.row(printable(spent.reports.front().units[unit].unit),
             [&](std::size_t i) { return spent.amounts[i].is_known ? three_digits(of(spent.reports[i])) : "-"; });
  }
  rows.both(
      "all that moves", [&](std::size_t i) { return spent.reports[i].moving; }, 1);
  rows.range("constant power x time", &EnergyReport::constant, 1);
  rows.range("total", &EnergyReport::total, 1);
  if (runs.size() > 1 && spent.amounts.front().seconds) {
    add_ratio(rows, runs[baseline].request, spent.amounts[baseline], spent, table);
  }
  rows.range("mean power, W", &EnergyReport::watts, 1);
  rows.range("pJ a fragment blended", &EnergyReport::picojoules_per_fragment, 1);
  rows.range("TGC and QRU, % of the total", &EnergyReport::quad_merging_share, 100);

  std::string text =
      rows.text(style) +
      broken_at_commas(fmt::format(
          "energies at {}; low to high: wherever in its range each figure lies, in a ratio the same in both "
          "runs (docs/energy.md)",
          printable(table.processes[spent.amounts.front().process].name)));
  if (const std::string& left_out = table.processes[spent.amounts.front().process].leaves_out; !left_out.empty()) {
    text += broken_at_commas("not in it: " + printable(left_out));
  }
  text += left_out_text(runs, spent, table);
  if (runs.size() > 1) {
    text += broken_at_commas(
        fmt::format("the paper has {} on average and {} (R12, R13) by another method: measured on an AGX Orin whose "
                    "shaders imitate termination, by a stencil that counts, and merging, by shuffles and blends, "
                    "without TGC and QRU, as `vrpipe frames --imitation` does",
                    paper_row("R12").says, paper_row("R13").says));
  }
  return text;
}

Json energy_json(const RunResult& run, const RunResult* baseline, const EnergyTable& table) {
  const EnergyAmounts amounts = energy_amounts(run, table);
  const EnergyReport report = energy_report(amounts, table);
  Json units = Json::array();
  for (const UnitEnergy& unit : report.units) {
    units.push_back({{"name", unit.unit}, {"millijoules", range_json(unit.millijoules)}});
  }
  Json events = Json::array();
  for (std::size_t i = 0; i < table.events.size(); ++i) {
    events.push_back({{"name", table.events[i].name},
                      {"unit", table.events[i].unit},
                      {"count", amounts.events[i]},
                      {"picojoules", range_json(table.events[i].picojoules[amounts.process])}});
  }
  std::optional<Range> ratio;
  if (baseline != nullptr) ratio = energy_ratio(energy_amounts(*baseline, table), amounts, table);
  const GpuProcess& process = table.processes[amounts.process];
  return {{"process", process.name},
          {"leaves_out", process.leaves_out.empty() ? Json() : Json(process.leaves_out)},
          {"units", std::move(units)},
          {"events", std::move(events)},
          {"moving_millijoules", range_json(report.moving)},
          {"constant_millijoules", range_json(report.constant)},
          {"total_millijoules", range_json(report.total)},
          {"ratio_over_baseline", range_json(ratio)},
          {"mean_watts", range_json(report.watts)},
          {"picojoules_per_fragment", range_json(report.picojoules_per_fragment)},
          {"quad_merging_share", range_json(report.quad_merging_share)},
          {"not_counted", amounts.not_counted},
          {"missing", amounts.missing},
          {"powers_of_other_platforms", powers_of_other_platforms(table, *run.request.platform)}};
}

}  // namespace vrpipe::tools
