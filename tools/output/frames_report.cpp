#include "output/frames_report.h"

#include <algorithm>
#include <cstdint>
#include <optional>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>

#include "jobs/paper_rows.h"
#include "output/energy_report.h"
#include "output/machines_text.h"
#include "output/report.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

std::string milliseconds_text(const std::optional<double>& value) {
  return value ? fmt::format("{:.3f}", *value) : "-";
}

/// Of lanes in all iterations of warps.
std::string lanes_text(const FramePath& software) {
  const std::uint64_t iterations = software.count("warp_iterations").value_or(0);
  if (iterations == 0) return "";
  const auto percent = [&](const char* name, double of) {
    return fmt::format("{:.1f} %", 100 * static_cast<double>(software.count(name).value_or(0)) / of);
  };
  const double lanes = 32 * static_cast<double>(iterations);
  return fmt::format(
      "software: {} pairs, {} warp iterations; of their lanes {} blend, {} are pruned, {} are dead beside a living\n"
      "one, {} stop; in {} of the iterations no lane blends\n",
      grouped(software.count("pairs").value_or(0)), grouped(iterations), percent("lanes_blending", lanes),
      percent("lanes_pruned", lanes), percent("lanes_dead", lanes), percent("lanes_stopping", lanes),
      percent("iterations_without_blending", static_cast<double>(iterations)));
}

/// Of the list entries of an accelerator, and what was published of it.
std::string entries_text(const FramePath& accelerator) {
  const auto count = [&](const char* name) { return grouped(accelerator.count(name).value_or(0)); };
  const auto published = [&](const char* name) {
    const auto found = std::find_if(accelerator.parameters.begin(), accelerator.parameters.end(),
                                    [&](const auto& each) { return each.first == name; });
    return found == accelerator.parameters.end() || found->second == "0" ? "" : found->second;
  };
  std::string text =
      fmt::format("accelerator: {} pairs; of {} with sub-tiles {} are drawn; {} of {} chunks are skipped\n",
                  count("pairs"), count("subtile_pairs"), count("subtile_pairs_drawn"), count("chunks_skipped"),
                  count("chunks"));
  const std::string area = published("accelerator.area_mm2"), power = published("accelerator.power_watts");
  if (!area.empty()) text += fmt::format("published: {} mm2{}\n", area, power.empty() ? "" : ", " + power + " W");
  return text;
}

std::string imitation_text(const ImitationReport& imitation) {
  std::string text = fmt::format(
      "imitation: {:.1f} % of the quads issue a merge, {:.1f} % of those left are discarded; {} pixels end at fragment "
      "255\n",
      100 * imitation.paired_quads, 100 * imitation.discarded_quads, grouped(imitation.pixels_short));
  if (!imitation.efficiency) return text;
  return text +
         fmt::format(
             "its draw's energy efficiency over hardware {:.2f}x ({:.2f} to {:.2f}); the paper measured {} (R12)\n",
             imitation.efficiency->nominal, imitation.efficiency->low, imitation.efficiency->high,
             paper_row("R12").says);
}

/// Of what millijoules are, or why there are none.
std::string energy_notes(const FramesResult& result) {
  const auto is_known = [](const FramePath& path) { return path.path != "accelerator" && path.energy.frame; };
  const bool any = std::any_of(result.paths.begin(), result.paths.end(), is_known);
  if (!any) return "mJ of the GPU are not known: without time, without its figures, or of units that do not count\n";
  std::string text = fmt::format("mJ at {}", printable(result.process));
  if (!result.energy_leaves_out.empty()) text += "; not in them: " + printable(result.energy_leaves_out);
  return text + " (docs/energy.md)\n";
}

/// Nothing where no path has any.
std::string energies_text(const FramesResult& result, const TextStyle& style) {
  TextTable table({"millijoules", "preprocess", "sort", "raster", "frame", "low to high", "hardware is 1"});
  const auto nominal = [](const std::optional<Range>& range) { return range ? three_digits(range->nominal) : "-"; };
  bool has_any = false;
  for (const FramePath& path : result.paths) {
    const FrameEnergy& energy = path.energy;
    has_any = has_any || energy.frame;
    table.row({printable(path.label()), nominal(energy.preprocess), nominal(energy.sort), nominal(energy.raster),
               nominal(energy.frame), energy.frame ? between(*energy.frame) : "-",
               energy.over_hardware ? fmt::format("{:.2f}x", energy.over_hardware->nominal) : "-"});
  }
  return has_any ? table.text(style) + "\n" : "";
}

}  // namespace

