#pragma once

namespace vrpipe {

/// Stages behind a port that sends, `items_per_cycle` wide. What is in them takes no place of the receiver's queue.
struct PipelineStages {
  unsigned cycles = 0;
  unsigned items_per_cycle = 1;

  /// Of a unit with so many cycles of latency, at least 1: the last of them is the link's.
  static constexpr PipelineStages of_latency(unsigned latency_cycles, unsigned items_per_cycle = 1) {
    return {latency_cycles - 1, items_per_cycle};
  }
};

}  // namespace vrpipe
