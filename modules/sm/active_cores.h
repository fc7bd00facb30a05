#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <vrpipe/component/statistic.h>
#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// How long the cores of an SM array have fragment warps, each from the launch of its first to the release of its last.
class ActiveCores : public StatisticSet {
 public:
  ActiveCores(StatisticSet& owner, std::size_t cores) : StatisticSet(owner, "fragments"), of_core_(cores) {}

  /// Of a core launches and releases come in the order of their cycles.
  void launched(std::size_t core, Cycle at) {
    if (of_core_[core].warps++ == 0) of_core_[core].since = at;
  }
  void released(std::size_t core, Cycle at) {
    if (--of_core_[core].warps == 0) core_cycles += at - std::min(at, of_core_[core].since);
  }
  /// The frame has ended.
  void close(Cycle end) {
    for (OfCore& core : of_core_) {
      if (core.warps > 0) core_cycles += end - std::min(end, core.since);
      core.warps = 0;
    }
  }

  Counter core_cycles{*this, "core_cycles", "cycles", "in which a core has fragment warps, of all cores"};

 private:
  struct OfCore {
    std::uint32_t warps = 0;
    Cycle since = 0;
  };
  std::vector<OfCore> of_core_;
};

}  // namespace vrpipe
