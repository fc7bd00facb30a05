#pragma once

#include <optional>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// Time of `baseline` over that of `run`: of cycles at one clock, of simulated time at different ones; none without time,
/// or where nothing was drawn.
std::optional<double> speedup(const RunResult& baseline, const RunResult& run);

/// Fragments blended by the first run without any extension over those blended with early termination alone, of variants
/// that are no changes of others and on one platform; none when a run is missing, or nothing is blended.
std::optional<double> early_termination_ratio(const std::vector<RunResult>& runs);

/// The most exact fidelity of any run.
Fidelity finest_fidelity_of(const std::vector<RunResult>& runs);
/// What `--fidelity` says for the first that has it.
std::string finest_fidelity_text(const std::vector<RunResult>& runs);

/// Whether nothing is more exact: at the finest fidelity that the variant has, and all of the frame.
bool is_finest(const RunRequest& request);

/// Whether runs are of several platforms.
bool are_of_several_platforms(const std::vector<RunResult>& runs);

/// The place of the run of this name; the first for an empty one. Throws UserError naming the nearest.
std::size_t place_of_run(const std::vector<RunRequest>& requests, const std::string& name, const std::string& option);

}  // namespace vrpipe::tools
