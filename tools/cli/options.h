#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/workloads/scene.h>

#include "cli/config_file.h"
#include "cli/time_options.h"
#include "jobs/settings.h"
#include "jobs/simulation_job.h"
#include "jobs/views_job.h"

namespace CLI {
class App;
class FormatterBase;
class Option;
}  // namespace CLI

namespace vrpipe::tools {

/// The texts given for one option, in the order of the command line; empty when it was not given.
using Values = std::vector<std::string>;

/// Adds an option that takes one text. `group` is its heading in --help.
CLI::Option* add_option(CLI::App& app, const std::string& name, Values& values, const std::string& value_name,
                        const std::string& help, const std::string& group);

/// The text of an option that may be given once; none when it was not. Throws UserError.
std::optional<std::string> single(const Values& values, const std::string& option);

/// The same of an option that names a file or folder.
std::optional<std::filesystem::path> single_path(const Values& values, const std::string& option);

std::shared_ptr<CLI::FormatterBase> help_formatter();

/// What a command that simulates frames of its own is asked to do it on.
struct MachineJob {
  Provenance provenance;
  RunRequest request;  ///< of the baseline
  std::optional<std::string> json;
  unsigned processes = 1;
  std::vector<NamedFile> inputs;
};

/// The options that all simulating commands share, as typed.
class SimulationArguments {
 public:
  enum class Variants { one, all };

  void declare(CLI::App& app, Variants variants);
  /// --variant and --platform as often as one likes, and --relative-to, for commands that compare any set of them.
  void declare_comparison(CLI::App& app);
  /// Those that all points of a study share.
  void declare_study(CLI::App& app);
  /// Those alone that say on what and how exactly it is simulated, for commands that draw frames of their own.
  void declare_machine(CLI::App& app);
  /// What these say; as `resolve`.
  MachineJob resolve_machine(const Invocation& invocation) const;
  /// --frame and --multi-pass, for commands that draw frames of several draws as well.
  void declare_frames(CLI::App& app);
  /// --views and --journal, for commands that draw a scene from many cameras as well.
  void declare_views(CLI::App& app);
  /// What these say; none without --views. Throws UserError for options that mean nothing beside them.
  std::optional<ViewsChoice> views() const;
  /// --energy and --energies, for commands that report what each run spends.
  void declare_energy(CLI::App& app);
  /// --interval, --heat-maps and the like, for commands that look at runs in their course; with --trace and --log for one
  /// that has one run.
  void declare_time(CLI::App& app, Variants variants);
  /// --html, for commands that make a page of their runs.
  void declare_page(CLI::App& app);
  /// --explain-effects, for commands that report effects of each run.
  void declare_explanation(CLI::App& app);
  /// Loads the plugins and checks every option but the names of output files, which the commands know. Throws UserError.
  SimulationJob resolve(Variants variants, const Invocation& invocation) const;

 private:
  void declare_scene(CLI::App& app);
  void declare_variant(CLI::App& app);
  void declare_rules(CLI::App& app);
  void declare_platform(CLI::App& app);
  void declare_changes(CLI::App& app);
  void declare_fidelity(CLI::App& app);
  void declare_json(CLI::App& app);
  void declare_jobs(CLI::App& app);
  /// The first platform, fidelity, settings and units.
  RunRequest machine(SettingsByPart& parts, const Invocation& invocation) const;
  std::vector<const Platform*> chosen_platforms() const;
  std::vector<Variant> chosen_variants(Variants variants) const;
  std::vector<RunRequest> requests(const RunRequest& common, Variants variants) const;
  unsigned processes() const;
  SceneRequest scene_request() const;
  FrameDescription frame() const;
  std::vector<NamedFile> inputs(const FrameDescription& frame) const;
  void check_explanation(const EffectChoice& effects) const;
  /// Null if energy is not asked for; throws UserError.
  std::shared_ptr<const EnergyTable> energies(const Platform& platform) const;

  Values meshes_;
  Values scene_, frame_, passes_, size_, camera_, eye_, look_at_, up_, fovy_;
  Values platform_, settings_, variant_, definitions_, units_, plugins_;
  Values fidelity_, effects_, format_, termination_;
  Values views_, journal_, relative_to_;
  bool compares_any_ = false;
  Values background_, output_, json_, html_, save_draw_, jobs_;
  TimeArguments time_;
  Values energies_;
  bool energy_ = false;
  bool explain_effects_ = false;
};

/// `--plugin` for commands that only list things.
void load_plugins(const Values& plugins);

}  // namespace vrpipe::tools
