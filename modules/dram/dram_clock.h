#pragma once

#include <cstdint>

#include <vrpipe/arithmetic/divisor.h>
#include <vrpipe/kernel/clock_domain.h>

namespace vrpipe {

/// Between the cycles of a clock domain and those of a DRAM, which both began at time 0: exact, in integers.
class DramClock {
 public:
  DramClock(const ClockDomain& domain, std::uint64_t tck_ps, std::uint64_t controller_ps)
      : period_(domain.period().value()),
        tck_(value_of(tck_ps)),
        controller_(controller_ps == 0 ? 0 : value_of(controller_ps)) {}

  /// The first edge of the DRAM that is not before that of a cycle of the domain.
  Cycle edge_of(Cycle cycle) const { return tck_.quotient_up(cycle * period_.value()); }
  /// The first cycle of the domain in which is seen what the DRAM has at an edge, once it has passed the controller.
  Cycle seen(Cycle edge) const { return period_.quotient_up(edge * tck_.value() + controller_); }
  /// The first cycle of the domain that is not before an edge of the DRAM.
  Cycle cycle_of(Cycle edge) const { return period_.quotient_up(edge * tck_.value()); }
  /// The first cycle of the domain whose `edge_of` is later than an edge.
  Cycle after(Cycle edge) const { return edge == never ? never : period_.quotient(edge * tck_.value()) + 1; }

 private:
  static std::uint64_t value_of(std::uint64_t ps) {
    return sc_core::sc_time(static_cast<double>(ps), sc_core::SC_PS).value();
  }

  Divisor period_, tck_;  ///< in units of sc_time
  std::uint64_t controller_;
};

}  // namespace vrpipe
