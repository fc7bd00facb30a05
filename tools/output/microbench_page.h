#pragma once

#include <string>

#include "output/microbench_report.h"

namespace vrpipe::tools {

/// One self-contained page with the figures, the curves and the findings; it needs no network.
std::string microbench_page(const MicrobenchRun& run);

}  // namespace vrpipe::tools
