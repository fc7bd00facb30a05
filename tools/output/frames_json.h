#pragma once

#include "jobs/frames_job.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// The result of `frames`: schema vrpipe.frames/1 of the contract.
Json frames_json(const FramesResult& result);
/// And with --views: schema vrpipe.frame-views/1 (docs/software.md).
Json frames_json(const FrameViewsResult& result);

}  // namespace vrpipe::tools
