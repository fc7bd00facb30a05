#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/scene.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "cli/command_line.h"
#include "cli/listing.h"
#include "cli/options.h"
#include "cli/scene_listing.h"
#include "host/output_file.h"
#include "host/progress_line.h"
#include "host/terminal.h"
#include "jobs/scene_measurement.h"
#include "output/report.h"
#include "output/result_json.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

std::string exact_triple(const Vec3& v) { return fmt::format("{},{},{}", v[0], v[1], v[2]); }

class ScenesCommand : public Command {
 public:
  std::string name() const override { return "scenes"; }
  std::string summary() const override {
    return "the built-in scenes and the formats that are read; or what is in a file";
  }

  void declare(Arguments& arguments) override {
    arguments.add_positional("FILE", file_, "a file of Gaussians to look into, or builtin:NAME");
    arguments.add_flag("--measure", measure_,
                       "instead of the list, a table of what each scene asks of the pipeline:\n"
                       "fragments per pixel, sizes of splats, early-termination ratio; takes a few\n"
                       "minutes for all",
                       other_group);
    arguments.add_option("--scene", scenes_, "NAME|NAME=FILE",
                         "with --measure: this built-in scene alone, or FILE in its place; can be\n"
                         "repeated",
                         "What is measured");
    arguments.add_option("--preview", preview_, "FILE.png", "draws the scene of FILE, 480x270 pixels", result_group);
    arguments.add_flag("--markdown", markdown_, "prints the formats that are read as a Markdown table", result_group);
    declare_json(arguments, json_, "list");
    arguments.set_footer(
        "Of a file: how many Gaussians, their SH degree, bounds, how opacities, scales and anisotropies are\n"
        "distributed, and a view that shows them.\n"
        "\n"
        "Examples:\n"
        "  vrpipe scenes\n"
        "  vrpipe scenes point_cloud.ply --preview preview.png\n"
        "  vrpipe scenes folder#lod=2 --json -\n"
        "  vrpipe scenes --measure --scene train --scene truck\n"
        "  vrpipe scenes --measure --scene train=train/point_cloud.ply\n"
        "  vrpipe compare --scene builtin:indoor");
  }

  void run() override {
    if (!measure_ && !scenes_.empty()) {
      throw UserError("cannot use option", "--scene", "the list has all scenes", "add --measure, or leave it out");
    }
    if (measure_ + markdown_ + !file_.empty() > 1) {
      throw UserError("cannot do both", measure_ ? "--measure" : "--markdown",
                      "FILE, --measure and --markdown are different things to print", "give one of them");
    }
    check_one_form("--markdown", markdown_, json_);
    const auto preview = single(preview_, "--preview");
    if (preview && std::filesystem::path(*preview).extension() != ".png") {
      throw UserError("cannot draw a preview", "--preview " + *preview,
                      "it is a PNG, and the file's name says otherwise", "name it ....png");
    }
    if (preview && file_.empty()) {
      throw UserError("nothing to draw", "--preview", "no file is named", "give vrpipe scenes FILE --preview FILE.png");
    }
    if (measure_) return measure();
    if (!file_.empty()) return describe(preview);
    if (markdown_) {
      std::cout << formats_as_markdown();
      return;
    }
    list();
  }

 private:
  void describe(const std::optional<std::string>& preview) {
    const auto json = single(json_, "--json");
    if (preview && json) check_files_differ({}, {{"--preview", *preview}, {"--json", *json}});
    const SceneListing listing = describe_scene(file_, preview, stdout_style());
    print_listing(listing.json, listing.text, json_);
  }

  /// SceneRequest::scene of each scene to measure.
  std::vector<std::string> wanted() const {
    std::vector<std::string> names, replaced, result;
    for (const std::string& text : scenes_) {
      const auto in_place = scene_substitution(text);
      if (in_place) replaced.push_back(text);
      names.push_back(in_place ? in_place->name : builtin_scene_named(builtin_name_of(text).value_or(text)).name);
      if (std::count(names.begin(), names.end(), names.back()) > 1) {
        throw UserError("option given twice", "--scene " + names.back(), "a scene is measured once", "give it once");
      }
    }
    const auto substitutions = scene_substitutions(replaced, "--scene");
    for (const std::string& name : names.empty() ? builtin_scene_names() : names) {
      result.push_back(scene_in_place(name, substitutions));
    }
    return result;
  }

