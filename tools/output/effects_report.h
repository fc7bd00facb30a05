#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/terminal.h"
#include "jobs/effect_costs.h"

namespace vrpipe::tools {

/// Why a run may omit an effect; none for one that is active, and for one that the user left out by force.
std::optional<EffectProof> proof_of(const RunResult& run, const EffectReport& effect);

/// In a word: active, or why it is omitted: static, verified, bounded, forced.
std::string state_of(const RunResult& run, const EffectReport& effect);

/// What a heading says of the choice of effects; empty where it is the default.
std::string effects_choice_text(const RunRequest& request);

/// The effects of one run with reasons, of several side by side; lines of at most 100 characters. Empty where no run has
/// any.
/// @param costs  one for each run, which then has a table of its own; or none
std::string effects_text(const std::vector<RunResult>& runs, const std::vector<EffectCosts>& costs,
                         const TextStyle& style);

}  // namespace vrpipe::tools
