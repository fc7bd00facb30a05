#include "jobs/reproduce_plan.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/component/names.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/scene_substitution.h>

namespace vrpipe::tools {
namespace {

constexpr std::size_t views_by_default = 6;
constexpr std::size_t views_of_a_quick_look = 2;

const std::vector<std::string> all_variants{"baseline", "qm", "het", "het+qm"};
const std::vector<std::string> without_merging{"baseline", "het"};
const std::vector<std::string> in_shader{"in-shader", "in-shader-no-lock"};

/// What could make the fragments of a blended quad fewer under HET: rules of termination, how many quads are tested at a
/// time, what is rasterised for a splat.
const std::vector<std::string> fragment_candidates{"state.termination_threshold=0.9",
                                                   "state.termination_threshold=0.98",
                                                   "state.termination_threshold=0.9999",
                                                   "termination=strict",
                                                   "tc.bin_quads=16",
                                                   "tc.bin_quads=512",
                                                   "tc.bins=4",
                                                   "state.splat_extent=aabb",
                                                   "state.splat_extent=three_sigma",
                                                   "state.pruning_threshold=0.02"};

/// Adds points once each, in the order in which they are asked for.
class Points {
 public:
  Points(ReproducePlan& plan, const RunRequest& base) : plan_(plan), base_(base) {}

  void add(PointKey key, const std::vector<std::string>& variants, bool with_map = false) {
    for (const std::string& variant : variants) {
      key.variant = variant;
      const auto [place, is_new] = plan_.places.emplace(key.name(plan_.scenes), plan_.points.size());
      if (!is_new) {
        plan_.points[place->second].with_map |= with_map;
        continue;
      }
      RunRequest request = with_settings(base_, key.settings);
      request.fidelity = key.fidelity;
      request.variant = variant_named(variant == PointKey::imitated_variant ? "baseline" : variant);
      request.reads_statistics = false;
      plan_.points.push_back({key, std::move(request), with_map});
    }
  }

