#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/workloads/scene.h>

#include "cli/arguments.h"
#include "cli/config_file.h"
#include "cli/time_options.h"
#include "jobs/settings.h"
#include "jobs/simulation_job.h"
#include "jobs/views_job.h"

namespace vrpipe::tools {

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

  void declare(Arguments& arguments, Variants variants);
  /// --variant as often as one likes.
  void declare_variants(Arguments& arguments);
  /// The same, --platform, and --relative-to, for commands that compare any set of them.
  void declare_comparison(Arguments& arguments);
  /// Those that all points of a study share.
  void declare_study(Arguments& arguments);
  /// Those alone that say on what and how exactly it is simulated, for commands that draw frames of their own.
  void declare_machine(Arguments& arguments);
  /// What these say; as `resolve`. `platform`: where --platform is not given; null: the first.
  MachineJob resolve_machine(const Invocation& invocation, const Platform* platform = nullptr) const;
  /// Those of a command that draws a scene in software as well, with kernels that it may name and set.
  void declare_whole_frames(Arguments& arguments);
  /// --error and --seed, for commands that may simulate a part of the frame alone.
  void declare_error(Arguments& arguments);
  /// --frame and --multi-pass, for commands that draw frames of several draws as well.
  void declare_frames(Arguments& arguments);
  /// --views and --journal, for commands that draw a scene from many cameras as well.
  void declare_views(Arguments& arguments);
  /// What these say; none without --views. Throws UserError for options that mean nothing beside them.
  std::optional<ViewsChoice> views() const;
  /// --energy and --energies, for commands that report what each run spends.
  void declare_energy(Arguments& arguments);
  /// --interval, --heat-maps and the like, for commands that look at runs in their course; with --trace and --log for one
  /// that has one run.
  void declare_time(Arguments& arguments, Variants variants);
  /// --html, for commands that make a page of their runs.
  void declare_page(Arguments& arguments);
  /// --explain-effects, for commands that report effects of each run.
  void declare_explanation(Arguments& arguments);
  /// Loads the plugins and checks every option but the names of output files, which the commands know. Throws UserError.
  /// @param of_study  names of those that a study draws with, in the place of the only one
  SimulationJob resolve(Variants variants, const Invocation& invocation,
                        const std::vector<std::string>& of_study = {}) const;

 private:
  void declare_scene(Arguments& arguments);
  void declare_variant(Arguments& arguments);
  void declare_rules(Arguments& arguments);
  void declare_images(Arguments& arguments);
  void declare_platform(Arguments& arguments);
  void declare_changes(Arguments& arguments);
  void declare_fidelity(Arguments& arguments);
  /// The first platform, fidelity, settings and units.
  RunRequest machine(SettingsByPart& parts, const Invocation& invocation, const Platform* platform = nullptr) const;
  std::vector<const Platform*> chosen_platforms() const;
  std::vector<Variant> chosen_variants(Variants variants) const;
  std::vector<RunRequest> requests(const RunRequest& common, Variants variants) const;
  SceneRequest scene_request() const;
  FrameDescription frame() const;
  std::vector<NamedFile> inputs(const FrameDescription& frame) const;
  static std::vector<Variant> variants_drawn_by(const SimulationJob& job, const std::vector<std::string>& of_study);
  void check_outside(const SimulationJob& job, const std::vector<Variant>& variants,
                     const Invocation& invocation) const;
  void check_explanation(const EffectChoice& effects) const;
  void choose_error(RunRequest& request) const;
  /// Null if energy is not asked for; throws UserError.
  std::shared_ptr<const EnergyTable> energies(const Platform& platform) const;

  Values meshes_;
  Values scene_, frame_, draws_, passes_, size_, camera_, eye_, look_at_, up_, fovy_, orthographic_;
  Values platform_, settings_, variant_, definitions_, units_, plugins_;
  Values fidelity_, error_, seed_, effects_, format_, termination_;
  Values views_, journal_, relative_to_;
  bool compares_any_ = false;
  bool takes_kernels_ = false;
  bool imitation_ = false;
  Values background_, output_, json_, html_, save_draw_, jobs_;
  TimeArguments time_;
  Values energies_;
  bool energy_ = false;
  bool no_scene_cache_ = false;
  bool undistorted_ = false;
  bool explain_effects_ = false;
};

/// The most that --views takes.
constexpr unsigned most_views = 100'000;

/// --json, for the result of simulations.
void declare_result_json(Arguments& arguments, Values& json);
/// --undistorted, of the cameras of --camera.
void declare_undistorted(Arguments& arguments, bool& undistorted);
/// What these say together. Throws UserError when there are no cameras.
Lenses lenses_of(bool undistorted, const Values& cameras);
/// --unit and --plugin.
void declare_units(Arguments& arguments, Values& units, Values& plugins);
/// --jobs.
void declare_jobs(Arguments& arguments, Values& jobs);
/// What it says; one for each processor where it is not given. Throws UserError.
unsigned processes(const Values& jobs);

/// `--plugin` for commands that only list things.
void load_plugins(const Values& plugins);

}  // namespace vrpipe::tools
