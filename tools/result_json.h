#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <vrpipe/platforms/simulation.h>

#include "simulation_job.h"

namespace vrpipe::tools {

using Json = nlohmann::ordered_json;

/// The result of `compare` and of `run`: schema vrpipe.compare/1 of the contract.
Json result_json(const JobResult& result);

// Parts that results have in common: of the contract, `scene` and `platform`.
Json scene_json(const SceneSummary& scene, std::uint32_t width, std::uint32_t height);
/// The parameters are those of all runs, which differ in the variant at most.
Json platform_json(const std::vector<RunResult>& runs);

/// A parameter's value with its type: numbers as numbers, switches as true and false, choices as strings.
Json typed_value(const Parameter& parameter, const std::string& value);

}  // namespace vrpipe::tools
