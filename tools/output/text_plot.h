#pragma once

#include <string>
#include <utility>
#include <vector>

namespace vrpipe::tools {

/// Points that a mark stands for.
struct TextSeries {
  char mark;
  std::vector<std::pair<double, double>> points;
};

/// Points in a plane drawn in characters, a line each of `height` + 2; those of a series that comes first hide others. Empty
/// without points that are finite.
std::string text_plot(const std::vector<TextSeries>& series, unsigned width, unsigned height);

}  // namespace vrpipe::tools
