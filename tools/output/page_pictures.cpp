#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "image/color_scale.h"
#include "output/compare_sections.h"
#include "output/page_parts.h"
#include "output/report.h"
#include "output/svg_plot.h"

namespace vrpipe::tools {
namespace {

/// Until the script has put one in its place.
constexpr const char* empty_picture = "data:image/gif;base64,R0lGODlhAQABAAAAACH5BAEKAAEALAAAAAABAAEAAAICTAEAOw==";

std::string choices(const JobResult& result, std::size_t chosen) {
  std::string text;
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    text += fmt::format("<option value=\"{}\"{}>{}</option>", i, i == chosen ? " selected" : "",
                        html_escaped(name_of(result.runs[i].request)));
  }
  return text;
}

/// Two of the pictures over one another; the script fills it in.
std::string stage(const JobResult& result) {
  const std::size_t right = result.baseline + 1 == result.runs.size() ? 0 : result.runs.size() - 1;
  return fmt::format(
      "<div class=\"controls\">\n<label>left <select id=\"left\">{}</select></label>\n"
      "<label>right <select id=\"right\">{}</select></label>\n"
      "<label>view <select id=\"view\"><option value=\"wipe\" selected>both, with a slider</option>"
      "<option value=\"difference\">their difference</option></select></label>\n"
      "<label id=\"wipe-control\">slider <input id=\"wipe\" type=\"range\" min=\"0\" max=\"100\" step=\"0.1\" "
      "value=\"50\"></label>\n"
      "<label id=\"gain-control\" class=\"hidden\">amplified <select id=\"gain\"><option value=\"1\">1x</option>"
      "<option value=\"4\">4x</option><option value=\"16\" selected>16x</option><option value=\"64\">64x</option>"
      "<option value=\"255\">255x</option></select></label>\n</div>\n"
      "<div class=\"stage\" id=\"stage\"><img id=\"under\" alt=\"the right picture\" src=\"{}\" draggable=\"false\">"
      "<img id=\"over\" class=\"over\" alt=\"the left picture\" src=\"{}\" draggable=\"false\">"
      "<canvas id=\"difference\" class=\"over hidden\"></canvas><div id=\"edge\" class=\"edge\"></div>"
      "<span id=\"left-tag\" class=\"tag left\"></span><span id=\"right-tag\" class=\"tag right\"></span></div>\n"
      "<p class=\"subtle\" id=\"difference-text\"></p>\n",
      choices(result, result.baseline), choices(result, right), empty_picture, empty_picture);
}

std::string error_text(const ImageError& error) {
  if (std::isinf(error.psnr_db)) return "equal to the last bit of a float";
  return fmt::format("PSNR {:.1f} dB, SSIM {:.5f}, largest difference {:.2g}", error.psnr_db, error.ssim,
                     error.max_abs_error);
}

std::string scale(const HeatRow& row) {
  std::string stops = "rgb(0,0,0) 0%";
  for (int i = 0; i <= 8; ++i) {
    const auto color = viridis(i / 8.0);
    stops += fmt::format(",rgb({},{},{}) {:g}%", color[0], color[1], color[2], 2 + 98 * i / 8.0);
  }
  return fmt::format(
      "<div class=\"scale\">0 <i style=\"background:linear-gradient(90deg,{})\"></i> {}; black: none</div>\n", stops,
      grouped(static_cast<std::uint64_t>(row.brightest)));
}

struct HeatMeaning {
  const char* name;
  const char* title;
};
constexpr HeatMeaning heat_meanings[] = {{"rasterized", "Fragments rasterized at each pixel"},
                                         {"terminated", "Fragments that early termination saved"},
                                         {"merged", "Fragments merged away"},
                                         {"blended", "Fragments blended"},
                                         {"termination_cycle", "Cycle in which each pixel terminated"}};

std::string title_of(const std::string& name) {
  for (const HeatMeaning& meaning : heat_meanings) {
    if (name == meaning.name) return meaning.title;
  }
  return name;
}

}  // namespace

