#include "cli/options.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <thread>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/software.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/multi_pass.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "cli/parse.h"
#include "host/crash_report.h"
#include "host/output_file.h"
#include "host/stdout_to_stderr.h"
#include "jobs/comparison.h"
#include "jobs/settings.h"
#include "jobs/user_variants.h"

namespace vrpipe::tools {
namespace {

constexpr const char* energies_option = "--energies";
constexpr const char* html_option = "--html";

constexpr unsigned usual_passes = 4;  // of the path that has several

const std::string variant_default = "het+qm";

std::string either_of(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    if (!text.empty()) text += name == names.back() ? " or " : ", ";
    text += name;
  }
  return text;
}

/// None for all of a file.
std::optional<std::size_t> view_count(const std::string& text) {
  if (text == "all") return std::nullopt;
  try {
    return parse_count(text, ViewsChoice::option, most_views);
  } catch (const UserError&) {
    throw UserError("bad value '" + text + "'", ViewsChoice::option,
                    fmt::format("it is neither `all` nor a whole number from 1 to {}", most_views),
                    "give e.g. 20, or all");
  }
}

unsigned passes_of(const std::string& text) { return parse_count(text, "--multi-pass", most_passes); }
unsigned seed_of(const std::string& text) {
  return parse_count(text, "--seed", std::numeric_limits<std::uint32_t>::max());
}
unsigned draws_of(const std::string& text) { return parse_count(text, "--draws", most_draws); }

/// Throws UserError where a setting's unit is known and cannot have it, whatever the platform and the variant.
void check_setting(const std::string& text) {
  const Setting setting = parse_settings({text}).front();
  const std::vector<ParameterListing> listings = all_parameters(nullptr);
  const ParameterListing* of_unit = nullptr;
  for (const ParameterListing& each : listings) {
    if (each.unit != without_gpc(setting.unit)) continue;
    const auto& declared = each.parameters->parameters();
    const bool has_it = std::any_of(declared.begin(), declared.end(),
                                    [&](const Parameter* parameter) { return parameter->name() == setting.parameter; });
    if (of_unit == nullptr || has_it) of_unit = &each;
    if (has_it) break;
  }
  if (of_unit != nullptr) of_unit->parameters->set(setting.unit, setting.parameter, setting.value);
}

void check_unit(const std::string& text) {
  const UnitChoice choice = parse_unit_choices({text}).front();
  Registry::instance().find(without_gpc(choice.slot), choice.implementation);
}

/// What can be said without the others, of which one may be the base.
void check_definition(const std::string& text) {
  for (const auto& [key, value] : parse_variant(text).changes) {
    const bool is_unit = Registry::instance().has_slot(without_gpc(key));
    (is_unit ? check_unit : check_setting)(key + "=" + value);
  }
}

/// A configuration file's [variants].
void declare_definitions(Arguments& arguments, Values& definitions) {
  arguments.add_option("--define", definitions, "NAME=BASE,...", "", "").check = check_definition;
}

void check_variant(const std::string& text) {
  if (text.find('=') != std::string::npos) {
    check_definition(text);
  } else {
    variant_named(text);
  }
}

/// A camera that has the value alone.
void check_fovy(const std::string& text) {
  View view;
  view.fovy_degrees = parse_number(text, "--fovy");
  look_at(view, {1, 1});
}
void check_orthographic(const std::string& text) {
  View view;
  view.orthographic_height = parse_number(text, "--orthographic");
  look_at(view, {1, 1});
}

/// Whether it draws with kernels, or by an accelerator.
bool is_outside(const Variant& variant) { return !variant.is_of_pipeline(); }

/// Whether a setting is from a configuration file.
std::function<bool(const Setting&)> of_file(const Invocation& invocation) {
  return [&invocation](const Setting& setting) {
    return invocation.gives("--set " + setting.unit + "." + setting.parameter);
  };
}

/// A unit with which no variant draws, and its settings. Those of the pipeline may be in a configuration file, which sets
/// everything where it was printed.
void refuse_unused(const RunRequest& request, const std::vector<Variant>& variants, const Invocation& invocation) {
  const auto is_of_file = of_file(invocation);
  const bool draws_outside = std::any_of(variants.begin(), variants.end(), is_outside);
  const auto check = [&](const std::string& option, const std::string& unit) {
    const auto lacks = [&](const Variant& variant) { return is_without(variant, unit); };
    if (!std::all_of(variants.begin(), variants.end(), lacks)) return;
    throw UserError("cannot choose or set '" + unit + "'", option,
                    draws_outside ? "no variant here draws with it" : "it is no unit of a draw by hardware",
                    "leave it out, or take a variant that draws with it, or `vrpipe frames`");
  };
  for (const Setting& setting : request.settings) {
    if (is_outside_pipeline(setting.unit) || !is_of_file(setting))
      check("--set " + setting.unit + "." + setting.parameter, setting.unit);
  }
  for (const UnitChoice& choice : request.units)
    check("--unit " + choice.slot + "=" + choice.implementation, choice.slot);
}

/// A unit for all that no variant takes, after refuse_unused().
void refuse_overridden(const std::vector<UnitChoice>& units, const std::vector<Variant>& variants) {
  for (const UnitChoice& choice : units) {
    const Variant* other = nullptr;
    const auto takes = [&](const Variant& variant) {
      if (!draws_with(variant, without_gpc(choice.slot))) return false;
      if (own_unit(variant, choice) == nullptr) return true;
      other = &variant;
      return false;
    };
    if (std::any_of(variants.begin(), variants.end(), takes)) continue;
    const UnitChoice& own = *own_unit(*other, choice);
    throw UserError("cannot choose a unit for '" + choice.slot + "'",
                    "--unit " + choice.slot + "=" + choice.implementation,
                    fmt::format("variant {} has a unit of its own in slot {}, {}", other->name, own.slot,
                                own.implementation),
                    "leave it out, or take another variant");
  }
}

}  // namespace

