#include "cli/scene_listing.h"

#include <array>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/workloads/scene.h>
#include <vrpipe/workloads/scene_description.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "cli/listing.h"
#include "host/output_file.h"
#include "host/progress_line.h"
#include "image/images.h"
#include "jobs/loaded_frame.h"
#include "jobs/processes.h"
#include "output/report.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

constexpr ImageSize kPreviewSize{480, 270};

/// In as many digits as read back to the same numbers.
template <class Triple>
std::string triple(const Triple& v) {
  return fmt::format("{},{},{}", v[0], v[1], v[2]);
}

struct DescribedDistribution {
  const char* name;
  const char* meaning;
  const DescribedQuantiles& quantiles;
};

std::array<DescribedDistribution, 3> distributions(const SceneDescription& description) {
  return {{{"opacity", "0 to 1", description.opacity},
           {"scale", "longest axis, one sigma, world units", description.scale},
           {"anisotropy", "longest axis over shortest", description.anisotropy}}};
}

std::string description_as_text(const SceneDescription& d) {
  std::string text = fmt::format("  positions     {} to {}\n", triple(d.low), triple(d.high));
  text +=
      fmt::format("  98 % of them  {} to {}, each coordinate apart\n\n", triple(d.low_middle), triple(d.high_middle));
  std::vector<std::string> heading = {""};
  for (const unsigned percent : kDescribedPercents) {
    heading.push_back(percent == 0 ? "least" : percent == 100 ? "greatest" : fmt::format("{} %", percent));
  }
  heading.push_back("");
  TextTable table(heading);
  table.left(heading.size() - 1);
  for (const DescribedDistribution& each : distributions(d)) {
    std::vector<std::string> row = {each.name};
    for (const double value : each.quantiles) row.push_back(fmt::format("{:.3g}", value));
    row.push_back(each.meaning);
    table.row(row);
  }
  return text + table.text({});
}

Json description_as_json(const SceneDescription& d) {
  Json json = {{"bounds", {{"low", d.low}, {"high", d.high}}},
               {"bounds_98_percent", {{"low", d.low_middle}, {"high", d.high_middle}}},
               {"percents", kDescribedPercents}};
  for (const DescribedDistribution& each : distributions(d)) json[each.name] = each.quantiles;
  return json;
}

/// The scene from its view, without time and in the widest format.
void draw_preview(const std::string& scene, GaussianFile&& file, const View& view, const std::string& png) {
  OpenedScene opened;
  opened.name = scene_name(scene);
  opened.gaussians = std::move(file.gaussians);
  opened.viewpoint = {look_at(view, kPreviewSize), view, {}};
  LoadedScene loaded = preprocess_scene(opened, {});
  opened = {};
  LoadedFrame frame;
  frame.width = kPreviewSize.width;
  frame.height = kPreviewSize.height;
  frame.geometry = {std::make_shared<const Draw>(std::move(loaded.draw))};
  frame.meshes.emplace_back();
  RunRequest request;
  request.platform = &platforms().front();
  request.variant = variant_named("baseline");
  request.fidelity = fidelity_named("functional");
  request.format = color_format_named("rgba32f");
  ProgressLine progress;
  const Simulated drawn = simulate_here(request, *make_frame(request, frame_of_scene(scene), frame), true, progress);
  write_output_file(png, encode_png(*drawn.image, {0, 0, 0}), "--preview");
}

}  // namespace

