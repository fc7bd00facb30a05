#pragma once

#include <string>
#include <vector>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// simulate() of a variant that draws with units outside the pipeline.
RunResult simulate_outside_pipeline(const RunRequest& request, const Frame& frame);

/// What check_configuration() checks of such a variant beside the platform. Throws UserError.
void check_outside_pipeline(const RunRequest& request);

/// Names of all that its units count.
std::vector<std::string> statistics_outside_pipeline(const RunRequest& request);

}  // namespace vrpipe