void declare_result_json(Arguments& arguments, Values& json) {
  arguments.add_option("--json", json, "FILE|-", "writes the result as JSON; `-`: to stdout, and nothing else there",
                       result_group);
}

void declare_jobs(Arguments& arguments, Values& jobs) {
  arguments.add_option("--jobs", jobs, "N",
                       "simulations at a time, each a process of its own (default: one for each\n"
                       "processor; results do not depend on it)",
                       result_group);
  arguments.find("--jobs")->check = [](const std::string& text) { processes({text}); };
}

unsigned processes(const Values& jobs) {
  const auto text = single(jobs, "--jobs");
  return text ? parse_count(*text, "--jobs", 1024) : std::max(1U, std::thread::hardware_concurrency());
}

void load_plugins(const Values& plugins) {
  const StdoutToStderr redirected;
  for (const std::string& plugin : plugins) {
    report_crashes();
    load_plugin(plugin);
  }
  if (!plugins.empty()) report_crashes();
}

void SimulationArguments::declare_scene(Arguments& arguments) {
  Option& scene = arguments.add_option("--scene", scene_, "FILE|builtin:NAME|NAME=FILE",
                                       "trained Gaussians (.ply, .spz, .sog, .splat, .glb ...), a .spl draw list,\n"
                                       "or a built-in scene (default: builtin:object; `vrpipe scenes` lists them);\n"
                                       "with NAME=FILE the file takes the place of a built-in scene and has its\n"
                                       "size: train=model.ply",
                                       scene_group);
  scene.default_text = "builtin:object";
  scene.default_unless = "--frame";
  arguments.add_option("--mesh", meshes_, "FILE",
                       "an opaque triangle mesh that is drawn with the scene: .obj, .ply, .gltf or\n"
                       ".glb, in the world of its Gaussians; can be repeated (docs/meshes.md)",
                       scene_group);
  arguments.add_option("--size", size_, "WxH",
                       "image size, pixels, each side 1 to 16384 (default: the scene's or the\n"
                       "camera's own, 1280x720 for a file without a camera)",
                       scene_group);
  arguments.add_option("--camera", camera_, "FILE[#INDEX|#NAME]",
                       "a cameras.json (INRIA), a transforms.json (NeRF, nerfstudio) or the folder of\n"
                       "a COLMAP model, and which camera of it, by number or by its image's name\n"
                       "(default: #0; docs/cameras.md)",
                       scene_group);
  declare_undistorted(arguments, undistorted_);
  arguments.find("--size")->check = [](const std::string& text) { parse_size(text, "--size"); };
  arguments.add_option("--eye", eye_, "X,Y,Z",
                       "where the camera stands, world units (default: chosen to fit the scene)", scene_group);
  arguments.add_option("--look-at", look_at_, "X,Y,Z", "the point in the middle of the image, world units",
                       scene_group);
  arguments.add_option("--up", up_, "X,Y,Z",
                       "the world's up direction (default: where the file says it is, else 0,-1,0,\n"
                       "since y points down in INRIA scenes; 0,1,0 for y-up files)",
                       scene_group);
  arguments.add_option("--fovy", fovy_, "DEGREES", "vertical field of view (default: the scene's own, 50 for a file)",
                       scene_group);
  arguments.add_option("--orthographic", orthographic_, "HEIGHT",
                       "in place of --fovy: without perspective, and how many world units the image's\n"
                       "height spans",
                       scene_group);
  for (const char* option : {"--eye", "--look-at", "--up"}) {
    arguments.find(option)->check = [option](const std::string& text) {
      parse_triple(text, option, "X,Y,Z", "0,-1,0");
    };
  }
  arguments.find("--fovy")->check = check_fovy;
  arguments.find("--orthographic")->check = check_orthographic;
  arguments.add_flag("--no-scene-cache", no_scene_cache_,
                     "makes a built-in scene anew, instead of reading what the same build has made\n"
                     "before from the user's cache folder",
                     scene_group);
}

