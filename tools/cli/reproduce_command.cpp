#include <filesystem>
#include <iostream>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "cli/command_line.h"
#include "cli/options.h"
#include "cli/parse.h"
#include "cli/print_config.h"
#include "host/output_file.h"
#include "host/process_setup.h"
#include "host/terminal.h"
#include "jobs/reproduce_job.h"
#include "output/json_text.h"
#include "output/reproduce_json.h"
#include "output/reproduce_markdown.h"
#include "output/reproduce_page.h"
#include "output/reproduce_report.h"

namespace vrpipe::tools {
namespace {

/// Of an option that takes NAME=FILE. Throws UserError with an example.
std::pair<std::string, std::string> named_file(const std::string& text, const char* option, const char* why,
                                               const char* example) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == text.size()) {
    throw UserError("bad value '" + text + "'", option, why, std::string("give NAME=FILE, e.g. ") + example);
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// Throws UserError where there is no such file.
std::filesystem::path scene_path(const SceneSubstitution& scene, const std::string& option) {
  std::filesystem::path path = gaussian_file_path(scene.file);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    throw UserError("cannot read scene", option + " " + scene.name + "=" + scene.file, "there is no such file",
                    "name a file of Gaussians");
  }
  return path;
}

class ReproduceCommand : public Command {
 public:
  std::string name() const override { return "reproduce"; }
  std::string summary() const override { return "the paper's numbers beside what is measured here"; }

  void declare(Arguments& arguments) override {
    declare_config(arguments);
    arguments.add_flag("--quick", quick_,
                       "a first answer in less than 3 minutes: everything at lt, two views, and of the\n"
                       "open parameters those that matter most",
                       scene_group);
    arguments.add_option("--scene", scenes_, "NAME=FILE",
                         "a trained model in the place of a scene's stand-in, e.g. train=model.ply;\n"
                         "can be repeated",
                         scene_group);
    arguments.add_option("--beside", beside_, "NAME=FILE",
                         "a scene of your own beside the paper's, e.g. mine=model.ply: in no row,\n"
                         "but wherever variants and settings are compared; can be repeated",
                         scene_group);
    arguments.add_option("--camera", cameras_, "NAME=FILE[#CAMERA]",
                         "cameras of such a model; the views are of this file, too; can be repeated", scene_group);
    declare_undistorted(arguments, undistorted_);
    arguments.add_option("--size", size_, "WxH", "image size of every scene, pixels (default: the paper's)",
                         scene_group);
    arguments.add_option("--views", views_, "N", "views of each scene for early-termination ratios (default: 6)",
                         scene_group);
    arguments.add_option("--rows", rows_, "FILE.toml",
                         "rows of your own in place of the paper's, written like tools/jobs/paper_rows.toml",
                         scene_group);
    arguments.add_option("--platform", platform_, "NAME", "the GPU (default: " + platforms().front().name + ")",
                         machine_group);
    arguments.add_option("--set", settings_, "UNIT.PARAMETER=VALUE",
                         "changes a parameter of every simulation; can be repeated", machine_group);
    declare_units(arguments, units_, plugins_);
    arguments.add_option("--fidelity", fidelity_, "NAME",
                         "of the main comparison: lt or cycle (default: cycle, with --quick lt); the\n"
                         "sensitivity is always at lt",
                         machine_group);
    arguments.find("--size")->check = [](const std::string& text) { parse_size(text, "--size"); };
    arguments.find("--views")->check = [](const std::string& text) { parse_count(text, "--views", most_views); };
    arguments.find("--platform")->check = [](const std::string& text) { platform_named(text); };
    arguments.find("--fidelity")->check = [](const std::string& text) { fidelity_named(text); };
    arguments.add_option("--output", output_, "DIR",
                         "writes the heat maps of fragments as PNG there; created if missing", result_group);
    declare_result_json(arguments, json_);
    arguments.add_option("--html", html_, "FILE", "writes a page with plots and heat maps; it needs no network",
                         result_group);
    arguments.add_option("--markdown", markdown_, "FILE", "writes the page of the documentation", result_group);
    arguments.add_option(ReproduceJob::journal_option, journal_, "FILE",
                         "where is stored what is done, to go on from after an interruption; it stays\n"
                         "(default: a file in the user's cache folder, removed at the end, or by a later\n"
                         "study when it was left alone for 30 days)",
                         result_group);
    declare_jobs(arguments, jobs_);
    arguments.set_footer(
        "Every number and statement of the paper, R1 to R32 and C1 to C13, with what is measured here, the\n"
        "difference, and, of those that could have failed, whether they agree; early-termination ratios over\n"
        "views, utilisation, large scenes, heat maps, and how far the speed-ups move with what the paper leaves\n"
        "open. Takes half an hour on two processors. Interrupted, the same command goes on where it was.\n"
        "\n"
        "Examples:\n"
        "  vrpipe reproduce --quick\n"
        "  vrpipe reproduce --html reproduction.html --output maps\n"
        "  vrpipe reproduce --scene train=train/point_cloud.ply --camera train=train/cameras.json\n"
        "  vrpipe reproduce --beside mine=model.ply\n"
        "  vrpipe reproduce --quick --set raster.screen_tile_interval_cycles=2");
  }