std::string frames_report(const FramesResult& result, const TextStyle& style) {
  std::string text = fmt::format("{}: {} splats, {}x{}\n", style.bold(printable(result.scene.name)),
                                 grouped(result.scene.gaussians_visible), result.width, result.height);
  text += machine_text(result.runs.front().request, style) + "\n";
  TextTable table(
      {"milliseconds", "preprocess", "sort", "raster", "frame", "hardware is 1", "in flight", "off by, %", "bound by"});
  table.left(8);
  const auto hardware = std::find_if(result.paths.begin(), result.paths.end(),
                                     [](const FramePath& path) { return path.path == "hardware"; });
  for (const FramePath& path : result.paths) {
    const bool is_timed = path.frame && hardware->frame && *hardware->frame > 0;
    table.row({printable(path.label()), milliseconds_text(path.preprocess), milliseconds_text(path.sort),
               milliseconds_text(path.raster), milliseconds_text(path.frame),
               is_timed ? fmt::format("{:.2f}x", *path.frame / *hardware->frame) : "-",
               milliseconds_text(path.interval),
               path.expected_error_percent ? fmt::format("{:g}", *path.expected_error_percent) : "-",
               path.bound_by.empty() ? "-" : printable(path.bound_by)});
  }
  if (hardware->frame) {
    text += table.text(style) + "\n";
  } else {
    text += fmt::format("{} has no time: nothing is told of how long frames take\n\n",
                        vrpipe::name_of(result.runs.front().request.fidelity));
  }
  text += energies_text(result, style);
  if (hardware->frame)
    text +=
        "in flight: the least from frame to frame, the next prepared beside the draw of this one, as the SM array, "
        "the\n"
        "memory and the graphics pipeline allow; off by: at most, where there is something measured to hold it to\n";
  for (const FramePath& path : result.paths) {
    if (path.path == "software") text += lanes_text(path);
    if (path.path == "accelerator") text += entries_text(path);
    if (path.path == "imitation") text += imitation_text(*result.imitation);
    if (path.fidelity != result.runs.front().request.fidelity)
      text += fmt::format("{}: at {}, the finest that it has\n", path.path, vrpipe::name_of(path.fidelity));
  }
  text += energy_notes(result);
  if (!result.viewpoint) text += "a draw list is preprocessed already: frames are without\n";
  for (const std::string& note : result.scene.notes) text += "note: " + printable(note) + "\n";
  return text;
}

std::string frames_report(const FrameViewsResult& result, const TextStyle& style) {
  const FramesResult& first = result.views.front();
  std::string text = style.bold(fmt::format("{}, {} views", printable(first.scene.name), result.views.size()));
  text += result.camera_file ? fmt::format(", of {} cameras in {}\n", result.cameras, printable(*result.camera_file))
                             : std::string(" round the scene\n");
  text += machine_text(first.runs.front().request, style) + "\n";
  TextTable table({"frame, milliseconds", "least", "median", "most", "hardware is 1: least", "median", "most",
                   "in view least, most"});
  for (std::size_t i = 0; i < first.paths.size(); ++i) {
    const FramePath& path = first.paths[i];
    const std::optional<Distribution> frame = frame_distribution(result, i),
                                      over = over_hardware_distribution(result, i);
    std::vector<std::string> cells{printable(path.label())};
    for (const double Distribution::*value : {&Distribution::minimum, &Distribution::median, &Distribution::maximum})
      cells.push_back(frame ? milliseconds_text(*frame.*value) : "-");
    for (const double Distribution::*value : {&Distribution::minimum, &Distribution::median, &Distribution::maximum})
      cells.push_back(over ? fmt::format("{:.2f}x", *over.*value) : "-");
    cells.push_back(over ? fmt::format("{}, {}", result.indices[over->least], result.indices[over->most]) : "-");
    table.row(std::move(cells));
  }
  return text + table.text(style);
}

}  // namespace vrpipe::tools
