#include "output/accuracy_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "image/base64.h"
#include "image/images.h"
#include "output/accuracy_report.h"
#include "output/effects_page.h"
#include "output/page_parts.h"
#include "output/report.h"

namespace vrpipe::tools {
namespace {

std::string image(const Picture& picture, const std::string& description) {
  return fmt::format("<img alt=\"{}\" width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{}\">",
                     html_escaped(description), picture.width, picture.height,
                     base64(encode_png(picture.width, picture.height, picture.rgb)));
}

std::string table(const AccuracyTable& source) {
  std::string text = "<div class=\"scroll\"><table>\n<tr>";
  for (const std::string& cell : source.heading) text += "<th>" + html_escaped(cell) + "</th>";
  text += "</tr>\n";
  std::string group;
  for (const AccuracyTable::Row& row : source.rows) {
    if (row.group != group) {
      text += fmt::format("<tr class=\"group\"><td colspan=\"{}\">{}</td></tr>\n", source.heading.size(),
                          html_escaped(row.group));
    }
    group = row.group;
    text += row.marked ? "<tr class=\"marked\">" : "<tr>";
    for (const std::string& cell : row.cells) text += "<td>" + html_escaped(cell) + "</td>";
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

std::string word_list(const std::vector<std::string>& lines) {
  if (lines.empty()) return {};
  std::string text = "<ul>\n";
  for (const std::string& line : lines) text += "<li>" + html_escaped(line) + "</li>\n";
  return text + "</ul>\n";
}

/// "word: what it means", the word in bold.
std::string definition(const std::string& text) {
  const std::size_t end = text.find(':');
  return "<p class=\"subtle\"><b>" + html_escaped(text.substr(0, end)) + "</b>" + html_escaped(text.substr(end)) +
         ".</p>\n";
}

std::string exactness(const ImageError& error) {
  return std::isinf(error.psnr_db) ? std::string("equal to the reference") : fmt::format("{:.2f} dB", error.psnr_db);
}

/// Colours that can be told from one another; what is of more kinds differs in the marker.
constexpr std::array<const char*, 8> fidelity_colors{"#0072b2", "#d1400f", "#009e73", "#e69f00",
                                                     "#cc79a7", "#56b4e9", "#7a3e9d", "#6b4a2b"};

std::string fidelity_plot(const AccuracyResult& result) {
  constexpr Marker markers[] = {Marker::triangle, Marker::square, Marker::diamond, Marker::circle};
  Plot plot;
  plot.description = "error in cycles against CPU seconds, for each variant and fidelity";
  plot.x = {"CPU seconds (logarithmic)", true};
  plot.y = {"error in cycles, % (logarithmic, none at the bottom)", true};
  std::vector<std::string> variants_seen;
  std::vector<std::string> fidelities_seen;
  decltype(plot.legend) legend;
  bool any_dominated = false;
  for (const FidelityLevel& level : result.fidelity) {
    const RunRequest& request = level.run.request;
    if (!level.cycles_error_percent) continue;
    const auto index_of = [](auto& seen, const auto& what) {
      const auto place = std::find(seen.begin(), seen.end(), what);
      if (place != seen.end()) return static_cast<std::size_t>(place - seen.begin());
      seen.push_back(what);
      return seen.size() - 1;
    };
    const std::size_t variant = index_of(variants_seen, request.variant.name);
    const std::string fidelity = fidelity_of(request);
    // Those with units at cycle have one marker.
    const Marker marker =
        fidelity != vrpipe::name_of(request.fidelity) ? Marker::star : markers[static_cast<unsigned>(request.fidelity)];
    if (index_of(fidelities_seen, fidelity) == legend.size())
      legend.push_back({fidelity, "#4d5b6a", marker, false, false});
    const std::string name = fmt::format("{} {}", request.variant.name, fidelity);
    const double error = std::fabs(*level.cycles_error_percent);
    const char* const color = fidelity_colors[variant % fidelity_colors.size()];
    plot.points.push_back({level.cpu_seconds, error, color, marker, level.dominated, name,
                           fmt::format("{}: {:.2g} % in {:.2f} s{}", name, error, level.cpu_seconds,
                                       level.dominated ? ", dominated" : "")});
    any_dominated |= level.dominated;
    if (variant >= plot.lines.size()) plot.lines.push_back({{}, color, true});
    if (!level.dominated) plot.lines[variant].points.emplace_back(level.cpu_seconds, error);
  }
  for (PlotLine& line : plot.lines) std::sort(line.points.begin(), line.points.end());
  for (std::size_t i = 0; i < variants_seen.size(); ++i) {
    plot.legend.push_back(
        {variants_seen[i], fidelity_colors[i % fidelity_colors.size()], Marker::circle, false, false});
  }
  plot.legend.insert(plot.legend.end(), legend.begin(), legend.end());
  plot.legend.push_back({"front of a variant", "#4d5b6a", Marker::circle, false, true});
  if (any_dominated) plot.legend.push_back({"dominated", "#4d5b6a", Marker::circle, true, false});
  return figure("error against time", plot);
}

std::string precision_plot(const AccuracyResult& result) {
  Plot plot;
  plot.description = "PSNR against simulated cycles, for each value of each knob";
  plot.x = {"simulated cycles, millions", false};
  plot.y = {"PSNR against exact arithmetic, dB (more is better)", false};
  double best = 0;
  for (const PrecisionRun& run : result.runs) {
    if (!std::isinf(run.error.psnr_db)) best = std::max(best, run.error.psnr_db);
  }
  const auto point_of = [&](const PrecisionRun& run) {
    const double psnr = std::isinf(run.error.psnr_db) ? best + 10 : run.error.psnr_db;
    return std::pair<double, double>{static_cast<double>(run.run.cycles.value_or(0)) * 1e-6, psnr};
  };
  PlotLine front{{}, "#4d5b6a", true};
  for (const PrecisionRun& run : result.runs) {
    if (run.on_front) front.points.push_back(point_of(run));
  }
  std::sort(front.points.begin(), front.points.end());
  plot.lines.push_back(front);

  const auto [default_x, default_y] = point_of(result.runs.front());
  plot.points.push_back({default_x, default_y, "#111", Marker::star, false, "default", "the default"});
  plot.legend.push_back({"the default", "#111", Marker::star, false, false});
  for (std::size_t k = 0; k < precision_knobs().size(); ++k) {
    const PrecisionKnob& knob = precision_knobs()[k];
    const char* const color = fidelity_colors[k % fidelity_colors.size()];
    constexpr Marker markers[] = {Marker::circle, Marker::square, Marker::triangle};
    const Marker marker = markers[k / fidelity_colors.size()];
    bool seen = false;
    for (const PrecisionRow& row : result.precision) {
      if (row.knob != &knob || row.run == 0) continue;
      seen = true;
      const PrecisionRun& run = result.runs[row.run];
      const auto [x, y] = point_of(run);
      const std::string value = readable_value(knob, row.value);
      const std::string name = knob.name + "=" + value;
      plot.points.push_back(
          {x, y, color, marker, !run.on_front, name,
           fmt::format("{}: {}, {} cycles", name, exactness(run.error), grouped(run.run.cycles.value_or(0)))});
    }
    if (seen) plot.legend.push_back({knob.name, color, marker, false, false});
  }
  plot.legend.push_back({"front", "#4d5b6a", Marker::circle, false, true});
  plot.legend.push_back({"not on the front", "#4d5b6a", Marker::circle, true, false});
  return figure("image error against cycles", plot);
}

/// Full markers are measured, hollow ones proved.
std::string fragments_plot(const AccuracyResult& result) {
  Plot plot;
  plot.description = "largest error against the fragments of a pixel, measured and proved";
  plot.x = {"fragments of a pixel, at least (logarithmic)", true};
  plot.y = {"largest error of a channel (logarithmic)", true};
  const std::vector<const PrecisionRun*> runs = runs_by_fragments(result);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const char* const color = fidelity_colors[i % fidelity_colors.size()];
    PlotLine measured{{}, color, false}, proved{{}, color, true};
    for (const ErrorOfRange& range : runs[i]->by_fragments) {
      const auto add = [&](PlotLine& line, double error, bool is_proved) {
        line.points.emplace_back(range.from, error);
        plot.points.push_back({static_cast<double>(range.from), error, color, Marker::circle, is_proved, "",
                               fmt::format("{} to {} fragments, {}: {} {:.2g}", range.from, range.to, runs[i]->name,
                                           is_proved ? "proved" : "measured", error)});
      };
      add(measured, range.max_abs_error, false);
      if (range.proved_max_error) add(proved, *range.proved_max_error, true);
    }
    plot.lines.push_back(std::move(measured));
    plot.lines.push_back(std::move(proved));
    plot.legend.push_back({runs[i]->name, color, Marker::circle, false, false});
  }
  plot.legend.push_back({"proved", "#4d5b6a", Marker::circle, true, true});
  return figure("error against fragments", plot);
}

std::string error_scale() {
  std::string stops;
  for (int i = 0; i <= 8; ++i) {
    const double error = smallest_mapped_error * std::pow(largest_mapped_error / smallest_mapped_error, i / 8.0);
    const auto color = error_color(error);
    stops += fmt::format("{}rgb({},{},{})", i == 0 ? "" : ",", color[0], color[1], color[2]);
  }
  return fmt::format(
      "<div class=\"scale\">error {:g} or less <i style=\"background:linear-gradient(90deg,{})\"></i> {:g} or more, "
      "logarithmic; an 8-bit level is {:.4f}</div>\n",
      smallest_mapped_error, stops, largest_mapped_error, 1 / 255.0);
}

std::string figures(const AccuracyResult& result) {
  std::string text = "<figure class=\"reference\"><figcaption><b>exact arithmetic</b><br>the reference</figcaption>" +
                     image(result.reference, "exact image") + "</figure>\n<div class=\"cards\">\n";
  const auto add = [&](const std::string& name, const PrecisionRun& run) {
    text += fmt::format(
        "<figure><figcaption><b>{}</b><br>{}, largest error {:.2g}</figcaption><div class=\"pair\">{}{}"
        "</div></figure>\n",
        html_escaped(name), exactness(run.error), run.error.max_abs_error, image(run.picture, name),
        image(run.error_map, "error map of " + name));
  };
  add("the default", result.runs.front());
  for (const PrecisionRow& row : result.precision) {
    if (row.run == 0) continue;
    add(row.knob->name + " = " + readable_value(*row.knob, row.value), result.runs[row.run]);
  }
  return text + "</div>\n";
}

std::string functional_note(const AccuracyResult& result) {
  std::string text;
  for (const FidelityLevel& level : result.fidelity) {
    if (level.run.cycles) continue;
    text += fmt::format("{}{} {:.2f} s", text.empty() ? "" : ", ", level.run.request.variant.name, level.cpu_seconds);
  }
  if (text.empty()) return {};
  return "<p class=\"subtle\">Without time, and so not in the plot: functional (" + html_escaped(text) + ").</p>\n";
}

/// Of the most exact level of each variant.
std::string omitted_effects_section(const AccuracyResult& result) {
  std::vector<const RunResult*> runs;
  for (const FidelityLevel& level : result.fidelity) {
    if (level.run.request.fidelity == fidelities().back() && !level.run.request.sampling && !level.run.effects.empty())
      runs.push_back(&level.run);
  }
  if (runs.empty()) return {};
  return fmt::format(
             "<h2>Effects: what is simulated</h2>\n<p>At {}, with <code>--effects {}</code>. What is not active is "
             "omitted: <b>static</b>, since frame, camera and platform decide beforehand; <b>verified</b>, as nothing "
             "called for it in the run; <b>bounded</b>, as an approximation; or by force.</p>\n",
             vrpipe::name_of(fidelities().back()), html_escaped(result.base.effects.text())) +
         effects_html(runs);
}

std::string precision_section(const AccuracyResult& result) {
  std::string text = "<h2>Precision: how exact numbers are</h2>\n";
  if (const std::string verdict = precision_verdict(result); !verdict.empty()) {
    text += "<p class=\"verdict\">" + html_escaped(verdict) + ".</p>\n";
  }
  text += fmt::format(
      "<p>{} at {} fidelity, with one choice changed at a time. Errors are against an image in double precision: no "
      "tiles, no termination, all bands, exact order, alpha below 1/255 pruned. What lies further left takes the "
      "modelled hardware less time, further up is more exact.</p>\n",
      html_escaped(result.base.variant.name), fidelity_of(result.base));
  if (result.runs.front().run.cycles) {
    text += precision_plot(result) +
            "<p class=\"subtle\">What lies on the default has no label; a point's name shows under the pointer.</p>\n" +
            definition(precision_definition());
  }
  text += word_list(precision_summary(result)) + table(precision_table(result));
  text += "<h3>" + fragments_title() + "</h3>\n" + fragments_plot(result) + table(fragments_table(result));
  if (!result.crossed.empty()) text += "<h3>" + crossed_title() + "</h3>\n" + table(crossed_table(result));
  if (!result.popping.empty()) text += "<h3>" + popping_title() + "</h3>\n" + table(popping_table(result));
  return text;
}

std::string images_section(const AccuracyResult& result) {
  return "<h2>Images and error maps</h2>\n"
         "<p>Left the image, averaged to its size here; right where it is wrong, the largest error of each block of "
         "pixels.</p>\n" +
         error_scale() + figures(result);
}

}  // namespace

std::string accuracy_page(const AccuracyResult& result) {
  const std::vector<std::string> heading = accuracy_heading(result);
  std::string text = page_head("vrpipe accuracy: " + result.scene.name) + "<h1>What accuracy costs in time</h1>\n";
  // Three lines on what was drawn; what follows is to be noticed.
  for (std::size_t i = 0; i < heading.size(); ++i) {
    text += fmt::format("<p class=\"{}\">{}</p>\n", i < 3 ? "subtle" : "notice", html_escaped(heading[i]));
  }

  text += "<h2>Fidelity: how exact time is</h2>\n";
  text += "<p class=\"verdict\">" + html_escaped(fidelity_verdict(result)) + ".</p>\n";
  text += fmt::format(
      "<p>Every variant at every fidelity, one simulation at a time. Errors are against <b>{}</b>; what lies further "
      "left is sooner done, further down more exact.</p>\n",
      html_escaped(most_exact_text(result)));
  text += fidelity_plot(result) + functional_note(result) + definition(fidelity_definition(result)) +
          word_list(fidelity_summary(result)) + table(fidelity_table(result));

  if (!result.stress.empty())
    text += "<h3>" + html_escaped(stress_title(result)) + "</h3>\n" + table(stress_table(result));
  text += word_list(stress_notes(result));

  text += result.precision_left_out.empty()
              ? precision_section(result)
              : "<p class=\"notice\">No precision ladder: " + html_escaped(result.precision_left_out) + ".</p>\n";
  text += omitted_effects_section(result);
  if (result.precision_left_out.empty()) text += images_section(result);
  text += fmt::format(
      "<h2>What made this page</h2>\n<p><code>{}</code></p>\n<p class=\"subtle\">vrpipe {}; {:.0f} s, with {} "
      "simulation{} of the precision ladder at a time, on a host whose load average was {:.1f}.</p>\n",
      html_escaped(command_text(result.provenance)), VRPIPE_VERSION, result.seconds, result.processes,
      result.processes == 1 ? "" : "s", result.provenance.load_average);
  for (const PluginFile& plugin : result.provenance.plugins) {
    text += fmt::format("<p class=\"subtle\">plugin {}, SHA-256 {}</p>\n", html_escaped(plugin.path), plugin.sha256);
  }
  text += "</body>\n</html>\n";
  return text;
}

}  // namespace vrpipe::tools