void SimulationArguments::declare_variant(Arguments& arguments) {
  arguments
      .add_option("--variant", variant_, "NAME|NAME=BASE,...",
                  "baseline, qm (quad merging), het (hardware early termination), het+qm,\n"
                  "in-shader or in-shader-no-lock (shaders blend), software or accelerator\n"
                  "(docs/software.md), or one of your own, as in\n"
                  "mine=het+qm,tgc=pass-through,tc.bins=64\n(default: " +
                      variant_default + "; docs/configuration.md)",
                  machine_group)
      .default_text = variant_default;
  arguments.find("--variant")->check = check_variant;
}

void SimulationArguments::declare_rules(Arguments& arguments) {
  declare_fidelity(arguments);
  arguments
      .add_option("--effects", effects_, "LIST",
                  "what is simulated: auto, what the frame calls for; approximate, of that\n"
                  "nothing whose absence is bounded; all; or a list, as in all,-raster.hi_z,\n"
                  "where -NAME is left out (docs/effects.md; `vrpipe units --effects` lists\n"
                  "them) (default: auto)",
                  rules_group)
      .default_text = "auto";
  arguments
      .add_option("--format", format_, "NAME",
                  "colour target: rgba8, srgb8, rgba16f, rgba16 (UNORM) or rgba32f\n(default: rgba16f)", rules_group)
      .default_text = "rgba16f";
  arguments.find("--format")->check = color_format_named;
  arguments
      .add_option("--termination", termination_, "NAME",
                  "when a termination bit counts: paper (once its update has travelled) or\n"
                  "strict (order alone decides) (default: paper)",
                  rules_group)
      .default_text = "paper";
  arguments.find("--termination")->check = termination_named;
  arguments.find("--effects")->check = EffectChoice::parse;
}

void SimulationArguments::declare_study(Arguments& arguments) {
  declare_scene(arguments);
  declare_definitions(arguments, definitions_);
  declare_platform(arguments);
  declare_variant(arguments);
  declare_changes(arguments);
  declare_rules(arguments);
  declare_result_json(arguments, json_);
  declare_jobs(arguments, jobs_);
}

void SimulationArguments::declare(Arguments& arguments, Variants variants) {
  declare_scene(arguments);
  declare_config(arguments);
  declare_definitions(arguments, definitions_);
  declare_platform(arguments);
  if (variants == Variants::one) declare_variant(arguments);
  declare_changes(arguments);
  declare_rules(arguments);
  declare_images(arguments);
  declare_result_json(arguments, json_);
  arguments.add_option("--save-draw", save_draw_, "FILE.spl",
                       "writes the draw after preprocessing; --scene FILE.spl takes it in again", result_group);
  if (variants == Variants::all) declare_jobs(arguments, jobs_);
}

void SimulationArguments::declare_variants(Arguments& arguments) {
  arguments.add_option("--variant", variant_, "NAME|NAME=BASE,...",
                       "what is compared: baseline, qm, het, het+qm, in-shader, in-shader-no-lock,\n"
                       "software, accelerator, or one of your own, as in\n"
                       "mine=het+qm,tgc=pass-through,tc.bins=64; can be repeated\n"
                       "(default: the first four, and those of plugins and of --config;\n"
                       "docs/configuration.md)",
                       machine_group);
  arguments.find("--variant")->check = check_variant;
}

void SimulationArguments::declare_comparison(Arguments& arguments) {
  compares_any_ = true;
  arguments.find("--platform")->help =
      "the GPU (default: " + platforms().front().name +
      "; `vrpipe platforms` lists them); can be\nrepeated: every variant on every platform";
  declare_variants(arguments);
  arguments.add_option("--relative-to", relative_to_, "NAME",
                       "over what speed-ups are: a variant, or PLATFORM/VARIANT where there are\n"
                       "several platforms (default: the first)",
                       result_group);
}

void SimulationArguments::declare_machine(Arguments& arguments) {
  declare_config(arguments);
  declare_platform(arguments);
  declare_changes(arguments);
  declare_fidelity(arguments);
  declare_result_json(arguments, json_);
  declare_jobs(arguments, jobs_);
}

