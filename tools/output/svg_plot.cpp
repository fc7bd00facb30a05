#include "output/svg_plot.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>

namespace vrpipe::tools {
namespace {

// Pixels of the drawing; the page scales it.
constexpr double plot_width = 1040;
constexpr double plot_height = 520;
constexpr double plot_left = 68;
constexpr double plot_right = 820;  // the legend is beyond
constexpr double plot_top = 16;
constexpr double plot_bottom = 466;
constexpr double plot_radius = 5.5;
constexpr double character_width = 7.4;
constexpr double line_height = 14;

struct Box {
  double x0, y0, x1, y1;
  bool overlaps(const Box& other) const { return x0 < other.x1 && other.x0 < x1 && y0 < other.y1 && other.y0 < y1; }
};

struct Segment {
  double x0, y0, x1, y1;
  /// Whether it crosses a box: what is left of it, clipped at the sides one after the other.
  bool crosses(const Box& box) const {
    double from = 0;
    double to = 1;
    const auto clip = [&](double start, double step, double least, double largest) {
      if (step == 0) return start > least && start < largest;
      const double a = (least - start) / step;
      const double b = (largest - start) / step;
      from = std::max(from, std::min(a, b));
      to = std::min(to, std::max(a, b));
      return from < to;
    };
    return clip(x0, x1 - x0, box.x0, box.x1) && clip(y0, y1 - y0, box.y0, box.y1);
  }
};

/// From values to pixels.
class PlotScale {
 public:
  PlotScale(const PlotAxis& axis, const std::vector<double>& values, double from, double to)
      : logarithmic_(axis.logarithmic), from_(from), to_(to) {
    double least = std::numeric_limits<double>::infinity();
    double largest = -least;
    bool has_zero = false;
    for (const double value : values) {
      if (logarithmic_ && value <= 0) {
        has_zero = true;
        continue;
      }
      least = std::min(least, transformed(value));
      largest = std::max(largest, transformed(value));
    }
    if (!(least <= largest)) least = largest = 0;
    if (has_zero) {
      lowest_power_ = least;
      least = zero_ = least - std::max(0.3, 0.15 * (largest - least));
    }
    const double margin = largest > least ? 0.07 * (largest - least)
                          : logarithmic_  ? 0.3
                                          : std::max(1.0, 0.1 * std::fabs(least));
    least_ = least - margin;
    largest_ = largest + margin;
  }

  double operator()(double value) const {
    return from_ + (transformed(value) - least_) / (largest_ - least_) * (to_ - from_);
  }

  std::vector<double> ticks() const {
    std::vector<double> all;
    if (!logarithmic_) {
      const double step = nice_step((largest_ - least_) / 6);
      for (double k = std::ceil(least_ / step); k * step <= largest_; ++k) all.push_back(k * step);
      return all;
    }
    if (lowest_power_ > least_) all.push_back(0);
    const double lowest = std::max(least_, lowest_power_);
    // Over less than a decade, more of them.
    const std::vector<double> digits =
        largest_ - lowest < 1 ? std::vector<double>{1, 1.5, 2, 3, 4, 5, 6, 8} : std::vector<double>{1, 2, 5};
    for (double power = std::floor(lowest); power <= largest_; ++power) {
      for (const double digit : digits) {
        const double value = digit * std::pow(10, power);
        if (transformed(value) >= lowest && transformed(value) <= largest_) all.push_back(value);
      }
    }
    return all;
  }

 private:
  double transformed(double value) const { return !logarithmic_ ? value : value > 0 ? std::log10(value) : zero_; }

