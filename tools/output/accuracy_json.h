#pragma once

#include "jobs/accuracy_job.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// Both ladders: schema vrpipe.accuracy/1 of the contract. A PSNR of equal images is null.
Json accuracy_json(const AccuracyResult& result);

}  // namespace vrpipe::tools
