#include "crop/in_shader_time.h"

namespace vrpipe {

namespace {
/// So many thousandths of a cycle of another clock, in those of this one.
std::uint64_t in_clock(std::uint64_t thousandths, double mhz, std::uint64_t clock_ps) {
  if (mhz <= 0) return thousandths;
  return static_cast<std::uint64_t>(static_cast<double>(thousandths) * 1e6 / mhz / static_cast<double>(clock_ps) + 0.5);
}
}  // namespace

InShaderTime::InShaderTime(const InShaderParameters& parameters, std::uint64_t clock_ps)
    : locks(parameters.lock == InShaderParameters::ordered),
      warps(parameters.warps),
      blend_cycles(parameters.blend_cycles),
      hand_over_cycles(static_cast<std::uint32_t>(
          (in_clock(std::uint64_t{parameters.hand_over_cycles} * 1000, parameters.lock_clock_mhz, clock_ps) + 500) /
          1000)),
      memory_bytes_per_cycle(parameters.memory_bytes_per_cycle),
      tile_thousandths_(in_clock(parameters.tile_lock_cycles.thousandths(), parameters.lock_clock_mhz, clock_ps)),
      warp_thousandths_(in_clock(parameters.warp_lock_cycles.thousandths(), parameters.lock_clock_mhz, clock_ps)) {}

}  // namespace vrpipe
