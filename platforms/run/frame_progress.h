#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "run/sampled_time.h"

#include <vrpipe/component/statistic.h>
#include <vrpipe/pipeline/counts.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

class Gpu;
class UntimedGpu;

/// How far a frame has come in a GPU, and with what work, by the counters of its units.
class FrameProgress {
 public:
  explicit FrameProgress(const UntimedGpu& gpu);
  explicit FrameProgress(const Gpu& gpu);

  std::uint64_t splats() const { return sum(splats_); }     ///< that DRAW has issued
  std::uint64_t rasterized() const { return sum(quads_); }  ///< quads
  /// What all units count.
  Counts counts() const;
  SampledWork work() const;

 private:
  using Counters = std::vector<const Counter*>;
  void add(const std::string& slot, const Behaviour& behaviour);
  static std::uint64_t sum(const Counters& counters);
  std::vector<const Behaviour*> behaviours_;
  Counters splats_, quads_;
  std::array<Counters, counted_work_kinds> work_;
};

}  // namespace vrpipe
