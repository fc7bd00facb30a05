#include "jobs/settings.h"

#include <algorithm>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/software.h>
#include <vrpipe/workloads/preprocess_parameters.h>

namespace vrpipe::tools {
namespace {

const std::string preprocess_unit = "preprocess";
/// What scenes' files decide where nobody sets it.
const std::string of_scene = preprocess_unit + ".opacity_compensation";

/// Platforms know nothing of preprocessing, and could not suggest it for a misspelling.
bool means_preprocess(const std::string& unit) {
  const std::vector<ParameterListing> listings = list_parameters(nullptr);
  const auto is_named = [&](const ParameterListing& listing) { return listing.unit == unit; };
  return unit != preprocess_unit && !near_name(unit, {preprocess_unit}).empty() &&
         std::none_of(listings.begin(), listings.end(), is_named);
}

}  // namespace

std::vector<ParameterListing> all_parameters(const Platform* platform) {
  std::vector<ParameterListing> listings = list_parameters(platform);
  listings.push_back({preprocess_unit, "projection", "what is done to a scene before the draw, at no simulated time",
                      false, std::make_unique<PreprocessParameters>()});
  return listings;
}

std::vector<std::pair<std::string, std::string>> final_parameters(const RunRequest& request) {
  RunRequest all = of_pipeline_alone(request);
  all.effects = EffectChoice::parse("all");
  all.observers = nullptr;
  return Configuration(all, Frame(1, 1)).parameters();
}

bool declares(const RunRequest& request, const std::string& parameter) {
  const std::size_t dot = parameter.rfind('.');
  const std::string slot = without_gpc(parameter.substr(0, dot)), name = parameter.substr(dot + 1);
  if (!Registry::instance().has_slot(slot)) return true;
  if (!draws_with(request.variant, slot)) return false;
  if (is_outside_pipeline(slot)) {
    const auto has = check_software(of_variant_alone(request));
    return std::any_of(has.begin(), has.end(), [&](const auto& each) { return each.first == parameter; });
  }
  const auto implementations = Configuration(of_pipeline_alone(request), Frame(1, 1)).implementations();
  return std::any_of(implementations.begin(), implementations.end(), [&](const auto& of_slot) {
    if (without_gpc(of_slot.first) != slot) return false;
    const std::unique_ptr<ParameterSet> set = Registry::instance().find(slot, of_slot.second).make_parameters();
    const auto& declared = set->parameters();
    return std::any_of(declared.begin(), declared.end(), [&](const Parameter* each) { return each->name() == name; });
  });
}

RunRequest without_changes(RunRequest request) {
  std::vector<Setting>& changed = request.variant.changed_settings;
  const auto is_of_unit = [](const Setting& setting) { return setting.unit != "platform"; };
  changed.erase(std::remove_if(changed.begin(), changed.end(), is_of_unit), changed.end());
  return request;
}

void leave_out_restated(std::vector<RunRequest>& requests, const std::function<bool(const Setting&)>& which) {
  const std::vector<Setting>& given = requests.front().settings;
  std::vector<bool> restated, is_listed(given.size(), false);
  for (const Setting& setting : given) restated.push_back(which(setting));
  for (const RunRequest& request : requests) {
    // What a variant sets itself hides a setting, and does not make it so anyway.
    const RunRequest whole = without_changes(request);
    RunRequest shorter = whole;
    std::vector<Setting>& kept = shorter.settings;
    kept.erase(std::remove_if(kept.begin(), kept.end(), which), kept.end());
    if (kept.size() == given.size()) return;
    // One that names a path may be in neither list.
    const auto with = final_parameters(whole), without = final_parameters(shorter);
    for (std::size_t i = 0; i < given.size(); ++i) {
      const std::string name = given[i].unit + "." + given[i].parameter;
      const auto value_in = [&](const auto& parameters) {
        const auto found = std::find_if(parameters.begin(), parameters.end(),
                                        [&](const auto& parameter) { return parameter.first == name; });
        return found == parameters.end() ? std::string() : found->second;
      };
      is_listed[i] = is_listed[i] || !value_in(with).empty();
      restated[i] = restated[i] && value_in(with) == value_in(without);
    }
  }
  std::vector<Setting> kept;
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (!restated[i] || !is_listed[i]) kept.push_back(given[i]);
  }
  for (RunRequest& request : requests) request.settings = kept;
}

bool restates_preprocessing(const Setting& setting) {
  if (setting.unit != preprocess_unit) return false;
  PreprocessParameters given;
  given.set(setting.parameter, setting.value);
  const PreprocessParameters usual;
  for (std::size_t i = 0; i < usual.parameters().size(); ++i) {
    if (given.parameters()[i]->value() != usual.parameters()[i]->value()) return false;
  }
  return true;
}

SettingsByPart sort_settings(const std::vector<Setting>& settings) {
  SettingsByPart parts;
  PreprocessParameters preprocess;
  for (const Setting& setting : settings) {
    if (means_preprocess(setting.unit)) {
      throw UserError("unknown unit '" + setting.unit + "'", "--set " + setting.unit + "." + setting.parameter,
                      "no such unit", suggestion(setting.unit, {preprocess_unit}, "`vrpipe units` lists all"));
    }
    if (setting.unit == preprocess_unit) {
      preprocess.set(setting.parameter, setting.value);
      parts.preprocessing.push_back(setting);
    } else {
      parts.machine.push_back(setting);
    }
  }
  parts.preprocess = preprocess.options();
  for (const Parameter* parameter : preprocess.parameters()) {
    parts.preprocess_parameters.emplace_back(preprocess_unit + "." + parameter->name(), parameter->value());
  }
  return parts;
}

void add_preprocess_parameters(const std::vector<std::pair<std::string, std::string>>& parameters,
                               const SceneSummary& scene, RunResult& run) {
  for (const auto& [name, value] : parameters) {
    const bool is_open = name == of_scene && value == "scene";
    const bool on = scene.gaussians_compensated == scene.gaussians_total, off = scene.gaussians_compensated == 0;
    // Scenes of a frame may be of two minds.
    run.parameters.emplace_back(name, is_open && off ? "off" : is_open && on ? "on" : value);
  }
}

const char* origin_unless_set(const std::string& parameter, const std::string& value) {
  return parameter == of_scene && value == "on" ? "scene" : "default";
}

}  // namespace vrpipe::tools
