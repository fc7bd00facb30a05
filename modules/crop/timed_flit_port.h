#pragma once

#include <algorithm>
#include <cstdint>

#include "flit_port.h"

#include <vrpipe/memory/bandwidth.h>

namespace vrpipe {

/// FlitPort at lt, where what goes through it is not known in the order of time: what is known late takes cycles that were idle.
class TimedFlitPort {
 public:
  explicit TimedFlitPort(const FlitPort& port) : flits_(std::max(port.per_cycle(), 1U)), backlog_(port.backlog()) {}
  /// The first cycle from one on in which its backlog takes more.
  Cycle open_from(Cycle cycle) const {
    const std::uint64_t waiting = flits_.reserved_from(cycle);
    if (waiting <= backlog_) return cycle;
    return cycle + (waiting - backlog_ + flits_.bytes_per_cycle() - 1) / flits_.bytes_per_cycle();
  }
  /// As FlitPort's; `present` is the cycle of the clock.
  void take(unsigned flits, Cycle at, Cycle present) { flits_.take(at, flits, present); }

 private:
  BandwidthReservation flits_;
  std::uint32_t backlog_;
};

}  // namespace vrpipe
