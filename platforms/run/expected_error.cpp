#include "run/expected_error.h"

namespace vrpipe {

namespace {

// What was measured: benchmarks/lt_errors.

/// A draw takes at least as long as its busiest resource works, which lt knows; where that never rests, no order of events
/// matters.
double error_of_units(double occupancy) {
  const double undecided = 1 - occupancy;
  return 0.2 + 2 * undecided / (undecided + 0.1);
}

/// Where requests wait for one another in memory, which gets them in the order of calls and answers later ones as if those before
/// were all.
constexpr double error_of_memory = 10;

}  // namespace

double least_expected_error_percent() { return error_of_units(1); }

std::optional<double> expected_error_percent(const Gpu& gpu, const RunResult& result) {
  if (!result.bottleneck || !result.outside_validated_range.empty()) return std::nullopt;
  double expected = error_of_units(result.bottleneck->occupancy);
  for (const Gpu::PlacedMemory& placed : gpu.memories()) {
    if (placed.memory->depends_on_order() || placed.instance->path == result.bottleneck->unit)
      expected = error_of_memory;
  }
  return expected;
}

}  // namespace vrpipe
