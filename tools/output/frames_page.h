#pragma once

#include <string>

#include "jobs/frames_job.h"

namespace vrpipe::tools {

/// A self-contained HTML page: the paper's figures of whole frames (5, 8, 9, 10, 17, 22), of this scene, beside the images.
std::string frames_page(const FramesResult& result);

}  // namespace vrpipe::tools
