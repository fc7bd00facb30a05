#include "jobs/settings.h"

#include <algorithm>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/preprocess_parameters.h>

namespace vrpipe::tools {
namespace {

const std::string preprocess_unit = "preprocess";

/// Platforms know nothing of preprocessing, and could not suggest it for a misspelling.
bool means_preprocess(const std::string& unit) {
  const std::vector<ParameterListing> listings = list_parameters(nullptr);
  const auto is_named = [&](const ParameterListing& listing) { return listing.unit == unit; };
  return unit != preprocess_unit && edit_distance(unit, preprocess_unit) <= 3 &&
         std::none_of(listings.begin(), listings.end(), is_named);
}

}  // namespace

std::vector<ParameterListing> all_parameters(const Platform* platform) {
  std::vector<ParameterListing> listings = list_parameters(platform);
  listings.push_back({preprocess_unit, "projection", "what is done to a scene before the draw, at no simulated time",
                      false, std::make_unique<PreprocessParameters>()});
  return listings;
}

SettingsByPart sort_settings(const std::vector<Setting>& settings) {
  SettingsByPart parts;
  PreprocessParameters preprocess;
  for (const Setting& setting : settings) {
    if (means_preprocess(setting.unit)) {
      throw UserError("unknown unit '" + setting.unit + "'", "--set " + setting.unit + "." + setting.parameter,
                      "no such unit", "did you mean " + preprocess_unit + "? `vrpipe units` lists all");
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

}  // namespace vrpipe::tools
