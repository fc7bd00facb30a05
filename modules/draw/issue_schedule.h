#pragma once

#include <algorithm>
#include <cstdint>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/barrier_plan.h>

namespace vrpipe {

/// When vertex warps are due: at an even rate from cycle 0 on, so that a stall is caught up. A barrier is none: behind it
/// nothing can be fetched ahead, and the rate begins anew.
class IssueSchedule {
 public:
  explicit IssueSchedule(std::uint32_t warps_per_1024_cycles) : rate_(warps_per_1024_cycles) {}
  /// The next warp.
  Cycle due() const { return due(issued_); }
  /// It is issued; returns the cycles from its turn to that of the one after it.
  Cycle issue() {
    ++issued_;
    return due(issued_) - due(issued_ - 1);
  }
  void restart(Cycle now) {
    begin_ = std::max(now, due());  // the turn of the last warp is over first
    issued_ = 0;
  }

 private:
  Cycle due(std::uint64_t warp) const { return begin_ + warp * 1024 / rate_; }

  const std::uint32_t rate_;
  Cycle begin_ = 0;
  std::uint64_t issued_ = 0;  ///< since then
};

}  // namespace vrpipe
