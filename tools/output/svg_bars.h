#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace vrpipe::tools {

struct Bar {
  double from = 0, to = 0;
  std::string color;  ///< as CSS writes it
  std::string tooltip;
};

/// Bars under one another, beside what they are of.
struct BarGroup {
  std::string label;
  std::vector<Bar> bars;
  std::vector<double> marks;  ///< across all of them
};

/// Horizontal bars on one scale, drawn as SVG. What is not a finite number is left out.
struct BarPlot {
  std::string description;  ///< for those who cannot see it
  std::string title;        ///< of the scale
  double least = 0;         ///< where the scale begins
  std::vector<BarGroup> groups;
  std::vector<std::pair<std::string, std::string>> legend;  ///< text and colour
  std::optional<double> line;                               ///< across all groups
};

std::string svg(const BarPlot& plot);

}  // namespace vrpipe::tools
