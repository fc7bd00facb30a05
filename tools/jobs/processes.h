#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

#include "host/progress_line.h"
#include "image/images.h"

namespace vrpipe::tools {

/// A simulation's result; its pixels are in `image`, when images were asked for, and not in `result.framebuffer.color`.
struct Simulated {
  RunResult result;
  std::optional<SharedImage> image;
};

/// Runs one simulation in this process. Whatever is printed to stdout meanwhile goes to stderr.
Simulated simulate_here(const RunRequest& request, const Frame& frame, bool with_image, ProgressLine& progress);

/// Gives the frame of a request, when its simulation is about to start; that may let go of it afterwards.
using FrameSource = std::function<std::shared_ptr<const Frame>(const RunRequest& request)>;

/// One of several simulations.
struct Task {
  std::string name;  ///< in progress and messages
  RunRequest request;
  FrameSource frame;
};

/// Where some simulations stand among all that a command runs, for the progress.
struct BatchPlace {
  std::string title;                          ///< before the progress; may be changed meanwhile, by `finished`
  std::size_t before = 0;                     ///< simulations done already
  std::size_t after = 0;                      ///< simulations that will follow
  double seconds_before = 0;                  ///< that those before took, wall time
  std::function<void()> meanwhile = nullptr;  ///< called some times a second, if there is one
  /// Given a simulation that ended in a fault of its own; then the others go on.
  std::function<void(std::size_t index, const std::string& fault)> failed = nullptr;
};

/// Runs simulations side by side, each in a process of its own, at most `processes` at a time: SystemC holds one
/// simulation per process. `finished` gets each as it ends, in whatever order; what it is given for one does not depend
/// on `processes`. The caller must not have other threads meanwhile, nor have used SystemC.
/// Throws CommandFailure with the text of the first simulation that failed, unless `failed` takes it, or was killed; the
/// others are ended.
void run_tasks(const std::vector<Task>& tasks, bool with_images, unsigned processes, const BatchPlace& place,
               ProgressLine& progress, const std::function<void(std::size_t index, Simulated&& simulated)>& finished);

/// The same for requests that share a source of frames; results in the order of the requests.
std::vector<Simulated> simulate_in_processes(const std::vector<RunRequest>& requests, const FrameSource& frame,
                                             bool with_images, unsigned processes, ProgressLine& progress);

}  // namespace vrpipe::tools