void SimulationArguments::declare_images(Arguments& arguments) {
  arguments.add_option("--output", output_, "DIR",
                       "writes SCENE-VARIANT.png (8 bit, over the background) and .exr (RGBA\n"
                       "float, premultiplied, no background) there; created if missing",
                       result_group);
  arguments
      .add_option("--background", background_, "R,G,B", "behind the PNG, each 0 to 1 (default: 0,0,0)", result_group)
      .default_text = "0,0,0";
  arguments.find("--background")->check = [](const std::string& text) { parse_background(text, "--background"); };
}

void SimulationArguments::declare_whole_frames(Arguments& arguments) {
  takes_kernels_ = true;
  declare_scene(arguments);
  declare_config(arguments);
  declare_definitions(arguments, definitions_);
  declare_platform(arguments);
  declare_changes(arguments);
  declare_rules(arguments);
  arguments
      .add_option("--multi-pass", passes_, "N", "passes of the path multi-pass (default: 4; 1: without it)",
                  scene_group)
      .check = passes_of;
  arguments.add_option(ViewsChoice::option, views_, "N|all",
                       "the scene from N cameras evenly spaced among those of --camera FILE, or from\n"
                       "all of them; without a file, from N round the scene: how frames are distributed",
                       scene_group);
  arguments.find(ViewsChoice::option)->check = view_count;
  arguments.add_flag("--imitation", imitation_,
                     "one more path: the baseline as the paper measured energy with it, termination imitated\n"
                     "by a stencil that counts, merging by the shader (docs/energy.md)",
                     scene_group);
  arguments.add_option(energies_option, energies_, "FILE.toml",
                       "millijoules by a table of your own (`vrpipe energies --toml` prints the one that\n"
                       "vrpipe comes with)",
                       result_group);
  declare_images(arguments);
  arguments.find("--output")->help =
      "writes SCENE-PATH.png (8 bit, over the background) and .exr (RGBA float,\n"
      "premultiplied, no background) there; created if missing";
  declare_page(arguments);
  arguments.find(html_option)->help =
      "writes a page: the paper's figures of whole frames, of this scene, and\n"
      "pictures; it needs no network";
  declare_result_json(arguments, json_);
  declare_jobs(arguments, jobs_);
}

void SimulationArguments::declare_platform(Arguments& arguments) {
  arguments
      .add_option("--platform", platform_, "NAME",
                  "the GPU (default: " + platforms().front().name + "; `vrpipe platforms` lists them)", machine_group)
      .default_text = platforms().front().name;
  arguments.find("--platform")->check = platform_named;
}

void SimulationArguments::declare_changes(Arguments& arguments) {
  arguments.add_option("--set", settings_, "UNIT.PARAMETER=VALUE",
                       "changes a parameter, e.g. tc.bins=64, or crop.cache_bytes=32K; can be\n"
                       "repeated (`vrpipe units` lists all, with units, ranges and defaults)",
                       machine_group);
  arguments.find("--set")->check = check_setting;
  declare_units(arguments, units_, plugins_);
}

void declare_undistorted(Arguments& arguments, bool& undistorted) {
  arguments.add_flag("--undistorted", undistorted,
                     "of --camera: takes distorted cameras without their distortion, for a model that\n"
                     "was trained on undistorted images",
                     scene_group);
}

Lenses lenses_of(bool undistorted, const Values& cameras) {
  if (!undistorted) return Lenses::as_written;
  if (cameras.empty()) {
    throw UserError("cannot use option", "--undistorted", "it is of the cameras of a file, and there is none",
                    "add --camera, or leave it out");
  }
  return Lenses::undistorted;
}

void declare_units(Arguments& arguments, Values& units, Values& plugins) {
  arguments.add_option("--unit", units, "SLOT=IMPLEMENTATION",
                       "puts another unit into a slot, in every variant where the slot is not\n"
                       "pass-through; can be repeated",
                       machine_group);
  arguments.find("--unit")->check = check_unit;
  arguments.add_option("--plugin", plugins, "FILE.so", "loads units from a plugin, for --unit; can be repeated",
                       machine_group);
}

void SimulationArguments::declare_fidelity(Arguments& arguments) {
  Option& fidelity =
      arguments.add_option("--fidelity", fidelity_, "NAME",
                           "how exact time is, from images and counts alone to every unit in every\n"
                           "cycle: " +
                               either_of(fidelity_names()) +
                               " (default: cycle);\n"
                               "lt,UNIT=cycle,... has some units in every cycle among others at lt; sampled\n"
                               "has windows of the frame at cycle, and an interval (docs/accuracy.md)",
                           rules_group);
  fidelity.default_text = vrpipe::name_of(Fidelity::cycle);
  fidelity.default_unless = "--error";
  fidelity.check = [](const std::string& text) {
    RunRequest request;
    choose_fidelity(request, text);
  };
}

