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
  std::uint64_t rasterized_before(DrawIndex draw) const;    ///< of draws before it
  std::uint64_t set_up() const { return sum(setups_); }     ///< primitives, once for each bin of TGC that they are in
  /// The same that TGC holds, to be set up later.
  std::uint64_t held() const { return sum(entries_) > set_up() ? sum(entries_) - set_up() : 0; }
  /// What all units count.
  Counts counts() const;
  SampledWork work() const;

 private:
  using Counters = std::vector<const Counter*>;
  void add(const std::string& slot, const Behaviour& behaviour);
  template <class AnyCounters>
  static std::uint64_t sum(const AnyCounters& counters) {
    std::uint64_t sum = 0;
    for (const Counter* const counter : counters) sum += counter->value();
    return sum;
  }
  std::vector<const Behaviour*> behaviours_;
  std::vector<const DrawCounter*> quads_;
  Counters splats_, setups_, entries_;
  std::array<Counters, counted_work_kinds> work_;
};

}  // namespace vrpipe
