#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

void ShadedWarp::keep(const std::array<LaneMask, quads_per_warp>& left) {
  unsigned kept = 0;
  for (unsigned i = 0; i < count; ++i) {
    const auto alive = static_cast<LaneMask>(live[i] & left[i]);
    if (alive == 0) continue;
    const LaneBits lanes = expand_mask(alive);
    const QuadColor& from = color[i];
    const Lanes none = splat_lanes(0);
    color[kept] = {select(lanes, from.red, none), select(lanes, from.green, none), select(lanes, from.blue, none),
                   select(lanes, from.alpha, none)};
    position[kept] = position[i];
    live[kept] = alive;
    covered[kept] = alive;
    first_primitive[kept] = first_primitive[i];
    last_primitive[kept] = last_primitive[i];
    draw[kept] = draw[i];
    ++kept;
  }
  count = static_cast<std::uint8_t>(kept);
}

}  // namespace vrpipe
