#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/preprocess.h>

namespace vrpipe::tools {

/// All that --set can set: what `list_parameters` lists, and `preprocess`.
std::vector<ParameterListing> all_parameters(const Platform* platform);

/// Settings of `--set`, by what they are for.
struct SettingsByPart {
  std::vector<Setting> machine;  ///< of units, l2 and state
  std::vector<Setting> preprocessing;
  PreprocessOptions preprocess;  ///< what `preprocessing` comes to
  /// `preprocess.NAME` and value of every parameter of preprocessing.
  std::vector<std::pair<std::string, std::string>> preprocess_parameters;
};

/// UNIT.PARAMETER and final value of everything that can be set, without preprocessing and kernels. Throws UserError.
std::vector<std::pair<std::string, std::string>> final_parameters(const RunRequest& request);

/// Whether the units of a request declare UNIT.PARAMETER: one that passes through, or is another make, may not. What is no
/// unit's is, if it can be set at all. Throws UserError.
bool declares(const RunRequest& request, const std::string& parameter);

/// Without what its variant sets itself beside the number of GPCs, whose units it may name.
RunRequest without_changes(RunRequest request);

/// Leaves out those settings of `which` that are so anyway in every request, so that reports list changes alone: a
/// configuration file may say everything. Throws UserError.
void leave_out_restated(std::vector<RunRequest>& requests, const std::function<bool(const Setting&)>& which);
/// Whether a setting of preprocessing is the default. Throws UserError for one that does not exist.
bool restates_preprocessing(const Setting& setting);

/// Sorts settings, and applies those of preprocessing. Throws UserError for an unknown parameter or a bad value of
/// preprocessing; the others are not checked.
SettingsByPart sort_settings(const std::vector<Setting>& settings);

/// Adds parameters of preprocessing to those of a run, with what its scenes' files decided in place of what was left to them.
void add_preprocess_parameters(const std::vector<std::pair<std::string, std::string>>& parameters,
                               const SceneSummary& scene, RunResult& run);
/// Where the final value of a parameter that nobody has set comes from.
const char* origin_unless_set(const std::string& parameter, const std::string& value);

}  // namespace vrpipe::tools
