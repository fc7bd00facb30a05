#pragma once

#include <algorithm>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/clock_crossing.h>

namespace vrpipe {

/// How long the data buses of all channels have data on them, in cycles of the DRAM. What moves after the frame is not counted.
class DataBusTime {
 public:
  /// `frame_end` outlives it.
  DataBusTime(const FrameEnd& frame_end, const ClockCrossing& clock) : clock_(clock), tally_(frame_end) {}

  /// Of a channel, from one edge of the DRAM up to another.
  void add(Cycle from, Cycle until) {
    const Cycle first = clock_.cycle_of(from);
    tally_.add(until - from, first, std::max(clock_.cycle_of(until), first + 1));
  }
  /// Whole ones before cycle `end` of the domain, which is not before `frame_end.so_far()`.
  std::uint64_t cycles(Cycle end) const { return static_cast<std::uint64_t>(tally_.items(end)); }

 private:
  ClockCrossing clock_;
  WorkTally tally_;
};

}  // namespace vrpipe
