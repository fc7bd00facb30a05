#include "run/expected_error.h"

#include <algorithm>

namespace vrpipe {

namespace {

// What was measured: benchmarks/lt_errors.

/// A draw takes at least as long as its busiest resource works, which lt knows; where that never rests, no order of events
/// matters.
double error_of_units(double occupancy) {
  const double undecided = 1 - occupancy;
  return 0.2 + 2 * undecided / (undecided + 0.1);
}

/// Memory gets requests in the order of calls, and answers those that run ahead as if the later ones, which come before them, were
/// not. Where hardly anything is under way none meets another one.
double error_of_memory(MemoryUnit::Order order, double occupancy) {
  switch (order) {
    case MemoryUnit::Order::does_not_matter: return 0;
    case MemoryUnit::Order::is_hidden_by_units: return std::min(10.0, 60 * occupancy * (1 - occupancy));
    case MemoryUnit::Order::matters: return 10;
  }
  return 0;
}

}  // namespace

double least_expected_error_percent() { return error_of_units(1); }

std::optional<double> expected_error_percent(const Gpu& gpu, const RunResult& result) {
  if (!result.bottleneck || !result.outside_validated_range.empty()) return std::nullopt;
  const Bottleneck& bottleneck = *result.bottleneck;
  double expected = error_of_units(bottleneck.occupancy);
  for (const Gpu::PlacedMemory& placed : gpu.memories()) {
    const auto order = placed.memory->order(*result.cycles, placed.instance->path == bottleneck.unit);
    expected = std::max(expected, error_of_memory(order, bottleneck.occupancy));
  }
  return expected;
}

}  // namespace vrpipe
