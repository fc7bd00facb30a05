#pragma once

#include <cmath>
#include <optional>

#include <nlohmann/json.hpp>

namespace vrpipe::tools {

/// Null for what there is not.
inline nlohmann::ordered_json optional_json(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

/// The same of a column of a study, in which infinity is the text "inf": JSON has no number for it.
inline nlohmann::ordered_json column_json(const std::optional<double>& value) {
  return value && std::isinf(*value) ? nlohmann::ordered_json("inf") : optional_json(value);
}

}  // namespace vrpipe::tools
