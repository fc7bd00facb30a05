#include <iostream>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <vrpipe/workloads/builtin_scenes.h>

#include "cli/command_line.h"
#include "cli/listing.h"
#include "cli/options.h"
#include "host/terminal.h"
#include "output/result_json.h"

namespace vrpipe::tools {
namespace {

Json json_triple(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }
std::string triple(const Vec3& v) { return fmt::format("{},{},{}", v[0], v[1], v[2]); }

class ScenesCommand : public Command {
 public:
  std::string name() const override { return "scenes"; }
  std::string summary() const override { return "the built-in scenes, and what else --scene takes"; }

  void declare(CLI::App& app) override {
    declare_json(app, json_);
    app.footer("Example:\n  vrpipe compare --scene builtin:indoor");
  }

  void run() override {
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
    text += style.bold("FILE.ply") +
            "\n  trained Gaussians as the INRIA code writes them, seen from --camera, or from "
            "--eye to --look-at, or\n  from a view that fits the scene\n";
    text += style.bold("FILE.spl") + "\n  a draw list that --save-draw wrote: its camera and size are part of it\n";
    print_listing({{"schema", "vrpipe.scenes/1"}, {"scenes", std::move(list)}}, text, json_);
  }

 private:
  Values json_;
};

}  // namespace

std::unique_ptr<Command> make_scenes_command() { return std::make_unique<ScenesCommand>(); }

}  // namespace vrpipe::tools
