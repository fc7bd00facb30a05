#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <vrpipe/platforms/simulation.h>

#include "jobs/simulation_job.h"

namespace vrpipe::tools {

using Json = nlohmann::ordered_json;

/// The result of `compare` or of `run`: schema vrpipe.compare/1 of the contract, or vrpipe.run/1, which is the same.
Json result_json(const JobResult& result);

// Parts that results have in common.

/// Schema, version, and what made the result. `processes` simulations ran at a time.
Json head_json(const std::string& schema, const Provenance& provenance, unsigned processes);
/// Null for a draw list.
Json camera_json(const std::optional<Viewpoint>& viewpoint);
Json implementations_json(const RunResult& run);
/// Null where nothing has time.
Json bottleneck_json(const RunResult& run);
/// Of all units that the contract names; null where nothing has time.
Json utilization_json(const RunResult& run);
Json counts_json(const std::vector<std::pair<std::string, std::uint64_t>>& counts);
/// Kernels, or stages of an accelerator.
Json kernels_json(const std::vector<KernelReport>& reports);
Json scene_json(const SceneSummary& scene, std::uint32_t width, std::uint32_t height);
/// Of the first run's platform, with the parameters that its variants start from; what differs from them is in
/// changed_parameters_json().
/// @param preprocessing  what --set changed of it
Json platform_json(const std::vector<RunResult>& runs, const std::vector<Setting>& preprocessing,
                   const Provenance& provenance);

/// The parameters of a run, those alone that are others than these, of platform_json().
Json changed_parameters_json(const RunResult& run, const Json& parameters);

/// A parameter's value with its type: numbers as numbers, switches as true and false, choices as strings.
Json typed_value(const Parameter& parameter, const std::string& value);

}  // namespace vrpipe::tools