 private:
  ReproducePlan& plan_;
  const RunRequest& base_;
};

void choose_scenes(const ReproduceOptions& options, ReproducePlan& plan) {
  const std::vector<SceneSubstitution> files = scene_substitutions(options.substitutions, "--scene");
  for (const BuiltinSceneInfo& info : builtin_scenes()) {
    if (!info.stands_for) continue;
    const bool is_large = info.stands_for->kind == "aerial";
    plan.scenes.push_back({info.name,
                           scene_in_place(info.name, files),
                           {},
                           is_large ? PlannedScene::Role::large : PlannedScene::Role::six});
  }
  std::stable_partition(plan.scenes.begin(), plan.scenes.end(),
                        [](const auto& scene) { return scene.role == PlannedScene::Role::six; });
  const auto is_planned = [&](const std::string& name) {
    return std::any_of(plan.scenes.begin(), plan.scenes.end(), [&](const auto& scene) { return scene.name == name; });
  };
  for (const SceneSubstitution& file : files) {
    if (is_planned(file.name)) continue;
    throw UserError("unused scene", "--scene " + file.name + "=" + file.file,
                    "it takes the place of a scene that the paper does not have",
                    "replace kitchen, bonsai, train, truck, lego, palace, building or rubble");
  }
  for (const SceneSubstitution& own : options.beside) {
    if (!is_good_name(own.name)) {
      throw UserError("bad name '" + printable(own.name) + "'", "--beside", std::string("it is not ") + good_name_rule,
                      "choose another");
    }
    if (is_planned(own.name)) {
      throw UserError("name taken", "--beside " + own.name + "=" + own.file, "there is a scene of that name",
                      "choose another; --scene puts a model in the place of one of the paper's");
    }
    plan.scenes.push_back({own.name, own.file, {}, PlannedScene::Role::beside});
  }
  std::set<std::string> given;
  for (const auto& [name, camera] : options.cameras) {
    if (!given.insert(name).second) {
      throw UserError("option given twice", "--camera " + name, "a scene has one camera file", "give it once");
    }
    const auto scene = std::find_if(plan.scenes.begin(), plan.scenes.end(),
                                    [&name = name](const PlannedScene& each) { return each.name == name; });
    const bool is_file = scene != plan.scenes.end() && scene->request != builtin_prefix + name;
    if (!is_file) {
      throw UserError("camera without a scene", "--camera " + name, "no file takes the place of that scene",
                      "add --scene " + name + "=FILE, or --beside");
    }
    scene->camera = camera;
  }
  for (std::size_t i = 0; i < plan.scenes.size(); ++i) {
    const std::string& name = plan.scenes[i].name;
    if (name == "lego" || (name == "train" && !options.quick)) plan.studied.push_back(i);
    if (name == "lego") plan.column = i;
    if (name == "bonsai") plan.indoor = i;
  }
}

/// Why the platform does not take settings.
std::optional<std::string> refusal(const ReproduceOptions& options, const std::string& settings) {
  try {
    static_cast<void>(with_settings(options.base, settings));
    return std::nullopt;
  } catch (const UserError& refused) {
    return refused.what();
  }
}

/// Of each parameter, and of what reasons name, the values that there are on the platform.
void choose_parameters(const ReproduceOptions& options, ReproducePlan& plan) {
  const auto is_kept = [&](const std::string& settings) {
    const std::optional<std::string> why = refusal(options, settings);
    if (why) plan.skipped.push_back({settings, *why});
    return !why;
  };
  for (const SensitivityParameter& parameter : sensitivity_parameters()) {
    SensitivityParameter chosen = parameter;
    chosen.values.clear();
    for (std::size_t i = 0; i < parameter.values.size(); ++i) {
      if (options.quick && i >= parameter.quick) break;
      if (is_kept(parameter.values[i])) chosen.values.push_back(parameter.values[i]);
    }
    if (!chosen.values.empty()) plan.parameters.push_back(std::move(chosen));
  }
  for (const std::string& settings : fragment_candidates) {
    if (options.quick && settings != "state.termination_threshold=0.9999") continue;
    if (is_kept(settings)) plan.fragment_settings.push_back(settings);
  }
  if (options.quick) return;
  std::set<std::string> seen;
  const bool is_papers = options.base.platform == &platforms().front();
  for (const std::string& settings : front_ends()) {
    if (!settings.empty() && !is_papers) continue;
    if (seen.insert(settings).second && is_kept(settings)) plan.trials.push_back(settings);
  }
  for (const PaperRow& row : options.rows) {
    for (const RowReason& reason : row.reasons) {
      if (seen.insert(reason.setting).second && is_kept(reason.setting)) plan.trials.push_back(reason.setting);
    }
  }
}

}  // namespace

const char* name_of(Extent extent) {
  switch (extent) {
    case Extent::full: return "full";
    case Extent::column: return "column";
    case Extent::half: return "half";
    case Extent::quarter: break;
  }
  return "quarter";
}

const std::vector<unsigned>& planned_passes(bool quick) {
  static const std::vector<unsigned> passes{4, 16}, of_a_quick_look{8};
  return quick ? of_a_quick_look : passes;
}

const std::vector<std::string>& checked_settings() {
  static const std::vector<std::string> settings{"", "raster.screen_tile_interval_cycles=2", "qru.quads_per_cycle=4",
                                                 "prop.quads_per_cycle=4", "state.termination_threshold=0.9999"};
  return settings;
}

const std::vector<std::string>& efficiency_settings() {
  static const std::vector<std::string> settings{"", "raster.setup_interval_cycles=2",
                                                 "raster.screen_tile_interval_cycles=2", "prop.quads_per_cycle=6",
                                                 "qru.quads_per_cycle=4"};
  return settings;
}

const std::vector<std::string>& front_ends() {
  static const std::vector<std::string> settings{"", "platform=agx-orin-emerald-2", "platform=agx-orin-emerald-1"};
  return settings;
}

std::string PointKey::name(const std::vector<PlannedScene>& scenes) const {
  std::string text =
      fmt::format("{} {} {} {}", scenes.at(scene).name, tools::name_of(extent), vrpipe::name_of(fidelity), variant);
  if (view > 0) text += fmt::format(" view={}", view);
  if (passes > 1) text += fmt::format(" passes={}", passes);
  return settings.empty() ? text : text + " " + settings;
}

std::vector<std::size_t> ReproducePlan::scenes_of(PlannedScene::Role role) const {
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (scenes[i].role == role) some.push_back(i);
  }
  return some;
}

