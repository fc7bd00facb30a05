#include "output/sweep_report.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/component/printable.h>

#include "jobs/comparison.h"
#include "output/json_text.h"
#include "output/machines_text.h"
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

/// Of what came of a point; the values of axes are as the study writes them.
std::string outcome_text(const Json& value) {
  return value.is_number_unsigned() ? grouped(value.get<std::uint64_t>()) : cell_text(value);
}

const char* idle_words(const IdleAxis& idle) { return idle.on_time_alone ? "no effect on time" : "no effect"; }

const IdleAxis* idle_of(const SweepFindings& findings, std::size_t axis) {
  const auto found =
      std::find_if(findings.idle.begin(), findings.idle.end(), [&](const IdleAxis& each) { return each.axis == axis; });
  return found == findings.idle.end() ? nullptr : &*found;
}

/// Without time nothing says more of them.
std::string idle_text(const SweepFindings& findings) {
  std::string text;
  if (!findings.effects.effects.empty()) return text;
  for (const IdleAxis& idle : findings.idle)
    text += fmt::format("{}: {}\n", printable(findings.result.study.axes[idle.axis].name), idle_words(idle));
  return text;
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
    table.group(printable(findings.result.study.axes[effect.axis].name) + ": " + effect_words(findings, effect));
    // All values come to the same.
    if (idle_of(findings, effect.axis) != nullptr) continue;
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
  // Without time the counts are the answer.
  if (findings.effects.effects.empty()) columns.push_back(table.column("counts.fragments_blended"));
  std::vector<std::string> heading;
  for (const std::size_t column : columns) heading.push_back(printable(table.columns[column]));
  TextTable text(std::move(heading));
  const std::size_t outcomes = findings.result.study.axes.size() + 1;
  for (std::size_t row = 0; row < std::min(table.rows.size(), most_points_shown); ++row) {
    std::vector<std::string> cells;
    for (const std::size_t column : columns) {
      const Json& value = table.rows[row][column];
      cells.push_back(column < outcomes ? cell_text(value) : outcome_text(value));
    }
    text.row(std::move(cells));
  }
  std::string all = text.text(style);
  if (table.rows.size() > most_points_shown)
    all += fmt::format("and {} more points: --csv, --jsonl or --html\n", table.rows.size() - most_points_shown);
  return all + "\n";
}

/// What all points have in common; null where an axis says it.
Json common_json(const SweepFindings& findings) {
  const SweepResult& result = findings.result;
  const Study& study = result.study;
  const RunRequest& request = result.machines.front().request;
  const auto unless_axis = [&](const char* axis, Json value) { return study.axis(axis) ? Json() : std::move(value); };
  const auto or_null = [](const auto& value) { return value ? Json(*value) : Json(); };
  Json options = Json::object();
  for (const auto& [name, texts] : result.options) options[name] = texts;
  Json platform;
  if (!study.axis("platform")) {
    platform = platform_json(result.machines, result.preprocessing, result.provenance);
    for (const char* of_parameters : {"parameters", "origins"}) {
      for (const StudyAxis& axis : study.axes) platform[of_parameters].erase(axis.name);
    }
  }
  const CommonScene& scene = findings.scene;
  return {{"options", std::move(options)},
          {"scene",
           {{"name", or_null(scene.name)},
            {"gaussians_total", or_null(scene.gaussians_total)},
            {"gaussians_visible", or_null(scene.gaussians_visible)},
            {"width", scene.size ? Json(scene.size->first) : Json()},
            {"height", scene.size ? Json(scene.size->second) : Json()}}},
          {"platform", std::move(platform)},
          {"variant", unless_axis("variant", request.variant.name)},
          {"fidelity", unless_axis("fidelity", finest_fidelity_text(result.machines))},
          {"format", unless_axis("format", vrpipe::name_of(request.format))},
          {"termination", unless_axis("termination", name_of(request.termination))},
          {"passes", unless_axis("multi-pass", result.passes)}};
}

}  // namespace

