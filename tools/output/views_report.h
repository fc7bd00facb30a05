#pragma once

#include <string>

#include "host/terminal.h"
#include "jobs/views_job.h"

namespace vrpipe::tools {

/// What a person reads: distributions over the views, and the views one by one.
std::string views_report(const ViewsResult& result, const TextStyle& style);

}  // namespace vrpipe::tools
