#pragma once

#include "jobs/simulation_job.h"
#include "jobs/views_job.h"

namespace vrpipe::tools {

/// Prints the report, and writes the JSON to where the job says; to stdout in place of the report. Throws
/// CommandFailure once all is written that can be.
void print_result(const SimulationJob& job, JobResult result);
/// The same of many views; finishes their journal.
void print_result(const SimulationJob& job, const ViewsResult& result);

}  // namespace vrpipe::tools