SweepFindings sweep_findings(const SweepResult& result) {
  SweepTable table = sweep_table(result);
  AxisEffects effects = axis_effects(result, table);
  std::optional<GroupedMeans> means = grouped_means(result, table, effects.of_speedups);
  std::optional<ParetoTable> pareto = pareto_table(result, table);
  return {result,           std::move(table), std::move(effects), idle_axes(result), common_scene(result),
          std::move(means), std::move(pareto)};
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

std::string points_line(const Study& study) {
  const std::uint64_t points = study.points.size();
  std::string text = fmt::format("{} point{}", grouped(points), points == 1 ? "" : "s");
  if (study.seed) return text + fmt::format(", a sample of {} (seed {})", grouped(study.product), *study.seed);
  if (study.product <= points) return text;
  const std::uint64_t same = study.product - points;
  return text + fmt::format(": {} combinations, of which {} (parameters that units do not have)",
                            grouped(study.product),
                            same == 1 ? "1 is the same as another" : grouped(same) + " are the same as others");
}

std::string study_machines_text(const SweepResult& result, const TextStyle& style) {
  std::vector<std::string> axes;
  for (const StudyAxis& axis : result.study.axes) axes.push_back(axis.name);
  return machines_text(result.machines, result.preprocessing, result.passes, style, axes);
}

std::string scene_line(const CommonScene& scene) {
  std::string text = scene.name.value_or("");
  if (scene.size) text += fmt::format("{}{}x{}", text.empty() ? "" : ", ", scene.size->first, scene.size->second);
  if (scene.gaussians_visible && scene.gaussians_total)
    return text + fmt::format(": {} of {} Gaussians visible", grouped(*scene.gaussians_visible),
                              grouped(*scene.gaussians_total));
  return scene.gaussians_total ? text + fmt::format(": {} Gaussians", grouped(*scene.gaussians_total)) : text;
}

std::string effect_words(const SweepFindings& findings, const AxisEffect& effect) {
  const IdleAxis* const idle = idle_of(findings, effect.axis);
  return idle != nullptr ? idle_words(*idle) : fmt::format("{:.2f}x", effect.ratio);
}

bool has_speedups(const SweepTable& table) {
  const std::size_t column = table.column("speedup");
  return std::any_of(table.rows.begin(), table.rows.end(), [&](const auto& row) { return !row[column].is_null(); });
}

std::string sweep_text(const SweepFindings& findings, const TextStyle& style) {
  const SweepResult& result = findings.result;
  const Study& study = result.study;
  std::string text;
  if (const std::string scene = scene_line(findings.scene); !scene.empty()) text += style.bold(printable(scene)) + "\n";
  text += study_machines_text(result, style) + "\n";
  text += style.bold(points_line(study));
  for (const StudyAxis& axis : study.axes) text += fmt::format("\n  {}: {}", printable(axis.name), axis.values.size());
  text += "\n\n" + points_text(findings, style) + effects_text(findings, style) + idle_text(findings) +
          pareto_text(findings, style);
  if (const std::string reference = reference_text(study); !reference.empty() && has_speedups(findings.table))
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
  Json axes = Json::array(), points = Json::array(), effects = Json::array(), idle = Json::array(),
       pareto = Json::array();
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
  for (const IdleAxis& each : findings.idle)
    idle.push_back({{"axis", study.axes[each.axis].name}, {"on", each.on_time_alone ? "time" : "results"}});
  // Nothing of the host or of how the points were run: an interrupted study ends with the same bytes.
  Json json = head_json("vrpipe.sweep/1", findings.result.provenance, 1);
  json.erase("host");
  json.update(common_json(findings));
  json.update(
      {{"axes", std::move(axes)},
       {"product", study.product},
       {"seed", study.seed ? Json(*study.seed) : Json()},
       {"relative_to", reference_text(study)},
       {"points", std::move(points)},
       {"effects_of",
        findings.effects.effects.empty() ? Json() : Json(findings.effects.of_speedups ? "speedup" : "milliseconds")},
       {"effects", std::move(effects)},
       {"without_effect", std::move(idle)},
       {"pareto", std::move(pareto)}});
  return json;
}

}  // namespace vrpipe::tools
