#include "jobs/sweep_analysis.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <map>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>

#include "jobs/comparison.h"
#include "jobs/optional_json.h"

namespace vrpipe::tools {
namespace {

nlohmann::ordered_json typed(const StudyAxis& axis, std::size_t place) {
  if (place == no_value) return {};
  const std::string& text = axis.values[place];
  if (!axis.numeric) return text;
  const char* const end = text.data() + text.size();
  std::int64_t whole = 0;
  if (const auto read = std::from_chars(text.data(), end, whole); read.ec == std::errc() && read.ptr == end)
    return whole;
  double number = 0;
  if (const auto read = std::from_chars(text.data(), end, number); read.ec == std::errc() && read.ptr == end)
    return number;
  return text;
}

constexpr std::array<const char*, 7> utilized{"raster", "zrop", "prop", "sm", "crop", "l2", "dram"};

/// Geometric, or arithmetic where a value is not above 0.
double mean_of_values(const std::vector<double>& values) {
  const bool all_above = std::all_of(values.begin(), values.end(), [](double value) { return value > 0; });
  double sum = 0;
  for (const double value : values) sum += all_above ? std::log(value) : value;
  sum /= static_cast<double>(values.size());
  return all_above ? std::exp(sum) : sum;
}

bool is_better(const std::string& column, double a, double b) { return column[0] == '-' ? a > b : a < b; }
std::string is_plain(const std::string& column) { return column[0] == '-' ? column.substr(1) : column; }

}  // namespace

std::size_t SweepTable::column(const std::string& name) const {
  return static_cast<std::size_t>(std::find(columns.begin(), columns.end(), name) - columns.begin());
}

std::optional<double> SweepTable::number(std::size_t row, std::size_t column) const {
  if (column >= columns.size() || !rows[row][column].is_number()) return std::nullopt;
  return rows[row][column].get<double>();
}

std::vector<std::string> sweep_columns(const Study& study) {
  std::vector<std::string> columns{"point"};
  for (const StudyAxis& axis : study.axes) columns.push_back(axis.name);
  for (const char* name : {"cycles", "milliseconds", "speedup", "energy_mj", "energy_mj_low", "energy_mj_high",
                           "quad_merging_storage_bytes"}) {
    columns.emplace_back(name);
  }
  for (const auto& [name, value] : Counts().named()) columns.push_back("counts." + name);
  for (const char* unit : utilized) columns.push_back(std::string("utilization.") + unit);
  for (const char* name : {"bottleneck", "bottleneck_occupancy", "result_hash"}) columns.emplace_back(name);
  columns.insert(columns.end(), study.columns.begin(), study.columns.end());
  columns.emplace_back("fault");
  return columns;
}

void check_pareto(const Study& study) {
  const std::vector<std::string> columns = sweep_columns(study);
  for (const std::string& name : study.pareto) {
    if (std::find(columns.begin(), columns.end(), is_plain(name)) == columns.end())
      throw UserError("unknown column '" + is_plain(name) + "'", "pareto", "results have no such column",
                      suggestion(is_plain(name), columns));
  }
}

SweepTable sweep_table(const SweepResult& result) {
  SweepTable table;
  table.columns = sweep_columns(result.study);
  const std::vector<std::optional<std::size_t>> relative_to = references(result.study);
  for (std::size_t i = 0; i < result.points.size(); ++i) {
    if (!result.points[i]) continue;
    const PointOutcome& point = *result.points[i];
    const RunResult& run = point.run;
    std::vector<nlohmann::ordered_json> row{i};
    for (std::size_t axis = 0; axis < result.study.axes.size(); ++axis) {
      const StudyAxis& of = result.study.axes[axis];
      row.push_back(typed(of, result.study.points[i].values[axis]));
    }
    if (!point.fault.empty()) {
      row.resize(table.columns.size() - 1);
      row.emplace_back(point.fault);
      table.rows.push_back(std::move(row));
      table.points.push_back(i);
      continue;
    }
    const bool timed = run.cycles.has_value();
    row.push_back(timed ? nlohmann::ordered_json(*run.cycles) : nlohmann::ordered_json());
    row.push_back(timed ? nlohmann::ordered_json(run.milliseconds) : nlohmann::ordered_json());
    const bool has_reference = relative_to[i] && result.points[*relative_to[i]];
    row.push_back(has_reference ? optional_json(speedup(result.points[*relative_to[i]]->run, run))
                                : nlohmann::ordered_json());
    row.push_back(point.energy ? nlohmann::ordered_json(point.energy->nominal) : nlohmann::ordered_json());
    row.push_back(point.energy ? nlohmann::ordered_json(point.energy->low) : nlohmann::ordered_json());
    row.push_back(point.energy ? nlohmann::ordered_json(point.energy->high) : nlohmann::ordered_json());
    row.push_back(point.storage_bytes);
    for (const auto& [name, value] : run.counts.named()) row.push_back(value);
    for (const char* unit : utilized) {
      const auto found = std::find_if(run.utilization.begin(), run.utilization.end(),
                                      [&](const auto& each) { return each.first == unit; });
      row.push_back(found == run.utilization.end() ? nlohmann::ordered_json() : nlohmann::ordered_json(found->second));
    }
    row.push_back(run.bottleneck ? nlohmann::ordered_json(run.bottleneck->unit) : nlohmann::ordered_json());
    row.push_back(run.bottleneck ? nlohmann::ordered_json(run.bottleneck->occupancy) : nlohmann::ordered_json());
    row.push_back(run.result_hash);
    for (const std::optional<double>& column : point.columns) row.push_back(column_json(column));
    row.emplace_back();
    table.rows.push_back(std::move(row));
    table.points.push_back(i);
  }
  return table;
}

AxisEffects axis_effects(const SweepResult& result, const SweepTable& table) {
  AxisEffects all;
  const std::size_t speedups = table.column("speedup"), milliseconds = table.column("milliseconds");
  all.of_speedups = !table.rows.empty();
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    if (!result.points[table.points[row]]->fault.empty()) continue;
    const auto gain = table.number(row, speedups);
    all.of_speedups = all.of_speedups && gain && *gain > 0;
  }
  const std::size_t column = all.of_speedups ? speedups : milliseconds;
  for (std::size_t axis = 0; axis < result.study.axes.size(); ++axis) {
    const StudyAxis& of = result.study.axes[axis];
    if (of.values.size() < 2) continue;
    AxisEffect effect;
    effect.axis = axis;
    double smallest = std::numeric_limits<double>::infinity(), largest = 0;
    for (std::size_t value = 0; value < of.values.size(); ++value) {
      std::vector<double> of_value;
      for (std::size_t row = 0; row < table.rows.size(); ++row) {
        const auto number = table.number(row, column);
        if (result.study.points[table.points[row]].values[axis] == value && number && *number > 0)
          of_value.push_back(*number);
      }
      if (of_value.empty()) continue;
      const auto [least, most] = std::minmax_element(of_value.begin(), of_value.end());
      effect.values.push_back({of.values[value], of_value.size(), mean_of_values(of_value), *least, *most});
      smallest = std::min(smallest, effect.values.back().mean);
      largest = std::max(largest, effect.values.back().mean);
    }
    if (effect.values.empty()) continue;
    effect.ratio = largest / smallest;
    all.effects.push_back(std::move(effect));
  }
  std::stable_sort(all.effects.begin(), all.effects.end(),
                   [](const AxisEffect& a, const AxisEffect& b) { return a.ratio > b.ratio; });
  return all;
}

