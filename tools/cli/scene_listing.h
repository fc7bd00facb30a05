#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "host/terminal.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// What is in a file of Gaussians, for `vrpipe scenes FILE`.
struct SceneListing {
  std::string text;
  Json json;
};

/// Reads the scene, describes it, and draws it if there is a name for the picture: small, in full precision, without time.
/// Throws UserError.
SceneListing describe_scene(const std::string& scene, const std::optional<std::string>& preview,
                            const TextStyle& style);

/// The formats that are read, for `vrpipe scenes`.
std::string formats_as_text(const TextStyle& style);
std::string formats_as_markdown();
Json formats_as_json();

}  // namespace vrpipe::tools
