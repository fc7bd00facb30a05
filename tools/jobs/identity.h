#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

// What journals belong to.

/// A file, or all files of a folder: paths, sizes and times.
nlohmann::json file_identity(const std::string& name);
/// Of SceneRequest::scene: the name of a built-in scene; else its files, and what of them is taken.
nlohmann::json scene_identity(const std::string& scene);
nlohmann::json settings_identity(const std::vector<Setting>& settings);
/// Of all that a run's result depends on beside what is drawn, the program and its plugins.
nlohmann::json request_identity(const RunRequest& request);
/// 64 hex digits.
std::string sha256(const std::string& text);

}  // namespace vrpipe::tools
