#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/platforms/netlist.h>

#include "output/compare_sections.h"
#include "output/page_parts.h"
#include "output/plot_fill.h"
#include "output/report.h"
#include "output/svg_plot.h"
#include "output/svg_stacks.h"
#include "output/unit_shares.h"

namespace vrpipe::tools {
namespace {

/// From what keeps a unit at work to what it has no part in.
constexpr UnitState states_in_order[] = {UnitState::busy, UnitState::memory, UnitState::latency, UnitState::blocked,
                                         UnitState::starved};

std::string states_csv(const std::vector<RunResult>& runs) {
  std::vector<std::string> heading{"run", "unit"};
  for (unsigned state = 0; state < unit_states; ++state)
    heading.emplace_back(vrpipe::name_of(static_cast<UnitState>(state)));
  heading.emplace_back("occupancy");
  CsvText csv(heading);
  for (const RunResult& run : runs) {
    for (const UnitReport& unit : run.units) {
      std::vector<std::string> cells{name_of(run.request), unit.name};
      for (const std::uint64_t cycles : unit.cycles) cells.push_back(fmt::format("{}", cycles));
      cells.push_back(csv_number(unit.occupancy));
      csv.row(cells);
    }
  }
  return csv.text();
}

std::string bound_note(const RunResult& run, const std::string& unit) {
  if (!run.bottleneck || without_gpc(run.bottleneck->unit) != unit) return {};
  return fmt::format("{}, {:.0f} % occupied",
                     run.bottleneck->occupancy >= bounding_occupancy ? "bottleneck" : "busiest",
                     100 * run.bottleneck->occupancy);
}

std::string states_figure(const std::vector<RunResult>& runs) {
  StackPlot plot;
  plot.id = "cycles";
  plot.description = "what units spent their cycles on";
  plot.axis = "cycles of the run, %";
  plot.most = 100;
  for (const UnitState state : states_in_order) plot.kinds.emplace_back(vrpipe::name_of(state), fill_of(state));
  for (const RunResult& run : runs) {
    for (const UnitShares& unit : unit_shares(run)) {
      auto group = std::find_if(plot.groups.begin(), plot.groups.end(),
                                [&](const StackGroup& each) { return each.title == unit.unit; });
      if (group == plot.groups.end()) group = plot.groups.insert(group, StackGroup{unit.unit, {}});
      StackedBar bar{name_of(run.request), {}, bound_note(run, unit.unit)};
      for (const UnitState state : states_in_order) {
        bar.values.push_back(100 * unit.shares[static_cast<unsigned>(state)]);
      }
      group->bars.push_back(std::move(bar));
    }
  }
  const bool has_gpcs =
      std::any_of(runs.begin(), runs.end(), [](const RunResult& run) { return gpcs_of(run.request) > 1; });
  return html(PageFigure{"cycles",
                         std::string("Each unit charges each cycle to one state") +
                             (has_gpcs ? ", here over all GPCs" : "") +
                             ". Units before the bottleneck are blocked, units behind it starved. Busy is no measure "
                             "of load: occupancy is.",
                         svg(plot), states_csv(runs)});
}

std::string utilization_table(const std::vector<RunResult>& runs) {
  std::vector<std::string> heading{"utilization, % of peak"}, names{"run"};
  for (const RunResult& run : runs) heading.push_back(name_of(run.request));
  std::vector<PageRow> rows;
  const auto most = std::max_element(runs.begin(), runs.end(), [](const RunResult& a, const RunResult& b) {
    return a.utilization.size() < b.utilization.size();
  });
  for (const auto& each : most->utilization) names.push_back(each.first);
  for (const std::string& name : utilized(runs)) {
    PageRow& row = rows.emplace_back(PageRow{{name}});
    for (const RunResult& run : runs) {
      const std::optional<double> share = utilization_of(run, name);
      row.cells.push_back(share ? fmt::format("{:.1f}", 100 * *share) : "-");
    }
  }
  CsvText csv(names);
  for (const RunResult& run : runs) {
    std::vector<std::string> cells{name_of(run.request)};
    for (std::size_t i = 1; i < names.size(); ++i) {
      const std::optional<double> share = utilization_of(run, names[i]);
      cells.push_back(share ? csv_number(*share) : std::string());
    }
    csv.row(cells);
  }
  return "<h3>Utilization</h3>\n<p>Work done over peak rate x cycles. <span class=\"links\">" +
         csv_link("utilization", csv.text()) + "</span></p>\n" + html_table(heading, rows);
}

}  // namespace

std::string cycles_section(const JobResult& result) {
  const std::vector<RunResult>& runs = result.runs;
  if (!runs.front().cycles || runs.front().units.empty()) return {};
  std::string bounds;
  for (const RunResult& run : runs) {
    if (const std::string bound = bound_text(run); !bound.empty()) bounds += "<li>" + html_escaped(bound) + "</li>\n";
  }
  std::string text = bounds.empty() ? std::string() : "<ul>\n" + bounds + "</ul>\n";
  text += states_figure(runs);
  return utilized(runs).empty() ? text : text + utilization_table(runs);
}

}  // namespace vrpipe::tools
