#pragma once

#include <atomic>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// simulate() of a request with a sampling.
RunResult simulate_sampled(const RunRequest& request, const Frame& frame, std::atomic<float>* progress);

/// simulate() of a request with an error.
RunResult simulate_within(const RunRequest& request, const Frame& frame, std::atomic<float>* progress);

/// Both throw UserError for a request that cannot be.
void check_may_sample(const RunRequest& request);
void check_error(const RunRequest& request);

}  // namespace vrpipe