void SimulationArguments::declare_error(Arguments& arguments) {
  arguments.add_option("--error", error_, "PERCENT",
                       "in place of --fidelity: the cheapest way to cycles that are so near, as 1%: lt,\n"
                       "sampled or cycle",
                       rules_group);
  arguments.add_option("--seed", seed_, "N", "of where the windows of a sampled run are (default: 1)", rules_group);
  arguments.find("--error")->check = [](const std::string& text) { parse_percent(text, "--error"); };
  arguments.find("--seed")->check = seed_of;
}

void SimulationArguments::choose_error(RunRequest& request) const {
  if (const auto text = single(error_, "--error")) {
    if (!fidelity_.empty())
      throw UserError("cannot use option", "--error", "--fidelity says which way is taken", "leave out one of them");
    request.error_percent = parse_percent(*text, "--error");
    request.sampling.emplace();
  }
  if (const auto text = single(seed_, "--seed")) {
    if (!request.sampling)
      throw UserError("cannot use option", "--seed", "nothing is drawn at random", "add --fidelity sampled or --error");
    request.sampling->seed = seed_of(*text);
  }
}

void SimulationArguments::declare_page(Arguments& arguments) {
  arguments.add_option(html_option, html_, "FILE",
                       "writes a page: pictures, speed-ups, where quads and cycles went, all settings;\n"
                       "it needs no network (docs/results.md)",
                       result_group);
}

void SimulationArguments::declare_frames(Arguments& arguments) {
  arguments.add_option("--frame", frame_, "FILE.json",
                       "in place of --scene: clears and draws of scenes, each with a state of its\n"
                       "own (docs/frames.md)",
                       scene_group);
  arguments.add_option("--draws", draws_, "N", "of --frame, its first N draws alone (default: all)", scene_group);
  arguments.add_option("--multi-pass", passes_, "N",
                       "early termination by software: the splats in N batches, after each but the\n"
                       "last a draw that sets the stencil where a pixel has terminated (default: 1;\n"
                       "docs/early-termination.md)",
                       scene_group);
  arguments.find("--multi-pass")->check = passes_of;
  arguments.find("--draws")->check = draws_of;
}

void SimulationArguments::declare_views(Arguments& arguments) {
  arguments.add_option(ViewsChoice::option, views_, "N|all",
                       "the scene from N cameras evenly spaced among those of --camera FILE, or from\n"
                       "all of them; without a file, from N round the scene. Reports how speed-ups\n"
                       "and early-termination ratios are distributed. Goes on where it was\n"
                       "interrupted (docs/cameras.md)",
                       scene_group);
  arguments.find(ViewsChoice::option)->check = view_count;
  arguments.add_option(ViewsChoice::journal_option, journal_, "FILE",
                       "where --views stores what is done, and goes on from; it stays (default: a\n"
                       "file in the user's cache folder, removed at the end, or by a later study when\n"
                       "it was left alone for 30 days)",
                       result_group);
}

std::optional<ViewsChoice> SimulationArguments::views() const {
  const auto text = single(views_, ViewsChoice::option);
  const auto journal = single(journal_, ViewsChoice::journal_option);
  if (!text) {
    if (journal) {
      throw UserError("nothing to store", ViewsChoice::journal_option, "only many views are worth it",
                      "add --views N|all");
    }
    return std::nullopt;
  }
  const auto refuse = [](bool given, const char* option, const std::string& why) {
    if (given) throw UserError("cannot use option", option, why, "leave out this or --views");
  };
  refuse(!frame_.empty(), "--frame", "--views draws one scene from many cameras");
  refuse(!save_draw_.empty(), "--save-draw", "a draw list has one draw, and each view has another");
  refuse(!html_.empty(), html_option, "a page shows the runs of one view");
  refuse(explain_effects_, "--explain-effects", "it measures the runs of one view");
  const std::string observing = time_.any_given();
  refuse(!observing.empty(), observing.c_str(), "it looks at the runs of one view");
  refuse(energy_ || (!energies_.empty() && !takes_kernels_), energy_ ? "--energy" : energies_option,
         "it is of the runs of one view");
  const auto scene = single(scene_, "--scene");
  refuse(scene && is_draw_list(*scene), "--scene", "a .spl is a draw list, of one camera");
  const auto camera = single(camera_, "--camera");
  refuse(camera && camera_choice(*camera).camera, "--camera", "what follows # names one camera");
  ViewsChoice choice;
  choice.count = view_count(*text);
  if (!choice.count && !camera) {
    throw UserError("bad value 'all'", ViewsChoice::option,
                    "without --camera FILE the cameras go round the scene, and there is no end of them",
                    "give a number, or a camera file");
  }
  if (journal) choice.journal = *journal;
  return choice;
}