std::vector<IdleAxis> idle_axes(const SweepResult& result) {
  std::vector<IdleAxis> idle;
  for (std::size_t axis = 0; axis < result.study.axes.size(); ++axis) {
    std::map<std::vector<std::size_t>, const RunResult*> first_of;  // by the values on all other axes
    std::size_t pairs = 0;
    bool same_time = true, same_results = true;
    for (std::size_t i = 0; i < result.points.size(); ++i) {
      std::vector<std::size_t> others = result.study.points[i].values;
      if (!result.points[i] || others[axis] == no_value) continue;
      others[axis] = no_value;
      const RunResult& run = result.points[i]->run;
      const auto [first, is_new] = first_of.emplace(std::move(others), &run);
      // What ends in a fault is like nothing else.
      same_time = same_time && result.points[i]->fault.empty();
      if (is_new) continue;
      ++pairs;
      same_time = same_time && run.cycles == first->second->cycles && run.milliseconds == first->second->milliseconds;
      same_results = same_results && run.result_hash == first->second->result_hash;
    }
    const bool is_timed = std::any_of(result.points.begin(), result.points.end(),
                                      [](const auto& point) { return point && point->run.cycles; });
    if (pairs > 0 && same_time && (same_results || is_timed)) idle.push_back({axis, !same_results});
  }
  return idle;
}

CommonScene common_scene(const SweepResult& result) {
  std::vector<const DrawnScene*> drawn;
  for (const auto& point : result.points) {
    if (point && point->fault.empty()) drawn.push_back(&point->drawn);
  }
  const auto common = [&](const auto& value_of) {
    using Value = std::decay_t<decltype(value_of(*drawn.front()))>;
    const bool all = !drawn.empty() && std::all_of(drawn.begin(), drawn.end(), [&](const DrawnScene* each) {
      return value_of(*each) == value_of(*drawn.front());
    });
    return all ? std::optional<Value>(value_of(*drawn.front())) : std::nullopt;
  };
  CommonScene scene;
  scene.name = common([](const DrawnScene& each) { return each.name; });
  // Numbers of several scenes say nothing of any.
  if (scene.name) {
    scene.gaussians_total = common([](const DrawnScene& each) { return each.gaussians_total; });
    scene.gaussians_visible = common([](const DrawnScene& each) { return each.gaussians_visible; });
  }
  scene.size = common([](const DrawnScene& each) { return std::pair{each.width, each.height}; });
  return scene;
}

