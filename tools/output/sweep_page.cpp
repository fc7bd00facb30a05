#include <algorithm>
#include <array>
#include <filesystem>
#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "output/page_parts.h"
#include "output/sweep_report.h"

namespace vrpipe::tools {
namespace {

constexpr const char* bar_color = "#0072b2";
constexpr const char* front_color = "#d1400f";
constexpr const char* other_color = "#8a949e";
constexpr std::array<const char*, 8> series_colors{"#8a949e", "#0072b2", "#009e73", "#d1400f",
                                                   "#e69f00", "#56b4e9", "#7a3e9d", "#6b4a2b"};
constexpr std::size_t most_rows = 5000;
constexpr const char* facts_style =
    "dl { display: grid; grid-template-columns: max-content 1fr; gap: 3px 18px; } dt { color: #5a6572; } "
    "dd { margin: 0; overflow-wrap: anywhere; }";

std::string cell(const Json& value) {
  if (value.is_null()) return {};
  if (value.is_string()) return html_escaped(value.get<std::string>());
  if (value.is_number_float()) return fmt::format("{:.5g}", value.get<double>());
  return value.dump();
}

/// A column in words, with its unit.
std::string words_of(const std::string& column) {
  const std::vector<std::pair<std::string, std::string>> known{
      {"milliseconds", "simulated time, ms"},
      {"energy_mj", "energy, mJ (nominal)"},
      {"energy_mj_low", "energy, mJ (lowest)"},
      {"energy_mj_high", "energy, mJ (highest)"},
      {"quad_merging_storage_bytes", "storage of quad merging, bytes"},
      {"bottleneck_occupancy", "occupancy of the busiest unit"},
      {"speedup", "speed-up"},
      {"image.psnr_db", "PSNR against the exact image, dB"},
      {"image.ssim", "SSIM against the exact image"},
      {"image.max_abs_error", "largest error against the exact image"}};
  for (const auto& [name, words] : known) {
    if (name == column) return words;
  }
  std::string words = column.rfind("counts.", 0) == 0 ? column.substr(7) : column;
  std::replace_if(
      words.begin(), words.end(), [](char c) { return c == '_' || c == '.'; }, ' ');
  return words;
}

/// What was simulated, as far as it is the same for all points.
std::string facts(const SweepResult& result, const CommonScene& scene) {
  std::string text;
  const auto add = [&](const char* name, const std::string& html) {
    if (!html.empty()) text += fmt::format("<dt>{}</dt><dd>{}</dd>\n", name, html);
  };
  add("drawn", html_escaped(scene_line(scene)));
  std::istringstream machines(study_machines_text(result, TextStyle()));
  for (std::string line; std::getline(machines, line);) add("simulated", html_escaped(line));
  std::string options;
  for (const auto& [name, texts] : result.options) {
    for (const std::string& each : texts) options += fmt::format("{}{} = {}", options.empty() ? "" : ", ", name, each);
  }
  add("options", html_escaped(options));
  add("command", "<code>" + html_escaped(command_text(result.provenance)) + "</code>");
  for (const PluginFile& plugin : result.provenance.plugins)
    add("plugin", html_escaped(plugin.path + ", SHA-256 " + plugin.sha256));
  return "<dl>\n" + text + "</dl>\n";
}

/// As papers have it: a group of bars for each scene, and one of the geometric means.
std::string grouped_section(const SweepFindings& findings) {
  const auto& means = findings.grouped;
  if (!means) return {};
  const Study& study = findings.result.study;
  const StudyAxis& groups = study.axes[means->groups_axis];
  const StudyAxis& series = study.axes[means->series_axis];
  BarPlot plot;
  const std::string what = findings.effects.of_speedups ? "speed-up" : "simulated time, ms";
  plot.title = what;
  plot.description = what + " by " + groups.name + " and " + series.name;
  if (findings.effects.of_speedups) plot.line = 1;
  const auto color = [](std::size_t i) { return series_colors[i % series_colors.size()]; };
  for (std::size_t i = 0; i < series.values.size(); ++i) plot.legend.emplace_back(series.values[i], color(i));
  const auto add = [&](const std::string& label, const std::vector<std::optional<double>>& values) {
    BarGroup group{label, {}, {}};
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i])
        group.bars.push_back({0, *values[i], color(i), fmt::format("{}: {:.3g}", series.values[i], *values[i])});
    }
    if (!group.bars.empty()) plot.groups.push_back(std::move(group));
  };
  for (std::size_t i = 0; i < groups.values.size(); ++i) add(groups.values[i], means->of_group[i]);
  add("geometric mean", means->geometric_mean);
  return fmt::format("<h2>By {} and {}</h2>\n", html_escaped(groups.name), html_escaped(series.name)) +
         figure("by " + groups.name + " and " + series.name, plot,
                "Geometric means over all other axes" +
                    std::string(findings.effects.of_speedups
                                    ? "; the line is 1, the speed of the point that speed-ups are over."
                                    : "."));
}