void SimulationArguments::declare_energy(Arguments& arguments) {
  arguments.add_flag("--energy", energy_, "reports what each run spends, mJ by unit, with its range (docs/energy.md)",
                     result_group);
  arguments.add_option(energies_option, energies_, "FILE.toml",
                       "--energy by a table of your own (`vrpipe energies --toml` prints the one that\n"
                       "vrpipe comes with)",
                       result_group);
}

std::shared_ptr<const EnergyTable> SimulationArguments::energies(const Platform& platform) const {
  const auto file = single(energies_, energies_option);
  if (!file && !energy_) return nullptr;
  auto table = std::make_shared<EnergyTable>(file ? read_energies(*file) : shipped_energies());
  const StdoutToStderr redirected;  // plugins may print while their units are made
  check_energy_names(*table, platform);
  return table;
}

void SimulationArguments::declare_explanation(Arguments& arguments) {
  arguments.add_flag("--explain-effects", explain_effects_,
                     "measures what each effect that was left out would cost the host: repeats\n"
                     "the run with it taken in, three times, and with all (docs/effects.md)",
                     result_group);
}

SceneRequest SimulationArguments::scene_request() const {
  SceneRequest request;
  request.scene = single(scene_, "--scene").value_or("");
  request.scene_cache = !no_scene_cache_;
  if (const auto text = single(size_, "--size")) request.size = parse_size(*text, "--size");
  request.meshes = meshes_;
  request.camera = single(camera_, "--camera");
  request.lenses = lenses_of(undistorted_, camera_);
  if (const auto text = single(eye_, "--eye")) request.eye = parse_triple(*text, "--eye", "X,Y,Z", "2,-1.5,-4");
  if (const auto text = single(look_at_, "--look-at"))
    request.look_at = parse_triple(*text, "--look-at", "X,Y,Z", "0,0,0");
  if (const auto text = single(up_, "--up")) request.up = parse_triple(*text, "--up", "X,Y,Z", "0,-1,0");
  if (const auto text = single(fovy_, "--fovy")) request.fovy_degrees = parse_number(*text, "--fovy");
  if (const auto text = single(orthographic_, "--orthographic")) {
    request.orthographic_height = parse_number(*text, "--orthographic");
  }
  return request;
}

FrameDescription SimulationArguments::frame() const {
  const auto file = single(frame_, "--frame");
  if (!file) {
    FrameDescription frame = frame_of_scene(single(scene_, "--scene").value_or(""));
    if (takes_kernels_) frame.passes = usual_passes;
    if (const auto text = single(passes_, "--multi-pass")) frame.passes = passes_of(*text);
    if (!draws_.empty())
      throw UserError("cannot use option", "--draws", "a scene is one draw", "leave it out, or draw a --frame FILE");
    return frame;
  }
  const auto refuse_with_frame = [](const Values& given, const char* option, const char* why) {
    if (!given.empty()) throw UserError("cannot use option", option, why, "leave out this or --frame");
  };
  refuse_with_frame(scene_, "--scene", "--frame says what is drawn");
  refuse_with_frame(meshes_, "--mesh", "--frame says what is drawn");
  refuse_with_frame(passes_, "--multi-pass", "it splits the one draw of a scene, and --frame says what is drawn");
  refuse_with_frame(save_draw_, "--save-draw", "a draw list has one draw, and a frame may have several");
  FrameDescription frame = read_frame_file(*file);
  if (const auto text = single(draws_, "--draws")) leave_out_draws_after(draws_of(*text), frame);
  return frame;
}

std::vector<NamedFile> SimulationArguments::inputs(const FrameDescription& frame) const {
  std::vector<NamedFile> files;
  for (const FrameCommand& command : frame.commands) {
    if (command.draw) files.push_back({command.where, gaussian_file_path(scene_file(command.draw->scene))});
  }
  for (const std::string& file : meshes_) files.push_back({"--mesh", file});
  for (const std::string& file : frame_) files.push_back({"--frame", file});
  for (const std::string& camera : camera_) {
    for (const auto& file : camera_files(camera_choice(camera).file)) files.push_back({"--camera", file});
  }
  for (const std::string& plugin : plugins_) files.push_back({"--plugin", plugin});
  for (const std::string& file : energies_) files.push_back({energies_option, file});
  return files;
}

void SimulationArguments::declare_time(Arguments& arguments, Variants variants) {
  time_.declare(arguments, "What is seen in its course", variants == Variants::one);
}

void SimulationArguments::check_explanation(const EffectChoice& effects) const {
  if (!explain_effects_) return;
  if (effects.base == EffectChoice::Base::all && effects.without.empty()) {
    throw UserError("nothing to explain", "--explain-effects", "--effects " + effects.text() + " leaves nothing out",
                    "leave out this or --effects");
  }
  const std::string observing = time_.any_given();
  if (!observing.empty()) {
    throw UserError("cannot use option", "--explain-effects", "it repeats the run, and " + observing + " is of one",
                    "leave out this or " + observing);
  }
}

