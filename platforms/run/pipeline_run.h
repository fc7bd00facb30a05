#pragma once

#include <atomic>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

class FrameSampler;

/// simulate() of a variant of the pipeline, at the fidelity of the request, whatever its sampling and its error are.
/// @param sampler  of the time of a run without time; or null
RunResult simulate_pipeline(const RunRequest& request, const Frame& frame, std::atomic<float>* progress,
                            FrameSampler* sampler = nullptr);

bool samples_statistics(const RunRequest& request);
/// Throws UserError for statistics that are to be sampled of a run that has no time for most of its course, or none.
void check_sampling_has_time(const RunRequest& request);
/// Throws UserError for a run that is to stop at a cycle, at a fidelity that cannot.
void check_may_stop(const RunRequest& request);

}  // namespace vrpipe
