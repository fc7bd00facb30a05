#include "output/svg_bars.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "output/svg_plot.h"

namespace vrpipe::tools {
namespace {

// Pixels of the drawing; the page scales it.
constexpr double bars_width = 1040;
constexpr double bars_left = 330;
constexpr double bars_right = 1020;
constexpr double bars_top = 34;
constexpr double bars_bar_height = 11;
constexpr double bars_group_gap = 9;

double greatest_of(const BarPlot& plot) {
  double greatest = plot.line.value_or(plot.least);
  for (const BarGroup& group : plot.groups) {
    for (const Bar& bar : group.bars) {
      if (std::isfinite(bar.to)) greatest = std::max(greatest, bar.to);
    }
    for (const double mark : group.marks) {
      if (std::isfinite(mark)) greatest = std::max(greatest, mark);
    }
  }
  return greatest > plot.least ? greatest + 0.02 * (greatest - plot.least) : plot.least + 1;
}

}  // namespace

std::string svg(const BarPlot& plot) {
  const double greatest = greatest_of(plot);
  const auto x = [&](double value) {
    return bars_left + (value - plot.least) / (greatest - plot.least) * (bars_right - bars_left);
  };
  std::string body;
  double y = bars_top;
  for (const BarGroup& group : plot.groups) {
    const double middle = y + bars_bar_height * static_cast<double>(std::max<std::size_t>(1, group.bars.size())) / 2;
    body += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n", bars_left - 8, middle + 4,
                        html_escaped(group.label));
    const double begin = y;
    for (const Bar& bar : group.bars) {
      if (std::isfinite(bar.from) && std::isfinite(bar.to)) {
        body += fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{}\" fill=\"{}\"><title>{}</title></rect>\n",
            x(bar.from), y, std::max(1.0, x(bar.to) - x(bar.from)), bars_bar_height - 1, bar.color,
            html_escaped(bar.tooltip));
      }
      y += bars_bar_height;
    }
    if (group.bars.empty()) y += bars_bar_height;
    for (const double mark : group.marks) {
      if (!std::isfinite(mark)) continue;
      body += fmt::format(
          "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" stroke=\"#1d232a\" stroke-width=\"2\"/>\n",
          x(mark), begin - 1, y);
    }
    y += bars_group_gap;
  }
  std::string text = fmt::format(
      "<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"{}\" xmlns=\"http://www.w3.org/2000/svg\">\n",
      bars_width, y + 44, html_escaped(plot.description));
  double at = bars_left;
  for (const auto& [name, color] : plot.legend) {
    text += fmt::format("<rect x=\"{:.0f}\" y=\"8\" width=\"12\" height=\"12\" fill=\"{}\"/>\n", at, color);
    text += fmt::format("<text x=\"{:.0f}\" y=\"18\">{}</text>\n", at + 17, html_escaped(name));
    at += 40 + 7.4 * static_cast<double>(name.size());
  }
  const double step = nice_step((greatest - plot.least) / 8);
  for (double k = std::ceil(plot.least / step); k * step <= greatest; ++k) {
    text += fmt::format("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2:.1f}\" class=\"grid\"/>\n", x(k * step),
                        bars_top - 6, y);
    text += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.6g}</text>\n", x(k * step), y + 16,
                        k * step);
  }
  text += body;
  if (plot.line && std::isfinite(*plot.line)) {
    text += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2:.1f}\" stroke=\"#d1400f\" stroke-dasharray=\"5 4\"/>\n",
        x(*plot.line), bars_top - 6, y);
  }
  text += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"axis\">{}</text>\n",
                      (bars_left + bars_right) / 2, y + 36, html_escaped(plot.title));
  return text + "</svg>\n";
}

}  // namespace vrpipe::tools
