#pragma once

#include <cstdint>

#include <vrpipe/arithmetic/divisor.h>
#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

class ClockDomain;

/// Between the cycles of a clock domain and those of another clock, in which a memory of the domain counts: an L2 of a
/// frequency of its own, a DRAM. Both began at time 0; exact, in integers.
class ClockCrossing {
 public:
  /// @param period_ps  of the other clock; 0: that of the domain
  /// @param delay_ps   from an edge of the other clock until the domain can see what is there
  ClockCrossing(const ClockDomain& domain, std::uint64_t period_ps, std::uint64_t delay_ps = 0);

  /// Whether both have one period, and so the same cycles.
  bool is_same() const { return same_; }
  /// The first edge of the other clock that is not before a cycle of the domain.
  Cycle edge_of(Cycle cycle) const { return same_ ? cycle : up(other_, cycle * domain_.value()); }
  /// How many cycles of the other clock are over by a cycle of the domain.
  Cycle over_by(Cycle cycle) const { return same_ ? cycle : other_.divide(cycle * domain_.value()).quotient; }
  /// The first cycle of the domain that is not before an edge of the other clock.
  Cycle cycle_of(Cycle edge) const { return same_ ? edge : up(domain_, edge * other_.value()); }
  /// The first cycle of the domain that can see what is there at an edge.
  Cycle seen(Cycle edge) const { return up(domain_, edge * other_.value() + delay_); }
  /// The first cycle of the domain whose `edge_of` is later than an edge.
  Cycle after(Cycle edge) const {
    if (edge == never) return never;
    return (same_ ? edge : domain_.divide(edge * other_.value()).quotient) + 1;
  }
  /// Cycles of the domain for one of the other clock.
  double ratio() const { return static_cast<double>(other_.value()) / static_cast<double>(domain_.value()); }

 private:
  // Out of line, so that of one clock only the question is left.
  static Cycle up(const Divisor& divisor, std::uint64_t dividend);

  Divisor domain_, other_;  ///< periods, in units of sc_time
  std::uint64_t delay_;
  bool same_;  ///< periods
};

}  // namespace vrpipe