  void run() override {
    const ReproduceJob job = resolve();
    if (prints_config(invocation())) {
      std::cout << config_text(invocation(), {job.options.base}, {});
      return;
    }
    ProgressLine progress;
    const ReproduceResult result = simulate_reproduction(job, progress);
    const Reproduction reproduction = reproduction_of(result);
    ResultFiles files;
    write_files(job, reproduction, files);
    if (job.json) {
      const std::string text = json_text(reproduction_json(reproduction));
      if (*job.json == "-") {
        std::cout << text;
      } else {
        files.write(*job.json, text, "--json");
      }
    }
    if (job.json != "-") print(job, reproduction, files);
    files.check();
    // Not before all of it is safe.
    std::cout.flush();
    if (std::cout) result.journal->finish();
  }

 private:
  ReproduceJob resolve() const {
    load_plugins(plugins_);
    invocation().check_overridden();
    ReproduceJob job;
    job.provenance = make_provenance(invocation().words, plugins_);
    for (const std::string& plugin : plugins_) job.inputs.push_back({"--plugin", plugin});
    note_config(invocation(), job.provenance);
    job.options.quick = quick_;
    job.options.substitutions = scenes_;
    for (const SceneSubstitution& file : scene_substitutions(scenes_, "--scene")) {
      job.inputs.push_back({"--scene", scene_path(file, "--scene")});
    }
    for (const std::string& text : beside_) {
      auto [name, file] = named_file(text, "--beside", "it does not say what to call it", "mine=model.ply");
      job.options.beside.push_back({std::move(name), std::move(file)});
      job.inputs.push_back({"--beside", scene_path(job.options.beside.back(), "--beside")});
    }
    if (const auto file = single_path(rows_, "--rows")) {
      job.options.rows = read_rows(*file);
      job.inputs.push_back({"--rows", *file});
    }
    job.options.lenses = lenses_of(undistorted_, cameras_);
    for (const std::string& text : cameras_) {
      job.options.cameras.push_back(
          named_file(text, "--camera", "it does not say of which scene it is", "train=cameras.json#3"));
      const std::string& camera = job.options.cameras.back().second;
      static_cast<void>(camera_from_file(camera, std::nullopt, job.options.lenses));
      for (const auto& file : camera_files(camera_choice(camera).file)) job.inputs.push_back({"--camera", file});
    }
    if (const auto text = single(size_, "--size")) job.size = parse_size(*text, "--size");
    if (const auto text = single(views_, "--views")) job.options.views = parse_count(*text, "--views", most_views);
    RunRequest& base = job.options.base;
    const auto platform = single(platform_, "--platform");
    base.platform = platform ? &platform_named(*platform) : &platforms().front();
    base.variant = variant_named("het+qm");
    if (const auto name = single(fidelity_, "--fidelity")) {
      job.options.fidelity = fidelity_named(*name);
      if (*job.options.fidelity < Fidelity::lt) {
        throw UserError("bad value '" + *name + "'", "--fidelity", "speed-ups need the time of every unit",
                        "give lt or cycle");
      }
    }
    base.settings = parse_settings(settings_);
    base.units = parse_unit_choices(units_);
    check_configuration(base);
    job.json = single(json_, "--json");
    job.html = single_path(html_, "--html");
    job.markdown = single_path(markdown_, "--markdown");
    job.output = single_path(output_, "--output");
    job.journal = single_path(journal_, ReproduceJob::journal_option);
    job.processes = processes(jobs_);
    return job;
  }

  static void write_files(const ReproduceJob& job, const Reproduction& of, ResultFiles& files) {
    if (job.html) files.write(*job.html, reproduction_page(of), "--html");
    if (job.markdown) files.write(*job.markdown, reproduction_markdown(of), "--markdown");
    if (!job.output) return;
    for (const SceneFinding& scene : of.findings.scenes) {
      for (const PointResult* point : {scene.map_without, scene.map_with}) {
        const std::string file =
            "fragments-" + of.result.plan.scenes[scene.scene].name + "-" + point->run.request.variant.name + ".png";
        files.write(*job.output / file, point->map->png, "--output");
      }
    }
  }

  static void print(const ReproduceJob& job, const Reproduction& of, const ResultFiles& files) {
    std::cout << reproduction_text(of, stdout_style());
    const ReproduceResult& result = of.result;
    std::cout << fmt::format("\ntook {:.0f} s, {:.0f} s of processor time, to simulate {} in {} process{}",
                             result.seconds, result.cpu_seconds, result.points.size() - result.done_before,
                             result.processes, result.processes == 1 ? "" : "es at a time");
    if (result.done_before > 0) std::cout << fmt::format("; {} were done before", result.done_before);
    std::cout << '\n';
    if (files.has("--json")) std::cout << "result: " << printable(*job.json) << '\n';
    if (files.has("--html")) std::cout << "page: " << printable(job.html->string()) << '\n';
    if (files.has("--markdown")) std::cout << "documentation: " << printable(job.markdown->string()) << '\n';
    if (files.has("--output")) std::cout << "heat maps: " << printable(job.output->string()) << '\n';
  }

  Values scenes_, beside_, cameras_, size_, views_, rows_, platform_, settings_, units_, plugins_, fidelity_;
  Values output_, json_, html_, markdown_, journal_, jobs_;
  bool quick_ = false, undistorted_ = false;
};

}  // namespace

std::unique_ptr<Command> make_reproduce_command() { return std::make_unique<ReproduceCommand>(); }

}  // namespace vrpipe::tools
