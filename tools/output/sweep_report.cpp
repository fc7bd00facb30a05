#include "output/sweep_report.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>

#include "output/json_text.h"
#include "output/page_parts.h"
#include "output/report.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

constexpr std::size_t most_points_shown = 40;
constexpr std::size_t most_rows_shown = 12;

std::string cell_text(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return printable(value.get<std::string>());
  if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
  return value.dump();
}

std::string csv_cell(const Json& value) {
  if (value.is_null()) return {};
  return value.is_string() ? csv_text(value.get<std::string>()) : value.dump();
}

std::string effects_text(const SweepFindings& findings, const TextStyle& style) {
  if (findings.effects.effects.empty()) return {};
  const char* const what = findings.effects.of_speedups ? "speed-up" : "milliseconds";
  TextTable table({"what matters, by " + std::string(what), "points", "mean", "least", "most"});
  for (const AxisEffect& effect : findings.effects.effects) {
    table.group(fmt::format("{}: {:.2f}x", printable(findings.result.study.axes[effect.axis].name), effect.ratio));
    for (const AxisEffect::OfValue& value : effect.values) {
      table.row({printable(value.value), std::to_string(value.points), fmt::format("{:.3g}", value.mean),
                 fmt::format("{:.3g}", value.least), fmt::format("{:.3g}", value.most)});
    }
  }
  return table.text(style) + "\n";
}

std::string pareto_text(const SweepFindings& findings, const TextStyle& style) {
  if (!findings.pareto) return {};
  const ParetoTable& pareto = *findings.pareto;
  std::vector<std::string> heading{pareto.axes.front()};
  heading.insert(heading.end(), pareto.axes.begin() + 1, pareto.axes.end());
  for (const std::string& column : pareto.columns)
    heading.push_back(column[0] == '-' ? column.substr(1) + " (more is better)" : column);
  TextTable table(std::move(heading));
  bool front = true;
  table.group("on the Pareto front");
  std::size_t shown = 0;
  for (const ParetoRow& each : pareto.rows) {
    if (front && !each.on_front) table.group("not on it");
    front = each.on_front;
    if (!front && ++shown > most_rows_shown) break;
    std::vector<std::string> cells;
    for (const std::string& value : each.values) cells.push_back(value.empty() ? "-" : printable(value));
    for (const double metric : each.metrics) cells.push_back(fmt::format("{:.4g}", metric));
    table.row(std::move(cells));
  }
  return table.text(style) + "\n";
}

std::string points_text(const SweepFindings& findings, const TextStyle& style) {
  const SweepTable& table = findings.table;
  std::vector<std::size_t> columns;
  for (std::size_t i = 0; i <= findings.result.study.axes.size(); ++i) columns.push_back(i);
  for (const char* name : {"cycles", "milliseconds", "speedup", "energy_mj", "bottleneck", "fault"}) {
    const std::size_t column = table.column(name);
    const bool any =
        std::any_of(table.rows.begin(), table.rows.end(), [&](const auto& row) { return !row[column].is_null(); });
    if (any) columns.push_back(column);
  }
  std::vector<std::string> heading;
  for (const std::size_t column : columns) heading.push_back(printable(table.columns[column]));
  TextTable text(std::move(heading));
  for (std::size_t row = 0; row < std::min(table.rows.size(), most_points_shown); ++row) {
    std::vector<std::string> cells;
    for (const std::size_t column : columns) cells.push_back(cell_text(table.rows[row][column]));
    text.row(std::move(cells));
  }
  std::string all = text.text(style);
  if (table.rows.size() > most_points_shown)
    all += fmt::format("and {} more points: --csv, --jsonl or --html\n", table.rows.size() - most_points_shown);
  return all + "\n";
}

}  // namespace

SweepFindings sweep_findings(const SweepResult& result) {
  SweepTable table = sweep_table(result);
  AxisEffects effects = axis_effects(result, table);
  std::optional<GroupedMeans> grouped = grouped_means(result, table, effects.of_speedups);
  std::optional<ParetoTable> pareto = pareto_table(result, table);
  return {result, std::move(table), std::move(effects), std::move(grouped), std::move(pareto)};
}

