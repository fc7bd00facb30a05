#include "output/reproduce_page.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include <fmt/format.h>

#include "image/base64.h"
#include "image/picture.h"
#include "output/page_parts.h"
#include "output/reproduce_answers.h"

namespace vrpipe::tools {
namespace {

constexpr std::array<const char*, 4> colors{"#8a949e", "#0072b2", "#009e73", "#d1400f"};
constexpr const char* own_style = R"(
td.agrees { background: #e6f4ea; } td.differs { background: #fde4dc; } td.cannot { color: #5a6572; }
table.rows { white-space: normal; } table.rows th, table.rows td { text-align: left; vertical-align: top; }
table.rows td:nth-child(4), table.rows td:nth-child(6) { white-space: nowrap; }
table.words td:last-child { white-space: normal; text-align: left; }
)";

std::string report_table_html(const ReportTable& table) {
  const bool has_words = table.heading.back() == "values";
  std::string text = has_words ? "<table class=\"words\">\n<tr>" : "<div class=\"scroll\"><table>\n<tr>";
  for (const std::string& cell : table.heading) text += "<th>" + html_escaped(cell) + "</th>";
  text += "</tr>\n";
  for (const auto& row : table.rows) {
    text += "<tr>";
    for (const std::string& cell : row) text += "<td>" + html_escaped(cell) + "</td>";
    text += "</tr>\n";
  }
  text += has_words ? "</table>\n" : "</table></div>\n";
  if (!table.note.empty()) text += "<p class=\"subtle\">" + html_escaped(table.note) + "</p>\n";
  return text;
}

std::string section(const ReportTable& table, const std::string& plot) {
  if (table.rows.empty()) return {};
  return "<h2>" + html_escaped(table.title) + "</h2>\n" + plot + report_table_html(table);
}

std::string rows_html(const Reproduction& of) {
  std::string text =
      "<h2>Row by row</h2>\n<table class=\"rows\">\n<tr><th>id</th><th>what</th><th>section of the paper</th>"
      "<th>the paper says</th><th>measured here</th><th>difference</th><th>verdict</th><th>why, or how "
      "measured</th></tr>\n";
  for (const RowFinding& finding : of.rows) {
    const PaperRow& row = *finding.row;
    const char* const kind = finding.verdict == Verdict::agrees    ? "agrees"
                             : finding.verdict == Verdict::differs ? "differs"
                                                                   : "cannot";
    text += fmt::format("<tr id=\"{0}\"><td>{0}</td>", row.id);
    for (const std::string& cell : {row.what, row.section, row.says, finding.measured, difference_text(finding)}) {
      text += "<td>" + html_escaped(cell) + "</td>";
    }
    text += fmt::format("<td class=\"{}\">{}</td><td>{}</td></tr>\n", kind, verdict_text(of, finding),
                        html_escaped(why_text(finding)));
  }
  return text + "</table>\n";
}

const std::string& label_of(const Reproduction& of, const SceneFinding& scene) {
  return of.result.plan.scenes[scene.scene].name;
}

std::string speedups_plot(const Reproduction& of) {
  BarPlot plot;
  plot.description = "speed-ups over the baseline, by scene and variant";
  plot.title = "speed-up over the baseline";
  plot.legend = {{"QM", colors[1]}, {"HET", colors[2]}, {"HET+QM", colors[3]}};
  plot.line = 1;
  for (const auto* scenes : {&of.findings.scenes, &of.findings.large}) {
    for (const SceneFinding& scene : *scenes) {
      const Gains& gains = scene.gains;
      BarGroup group{label_of(of, scene), {}, {}};
      group.bars = {{0, gains.qm, colors[1], fmt::format("QM {:.2f}x", gains.qm)},
                    {0, gains.het, colors[2], fmt::format("HET {:.2f}x", gains.het)},
                    {0, gains.het_qm, colors[3], fmt::format("HET+QM {:.2f}x", gains.het_qm)}};
      plot.groups.push_back(std::move(group));
    }
  }
  return figure("speed-ups", plot);
}

std::string utilization_plot(const Reproduction& of) {
  BarPlot plot;
  plot.description = "utilisation of units, by scene, baseline and HET+QM";
  plot.title = "% of peak";
  plot.legend = {{"baseline", colors[0]}, {"HET+QM", colors[3]}};
  for (const auto* scenes : {&of.findings.scenes, &of.findings.large}) {
    for (const SceneFinding& scene : *scenes) {
      const auto& baseline = scene.runs[0]->run.utilization;
      const auto& both = scene.runs[3]->run.utilization;
      for (std::size_t i = 0; i < std::min(baseline.size(), both.size()); ++i) {
        if (baseline[i].first == "dram") continue;
        BarGroup group{label_of(of, scene) + ", " + baseline[i].first, {}, {}};
        group.bars = {{0, 100 * baseline[i].second, colors[0], fmt::format("{:.1f} %", 100 * baseline[i].second)},
                      {0, 100 * both[i].second, colors[3], fmt::format("{:.1f} %", 100 * both[i].second)}};
        plot.groups.push_back(std::move(group));
      }
    }
  }
  return figure("utilisation", plot);
}

std::string ratios_plot(const Reproduction& of) {
  BarPlot plot;
  plot.description = "early-termination ratios over views, by scene";
  plot.title = "early-termination ratio: quartiles as a bar, least, median and greatest as marks";
  plot.least = 1;
  for (const SceneFinding& scene : of.findings.scenes) {
    const auto& distribution = scene.ratio_distribution;
    if (!distribution) continue;
    BarGroup group{label_of(of, scene), {}, {distribution->minimum, distribution->median, distribution->maximum}};
    group.bars = {{distribution->lower_quartile, distribution->upper_quartile, colors[2],
                   fmt::format("{} views", distribution->count)}};
    plot.groups.push_back(std::move(group));
  }
  return figure("early-termination ratios", plot);
}

std::string tornado(const Reproduction& of) {
  BarPlot plot;
  plot.description = "how far each parameter moves the mean speed-up of HET+QM, the farthest first";
  plot.title = "mean speed-up of HET+QM from its least to its greatest, of the default's";
  plot.line = 1;
  double least = 1;
  for (const SensitivityFinding& finding : of.findings.sensitivity) {
    const double base = finding.at_default.het_qm.arithmetic;
    double from = 1, to = 1;
    for (const StudyPoint& point : finding.values) {
      from = std::min(from, point.het_qm.arithmetic / base);
      to = std::max(to, point.het_qm.arithmetic / base);
    }
    least = std::min(least, from);
    BarGroup group{finding.parameter.name, {}, {}};
    group.bars = {{from, 1, colors[1], fmt::format("{:.3f}", from)}};
    group.bars.push_back({1, to, colors[3], fmt::format("{:.3f}", to)});
    plot.groups.push_back(std::move(group));
  }
  plot.least = 0.1 * static_cast<int>(10 * least);
  plot.legend = {{"less", colors[1]}, {"more", colors[3]}};
  return figure("sensitivity", plot);
}

std::string maps_html(const Reproduction& of) {
  std::string stops;
  for (const double count : {1.0, 4.0, 16.0, 64.0, 250.0, 1000.0}) {
    const auto color = count_color(count);
    stops += fmt::format("{}rgb({},{},{})", stops.empty() ? "" : ",", color[0], color[1], color[2]);
  }
  std::string text = fmt::format(
      "<div class=\"scale\">{:g} fragment <i style=\"background:linear-gradient(90deg,{})\"></i> {:g} or more, in "
      "powers of "
      "ten; left without, right with termination</div>\n<div class=\"cards\">\n",
      smallest_mapped_count, stops, largest_mapped_count);
  for (const SceneFinding& scene : of.findings.scenes) {
    text += "<figure><figcaption><b>" + html_escaped(label_of(of, scene)) + "</b></figcaption><div class=\"pair\">";
    for (const PointResult* point : {scene.map_without, scene.map_with}) {
      if (!point->map) continue;
      text += fmt::format("<img alt=\"fragments blended a pixel, {}\" src=\"data:image/png;base64,{}\">",
                          point->run.request.variant.name, base64(point->map->png));
    }
    text += "</div></figure>\n";
  }
  return text + "</div>\n";
}

}  // namespace

std::string reproduction_page(const Reproduction& of) {
  std::string text = page_head("vrpipe reproduce", own_style) + "<h1>The paper's results, reproduced</h1>\n";
  for (const std::string& line : reproduction_heading(of))
    text += "<p class=\"subtle\">" + html_escaped(line) + "</p>\n";
  text += fmt::format("<p class=\"{}\">{}</p>\n", of.result.plan.quick ? "verdict notice" : "verdict",
                      html_escaped(verdict_summary(of)));
  text += rows_html(of);
  text += section(scenes_table(of), speedups_plot(of));
  text += section(blended_table(of), "");
  text += section(utilization_table(of), utilization_plot(of));
  text += section(maps_table(of), maps_html(of));
  text += section(ratios_table(of), ratios_plot(of));
  text += section(passes_table(of), "");
  text += section(frames_table(of), "");
  text += section(large_table(of), "");
  text += section(cost_table(of), "");
  text += section(microbench_table(of), "");
  text += section(sensitivity_table(of), tornado(of));
  text += section(checks_table(of), "");
  text += section(fragments_table(of), "");
  text += section(efficiency_table(of), "");
  for (const Answer& answer : answers(of)) {
    text += "<h2>" + html_escaped(answer.question) + "</h2>\n<p>" + html_escaped(answer.text) + "</p>\n";
  }
  if (!of.result.plan.skipped.empty()) text += "<h2>Not tried</h2>\n<ul>\n";
  for (const SkippedSetting& skipped : of.result.plan.skipped) {
    text += "<li>" + html_escaped(skipped.settings + ": " + skipped.reason) + "</li>\n";
  }
  if (!of.result.plan.skipped.empty()) text += "</ul>\n";
  text += "<p class=\"subtle\"><code>" + html_escaped(command_text(of.result.provenance)) + "</code></p>\n";
  return text + "</body>\n</html>\n";
}

}  // namespace vrpipe::tools