  void measure() {
    const std::vector<std::string> scenes = wanted();
    Json list = Json::array();
    TextTable table(
        {"scene", "size", "Gaussians", "visible", "rasterised", "blended", "median", "90 %", "quads, M", "ET ratio"});
    ProgressLine progress;
    for (const std::string& scene : scenes) {
      progress.show("measuring " + scene_name(scene));
      const SceneMeasurement m = measure_scene(scene);
      const double rasterized = static_cast<double>(m.fragments_rasterized) / m.pixels();
      const double blended = static_cast<double>(m.fragments_blended) / m.pixels();
      const double ratio = m.early_termination_ratio();
      list.push_back({{"name", m.name},
                      {"width", m.width},
                      {"height", m.height},
                      {"gaussians_total", m.gaussians_total},
                      {"gaussians_visible", m.gaussians_visible},
                      {"fragments_rasterized", m.fragments_rasterized},
                      {"fragments_blended", m.fragments_blended},
                      {"fragments_blended_with_termination", m.fragments_remaining},
                      {"quads_rasterized", m.quads_rasterized},
                      {"fragments_rasterized_per_pixel", rasterized},
                      {"fragments_blended_per_pixel", blended},
                      {"splat_side_median_pixels", m.side_median},
                      {"splat_side_90_percent_pixels", m.side_ninth_decile},
                      {"early_termination_ratio", ratio > 0 ? Json(ratio) : Json()},
                      {"load_seconds", m.load_seconds}});
      table.row({m.name, fmt::format("{}x{}", m.width, m.height), grouped(m.gaussians_total),
                 grouped(m.gaussians_visible), fmt::format("{:.1f}", rasterized), fmt::format("{:.1f}", blended),
                 fmt::format("{:.1f}", m.side_median), fmt::format("{:.1f}", m.side_ninth_decile),
                 fmt::format("{:.2f}", static_cast<double>(m.quads_rasterized) / 1e6),
                 ratio > 0 ? fmt::format("{:.2f}", ratio) : "n/a"});
    }
    progress.erase();
    std::string text = table.text(stdout_style());
    text +=
        "\nrasterised, blended: fragments per pixel of the image, without early termination\n"
        "median, 90 %: side of a square as large as a splat's box, pixels, that so many of the visible splats do not "
        "exceed\n"
        "ET ratio: fragments blended without over with early termination (strict)\n";
    print_listing({{"schema", "vrpipe.scene_measurements/1"}, {"scenes", std::move(list)}}, text, json_);
  }

  void list() {
    Json list = Json::array();
    std::string text;
    const TextStyle style = stdout_style();
    for (const BuiltinSceneInfo& scene : builtin_scenes()) {
      const std::string full_name = builtin_prefix + scene.name;
      const bool is_default = scene.name == kDefaultBuiltinScene;
      Json paper;
      if (scene.stands_for) {
        paper = {{"name", scene.stands_for->name},
                 {"dataset", scene.stands_for->dataset},
                 {"kind", scene.stands_for->kind},
                 {"gaussians", scene.stands_for->gaussians}};
      }
      list.push_back({{"name", full_name},
                      {"description", scene.description},
                      {"default", is_default},
                      {"width", scene.size.width},
                      {"height", scene.size.height},
                      {"eye", json_triple(scene.view.eye)},
                      {"look_at", json_triple(scene.view.look_at)},
                      {"up", json_triple(scene.view.up)},
                      {"fovy_degrees", scene.view.fovy_degrees},
                      {"stands_for", std::move(paper)}});
      text += fmt::format("{}{}\n  {}\n", style.bold(full_name), is_default ? " (default)" : "", scene.description);
      if (scene.stands_for) {
        const PaperScene& of_paper = *scene.stands_for;
        text += fmt::format("  stands in for the paper's {} ({}, {}), {} Gaussians as there\n", of_paper.name,
                            of_paper.dataset, of_paper.kind, grouped(of_paper.gaussians));
      }
      text += fmt::format("  --size {}x{} --eye {} --look-at {} --up {} --fovy {}\n", scene.size.width,
                          scene.size.height, exact_triple(scene.view.eye), exact_triple(scene.view.look_at),
                          exact_triple(scene.view.up), scene.view.fovy_degrees);
    }
    text += formats_as_text(style);
    text += style.bold("FILE.spl") + "\n  a draw list that --save-draw wrote: its camera and size are part of it\n";
    text += style.bold("NAME=FILE") +
            "\n  a file in the place of a built-in scene, as train=point_cloud.ply: with the scene's size, and a "
            "camera or\n"
            "  view as a file has them\n";
    print_listing({{"schema", "vrpipe.scenes/1"}, {"scenes", std::move(list)}, {"formats", formats_as_json()}}, text,
                  json_);
  }

  std::string file_;
  bool measure_ = false, markdown_ = false;
  Values scenes_, preview_, json_;
};

}  // namespace

std::unique_ptr<Command> make_scenes_command() { return std::make_unique<ScenesCommand>(); }

}  // namespace vrpipe::tools
