#pragma once

#include <string>

#include "host/terminal.h"
#include "jobs/frames_job.h"

namespace vrpipe::tools {

/// What a person reads: the ways to draw a frame side by side, and what software did in it.
std::string frames_report(const FramesResult& result, const TextStyle& style);
/// And over many views.
std::string frames_report(const FrameViewsResult& result, const TextStyle& style);

}  // namespace vrpipe::tools
