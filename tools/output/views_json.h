#pragma once

#include "jobs/views_job.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// The result of `compare --views`: schema vrpipe.views/1 (docs/cameras.md).
Json views_json(const ViewsResult& result);

}  // namespace vrpipe::tools
