#include "output/microbench_page.h"

#include <cmath>

#include <fmt/format.h>

#include "output/page_parts.h"

namespace vrpipe::tools {

namespace {

constexpr const char* own_style = R"(
h3 { font-size: 15px; margin: 20px 0 0; } tr.differs td { background: #fff4d6; }
td.left, th.left { text-align: left; }
)";

struct Look {
  const char* name;
  const char* color;
  Marker marker;
  bool hollow;
};
constexpr Look simulator{"simulator", "#0072b2", Marker::circle, false};
constexpr Look real_gpu{"real GPU", "#d1400f", Marker::square, true};
constexpr Look paper{"paper", "#009e73", Marker::diamond, false};

void add_points(Plot& plot, const MicrobenchPoints& points, const Look& look) {
  if (points.empty()) return;
  PlotLine line;
  line.color = look.color;
  line.dashed = look.hollow;
  for (const auto& [x, y] : points) {
    if (!std::isfinite(x) || !std::isfinite(y)) continue;
    line.points.emplace_back(x, y);
    plot.points.push_back({x, y, look.color, look.marker, look.hollow, "",
                           fmt::format("{}: {}, {}", look.name, number_text(x), number_text(y))});
  }
  // Two numbers of the paper are no curve.
  if (look.marker != paper.marker && line.points.size() > 1) plot.lines.push_back(std::move(line));
  plot.legend.push_back({look.name, look.color, look.marker, look.hollow, false});
}

std::string curve_html(const MicrobenchCurve& curve) {
  Plot plot;
  plot.description = fmt::format("{}: {}, by {}", curve.name, curve.y_label, curve.x_label);
  plot.x.title = curve.x_label;
  plot.y.title = curve.y_label;
  add_points(plot, curve.measured, simulator);
  add_points(plot, curve.gpu, real_gpu);
  add_points(plot, curve.paper, paper);
  return "<h3>" + html_escaped(curve.name) + "</h3>\n" + figure(curve.name, plot);
}

std::string table_html(const MicrobenchResult& result) {
  std::string text =
      "<div class=\"scroll\"><table>\n<tr><th></th><th>paper</th><th>real GPU</th><th>simulator</th>"
      "<th class=\"left\">unit</th><th class=\"left\">source of what is published</th></tr>\n";
  for (const MicrobenchFigure& figure : result.figures) {
    const bool differs = figure.reference && figure.tolerance_percent >= 0 && !figure.agrees();
    text += fmt::format(
        "<tr{}><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"left\">{}</td><td class=\"left\">{}</td></tr>\n",
        differs ? " class=\"differs\"" : "", html_escaped(figure.name), figure.paper ? number_text(*figure.paper) : "-",
        html_escaped(gpu_text(figure)), number_text(figure.measured), html_escaped(figure.unit),
        html_escaped(figure.source));
  }
  return text + "</table></div>\n";
}

}  // namespace

std::string microbench_page(const MicrobenchRun& run) {
  const Platform& platform = *run.request.platform;
  std::string text = page_head("vrpipe microbench: " + platform.name, own_style) + "<h1>Microbenchmarks</h1>\n";
  text += fmt::format("<p class=\"subtle\">{} ({}), {} fidelity. What differs from what is published is marked.</p>\n",
                      html_escaped(platform.name), html_escaped(platform.description), fidelity_of(run.request));
  for (const MicrobenchResult& result : run.results) {
    text += fmt::format("<h2 id=\"{0}\">{0}</h2>\n<p>{1}</p>\n", result.name, html_escaped(result.question));
    text += table_html(result) + "<ul>\n";
    for (const std::string& each : findings(result)) text += "<li>" + html_escaped(each) + "</li>\n";
    text += "</ul>\n";
    for (const MicrobenchCurve& curve : result.curves) text += curve_html(curve);
  }
  text += fmt::format("<h2>What made this page</h2>\n<p><code>{}</code></p>\n<p class=\"subtle\">vrpipe {}</p>\n",
                      html_escaped(command_text(run.provenance)), VRPIPE_VERSION);
  return text + "</body>\n</html>\n";
}

}  // namespace vrpipe::tools
