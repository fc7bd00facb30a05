#include "output/frames_page.h"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>

#include "output/frames_report.h"
#include "output/machines_text.h"
#include "output/page_parts.h"
#include "output/report.h"
#include "output/svg_plot.h"
#include "output/svg_stacks.h"

namespace vrpipe::tools {
namespace {

constexpr const char* software_color = "#0072b2";
constexpr const char* hardware_color = "#d1400f";

double count_in(const FramePath& path, const std::string& name) {
  return static_cast<double>(path.count(name).value_or(0));
}

const FramePath* path_named(const FramesResult& result, const std::string& name) {
  for (const FramePath& path : result.paths) {
    if (path.path == name) return &path;
  }
  return nullptr;
}

/// Figure 5: where the time of a frame goes.
std::string time_figure(const FramesResult& result) {
  StackPlot plot;
  plot.id = "time";
  plot.description = "milliseconds of a frame on each path: preprocess, sort, raster";
  plot.axis = "simulated milliseconds";
  plot.kinds = {{"preprocess", 0}, {"sort", 1}, {"raster", 2}};
  CsvText csv({"path", "name", "preprocess_ms", "sort_ms", "raster_ms", "frame_ms"});
  StackGroup& group = plot.groups.emplace_back();
  for (const FramePath& path : result.paths) {
    const std::array<double, 3> parts{path.preprocess.value_or(0), path.sort.value_or(0), path.raster.value_or(0)};
    group.bars.push_back({path.label(), {parts.begin(), parts.end()}, fmt::format("{:.2f} ms", *path.frame)});
    csv.row({path.path, path.name, csv_number(parts[0]), csv_number(parts[1]), csv_number(parts[2]),
             csv_number(*path.frame)});
  }
  return html(
      PageFigure{"frame-time",
                 "Where a frame's time goes (the paper's Figure 5). Stages of an accelerator overlap: its bar is "
                 "what each of them is busy, its number the frame.",
                 svg(plot), csv.text()});
}

/// Figures 17 and 22: frames over software's and hardware's.
std::string speedup_figure(const FramesResult& result) {
  const FramePath *const software = path_named(result, "software"), *const hardware = path_named(result, "hardware");
  BarPlot plot;
  plot.description = "speed-up of whole frames over software and over hardware, by path";
  plot.title = "speed-up of the whole frame";
  plot.legend = {{"over software", software_color}, {"over hardware", hardware_color}};
  plot.line = 1;
  for (const FramePath& path : result.paths) {
    BarGroup group{path.label(), {}, {}};
    const double over_software = *software->frame / *path.frame, over_hardware = *hardware->frame / *path.frame;
    group.bars = {{0, over_software, software_color, fmt::format("{:.2f}x over software", over_software)},
                  {0, over_hardware, hardware_color, fmt::format("{:.2f}x over hardware", over_hardware)}};
    plot.groups.push_back(std::move(group));
  }
  return figure("frame speed-ups", plot,
                "Whole frames over today's (Figures 17 and 22). The paper: HET+QM 2.05x over software and 1.60x over "
                "hardware in the mean, and an accelerator faster than that.");
}

/// Figure 10, and the passes of Figure 11: other ways to blend on the same platform.
std::string raster_figure(const FramesResult& result) {
  const FramePath* const hardware = path_named(result, "hardware");
  BarPlot plot;
  plot.description = "time of the draw alone over that of today's hardware, by path";
  plot.title = "time of the draw, hardware's being 1";
  plot.line = 1;
  const auto add = [&](const FramePath& path) {
    const double over = *path.raster / *hardware->raster;
    plot.groups.push_back({path.label(), {{0, over, hardware_color, fmt::format("{:.2f}", over)}}, {}});
  };
  for (const FramePath& path : result.paths) {
    if (path.path != "software" && path.path != "accelerator") add(path);
    if (path.path == "in-shader" && result.without_lock) add(*result.without_lock);
  }
  return figure("draw times", plot, "The draw alone, by what blends and what terminates (Figures 10 and 11).");
}

/// Figure 9: what the lanes of software's warps do.
std::string lanes_figure(const FramesResult& result) {
  StackPlot plot;
  plot.id = "lanes";
  plot.description = "what lanes of warps do in software, percent of all of their iterations";
  plot.axis = "% of the lanes of all iterations";
  plot.most = 100;
  plot.kinds = {{"blends", 0}, {"stops", 1}, {"pruned", 2}, {"dead beside a living one", 3}};
  constexpr std::array<const char*, 4> counted{"lanes_blending", "lanes_stopping", "lanes_pruned", "lanes_dead"};
  CsvText csv({"kernel", "blending_percent", "stopping_percent", "pruned_percent", "dead_percent"});
  StackGroup& group = plot.groups.emplace_back();
  const auto add = [&](const FramePath& path) {
    const double lanes = 32 * count_in(path, "warp_iterations");
    if (lanes == 0) return;
    std::vector<double> shares;
    std::vector<std::string> cells{path.name};
    for (const char* name : counted) {
      shares.push_back(100 * count_in(path, name) / lanes);
      cells.push_back(csv_number(shares.back()));
    }
    group.bars.push_back({path.name, shares, fmt::format("{:.1f} % blend", shares.front())});
    csv.row(cells);
  };
  add(*path_named(result, "software"));
  if (result.without_termination) add(*result.without_termination);
  if (group.bars.empty()) return {};
  return html(PageFigure{"lanes",
                         "What the lanes of a warp do in software (Figure 9; the paper: less than 40 % blend).",
                         svg(plot), csv.text()});
}

/// Figure 8: what termination saves in software.
std::string termination_figure(const FramesResult& result) {
  if (!result.without_termination) return {};
  const FramePath &with = *path_named(result, "software"), &without = *result.without_termination;
  BarPlot plot;
  plot.description = "what termination saves in software: time, iterations of warps, fragments";
  plot.title = "without termination over with it";
  plot.line = 1;
  const auto add = [&](const char* what, double of, double over) {
    if (of > 0) plot.groups.push_back({what, {{0, over / of, software_color, fmt::format("{:.2f}x", over / of)}}, {}});
  };
  add("time of rendering", *with.raster, *without.raster);
  add("iterations of warps", count_in(with, "warp_iterations"), count_in(without, "warp_iterations"));
  add("fragments blended", count_in(with, "lanes_blending"), count_in(without, "lanes_blending"));
  return figure(
      "termination in software", plot,
      "What termination saves in software (Figure 8): a warp stays for its last living lane, so that time falls "
      "less than fragments do.");
}

std::string pictures(const FramesResult& result) {
  std::string text = "<div class=\"cards\">\n";
  for (std::size_t i = 0; i < result.pictures.size(); ++i) {
    const Picture& picture = result.pictures[i];
    text += fmt::format(
        "<figure><figcaption><b>{0}</b></figcaption><img alt=\"{0}\" style=\"width:100%\" width=\"{1}\" height=\"{2}\" "
        "src=\"{3}\"></figure>\n",
        html_escaped(result.paths[i].label()), picture.width, picture.height, png_uri(picture));
  }
  return text + "</div>\n";
}

}  // namespace

std::string frames_page(const FramesResult& result) {
  const RunRequest& request = result.runs.front().request;
  std::string text = page_head("vrpipe frames: " + result.scene.name) + "<h1>" + html_escaped(result.scene.name) +
                     ": whole frames</h1>\n";
  text += fmt::format("<p>{} splats, {}x{}, on {} at {}.</p>\n", grouped(result.scene.gaussians_visible), result.width,
                      result.height, html_escaped(request.platform->name), vrpipe::name_of(request.fidelity));
  text += "<div class=\"scroll\"><pre>" + html_escaped(frames_report(result, TextStyle{})) + "</pre></div>\n";
  if (request.fidelity == Fidelity::functional) {
    text += "<p class=\"notice\">At functional fidelity nothing takes time.</p>\n";
  } else {
    text += "<h2>Time</h2>\n" + time_figure(result) + speedup_figure(result) + raster_figure(result);
  }
  text += "<h2>Software</h2>\n" + lanes_figure(result);
  if (request.fidelity != Fidelity::functional) text += termination_figure(result);
  text += "<h2>Pictures</h2>\n" + pictures(result);
  return text + "<p class=\"subtle\"><code>" + html_escaped(command_text(result.provenance)) +
         "</code></p>\n</body>\n</html>\n";
}

}  // namespace vrpipe::tools
