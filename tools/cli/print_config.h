#pragma once

#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>

#include "cli/config_file.h"

namespace vrpipe::tools {

/// Whether --print-config is given.
bool prints_config(const Invocation& invocation);

/// A configuration file of what a command would do: its options, the variants that are not vrpipe's, and every parameter,
/// each with where it comes from. It reads back to the same runs.
/// @param requests    at least one; alike but for platform and variant
/// @param preprocess  `preprocess.NAME` and value; empty where nothing is preprocessed
std::string config_text(const Invocation& invocation, const std::vector<RunRequest>& requests,
                        const std::vector<std::pair<std::string, std::string>>& preprocess);

}  // namespace vrpipe::tools