std::string pictures_section(const JobResult& result) {
  if (result.page.pictures.empty()) return {};
  std::string text = result.runs.size() > 1 ? stage(result) : std::string();
  text += result.runs.size() > 1 ? "<div class=\"pictures\">\n" : "<div class=\"pictures one\">\n";
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const Picture& picture = result.page.pictures[i];
    const std::string name = html_escaped(name_of(result.runs[i].request));
    text += fmt::format(
        "<figure><figcaption><b>{0}</b></figcaption><img alt=\"{0}\" width=\"{1}\" height=\"{2}\" src=\"{3}\">"
        "</figure>\n",
        name, picture.width, picture.height, png_uri(picture));
  }
  text += "</div>\n";
  const Picture& first = result.page.pictures.front();
  if (first.width != result.width) {
    text += fmt::format("<p class=\"subtle\">Pictures are averaged to {}x{} here.</p>\n", first.width, first.height);
  }
  if (result.runs.size() == 1) return text;
  std::vector<PageRow> rows;
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const std::optional<ImageError>& error = result.page.errors[i];
    if (!error) continue;
    rows.push_back({{name_of(result.runs[i].request), error_text(*error),
                     fmt::format("{} ({:.2f} %)", grouped(error->pixels_differing), 100 * error->share_differing)}});
  }
  return text + html_table({"against " + name_of(result.runs[result.baseline].request), "error of the image",
                            "pixels that differ in 8 bits"},
                           rows);
}

std::string heat_section(const JobResult& result) {
  std::string text;
  CsvText csv({"run", "map", "sum", "largest"});
  for (const HeatRow& row : result.page.heat) {
    for (std::size_t i = 0; i < result.runs.size(); ++i) {
      if (const auto& map = row.of_run[i])
        csv.row({name_of(result.runs[i].request), row.name, fmt::format("{:.0f}", map->sum),
                 fmt::format("{:.0f}", map->largest)});
    }
    if (row.brightest <= 0) continue;
    text += "<h3>" + html_escaped(title_of(row.name)) + "</h3>\n" + scale(row);
    text += fmt::format("<div class=\"maps\" style=\"grid-template-columns:repeat({},minmax(0,{}px))\">\n",
                        std::min<std::size_t>(result.runs.size(), 4), PageMaterial::largest_heat_width);
    std::string without, unknown;
    const auto add = [](std::string& names, const std::string& name) { names += (names.empty() ? "" : ", ") + name; };
    // What is rasterised is mostly the same in all runs.
    const bool is_of_all = std::all_of(row.of_run.begin(), row.of_run.end(), [&](const auto& map) {
      return map && row.of_run.front() && map->picture.rgb == row.of_run.front()->picture.rgb;
    });
    for (std::size_t i = 0; i < result.runs.size(); ++i) {
      const std::string name = name_of(result.runs[i].request);
      if (!row.of_run[i]) {
        add(unknown, name);
        continue;
      }
      const HeatPicture& map = *row.of_run[i];
      if (map.largest <= 0) {
        add(without, name);
        continue;
      }
      if (is_of_all && i > 0) break;
      text += fmt::format(
          "<figure><figcaption>{0}</figcaption><img alt=\"{1}: {0}\" width=\"{2}\" height=\"{3}\" src=\"{4}\">"
          "</figure>\n",
          html_escaped(is_of_all && result.runs.size() > 1 ? "all runs" : name), html_escaped(title_of(row.name)),
          map.picture.width, map.picture.height, png_uri(map.picture));
    }
    text += "</div>\n";
    if (!without.empty()) text += "<p class=\"subtle\">None in " + html_escaped(without) + ".</p>\n";
    if (!unknown.empty()) text += "<p class=\"subtle\">Not known of " + html_escaped(unknown) + ".</p>\n";
  }
  if (text.empty()) return {};
  return "<p>Maps of one kind share a scale, which rises in lightness. <code>--heat-maps</code> writes them in full, "
         "also "
         "of screen tiles. <span class=\"links\">" +
         csv_link("heat", csv.text()) + "</span></p>\n" + text;
}

}  // namespace vrpipe::tools
