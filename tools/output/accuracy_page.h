#pragma once

#include <string>

#include "jobs/accuracy_job.h"

namespace vrpipe::tools {

/// A page of HTML that stands alone: both ladders with their plots, the images and their error maps. Nothing in it is
/// loaded from elsewhere.
std::string accuracy_page(const AccuracyResult& result);

}  // namespace vrpipe::tools
