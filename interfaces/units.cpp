#include <vrpipe/units.h>

#include <fmt/format.h>

#include <vrpipe/error.h>

namespace vrpipe {

std::uint32_t SmBehaviour::Cost::fragment_slots() const {
  const std::uint64_t slots = std::uint64_t{cores} * warps_per_core;
  if (slots > no_slot) {
    throw UserError("unusable SM array", "sm.cores, sm.warps_per_core",
                    fmt::format("{} cores of {} warps are more than {} warps", cores, warps_per_core, no_slot),
                    "lower one of them");
  }
  return static_cast<std::uint32_t>(slots);
}

}  // namespace vrpipe