std::string reference_text(const Study& study) {
  const std::vector<std::size_t> values =
      reference_values(study, std::vector<std::size_t>(study.axes.size(), no_value));
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] != no_value)
      text += fmt::format("{}{}={}", text.empty() ? "" : ", ", study.axes[i].name, study.axes[i].values[values[i]]);
  }
  return text;
}

std::string sweep_text(const SweepFindings& findings, const TextStyle& style) {
  const Study& study = findings.result.study;
  std::string text = style.bold(fmt::format("{} point{}", study.points.size(), study.points.size() == 1 ? "" : "s"));
  if (study.seed) text += fmt::format(", a sample of {} (seed {})", grouped(study.product), *study.seed);
  for (const StudyAxis& axis : study.axes) text += fmt::format("\n  {}: {}", printable(axis.name), axis.values.size());
  text += "\n\n" + points_text(findings, style) + effects_text(findings, style) + pareto_text(findings, style);
  if (const std::string reference = reference_text(study); !reference.empty())
    text += "speed-ups are over the point with " + printable(reference) + ", of the same scene, view and fidelity\n";
  return text;
}

std::string sweep_csv(const SweepTable& table) {
  std::string text;
  for (std::size_t i = 0; i < table.columns.size(); ++i)
    text += (i > 0 ? "," : "") + csv_cell(valid_utf8(table.columns[i]));
  text += "\r\n";
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i > 0) text += ",";
      text += csv_cell(row[i].is_string() ? Json(valid_utf8(row[i].get<std::string>())) : row[i]);
    }
    text += "\r\n";
  }
  return text;
}

std::string sweep_jsonl(const SweepTable& table) {
  std::string text;
  for (const auto& row : table.rows) {
    Json line = Json::object();
    for (std::size_t i = 0; i < row.size(); ++i) {
      line[valid_utf8(table.columns[i])] = row[i].is_string() ? Json(valid_utf8(row[i].get<std::string>())) : row[i];
    }
    text += line.dump() + "\n";
  }
  return text;
}

Json sweep_json(const SweepFindings& findings) {
  const Study& study = findings.result.study;
  Json axes = Json::array(), points = Json::array(), effects = Json::array(), pareto = Json::array();
  for (const StudyAxis& axis : study.axes) axes.push_back({{"name", axis.name}, {"values", axis.values}});
  for (const auto& row : findings.table.rows) {
    Json point = Json::object();
    for (std::size_t i = 0; i < row.size(); ++i) point[findings.table.columns[i]] = row[i];
    points.push_back(std::move(point));
  }
  for (const AxisEffect& effect : findings.effects.effects) {
    Json values = Json::array();
    for (const AxisEffect::OfValue& value : effect.values) {
      values.push_back({{"value", value.value},
                        {"points", value.points},
                        {"mean", value.mean},
                        {"least", value.least},
                        {"most", value.most}});
    }
    effects.push_back({{"axis", study.axes[effect.axis].name}, {"ratio", effect.ratio}, {"values", std::move(values)}});
  }
  if (findings.pareto) {
    for (const ParetoRow& each : findings.pareto->rows) {
      Json of = Json::object(), metrics = Json::object();
      for (std::size_t i = 0; i < each.values.size(); ++i) of[findings.pareto->axes[i]] = each.values[i];
      for (std::size_t i = 0; i < each.metrics.size(); ++i) metrics[findings.pareto->columns[i]] = each.metrics[i];
      pareto.push_back({{"on_front", each.on_front}, {"axes", std::move(of)}, {"metrics", std::move(metrics)}});
    }
  }
  // Nothing of the host or of how the points were run: an interrupted study ends with the same bytes.
  return {{"schema", "vrpipe.sweep/1"},
          {"version", VRPIPE_VERSION},
          {"axes", std::move(axes)},
          {"product", study.product},
          {"seed", study.seed ? Json(*study.seed) : Json()},
          {"relative_to", reference_text(study)},
          {"points", std::move(points)},
          {"effects_of",
           findings.effects.effects.empty() ? Json() : Json(findings.effects.of_speedups ? "speedup" : "milliseconds")},
          {"effects", std::move(effects)},
          {"pareto", std::move(pareto)}};
}

}  // namespace vrpipe::tools