std::vector<std::size_t> ReproducePlan::scenes_of(Breadth breadth) const {
  return breadth == Breadth::headline ? studied : std::vector<std::size_t>{column};
}

Extent ReproducePlan::extent_of(Breadth breadth) {
  return breadth == Breadth::headline ? Extent::full : Extent::column;
}

ReproducePlan plan_reproduction(const ReproduceOptions& options) {
  ReproducePlan plan;
  plan.quick = options.quick;
  plan.rows = options.rows;
  plan.views = options.views.value_or(options.quick ? views_of_a_quick_look : views_by_default);
  plan.fidelity = options.fidelity.value_or(options.quick ? sensitivity_fidelity : Fidelity::cycle);
  choose_scenes(options, plan);
  choose_parameters(options, plan);

  Points points(plan, options.base);
  // Scene by scene, so that one at a time is in memory; within it, camera by camera.
  for (std::size_t scene = 0; scene < plan.scenes.size(); ++scene) {
    PointKey key;
    key.scene = scene;
    const auto add = [&](Fidelity fidelity, const std::string& settings, const std::vector<std::string>& variants,
                         bool with_map = false) {
      key.fidelity = fidelity;
      key.settings = settings;
      points.add(key, variants, with_map);
    };
    const PlannedScene::Role role = plan.scenes[scene].role;
    if (plan.quick && role == PlannedScene::Role::large) continue;
    add(plan.fidelity, "", all_variants);
    if (role == PlannedScene::Role::large) continue;
    for (const std::string& settings : plan.trials) add(sensitivity_fidelity, settings, all_variants);
    if (role == PlannedScene::Role::beside) continue;
    add(Fidelity::functional, "", without_merging, true);
    add(sensitivity_fidelity, "", without_merging);
    if (!plan.quick) add(sensitivity_fidelity, "", in_shader);
    if (!plan.quick) add(sensitivity_fidelity, "", {PointKey::imitated_variant});
    for (const unsigned passes : planned_passes(plan.quick)) {
      key.passes = passes;
      add(sensitivity_fidelity, "", {"baseline"});
    }
    key.passes = 1;
    for (const std::string& settings : efficiency_settings()) {
      if (scene == plan.indoor && !plan.quick && !refusal(options, settings)) {
        add(sensitivity_fidelity, settings, all_variants);
      }
    }
    for (const Breadth breadth : {Breadth::headline, Breadth::open}) {
      const std::vector<std::size_t> scenes = plan.scenes_of(breadth);
      if (std::find(scenes.begin(), scenes.end(), scene) == scenes.end()) continue;
      key.extent = ReproducePlan::extent_of(breadth);
      for (const SensitivityParameter& parameter : plan.parameters) {
        if (parameter.breadth != breadth) continue;
        add(sensitivity_fidelity, "", all_variants);
        for (const std::string& value : parameter.values) add(sensitivity_fidelity, value, all_variants);
      }
      if (breadth == Breadth::open) continue;
      for (const std::string& settings : plan.fragment_settings) add(Fidelity::functional, settings, without_merging);
      if (scene != plan.column) continue;
      for (const std::string& settings : checked_settings()) {
        if (!plan.quick && !refusal(options, settings)) add(plan.fidelity, settings, all_variants);
      }
    }
    for (const Extent extent : {Extent::half, Extent::quarter}) {
      key.extent = extent;
      if (!plan.quick) add(Fidelity::functional, "", without_merging);
    }
    key.extent = Extent::full;
    for (key.view = 1; key.view < plan.views; ++key.view) add(Fidelity::functional, "", without_merging);
  }
  return plan;
}

}  // namespace vrpipe::tools
