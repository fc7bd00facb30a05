#include <fmt/format.h>

#include <vrpipe/platforms/netlist.h>

#include "jobs/comparison.h"
#include "output/compare_sections.h"
#include "output/effects_page.h"
#include "output/page_parts.h"
#include "output/report.h"
#include "output/svg_plot.h"
#include "output/svg_stacks.h"

namespace vrpipe::tools {
namespace {

std::string busiest_text(const RunResult& run) {
  if (!run.bottleneck) return "-";
  const std::string& unit = run.bottleneck->unit;
  return fmt::format("{}, {:.0f} %", gpcs_of(run.request) > 1 ? unit : without_gpc(unit),
                     100 * run.bottleneck->occupancy);
}

std::string speedup_figure(const JobResult& result, const std::string& csv) {
  const RunResult& baseline = result.runs[result.baseline];
  StackPlot plot;
  plot.id = "speedup";
  plot.description = "speed-up of each run over " + name_of(baseline.request);
  plot.axis = "speed-up over " + name_of(baseline.request);
  plot.kinds = {{"speed-up", 0}};
  plot.line = 1;
  StackGroup& group = plot.groups.emplace_back();
  for (const RunResult& run : result.runs) {
    const std::optional<double> gain = speedup(baseline, run);
    if (gain) group.bars.push_back({name_of(run.request), {*gain}, fmt::format("{:.2f}x", *gain)});
  }
  if (group.bars.empty()) return {};
  return html(PageFigure{"speedup",
                         "Speed-up over " + html_escaped(name_of(baseline.request)) +
                             ": its cycles over those of each run, or its time where clocks differ.",
                         svg(plot), csv});
}

}  // namespace

std::string speedups_section(const JobResult& result) {
  const RunResult& baseline = result.runs[result.baseline];
  if (!baseline.cycles) return {};
  const bool compares = result.runs.size() > 1;
  CsvText csv({"run", "platform", "variant", "cycles", "milliseconds", "speedup", "host_seconds", "cpu_seconds",
               "bottleneck", "occupancy", "result_hash"});
  std::vector<PageRow> rows;
  for (const RunResult& run : result.runs) {
    const std::optional<double> gain = speedup(baseline, run);
    const std::string cycles = fmt::format("{}", run.cycles.value_or(0));
    csv.row({name_of(run.request), run.request.platform->name, run.request.variant.name, cycles,
             csv_number(run.milliseconds), gain ? csv_number(*gain) : std::string(), csv_number(run.host_seconds),
             csv_number(run.cpu_seconds), run.bottleneck ? run.bottleneck->unit : std::string(),
             run.bottleneck ? csv_number(run.bottleneck->occupancy) : std::string(), run.result_hash});
    rows.push_back({{name_of(run.request), grouped(run.cycles.value_or(0)), fmt::format("{:.3f}", run.milliseconds),
                     gain ? fmt::format("{:.2f}x", *gain) : std::string("-"), busiest_text(run),
                     fmt::format("{:.2f}", run.host_seconds), run.result_hash},
                    &run == &baseline && compares ? "marked" : ""});
  }
  std::string text = compares ? speedup_figure(result, csv.text()) : std::string();
  text +=
      html_table({"run", "cycles", "simulated ms", "speed-up", "busiest unit, occupied", "host seconds", "result hash"},
                 rows);
  if (!compares) text += "<p class=\"links\">" + csv_link("speedup", csv.text()) + "</p>\n";
  if (const auto early = early_termination_ratio(result.runs)) {
    text += fmt::format(
        "<p>Early-termination ratio {:.2f}: fragments blended without termination over those blended with it.</p>\n",
        *early);
  }
  return text;
}

std::string runs_effects_section(const JobResult& result) {
  std::vector<const RunResult*> runs;
  for (const RunResult& run : result.runs) {
    if (!run.effects.empty()) runs.push_back(&run);
  }
  if (runs.empty()) return {};
  return "<p>With <code>--effects " + html_escaped(result.runs.front().request.effects.text()) +
         "</code>. What is not active is omitted: <b>static</b>, since frame, camera and platform decide beforehand; "
         "<b>verified</b>, as nothing called for it in the run; <b>bounded</b>, as an approximation; or by "
         "force.</p>\n" +
         effects_html(runs);
}

std::string notes_section(const JobResult& result) {
  std::string text;
  for (const std::string& note : notes_of(result)) text += "<li>" + html_escaped(note) + "</li>\n";
  return text.empty() ? "<p>None.</p>\n" : "<ul>\n" + text + "</ul>\n";
}

}  // namespace vrpipe::tools
