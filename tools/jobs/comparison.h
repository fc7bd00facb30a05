#pragma once

#include <optional>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// Cycles of `baseline` over those of `run`; none without time, or where nothing was drawn.
std::optional<double> speedup(const RunResult& baseline, const RunResult& run);

/// Fragments blended by the baseline over those blended with early termination alone; none when a run is missing, or
/// nothing is blended.
std::optional<double> early_termination_ratio(const std::vector<RunResult>& runs);

}  // namespace vrpipe::tools
