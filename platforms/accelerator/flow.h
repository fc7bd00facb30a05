#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/slots/accelerator.h>

namespace vrpipe {

/// When steps have passed the stages of an accelerator. A stage works on one step at a time, in their order, on what the stage
/// before has done; between two stages there is room for `buffers` steps. What a step moves is served by the one memory while
/// its stage works. Time is in thousandths of a cycle.
class AcceleratorFlow {
 public:
  explicit AcceleratorFlow(const AcceleratorBehaviour::TimingParameters& timing) : timing_(timing) {}

  /// What no order of memory requests and no number of buffers undercuts: the busiest stage, all that precedes its first
  /// work and follows its last, or the memory.
  std::uint64_t bound(const std::vector<AcceleratorStep>& steps) const;
  /// Step by step: a stage waits for the one before, for room, and for a memory that serves requests in the order of
  /// time.
  std::uint64_t end(const std::vector<AcceleratorStep>& steps) const;

  /// Of moving bytes with nothing else to do.
  std::uint64_t memory_time(std::uint64_t bytes) const;

 private:
  /// Of a step in a stage that has the memory to itself.
  std::uint64_t alone(const AcceleratorStep::Part& part) const;
  std::uint64_t latency(std::size_t stage) const { return std::uint64_t{1000} * timing_.latency_cycles[stage]; }

  AcceleratorBehaviour::TimingParameters timing_;
};

}  // namespace vrpipe
