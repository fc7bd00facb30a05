#include "l2/own_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/model/memory_unit.h>

namespace vrpipe {

OwnClock::OwnClock(const char* slot, std::uint32_t frequency_mhz, const RenderContext& context)
    : units_ps_(context.clock_ps),
      period_ps_(frequency_mhz == 0 ? 0 : static_cast<std::uint64_t>(std::llround(1e6 / frequency_mhz))) {
  if (frequency_mhz == 0 || period_ps_ >= units_ps_) return;
  throw UserError("unusable clock", fmt::format("{}.frequency_mhz", slot),
                  fmt::format("{} MHz is more than the {:.6g} MHz of the units", frequency_mhz,
                              1e6 / static_cast<double>(units_ps_)),
                  "use less, or 0 for theirs");
}

std::vector<unsigned> OwnClock::port_bytes(MemoryPlace place, unsigned own) const {
  for (unsigned& bytes : place.ports) {
    if (period_ps_ != 0) bytes = static_cast<unsigned>((bytes * period_ps_ + units_ps_ - 1) / units_ps_);
  }
  return place.port_bytes(own);
}

MemoryBehaviour::TimingParameters OwnClock::of_units(const MemoryBehaviour::TimingParameters& own) const {
  if (period_ps_ == 0) return own;
  const std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
  return {static_cast<std::uint32_t>(std::min(own.latency_cycles * period_ps_ / units_ps_, most)),
          static_cast<std::uint32_t>((own.bytes_per_cycle * units_ps_ + period_ps_ - 1) / period_ps_)};
}

}  // namespace vrpipe
