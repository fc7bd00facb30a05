#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

#include "host/terminal.h"

namespace vrpipe::tools {

/// On what runs were simulated: a line for each platform, one on what was asked of all runs, and one for each variant
/// that changes another. The runs are alike in everything else.
std::string machines_text(const std::vector<RunResult>& runs, const std::vector<Setting>& preprocessing,
                          std::uint32_t passes, const TextStyle& style);

/// Of a run whose platform and settings alone matter.
std::string machine_text(const RunRequest& request, const TextStyle& style);

}  // namespace vrpipe::tools
