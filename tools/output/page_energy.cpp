#include <algorithm>

#include <fmt/format.h>

#include "jobs/energy.h"
#include "output/compare_sections.h"
#include "output/energy_report.h"
#include "output/page_parts.h"
#include "output/plot_fill.h"
#include "output/svg_plot.h"
#include "output/svg_stacks.h"

namespace vrpipe::tools {
namespace {

/// Of each run: what each unit spends, and at the end what constant power does; nominal, mJ.
struct EnergyBars {
  std::vector<std::string> names;
  std::vector<std::vector<Range>> of_run;
};

EnergyBars energy_bars(const JobResult& result, const std::vector<EnergyReport>& reports) {
  EnergyBars bars;
  bars.of_run.resize(reports.size());
  for (std::size_t unit = 0; unit < reports.front().units.size(); ++unit) {
    const auto spends = [&](const EnergyReport& report) { return report.units[unit].millijoules.nominal > 0; };
    if (std::none_of(reports.begin(), reports.end(), spends)) continue;
    bars.names.push_back(reports.front().units[unit].unit);
    for (std::size_t i = 0; i < reports.size(); ++i) bars.of_run[i].push_back(reports[i].units[unit].millijoules);
  }
  if (result.runs.front().cycles && reports.front().constant) {
    bars.names.emplace_back("constant power");
    for (std::size_t i = 0; i < reports.size(); ++i) bars.of_run[i].push_back(reports[i].constant.value_or(Range{}));
  }
  return bars;
}

/// A bar for each run has no room for more kinds than fills: those that spend the least are one.
std::string energy_plot(const JobResult& result, const EnergyBars& bars) {
  StackPlot plot;
  plot.id = "energy";
  plot.description = "energy of each run by unit";
  plot.axis = "energy, mJ (nominal)";
  std::vector<std::pair<double, std::size_t>> by_energy;
  for (std::size_t kind = 0; kind < bars.names.size(); ++kind) {
    double most = 0;
    for (const auto& run : bars.of_run) most = std::max(most, run[kind].nominal);
    by_energy.emplace_back(-most, kind);
  }
  std::sort(by_energy.begin(), by_energy.end());
  const std::size_t shown = by_energy.size() > plot_fills.size() ? plot_fills.size() - 1 : by_energy.size();
  for (std::size_t i = 0; i < shown; ++i) plot.kinds.emplace_back(bars.names[by_energy[i].second], i);
  if (shown < by_energy.size()) plot.kinds.emplace_back("others", shown);
  StackGroup& group = plot.groups.emplace_back();
  for (std::size_t run = 0; run < bars.of_run.size(); ++run) {
    StackedBar bar{name_of(result.runs[run].request), std::vector<double>(plot.kinds.size(), 0.0)};
    double sum = 0;
    for (std::size_t i = 0; i < by_energy.size(); ++i) {
      const double spent = bars.of_run[run][by_energy[i].second].nominal;
      bar.values[std::min(i, plot.kinds.size() - 1)] += spent;
      sum += spent;
    }
    bar.note = fmt::format("{:.3g} mJ", sum);
    group.bars.push_back(std::move(bar));
  }
  return svg(plot);
}

std::string process_name(const JobResult& result) {
  const EnergyTable& table = *result.energies;
  return table.processes[table.process_of(result.runs.front().request.platform->name)].name;
}

}  // namespace

std::string energy_section(const JobResult& result) {
  if (!result.energies) return {};
  std::vector<EnergyReport> reports;
  for (const RunResult& run : result.runs) {
    reports.push_back(energy_report(energy_amounts(run, *result.energies), *result.energies));
  }
  const EnergyBars bars = energy_bars(result, reports);
  if (bars.names.empty()) return {};
  CsvText csv({"run", "unit", "low_mj", "nominal_mj", "high_mj"});
  for (std::size_t run = 0; run < bars.of_run.size(); ++run) {
    for (std::size_t kind = 0; kind < bars.names.size(); ++kind) {
      const Range& range = bars.of_run[run][kind];
      csv.row({name_of(result.runs[run].request), bars.names[kind], csv_number(range.low), csv_number(range.nominal),
               csv_number(range.high)});
    }
  }
  return html(PageFigure{"energy",
                         "What each run spends, by unit, with the energies at " + html_escaped(process_name(result)) +
                             ".",
                         energy_plot(result, bars), csv.text()}) +
         "<details open><summary>With ranges</summary>\n<pre>" +
         html_escaped(energy_text(result.runs, result.baseline, *result.energies, TextStyle{})) + "</pre></details>\n";
}

}  // namespace vrpipe::tools
