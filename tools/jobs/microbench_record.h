#pragma once

#include <nlohmann/json_fwd.hpp>

#include "jobs/microbench_job.h"

namespace vrpipe::tools {

// Figures of a microbenchmark, for a journal; without curves and what the host did.

nlohmann::json to_json(const MicrobenchResult& result);
/// Throws json::exception for what to_json() cannot have made.
MicrobenchResult microbench_from_json(const nlohmann::json& json);

}  // namespace vrpipe::tools
