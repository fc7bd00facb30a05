#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>

#include "cli/config_file.h"
#include "jobs/simulation_job.h"

namespace vrpipe::tools {

/// Whether --print-config is given.
bool prints_config(const Invocation& invocation);

/// A configuration file of what a command would do: its options, the variants that are not vrpipe's, and every parameter,
/// each with where it comes from. It reads back to the same runs.
/// @param requests    at least one; alike but for platform and variant
/// @param preprocess  `preprocess.NAME` and value; empty where nothing is preprocessed
/// @param camera      of camera_texts(); empty where a command has its own
std::string config_text(const Invocation& invocation, const std::vector<RunRequest>& requests,
                        const std::vector<std::pair<std::string, std::string>>& preprocess,
                        const std::map<std::string, std::string>& camera = {});

/// By options without dashes the image's size and the camera as the scene has them, where nobody gives them; none of a draw list
/// and of a camera file. Throws UserError for a scene that is not there, and a camera that cannot be.
std::map<std::string, std::string> camera_texts(const SimulationJob& job);

}  // namespace vrpipe::tools