std::string effect_plot(const SweepFindings& findings, const AxisEffect& effect) {
  const bool of_speedups = findings.effects.of_speedups;
  BarPlot plot;
  plot.description = "by " + findings.result.study.axes[effect.axis].name;
  plot.title = of_speedups ? "speed-up; lines: least and most" : "milliseconds; lines: least and most";
  if (of_speedups) plot.line = 1;
  for (const AxisEffect::OfValue& value : effect.values) {
    const std::string tip = fmt::format("{}: {:.3g} ({:.3g} to {:.3g}, {} points)", value.value, value.mean,
                                        value.least, value.most, value.points);
    plot.groups.push_back({value.value, {{0, value.mean, bar_color, tip}}, {value.least, value.most}});
  }
  return fmt::format("<h3>{}: {}</h3>\n", html_escaped(findings.result.study.axes[effect.axis].name),
                     effect_words(findings, effect)) +
         figure("by " + findings.result.study.axes[effect.axis].name, plot);
}

std::string effects_section(const SweepFindings& findings) {
  if (findings.effects.effects.empty()) return {};
  std::string text = "<h2>What matters</h2>\n<p>The axis that moves ";
  text += findings.effects.of_speedups ? "speed-ups" : "time";
  text += " most comes first: the largest of its values' geometric means over the smallest, over all other axes.</p>\n";
  for (const AxisEffect& effect : findings.effects.effects) text += effect_plot(findings, effect);
  return text;
}

std::string pareto_section(const SweepFindings& findings) {
  if (!findings.pareto) return {};
  const ParetoTable& pareto = *findings.pareto;
  const auto name = [](const std::string& column) { return column[0] == '-' ? column.substr(1) : column; };
  Plot plot;
  plot.description = "GPUs of the study";
  plot.x.title = words_of(name(pareto.columns[0]));
  plot.y.title = words_of(name(pareto.columns[1]));
  std::string rows;
  for (const ParetoRow& each : pareto.rows) {
    std::string label;
    for (const std::string& value : each.values) {
      if (!value.empty()) label += (label.empty() ? "" : ", ") + value;
    }
    plot.points.push_back({each.metrics[0], each.metrics[1], each.on_front ? front_color : other_color, Marker::circle,
                           !each.on_front, each.on_front ? label : std::string(), label});
    rows += each.on_front ? "<tr class=\"marked\">" : "<tr>";
    for (const std::string& value : each.values) rows += "<td>" + html_escaped(value) + "</td>";
    for (const double metric : each.metrics) rows += fmt::format("<td>{:.5g}</td>", metric);
    rows += "</tr>\n";
  }
  plot.legend = {{"on the Pareto front", front_color, Marker::circle, false, false},
                 {"another is better in all", other_color, Marker::circle, true, false}};
  std::string heading;
  for (const std::string& axis : pareto.axes) heading += "<th>" + html_escaped(axis) + "</th>";
  for (const std::string& column : pareto.columns) heading += "<th>" + html_escaped(words_of(name(column))) + "</th>";
  return "<h2>What is worth it</h2>\n<p>Each GPU over all that it draws (geometric means). Those on the Pareto front "
         "are "
         "marked: no other is better in one and no worse in the others.</p>\n" +
         figure("Pareto front", plot) + "<div class=\"scroll\"><table>\n<tr>" + heading + "</tr>\n" + rows +
         "</table></div>\n";
}

std::string points_section(const SweepFindings& findings) {
  const SweepTable& table = findings.table;
  std::string text = "<h2>All points</h2>\n<p class=\"links\">" + csv_link("study", sweep_csv(table)) + "</p>\n";
  text += "<div class=\"scroll\"><table>\n<tr>";
  for (const std::string& column : table.columns) text += "<th>" + html_escaped(column) + "</th>";
  text += "</tr>\n";
  for (std::size_t row = 0; row < std::min(table.rows.size(), most_rows); ++row) {
    text += "<tr>";
    for (const Json& value : table.rows[row]) text += "<td>" + cell(value) + "</td>";
    text += "</tr>\n";
  }
  text += "</table></div>\n";
  if (table.rows.size() > most_rows)
    text += fmt::format("<p class=\"subtle\">and {} more in the CSV.</p>\n", table.rows.size() - most_rows);
  return text;
}

}  // namespace

std::string sweep_page(const SweepFindings& findings) {
  const Study& study = findings.result.study;
  const std::string title = std::filesystem::path(findings.result.provenance.config).filename().string();
  std::string text = page_head("vrpipe sweep: " + title, facts_style) + "<h1>" + html_escaped(title) + "</h1>\n";
  text +=
      "<p class=\"verdict\">" + html_escaped(points_line(study)) + "</p>\n" + facts(findings.result, findings.scene);
  text += "<h2>What varies</h2>\n<ul>\n";
  for (const StudyAxis& axis : study.axes) {
    std::string values;
    for (const std::string& value : axis.values) values += (values.empty() ? "" : ", ") + value;
    text += "<li><b>" + html_escaped(axis.name) + "</b>: " + html_escaped(values) + "</li>\n";
  }
  text += "</ul>\n";
  if (const std::string reference = reference_text(study); !reference.empty() && has_speedups(findings.table))
    text += "<p class=\"subtle\">Speed-ups are over the point with " + html_escaped(reference) +
            ", of the same scene, view and fidelity.</p>\n";
  text += grouped_section(findings) + effects_section(findings) + pareto_section(findings) + points_section(findings);
  return text + fmt::format("<p class=\"subtle\">vrpipe {}</p>\n</body>\n</html>\n", VRPIPE_VERSION);
}

}  // namespace vrpipe::tools
