#include <vrpipe/kernel/clock_crossing.h>

#include <vrpipe/kernel/clock_domain.h>

namespace vrpipe {

namespace {

std::uint64_t value_of(std::uint64_t ps) { return sc_core::sc_time(static_cast<double>(ps), sc_core::SC_PS).value(); }

}  // namespace

Cycle ClockCrossing::up(const Divisor& divisor, std::uint64_t dividend) {
  const Divisor::Division division = divisor.divide(dividend);
  return division.quotient + (division.remainder > 0 ? 1 : 0);
}

ClockCrossing::ClockCrossing(const ClockDomain& domain, std::uint64_t period_ps, std::uint64_t delay_ps)
    : domain_(domain.period().value()),
      other_(period_ps == 0 ? domain_.value() : value_of(period_ps)),
      delay_(delay_ps == 0 ? 0 : value_of(delay_ps)),
      same_(other_.value() == domain_.value()) {}

}  // namespace vrpipe