std::vector<Variant> SimulationArguments::variants_drawn_by(const SimulationJob& job,
                                                            const std::vector<std::string>& of_study) {
  std::vector<Variant> all;
  for (const std::string& name : of_study) all.push_back(variant_named(name));
  if (!of_study.empty()) return all;
  for (const RunRequest& request : job.requests) all.push_back(request.variant);
  return all;
}

/// Of variants that draw outside the pipeline, what there is not.
void SimulationArguments::check_outside(const SimulationJob& job, const std::vector<Variant>& variants,
                                        const Invocation& invocation) const {
  if (takes_kernels_) return;
  refuse_unused(job.requests.front(), variants, invocation);
  const auto found = std::find_if(variants.begin(), variants.end(), is_outside);
  if (found == variants.end()) return;
  const auto refuse = [&](bool is_given, const char* option, const std::string& why) {
    if (!is_given) return;
    throw UserError("cannot use option", option, why, "leave out this or the variant");
  };
  const std::string who = "variant " + found->name;
  refuse(!frame_.empty(), "--frame", who + " draws one scene, without states of draws");
  refuse(job.frame.passes > 1, "--multi-pass", who + " draws in one pass");
  refuse(!meshes_.empty(), "--mesh", who + " draws splats alone");
  const std::string observing = time_.any_of_units();
  refuse(!observing.empty(), observing.c_str(), who + " has no units of a pipeline, nor a course of time");
  const auto accelerator = std::find_if(variants.begin(), variants.end(), [](const Variant& variant) {
    return variant.drawn_by == DrawnBy::accelerator;
  });
  if (accelerator != variants.end())
    refuse(time_.heat_maps(), HeatMaps::option, "variant " + accelerator->name + " does not tell of its fragments");
  if (!std::all_of(variants.begin(), variants.end(), is_outside)) return;
  refuse(job.requests.front().effects.text() != EffectChoice().text(), "--effects", who + " has no effects");
  refuse(explain_effects_, "--explain-effects", who + " has no effects");
}

SimulationJob SimulationArguments::resolve(Variants variants, const Invocation& invocation,
                                           const std::vector<std::string>& of_study) const {
  // Plugins first: they may bring the platform and the units that the other options name.
  load_plugins(plugins_);
  std::vector<VariantDefinition> definitions;
  for (const Values& texts : {definitions_, variant_}) {
    for (const std::string& text : texts) {
      if (text.find('=') != std::string::npos) definitions.push_back(parse_variant(text));
    }
  }
  add_user_variants(std::move(definitions));
  invocation.check_overridden();

  SimulationJob job;
  job.schema = !views_.empty() ? "vrpipe.views/1" : variants == Variants::one ? "vrpipe.run/1" : "vrpipe.compare/1";
  job.provenance = make_provenance(invocation.words, plugins_);
  note_config(invocation, job.provenance);
  job.scene = scene_request();
  job.frame = frame();

  SettingsByPart parts;
  RunRequest request = machine(parts, invocation);
  if (const auto list = single(effects_, "--effects")) request.effects = EffectChoice::parse(*list);
  check_explanation(request.effects);
  job.explain_effects = explain_effects_;
  job.energies = energies(*request.platform);
  job.imitation = imitation_;
  // Those of the table that vrpipe comes with are counted in any case.
  job.html = single(html_, html_option);
  request.reads_statistics = (single(json_, "--json").has_value() && views_.empty()) || job.html || !energies_.empty();
  if (const auto name = single(format_, "--format")) request.format = color_format_named(*name);
  if (const auto name = single(termination_, "--termination")) request.termination = termination_named(*name);
  if (takes_kernels_) {
    job.kernel_parameters = check_software(request);
    const auto take = [](const auto& all, auto& kernels, const auto& unit_of) {
      std::copy_if(all.begin(), all.end(), std::back_inserter(kernels),
                   [&](const auto& each) { return is_outside_pipeline(unit_of(each)); });
    };
    take(request.settings, job.kernel_settings, [](const Setting& setting) { return setting.unit; });
    take(request.units, job.kernel_units, [](const UnitChoice& choice) { return choice.slot; });
    request = of_pipeline_alone(std::move(request));
  }
  job.scene.preprocess = parts.preprocess;
  job.preprocessing = std::move(parts.preprocessing);
  job.preprocess_parameters = std::move(parts.preprocess_parameters);

  job.requests = requests(request, variants);
  const std::vector<Variant> drawn = variants_drawn_by(job, of_study);
  check_outside(job, drawn, invocation);
  refuse_overridden(job.requests.front().units, drawn);
  leave_out_restated(job.requests, of_file(invocation));
  for (RunRequest& each : job.requests) {
    const StdoutToStderr redirected;
    each.fidelity = std::min(each.fidelity, finest_fidelity(each.variant));
    check_configuration(of_variant_alone(each));
  }
  job.baseline = place_of_run(job.requests, single(relative_to_, "--relative-to").value_or(""), "--relative-to");
  if (job.baseline != 0 && request.fidelity == Fidelity::functional) {
    throw UserError("cannot use option", "--relative-to", "speed-ups are of time, and functional has none",
                    "leave it out, or choose another --fidelity");
  }

  if (const auto text = single(background_, "--background")) job.background = parse_background(*text, "--background");
  if (const auto folder = single(output_, "--output")) {
    check_output_folder(*folder, "--output");
    job.output = *folder;
  }
  job.json = single(json_, "--json");
  if (const auto file = single(save_draw_, "--save-draw")) job.save_draw = *file;
  job.inputs = inputs(job.frame);

  job.processes = processes(jobs_);
  time_.observe(job);
  return job;
}

