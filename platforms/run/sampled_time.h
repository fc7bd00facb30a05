#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace vrpipe {

constexpr std::size_t counted_work_kinds = 6;
/// What a frame makes units do, in items of a kind, so far or in a part of it; the last is what the busiest of them takes.
using SampledWork = std::array<double, counted_work_kinds + 1>;

/// A part of a frame of which a window was simulated with time. Work is that of `functional`, everywhere.
struct SampledStratum {
  double quads = 0;  ///< of all of it
  SampledWork work{};
  std::size_t group = 0;    ///< of strata alike
  double window_quads = 0;  ///< of the window in it
  SampledWork window_work{};
  double window_cycles = 0;
};

struct EstimatedTime {
  double cycles = 0;
  double half_width = 0;  ///< of the interval that holds the cycles of 95 frames in 100
};

/// Cycles of all strata by those of their windows: those that the work takes, at prices of no less than 0 that fit those of the
/// windows best, and what a window took beyond that, for each quad of its stratum: a generalised regression estimator (Sarndal,
/// Swensson and Wretman, Model Assisted Survey Sampling, 6.4). The variance is that of windows of a group that were drawn without strata, of
/// which strata only take away; a window alone in its group stands for about itself.
///
/// @param strata  in the order of the frame; twelve at least
EstimatedTime estimate_time(const std::vector<SampledStratum>& strata);

}  // namespace vrpipe