  bool logarithmic_;
  double from_, to_;
  double least_ = 0, largest_ = 1;
  double zero_ = 0;                                                 // where 0 lies on a logarithmic axis
  double lowest_power_ = -std::numeric_limits<double>::infinity();  // below which such an axis has no ticks but that
};

std::string marker_shape(Marker marker, double x, double y, const std::string& style, const std::string& tooltip) {
  std::string title = tooltip.empty() ? "" : "<title>" + html_escaped(tooltip) + "</title>";
  const auto polygon = [&](const std::vector<std::pair<double, double>>& corners) {
    std::string points;
    for (const auto& [dx, dy] : corners) points += fmt::format("{:.1f},{:.1f} ", x + dx, y + dy);
    points.pop_back();
    return fmt::format("<polygon points=\"{}\" {}>{}</polygon>\n", points, style, title);
  };
  constexpr double r = plot_radius;
  switch (marker) {
    case Marker::circle:
      return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" {}>{}</circle>\n", x, y, r, style, title);
    case Marker::square: return polygon({{-r, -r}, {r, -r}, {r, r}, {-r, r}});
    case Marker::diamond: return polygon({{0, -1.3 * r}, {1.3 * r, 0}, {0, 1.3 * r}, {-1.3 * r, 0}});
    case Marker::triangle: return polygon({{0, -1.2 * r}, {1.2 * r, r}, {-1.2 * r, r}});
    case Marker::star: {
      std::vector<std::pair<double, double>> corners;
      for (int i = 0; i < 10; ++i) {
        const double angle = i * 0.6283185307179586;
        const double reach = i % 2 == 0 ? 1.9 * r : 0.85 * r;
        corners.emplace_back(reach * std::sin(angle), -reach * std::cos(angle));
      }
      return polygon(corners);
    }
  }
  return {};
}

std::string marker_style(const std::string& color, bool hollow) {
  return fmt::format("fill=\"{}\" stroke=\"{}\" stroke-width=\"{}\"", hollow ? "#fff" : color, hollow ? color : "#fff",
                     hollow ? 2 : 1);
}

/// Where a label of a point may go: offset of its nearest corner or edge, and how it is aligned.
struct Place {
  double dx, dy;
  const char* anchor;
};

std::vector<Place> places() {
  std::vector<Place> all;
  for (const double distance : {9.0, 18.0, 30.0, 46.0, 66.0, 90.0}) {
    const double diagonal = 0.75 * distance;
    all.insert(all.end(), {{distance, 0, "start"},
                           {-distance, 0, "end"},
                           {0, -distance - 3, "middle"},
                           {0, distance + 3, "middle"},
                           {diagonal, -diagonal, "start"},
                           {diagonal, diagonal, "start"},
                           {-diagonal, -diagonal, "end"},
                           {-diagonal, diagonal, "end"}});
  }
  return all;
}

Box label_box(double x, double y, const Place& place, double width_of_label) {
  const double at = x + place.dx;
  const std::string anchor = place.anchor;
  const double x0 = anchor == "start" ? at : anchor == "end" ? at - width_of_label : at - width_of_label / 2;
  return {x0, y + place.dy - line_height / 2, x0 + width_of_label, y + place.dy + line_height / 2};
}

std::string axes(const Plot& plot, const PlotScale& x, const PlotScale& y) {
  std::string text;
  double last = -1e9;
  for (const double tick : x.ticks()) {
    text += fmt::format("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" class=\"grid\"/>\n", x(tick),
                        plot_top, plot_bottom);
    const std::string label = fmt::format("{:.6g}", tick);
    if (x(tick) - last < character_width * static_cast<double>(label.size()) + 14) continue;
    last = x(tick);
    text +=
        fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", x(tick), plot_bottom + 18, label);
  }
  last = 1e9;
  for (const double tick : y.ticks()) {
    text += fmt::format("<line x1=\"{1}\" x2=\"{2}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\" class=\"grid\"/>\n", y(tick),
                        plot_left, plot_right);
    if (last - y(tick) < line_height) continue;
    last = y(tick);
    const double shown = std::fabs(tick) < 1e-12 ? 0 : tick;
    text += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:.6g}</text>\n", plot_left - 8, y(tick) + 4,
                        shown);
  }
  text += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"frame\"/>\n", plot_left, plot_top,
                      plot_right - plot_left, plot_bottom - plot_top);
  text += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" class=\"axis\">{}</text>\n",
                      (plot_left + plot_right) / 2, plot_bottom + 42, html_escaped(plot.x.title));
  text +=
      fmt::format("<text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\" class=\"axis\">{}</text>\n",
                  (plot_top + plot_bottom) / 2, html_escaped(plot.y.title));
  return text;
}

std::string legend_text(const std::vector<LegendEntry>& legend) {
  std::string text;
  double y = plot_top + 10;
  for (const LegendEntry& entry : legend) {
    if (entry.is_line) {
      text += fmt::format(
          "<line x1=\"{}\" x2=\"{}\" y1=\"{}\" y2=\"{}\" stroke=\"{}\" stroke-width=\"1.5\" stroke-dasharray=\"5 "
          "4\"/>\n",
          plot_right + 16, plot_right + 36, y, y, entry.color);
    } else {
      text += marker_shape(entry.marker, plot_right + 26, y, marker_style(entry.color, entry.hollow), "");
    }
    text += fmt::format("<text x=\"{}\" y=\"{}\">{}</text>\n", plot_right + 44, y + 4, html_escaped(entry.text));
    y += 21;
  }
  return text;
}

}  // namespace

