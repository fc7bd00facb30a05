#pragma once

#include <optional>
#include <vector>

#include <vrpipe/draw.h>
#include <vrpipe/platforms/simulation.h>

#include "images.h"
#include "progress_line.h"

namespace vrpipe::tools {

/// A simulation's result; its pixels are in `image`, when images were asked for, and not in `result.surface`.
struct Simulated {
  RunResult result;
  std::optional<SharedImage> image;
};

/// Runs one simulation in this process. Whatever is printed to stdout meanwhile goes to stderr.
Simulated simulate_here(const RunRequest& request, const Draw& draw, bool with_image, ProgressLine& progress);

/// Runs simulations side by side, each in a process of its own, at most `processes` at a time: SystemC holds one
/// simulation per process. The draw is shared, not copied. Results come in the order of the requests, and do not depend
/// on `processes`. The caller must not have other threads, nor have used SystemC.
/// Throws CommandFailure with the text of the first simulation that failed, or was killed; the others are ended.
std::vector<Simulated> simulate_in_processes(const std::vector<RunRequest>& requests, const Draw& draw,
                                             bool with_images, unsigned processes, ProgressLine& progress);

}  // namespace vrpipe::tools
