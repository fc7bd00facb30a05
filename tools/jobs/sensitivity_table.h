#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// Where a parameter's values are tried.
enum class Breadth {
  headline,  ///< whole images of some scenes
  open       ///< a column of one; not in a quick look
};

/// A parameter, or several that go together, and the values that are tried beside the default.
struct SensitivityParameter {
  std::string name;  ///< UNIT.PARAMETER, or in words
  Breadth breadth;
  /// Each is settings, "UNIT.PARAMETER=VALUE,...", of which `platform=NAME` takes another platform.
  std::vector<std::string> values;
  std::size_t quick = 100;  ///< so many of the values in a quick look
};
const std::vector<SensitivityParameter>& sensitivity_parameters();

/// A parameter that the paper leaves open and that is not varied, and why.
struct NotVaried {
  std::string name;  ///< of a parameter; a * stands for any unit or any parameter
  std::string reason;
};
const std::vector<NotVaried>& parameters_not_varied();

/// The request with settings in the form of SensitivityParameter::values. Throws UserError for what the platform does not
/// know.
RunRequest with_settings(RunRequest request, const std::string& settings);

}  // namespace vrpipe::tools