SceneListing describe_scene(const std::string& scene, const std::optional<std::string>& preview,
                            const TextStyle& style) {
  if (preview) {
    check_output_file(*preview, "--preview");
    check_files_differ({{"FILE", gaussian_file_path(scene_file(scene))}}, {{"--preview", *preview}});
  }
  GaussianFile file = open_gaussians(scene);
  const SceneDescription description = describe(file.gaussians);
  const std::string name = scene_name(scene);
  SceneListing listing;
  listing.text = style.bold(printable(name)) + "  " + file.format + "\n";
  listing.text += fmt::format("  {} Gaussians, SH degree {}\n", grouped(description.count), file.gaussians.sh_degree());
  listing.json = {{"schema", "vrpipe.scene/1"},
                  {"name", name},
                  {"format", file.format},
                  {"gaussians", description.count},
                  {"sh_degree", file.gaussians.sh_degree()},
                  {"rejected",
                   {{"not_finite", description.rejected.not_finite},
                    {"zero_quaternion", description.rejected.zero_quaternion}}},
                  {"notes", file.notes},
                  {"description", nullptr},
                  {"view", nullptr}};
  if (description.rejected.total() > 0) {
    listing.text +=
        fmt::format("  {} of them cannot be drawn: {} with a NaN or infinite value, {} without an orientation\n",
                    grouped(description.rejected.total()), grouped(description.rejected.not_finite),
                    grouped(description.rejected.zero_quaternion));
  }
  for (const std::string& note : file.notes) listing.text += "  note: " + printable(note) + "\n";
  if (description.count == description.rejected.total()) {
    if (preview)
      throw UserError("cannot draw the scene", scene, "no Gaussian of it can be drawn", "leave out --preview");
    return listing;
  }
  listing.text += description_as_text(description);
  listing.json["description"] = description_as_json(description);
  std::optional<View> view;
  try {
    view = view_of(scene, file);
  } catch (const UserError& error) {
    if (preview) throw;
    listing.text += std::string("\n  no view: ") + printable(error.what()) + "\n";
  }
  if (!view) return listing;
  listing.text += fmt::format("\n  seen with --eye {} --look-at {} --up {} --fovy {}\n", triple(view->eye),
                              triple(view->look_at), triple(view->up), view->fovy_degrees);
  listing.json["view"] = {{"eye", json_triple(view->eye)},
                          {"look_at", json_triple(view->look_at)},
                          {"up", json_triple(view->up)},
                          {"fovy_degrees", view->fovy_degrees}};
  if (preview) {
    draw_preview(scene, std::move(file), *view, *preview);
    listing.text += fmt::format("  preview: {}\n", printable(*preview));
    listing.json["preview"] = *preview;
  }
  return listing;
}

std::string formats_as_text(const TextStyle& style) {
  std::string text;
  for (const GaussianFormat& format : gaussian_formats()) {
    text += fmt::format("{}\n  {}: {}{}\n", style.bold(format.files), format.name, format.meaning,
                        format.is_written ? "; `vrpipe convert` writes it" : "");
    for (const FormatChoice& choice : format.choices)
      text += fmt::format("  #{}=VALUE  {}\n", choice.key, choice.meaning);
  }
  return text;
}

std::string formats_as_markdown() {
  std::string text = "| file | format | what it holds | `#KEY=VALUE` | written |\n|---|---|---|---|---|\n";
  for (const GaussianFormat& format : gaussian_formats()) {
    std::string choices;
    for (const FormatChoice& choice : format.choices) {
      choices += fmt::format("{}`{}`: {}", choices.empty() ? "" : "; ", choice.key, markdown_escaped(choice.meaning));
    }
    text += fmt::format("| {} | {} | {} | {} | {} |\n", format.files, format.name, markdown_escaped(format.meaning),
                        choices, format.is_written ? "yes" : "");
  }
  return text;
}

Json formats_as_json() {
  Json list = Json::array();
  for (const GaussianFormat& format : gaussian_formats()) {
    Json choices = Json::object();
    for (const FormatChoice& choice : format.choices) choices[choice.key] = choice.meaning;
    list.push_back({{"name", format.name},
                    {"files", format.files},
                    {"meaning", format.meaning},
                    {"choices", std::move(choices)},
                    {"is_written", format.is_written}});
  }
  return list;
}

}  // namespace vrpipe::tools
