#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

// Results on their way between processes and into files: all of a RunResult but the request, which points into the
// process and which the receiver knows, and the pixels. Integers, doubles and texts of any bytes come back as they were.

nlohmann::json encode(const RunResult& result);
/// @throws std::runtime_error for what encode() cannot have made
RunResult decode(const nlohmann::json& json, const RunRequest& request);

/// The same for another process of this very program: values without names, which take less time.
std::string to_bytes(const RunResult& result);
/// @throws std::runtime_error for what to_bytes() cannot have made
RunResult from_bytes(const std::string& bytes, const RunRequest& request);

}  // namespace vrpipe::tools
