#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "jobs/sweep_job.h"

namespace vrpipe::tools {

/// All results of a study as one table: a row for each point that is done, in the order of the study.
struct SweepTable {
  std::vector<std::string> columns;                       ///< point, the axes, then what came of it
  std::vector<std::vector<nlohmann::ordered_json>> rows;  ///< numbers, texts, null for what there is not
  std::vector<std::size_t> points;                        ///< of each row

  std::size_t column(const std::string& name) const;  ///< columns.size() if there is none
  std::optional<double> number(std::size_t row, std::size_t column) const;
};
/// Of every study with these axes.
std::vector<std::string> sweep_columns(const Study& study);
SweepTable sweep_table(const SweepResult& result);

/// How much an axis moves time, over all points.
struct AxisEffect {
  std::size_t axis = 0;
  struct OfValue {
    std::string value;
    std::size_t points = 0;
    double mean = 0, least = 0, most = 0;  ///< geometric mean and extremes
  };
  std::vector<OfValue> values;  ///< in the order of the axis; those without a point that has time left out
  double ratio = 1;             ///< of the largest mean over the smallest
};
/// Of speed-ups where every point has one, otherwise of milliseconds. The axis that matters most first; empty without time.
struct AxisEffects {
  bool of_speedups = false;
  std::vector<AxisEffect> effects;
};
AxisEffects axis_effects(const SweepResult& result, const SweepTable& table);

/// An axis that changes nothing: points that differ in it alone, of which there are some, come to the same.
struct IdleAxis {
  std::size_t axis = 0;
  bool on_time_alone = false;  ///< these take the same time, but their results differ
};
std::vector<IdleAxis> idle_axes(const SweepResult& result);

/// What all points have drawn; none where they differ.
struct CommonScene {
  std::optional<std::string> name;
  std::optional<std::uint64_t> gaussians_total, gaussians_visible;
  std::optional<std::pair<std::uint32_t, std::uint32_t>> size;  ///< width and height, pixels
};
CommonScene common_scene(const SweepResult& result);

/// What is drawn, by what draws it, as papers show it: means of speed-ups, or of milliseconds where there are none, over all
/// other axes.
struct GroupedMeans {
  std::size_t groups_axis = 0;                               ///< scene, or another of what is drawn
  std::size_t series_axis = 0;                               ///< variant, or another of what the GPU is
  std::vector<std::vector<std::optional<double>>> of_group;  ///< by value of groups_axis, then of series_axis
  std::vector<std::optional<double>> geometric_mean;         ///< over the groups, where all have the value
};
/// None where there are not two values on one such axis and two or more on the other.
std::optional<GroupedMeans> grouped_means(const SweepResult& result, const SweepTable& table, bool of_speedups);

/// A GPU of the study, over all that it draws.
struct ParetoRow {
  std::vector<std::string> values;  ///< by axis of ParetoTable
  std::vector<double> metrics;      ///< by column: geometric mean over what is drawn, arithmetic where one is 0
  bool on_front = false;            ///< no other is better in one and no worse in all
};
struct ParetoTable {
  std::vector<std::string> axes;     ///< of what the GPU is
  std::vector<std::string> columns;  ///< as Study::pareto
  std::vector<ParetoRow> rows;       ///< those on the front first, then by the first column
};
/// Throws UserError for a column that there is not.
void check_pareto(const Study& study);
/// Of GPUs that have all points; none where a column has no numbers, as without time.
std::optional<ParetoTable> pareto_table(const SweepResult& result, const SweepTable& table);

}  // namespace vrpipe::tools
