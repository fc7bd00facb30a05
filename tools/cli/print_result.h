#pragma once

#include "jobs/simulation_job.h"

namespace vrpipe::tools {

/// Prints the report, and writes the JSON to where the job says; to stdout in place of the report. Throws UserError.
void print_result(const SimulationJob& job, const JobResult& result);

}  // namespace vrpipe::tools