std::optional<GroupedMeans> grouped_means(const SweepResult& result, const SweepTable& table, bool of_speedups) {
  const Study& study = result.study;
  const auto first_of = [&](std::initializer_list<const char*> names, bool drawn) -> std::optional<std::size_t> {
    for (const char* name : names) {
      const auto axis = study.axis(name);
      if (axis && study.axes[*axis].values.size() > 1) return axis;
    }
    for (std::size_t i = 0; i < study.axes.size(); ++i) {
      if (follows_the_point(study.axes[i].name) == drawn && study.axes[i].values.size() > 1) return i;
    }
    return std::nullopt;
  };
  const auto groups = first_of({"scene", "view", "size"}, true);
  const auto series = first_of({"variant", "platform"}, false);
  if (!groups || !series) return std::nullopt;
  GroupedMeans means{*groups, *series, {}, {}};
  const std::size_t column = table.column(of_speedups ? "speedup" : "milliseconds");
  const auto mean_of = [&](std::size_t group, std::size_t each) -> std::optional<double> {
    std::vector<double> values;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const std::vector<std::size_t>& at = study.points[table.points[row]].values;
      const auto number = table.number(row, column);
      if (at[*groups] == group && at[*series] == each && number && *number > 0) values.push_back(*number);
    }
    return values.empty() ? std::nullopt : std::optional(mean_of_values(values));
  };
  for (std::size_t group = 0; group < study.axes[*groups].values.size(); ++group) {
    means.of_group.emplace_back();
    for (std::size_t each = 0; each < study.axes[*series].values.size(); ++each)
      means.of_group.back().push_back(mean_of(group, each));
  }
  for (std::size_t each = 0; each < study.axes[*series].values.size(); ++each) {
    std::vector<double> values;
    for (const auto& group : means.of_group) {
      if (group[each]) values.push_back(*group[each]);
    }
    means.geometric_mean.push_back(values.size() == means.of_group.size() ? std::optional(mean_of_values(values))
                                                                          : std::nullopt);
  }
  return means;
}

std::optional<ParetoTable> pareto_table(const SweepResult& result, const SweepTable& table) {
  ParetoTable pareto;
  pareto.columns = result.study.pareto;
  std::vector<std::size_t> columns;
  if (pareto.columns.empty()) pareto.columns = {"milliseconds", "energy_mj"};
  for (const std::string& name : pareto.columns) {
    columns.push_back(table.column(is_plain(name)));
  }
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < result.study.axes.size(); ++axis) {
    if (follows_the_point(result.study.axes[axis].name)) continue;
    axes.push_back(axis);
    pareto.axes.push_back(result.study.axes[axis].name);
  }
  if (axes.empty()) return std::nullopt;
  std::map<std::vector<std::size_t>, std::vector<std::size_t>> rows_of;  // by values of these axes
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    std::vector<std::size_t> key;
    for (const std::size_t axis : axes) key.push_back(result.study.points[table.points[row]].values[axis]);
    rows_of[key].push_back(row);
  }
  std::size_t most = 0;
  for (const auto& [key, rows] : rows_of) most = std::max(most, rows.size());
  for (const auto& [key, rows] : rows_of) {
    ParetoRow row_of_gpu;
    for (std::size_t i = 0; i < axes.size(); ++i)
      row_of_gpu.values.push_back(text_of(result.study.axes[axes[i]], key[i]));
    for (const std::size_t column : columns) {
      std::vector<double> values;
      for (const std::size_t row : rows) {
        if (const auto number = table.number(row, column)) values.push_back(*number);
      }
      if (values.size() == most) row_of_gpu.metrics.push_back(mean_of_values(values));
    }
    if (row_of_gpu.metrics.size() == columns.size()) pareto.rows.push_back(std::move(row_of_gpu));
  }
  if (pareto.rows.empty()) return std::nullopt;
  const auto dominates = [&](const ParetoRow& a, const ParetoRow& b) {
    bool better = false;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (is_better(pareto.columns[i], b.metrics[i], a.metrics[i])) return false;
      better = better || is_better(pareto.columns[i], a.metrics[i], b.metrics[i]);
    }
    return better;
  };
  for (ParetoRow& each : pareto.rows) {
    each.on_front = std::none_of(pareto.rows.begin(), pareto.rows.end(),
                                 [&](const ParetoRow& other) { return dominates(other, each); });
  }
  std::stable_sort(pareto.rows.begin(), pareto.rows.end(), [&](const ParetoRow& a, const ParetoRow& b) {
    if (a.on_front != b.on_front) return a.on_front;
    return is_better(pareto.columns[0], a.metrics[0], b.metrics[0]);
  });
  return pareto;
}

}  // namespace vrpipe::tools
