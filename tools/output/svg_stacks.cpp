#include "output/svg_stacks.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "output/plot_fill.h"
#include "output/svg_plot.h"

namespace vrpipe::tools {
namespace {

// Pixels of the drawing; the page scales it.
constexpr double stacks_width = 1040;
constexpr double stacks_left = 260;
constexpr double stacks_right = 840;  // notes stand behind it
constexpr double stacks_bar_height = 15;
constexpr double stacks_bar_step = 18;
constexpr double stacks_group_gap = 10;

bool is_drawn(double value) { return std::isfinite(value) && value > 0; }

double length_of(const StackedBar& bar) {
  double length = 0;
  for (const double value : bar.values) length += is_drawn(value) ? value : 0;
  return length;
}

double end_of_scale(const StackPlot& plot) {
  if (plot.most) return *plot.most;
  double greatest = plot.line.value_or(0);
  for (const StackGroup& group : plot.groups) {
    for (const StackedBar& bar : group.bars) greatest = std::max(greatest, length_of(bar));
  }
  return greatest > 0 ? greatest : 1;
}

}  // namespace

std::string svg_legend(const std::string& id, const std::vector<std::pair<std::string, std::size_t>>& kinds, double x,
                       double y) {
  std::string text;
  for (const auto& [name, fill] : kinds) {
    text += fmt::format(
        "<rect x=\"{:.0f}\" y=\"{:.0f}\" width=\"14\" height=\"12\" fill=\"{}\" class=\"piece\"/>\n"
        "<text x=\"{:.0f}\" y=\"{:.0f}\">{}</text>\n",
        x, y - 6, fill_text(id, fill), x + 19, y + 4, html_escaped(name));
    x += 42 + 7.2 * static_cast<double>(name.size());
  }
  return text;
}

std::string svg(const StackPlot& plot) {
  const double end = end_of_scale(plot);
  const auto x = [&](double value) { return stacks_left + value / end * (stacks_right - stacks_left); };
  const double top = plot.kinds.size() > 1 ? 34 : 10;  // below a legend
  std::string body;
  double y = top;
  for (const StackGroup& group : plot.groups) {
    if (!group.title.empty()) {
      body += fmt::format("<text x=\"4\" y=\"{:.1f}\" class=\"axis strong\">{}</text>\n", y + 12,
                          html_escaped(group.title));
    }
    for (const StackedBar& bar : group.bars) {
      body += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n", stacks_left - 8, y + 12,
                          html_escaped(bar.label));
      double from = 0;
      for (std::size_t kind = 0; kind < bar.values.size(); ++kind) {
        const double value = bar.values[kind];
        if (!is_drawn(value)) continue;
        body += fmt::format(
            "<rect x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{}\" fill=\"{}\" class=\"piece\">"
            "<title>{}: {} {:.4g}</title></rect>\n",
            x(from), y, x(from + value) - x(from), stacks_bar_height, fill_text(plot.id, plot.kinds[kind].second),
            html_escaped((group.title.empty() ? "" : group.title + ", ") + bar.label),
            html_escaped(plot.kinds[kind].first), value);
        from += value;
      }
      if (!bar.note.empty()) {
        body += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" class=\"label\">{}</text>\n", x(from) + 7, y + 12,
                            html_escaped(bar.note));
      }
      y += stacks_bar_step;
    }
    y += stacks_group_gap;
  }
  std::string text = fmt::format(
      "<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"{}\" xmlns=\"http://www.w3.org/2000/svg\">\n",
      stacks_width, y + 40, html_escaped(plot.description));
  text += fill_definitions(plot.id);
  if (plot.kinds.size() > 1) text += svg_legend(plot.id, plot.kinds, stacks_left, 12);
  const double step = nice_step(end / 6);
  for (double k = 0; k * step <= end * 1.0001; ++k) {
    text += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2:.1f}\" class=\"grid\"/>\n"
        "<text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\">{4:.6g}</text>\n",
        x(k * step), top - 6, y, y + 14, k * step);
  }
  text += body;
  if (plot.line && std::isfinite(*plot.line)) {
    text += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2:.1f}\" stroke=\"#1d232a\" stroke-dasharray=\"5 4\"/>\n",
        x(*plot.line), top - 6, y);
  }
  text += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"axis\">{}</text>\n",
                      (stacks_left + stacks_right) / 2, y + 33, html_escaped(plot.axis));
  return text + "</svg>\n";
}

}  // namespace vrpipe::tools
