#pragma once

#include <string>

#include "jobs/simulation_job.h"

namespace vrpipe::tools {

/// One page that needs no network, of a job with SimulationJob::html: pictures, speed-ups, where quads and cycles went,
/// and every parameter. Plots are vectors that can be read in grey, with their data as CSV beside them.
std::string compare_page(const JobResult& result);

}  // namespace vrpipe::tools
