#include "output/text_plot.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace vrpipe::tools {

namespace {

struct AxisRange {
  double from = INFINITY;
  double to = -INFINITY;
  void add(double value) {
    from = std::min(from, value);
    to = std::max(to, value);
  }
  /// The cell of a value, of so many.
  unsigned cell(double value, unsigned cells) const {
    const double share = to > from ? (value - from) / (to - from) : 0;
    return std::min(cells - 1, static_cast<unsigned>(std::lround(share * (cells - 1))));
  }
};

}  // namespace

std::string text_plot(const std::vector<TextSeries>& series, unsigned width, unsigned height) {
  AxisRange x;
  AxisRange y;
  y.add(0);
  for (const TextSeries& each : series) {
    for (const auto& [px, py] : each.points) {
      if (!std::isfinite(px) || !std::isfinite(py)) continue;
      x.add(px);
      y.add(py);
    }
  }
  if (!(x.from <= x.to)) return {};
  std::vector<std::string> lines(height, std::string(width, ' '));
  for (auto each = series.rbegin(); each != series.rend(); ++each) {
    for (const auto& [px, py] : each->points) {
      if (!std::isfinite(px) || !std::isfinite(py)) continue;
      lines[height - 1 - y.cell(py, height)][x.cell(px, width)] = each->mark;
    }
  }
  const std::string top = fmt::format("{:.4g}", y.to);
  const std::string bottom = fmt::format("{:.4g}", y.from);
  const std::size_t margin = std::max(top.size(), bottom.size());
  std::string text;
  for (unsigned i = 0; i < height; ++i) {
    const std::string& label = i == 0 ? top : i + 1 == height ? bottom : std::string();
    lines[i].erase(lines[i].find_last_not_of(' ') + 1);
    text += fmt::format("{:>{}} |{}\n", label, margin, lines[i]);
  }
  const std::string right = fmt::format("{:.4g}", x.to);
  const std::string left = fmt::format("{:.4g}", x.from);
  text += fmt::format("{:{}} +{:->{}}\n", "", margin, "", width);
  text += fmt::format("{:{}}  {:<{}}{}\n", "", margin, left, width - std::min<std::size_t>(width, right.size()), right);
  return text;
}

}  // namespace vrpipe::tools
