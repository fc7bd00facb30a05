#pragma once

#include "output/microbench_report.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// Schema vrpipe.microbench/1.
Json microbench_json(const MicrobenchRun& run);

}  // namespace vrpipe::tools
