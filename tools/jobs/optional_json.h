#pragma once

#include <optional>

#include <nlohmann/json.hpp>

namespace vrpipe::tools {

/// Null for what there is not.
inline nlohmann::ordered_json optional_json(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

}  // namespace vrpipe::tools
