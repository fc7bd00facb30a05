#pragma once

#include <string>
#include <utility>
#include <vector>

namespace vrpipe::tools {

enum class Marker { circle, square, diamond, triangle, star };

struct PlotAxis {
  std::string title;
  bool logarithmic = false;  ///< values of 0 lie on a tick of their own, apart
};

struct PlotPoint {
  double x, y;
  std::string color;  ///< as CSS writes it
  Marker marker = Marker::circle;
  bool hollow = false;
  std::string label;    ///< beside the point where there is room; may be empty
  std::string tooltip;  ///< may be empty
};

struct PlotLine {
  std::vector<std::pair<double, double>> points;
  std::string color;
  bool dashed = false;
};

struct LegendEntry {
  std::string text;
  std::string color;
  Marker marker = Marker::circle;
  bool hollow = false;
  bool is_line = false;  ///< dashed, in place of the marker
};

/// Points in a plane, drawn as SVG.
struct Plot {
  std::string description;  ///< for those who cannot see it
  PlotAxis x, y;
  std::vector<PlotPoint> points;
  std::vector<PlotLine> lines;
  std::vector<LegendEntry> legend;
};

/// An <svg> element. Labels never overlap one another or a point, nor a line where there is other room: one for which
/// there is no room is left out, and so is that of a point which lies under an earlier one.
std::string svg(const Plot& plot);

/// The least of 1, 2 and 5 times a power of ten that is no less than this: from one tick of an axis to the next.
double nice_step(double rough);

/// Text for HTML and SVG, also inside double quotes.
std::string html_escaped(const std::string& text);

}  // namespace vrpipe::tools
