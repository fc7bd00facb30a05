#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

#include "host/terminal.h"

namespace vrpipe::tools {

/// On what runs were simulated: a line for each platform, one on what was asked of all runs, and one for each variant
/// that changes another. The runs are alike in everything else.
/// @param axes  of a study: what these say (fidelity, format, termination, multi-pass) is left out
std::string machines_text(const std::vector<RunResult>& runs, const std::vector<Setting>& preprocessing,
                          std::uint32_t passes, const TextStyle& style, const std::vector<std::string>& axes = {});

/// Which variants do not take a unit that is chosen for all, and why; empty if all do.
std::string not_taken_text(const UnitChoice& unit, const std::vector<const Variant*>& variants);

/// Of a run whose platform and settings alone matter.
std::string machine_text(const RunRequest& request, const TextStyle& style);

}  // namespace vrpipe::tools
