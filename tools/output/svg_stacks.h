#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace vrpipe::tools {

/// A bar of segments, one for each kind.
struct StackedBar {
  std::string label;
  std::vector<double> values;  ///< what is not a finite number above 0 is left out
  std::string note = {};       ///< behind the bar
};

/// Bars that belong together, under one another.
struct StackGroup {
  std::string title;
  std::vector<StackedBar> bars;
};

/// Horizontal stacked bars on one scale from 0, drawn as SVG.
struct StackPlot {
  std::string id;                                          ///< unique in the page
  std::string description;                                 ///< for those who cannot see it
  std::string axis;                                        ///< title of the scale
  std::vector<std::pair<std::string, std::size_t>> kinds;  ///< name and place in plot_fills
  std::vector<StackGroup> groups;
  std::optional<double> line = std::nullopt;  ///< across all bars
  std::optional<double> most = std::nullopt;  ///< where the scale ends; none for the longest bar
};

std::string svg(const StackPlot& plot);

/// Kinds beside one another: squares and names, from the left of a drawing. `y` is their middle.
std::string svg_legend(const std::string& id, const std::vector<std::pair<std::string, std::size_t>>& kinds, double x,
                       double y);

}  // namespace vrpipe::tools