std::string html_escaped(const std::string& text) {
  std::string result;
  for (const char c : valid_utf8(text)) {
    switch (c) {
      case '&': result += "&amp;"; break;
      case '<': result += "&lt;"; break;
      case '>': result += "&gt;"; break;
      case '"': result += "&quot;"; break;
      default: result += c;
    }
  }
  return result;
}

double nice_step(double rough) {
  const double power = std::pow(10, std::floor(std::log10(rough)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * power >= rough) return digit * power;
  }
  return 10 * power;
}

std::string svg(const Plot& plot) {
  std::vector<double> xs;
  std::vector<double> ys;
  for (const PlotPoint& point : plot.points) {
    xs.push_back(point.x);
    ys.push_back(point.y);
  }
  const PlotScale x(plot.x, xs, plot_left, plot_right);
  const PlotScale y(plot.y, ys, plot_bottom, plot_top);

  std::string text =
      fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\" xmlns=\"http://www.w3.org/2000/svg\">\n",
                  plot_width, plot_height, html_escaped(plot.description));
  text += axes(plot, x, y);
  std::vector<Segment> segments;
  for (const PlotLine& line : plot.lines) {
    std::string points;
    for (std::size_t i = 0; i < line.points.size(); ++i) {
      const auto& [px, py] = line.points[i];
      points += fmt::format("{:.1f},{:.1f} ", x(px), y(py));
      if (i > 0) segments.push_back({x(line.points[i - 1].first), y(line.points[i - 1].second), x(px), y(py)});
    }
    text += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"{}/>\n", points,
                        line.color, line.dashed ? " stroke-dasharray=\"5 4\"" : "");
  }

  std::vector<Box> taken;
  for (const PlotPoint& point : plot.points) {
    const double reach = plot_radius + 2;
    taken.push_back({x(point.x) - reach, y(point.y) - reach, x(point.x) + reach, y(point.y) + reach});
  }
  const std::vector<Place> candidates = places();
  std::string labels;
  for (const PlotPoint& point : plot.points) {
    const double px = x(point.x);
    const double py = y(point.y);
    const auto is_here = [&](const PlotPoint& other) {
      return std::fabs(x(other.x) - px) < plot_radius && std::fabs(y(other.y) - py) < plot_radius;
    };
    const bool covered = &*std::find_if(plot.points.begin(), plot.points.end(), is_here) != &point;
    if (point.label.empty() || covered) continue;
    const double width_of_label = character_width * static_cast<double>(point.label.size()) + 2;
    const auto is_free = [&](const Place& place) {
      const Box box = label_box(px, py, place, width_of_label);
      if (box.x0 < plot_left + 2 || box.x1 > plot_right - 2 || box.y0 < plot_top + 2 || box.y1 > plot_bottom - 2)
        return false;
      return std::none_of(taken.begin(), taken.end(), [&](const Box& other) { return box.overlaps(other); });
    };
    const auto is_clear = [&](const Place& place) {
      const Box box = label_box(px, py, place, width_of_label);
      return is_free(place) &&
             std::none_of(segments.begin(), segments.end(), [&](const Segment& line) { return line.crosses(box); });
    };
    auto place = std::find_if(candidates.begin(), candidates.end(), is_clear);
    if (place == candidates.end()) place = std::find_if(candidates.begin(), candidates.end(), is_free);
    if (place == candidates.end()) continue;
    taken.push_back(label_box(px, py, *place, width_of_label));
    if (std::max(std::fabs(place->dx), std::fabs(place->dy)) > 14) {
      labels += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"leader\"/>\n", px,
                            py, px + place->dx, py + place->dy);
    }
    labels += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" class=\"label\">{}</text>\n",
                          px + place->dx, py + place->dy + 4, place->anchor, html_escaped(point.label));
  }
  text += labels;
  // The first on top.
  for (auto point = plot.points.rbegin(); point != plot.points.rend(); ++point) {
    text += marker_shape(point->marker, x(point->x), y(point->y), marker_style(point->color, point->hollow),
                         point->tooltip);
  }
  return text + legend_text(plot.legend) + "</svg>\n";
}

}  // namespace vrpipe::tools
