#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace vrpipe::tools {

/// The JSON as a file holds it. Texts and keys become valid UTF-8, whatever bytes paths or plugins gave them: one that is
/// no part of it becomes e.g. `\xE9`, which JSON writes with two backslashes.
std::string json_text(const nlohmann::ordered_json& json);

}  // namespace vrpipe::tools
