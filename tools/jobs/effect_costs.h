#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>

#include "host/progress_line.h"
#include "jobs/processes.h"

namespace vrpipe::tools {

/// What the effects that a run omits would cost the host: CPU seconds of whole runs, of each the least of some.
struct EffectCosts {
  double without = 0;                                ///< the run as it was
  std::vector<std::pair<std::string, double>> with;  ///< one effect more, by its name
  double with_all = 0;                               ///< all effects

  /// None for an effect that the run did not omit.
  std::optional<double> with_effect(const std::string& name) const;
};

/// Repeats runs with what they omitted, three times in turn, one simulation at a time. Where that takes long, says so on
/// stderr beforehand.
/// Throws what run_tasks() throws, and CommandFailure where an effect that was proved to change nothing changes the result.
std::vector<EffectCosts> measure_effects(const std::vector<RunResult>& runs, const FrameSource& frame,
                                         ProgressLine& progress);

/// What is said beforehand of so many simulations, which take so long altogether; empty where that is not long.
std::string announcement(std::size_t simulations, double seconds);

}  // namespace vrpipe::tools