MachineJob SimulationArguments::resolve_machine(const Invocation& invocation, const Platform* platform) const {
  load_plugins(plugins_);
  invocation.check_overridden();
  MachineJob job;
  job.provenance = make_provenance(invocation.words, plugins_);
  note_config(invocation, job.provenance);
  SettingsByPart parts;
  job.request = machine(parts, invocation, platform);
  if (!parts.preprocessing.empty()) {
    throw UserError("cannot set 'preprocess." + parts.preprocessing.front().parameter + "'", "--set",
                    "no scene is preprocessed", "leave it out");
  }
  job.request.variant = variant_named("baseline");
  if (job.request.sampling)
    throw UserError("cannot be sampled", "--fidelity", "a microbenchmark is short", "use lt or cycle");
  refuse_unused(job.request, {job.request.variant}, invocation);
  std::vector<RunRequest> requests{job.request};
  leave_out_restated(requests, of_file(invocation));
  job.request = requests.front();
  {
    const StdoutToStderr redirected;
    check_configuration(job.request);
  }
  job.json = single(json_, "--json");
  job.processes = processes(jobs_);
  for (const std::string& plugin : plugins_) job.inputs.push_back({"--plugin", plugin});
  return job;
}

RunRequest SimulationArguments::machine(SettingsByPart& parts, const Invocation& invocation,
                                        const Platform* platform) const {
  RunRequest request;
  request.platform = platform_.empty() && platform != nullptr ? platform : chosen_platforms().front();
  if (const auto name = single(fidelity_, "--fidelity")) choose_fidelity(request, *name);
  choose_error(request);
  std::vector<Setting> settings;
  for (const Setting& setting : parse_settings(settings_)) {
    if (!restates_preprocessing(setting) || !of_file(invocation)(setting)) settings.push_back(setting);
  }
  parts = sort_settings(settings);
  request.settings = parts.machine;
  request.units = parse_unit_choices(units_);
  return request;
}

std::vector<const Platform*> SimulationArguments::chosen_platforms() const {
  if (platform_.empty()) return {&platforms().front()};
  if (!compares_any_) static_cast<void>(single(platform_, "--platform"));
  std::vector<const Platform*> chosen;
  for (const std::string& name : platform_) chosen.push_back(&platform_named(name));
  return chosen;
}

std::vector<Variant> SimulationArguments::chosen_variants(Variants variants) const {
  if (variants == Variants::one) static_cast<void>(single(variant_, "--variant"));
  std::vector<Variant> chosen;
  for (const std::string& text : variant_) {
    const bool is_new = text.find('=') != std::string::npos;
    chosen.push_back(variant_named(is_new ? parse_variant(text).name : text));
  }
  if (chosen.empty() && variants == Variants::one) return {variant_named(variant_default)};
  return chosen.empty() ? vrpipe::variants() : chosen;
}

std::vector<RunRequest> SimulationArguments::requests(const RunRequest& common, Variants variants) const {
  std::vector<RunRequest> all;
  const std::vector<const Platform*> on = chosen_platforms();
  const std::vector<Variant> compared = chosen_variants(variants);
  std::vector<std::string> names;
  for (const Platform* platform : on) {
    for (const Variant& variant : compared) {
      RunRequest request = common;
      request.platform = platform;
      request.variant = variant;
      request.name = on.size() > 1 ? platform->name + "/" + variant.name : variant.name;
      if (std::find(names.begin(), names.end(), request.name) != names.end()) {
        throw UserError("'" + request.name + "' given twice", on.size() > 1 ? "--platform, --variant" : "--variant",
                        "each is compared once", "leave out one");
      }
      names.push_back(request.name);
      all.push_back(std::move(request));
    }
  }
  return all;
}

}  // namespace vrpipe::tools
