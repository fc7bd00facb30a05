#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace vrpipe::tools {

// What journals belong to.

/// A file, or all files of a folder: paths, sizes and times.
nlohmann::json file_identity(const std::string& name);
/// Of SceneRequest::scene, which names a file: its files, and what of them is taken.
nlohmann::json scene_identity(const std::string& scene);
/// 64 hex digits.
std::string sha256(const std::string& text);

}  // namespace vrpipe::tools
