#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/platforms/software.h>

namespace vrpipe {

/// A frame drawn by an accelerator: a unit of slot `accelerator` (slots/accelerator.h), by the slot's default or `--unit`,
/// with a clock and a memory of its own. Nothing of the platform tells.
struct AcceleratorResult {
  RunRequest request;
  std::string name;  ///< of the unit
  std::uint32_t frequency_mhz = 0;
  /// Stages with what they are busy for alone, the memory theirs, in cycles of the accelerator. They overlap.
  std::optional<KernelReport> preprocess;  ///< none of a draw list
  KernelReport sort, raster;
  std::optional<std::uint64_t> cycles;           ///< of the frame; none where the fidelity has no time
  std::optional<std::uint64_t> interval_cycles;  ///< least from frame to frame: of the busiest stage, or the memory
  std::string bound_by;     ///< the busiest stage and what bounds it, or "memory"; empty without time
  double host_seconds = 0;  ///< wall time of the simulation alone
  Counts counts;            ///< fragments, as far as the unit says
  std::vector<StatisticReport> statistics;
  std::vector<std::pair<std::string, std::string>> parameters;  ///< accelerator.PARAMETER and value
  Framebuffer framebuffer;                                      ///< of RGBA32F
  std::string result_hash;  ///< of statistics, cycles and the stored bits of the image, 16 hex digits
};

/// Draws a frame. `functional` counts and gives the image; `bound` is the busiest stage with what precedes it, or the memory;
/// at `lt` chunks pass the stages one after the other, and share the memory.
/// @param gaussians  of the scene; none where splats are given, and nothing is converted
/// Throws UserError for unknown units, parameters and values, for `cycle`, which there is not, and for a frame that is not
/// one draw of splats; SimulationFault for a unit that breaks a rule.
AcceleratorResult simulate_accelerator(const RunRequest& request, const Frame& frame,
                                       std::optional<std::uint64_t> gaussians);

}  // namespace vrpipe
