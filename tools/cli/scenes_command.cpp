#include <iostream>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/builtin_scenes.h>

#include "cli/command_line.h"
#include "cli/listing.h"
#include "cli/options.h"
#include "cli/scene_listing.h"
#include "host/output_file.h"
#include "host/terminal.h"
#include "output/result_json.h"

namespace vrpipe::tools {
namespace {

Json json_triple(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }
std::string triple(const Vec3& v) { return fmt::format("{},{},{}", v[0], v[1], v[2]); }

class ScenesCommand : public Command {
 public:
  std::string name() const override { return "scenes"; }
  std::string summary() const override {
    return "the built-in scenes and the formats that are read; or what is in a file";
  }

  void declare(CLI::App& app) override {
    app.add_option("FILE", file_, "a file of Gaussians to look into, or builtin:NAME");
    add_option(app, "--preview", preview_, "FILE.png", "draws the scene of FILE, 480x270 pixels", "Where results go");
    app.add_flag("--markdown", markdown_, "prints the formats that are read as a Markdown table")
        ->group("Where results go");
    declare_json(app, json_);
    app.footer(
        "Of a file: how many Gaussians, their SH degree, bounds, how opacities, scales and anisotropies are\n"
        "distributed, and a view that shows them.\n"
        "\n"
        "Examples:\n"
        "  vrpipe scenes\n"
        "  vrpipe scenes point_cloud.ply --preview preview.png\n"
        "  vrpipe scenes folder#lod=2 --json -");
  }

  void run() override {
    const auto preview = single(preview_, "--preview");
    if (!file_.empty()) {
      if (preview && single(json_, "--json"))
        check_files_differ({}, {{"--preview", *preview}, {"--json", *single(json_, "--json")}});
      const SceneListing listing = describe_scene(file_, preview, stdout_style());
      print_listing(listing.json, listing.text, json_);
      return;
    }
    if (preview)
      throw UserError("nothing to draw", "--preview", "no file is named", "give vrpipe scenes FILE --preview FILE.png");
    list();
  }

 private:
  void list() {
    Json list = Json::array();
    std::string text;
    const TextStyle style = stdout_style();
    for (const BuiltinSceneInfo& scene : builtin_scenes()) {
      const std::string full_name = "builtin:" + scene.name;
      const bool is_default = scene.name == kDefaultBuiltinScene;
      list.push_back({{"name", full_name},
                      {"description", scene.description},
                      {"default", is_default},
                      {"width", scene.size.width},
                      {"height", scene.size.height},
                      {"eye", json_triple(scene.view.eye)},
                      {"look_at", json_triple(scene.view.look_at)},
                      {"up", json_triple(scene.view.up)},
                      {"fovy_degrees", scene.view.fovy_degrees}});
      text += fmt::format("{}{}\n  {}\n", style.bold(full_name), is_default ? " (default)" : "", scene.description);
      text += fmt::format("  --size {}x{} --eye {} --look-at {} --up {} --fovy {}\n", scene.size.width,
                          scene.size.height, triple(scene.view.eye), triple(scene.view.look_at), triple(scene.view.up),
                          scene.view.fovy_degrees);
    }
    text += formats_as_text(style);
    text += style.bold("FILE.spl") + "\n  a draw list that --save-draw wrote: its camera and size are part of it\n";
    print_listing({{"schema", "vrpipe.scenes/1"}, {"scenes", std::move(list)}, {"formats", formats_as_json()}}, text,
                  json_);
  }

  std::string file_;
  bool markdown_ = false;
  Values preview_, json_;
};

}  // namespace

std::unique_ptr<Command> make_scenes_command() { return std::make_unique<ScenesCommand>(); }

}  // namespace vrpipe::tools
