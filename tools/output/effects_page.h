#pragma once

#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// A table of HTML: what each run made of each effect, side by side, and why. The runs differ in the variant.
std::string effects_html(const std::vector<const RunResult*>& runs);

}  // namespace vrpipe::tools
