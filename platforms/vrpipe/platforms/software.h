#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// Frames prepared and rendered by compute kernels, one after the other, on a platform's SM array: units of the slots
/// `preparation`, `binning` and `render` (slots/kernel_work.h). They come from the registry as those of the pipeline do,
/// by their slot's default or `--unit`, and have parameters and statistics; the SM array's cores, the clock and the
/// memory are those of the platform.

struct SoftwareResult {
  RunRequest request;
  std::optional<KernelReport> preprocess;  ///< none of a draw list
  std::vector<KernelReport> binning;
  KernelReport render;
  std::optional<std::uint64_t> cycles;  ///< of all; none where the fidelity has no time
  double host_seconds = 0;              ///< wall time of the simulation alone
  Counts counts;                        ///< fragments, as far as the render kernel says
  std::vector<StatisticReport> statistics;
  std::vector<std::pair<std::string, std::string>> implementations;  ///< slot and name
  std::vector<std::pair<std::string, std::string>> parameters;       ///< SLOT.PARAMETER and value
  bool as_shipped = true;   ///< every slot has its own unit, and that its defaults
  Framebuffer framebuffer;  ///< of RGBA32F
  std::string result_hash;  ///< of statistics, cycles and the stored bits of the image, 16 hex digits
};

/// Whether --set and --unit of this name are for kernels or an accelerator.
bool is_outside_pipeline(const std::string& unit);
/// The request without what is for these: for the pipeline.
RunRequest of_pipeline_alone(RunRequest request);
/// Whether a variant draws with a unit of this slot.
bool draws_with(const Variant& variant, const std::string& slot);
/// Whether a unit or link, `gpc0.crop` as well, is known and is none of those that a variant draws with.
bool is_without(const Variant& variant, const std::string& unit);
/// Throws UserError for a frame that the variant of a request cannot draw: outside the pipeline one plain draw of splats is all.
void check_drawable(const RunRequest& request, const Frame& frame);
/// The request without its settings and units for kernels and accelerators that its variant does not draw with.
RunRequest of_variant_alone(RunRequest request);

/// Renders a frame in software. Settings and units of the request may be of the platform's units, too. `functional` counts and
/// gives the image; `bound` is the least that kernels take; at `lt` the blocks of the render kernel are a fluid that cores share, at
/// `cycle` each of its instructions has a cycle. The other kernels have a price for each item at all of them.
/// @param gaussians  of the scene; none where splats are given, and nothing is projected
/// Throws UserError for unknown units, parameters and values, and a frame that is not one draw of splats;
/// SimulationFault for a unit that breaks a rule.
SoftwareResult simulate_software(const RunRequest& request, const Frame& frame, std::optional<std::uint64_t> gaussians);

/// What precedes a hardware draw: Gaussians projected, and splats sorted.
struct HardwarePreparation {
  std::optional<KernelReport> preprocess;  ///< none of a draw list
  KernelReport sort;
};
/// Throws as simulate_software().
HardwarePreparation prepare_for_hardware(const RunRequest& request, const Frame& frame,
                                         std::optional<std::uint64_t> gaussians);

/// Units and settings of kernels and accelerators, without running any; throws UserError. Gives SLOT.PARAMETER and final value of all that
/// the chosen units have.
std::vector<std::pair<std::string, std::string>> check_software(const RunRequest& request);

}  // namespace vrpipe
