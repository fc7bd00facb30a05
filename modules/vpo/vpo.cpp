#include "vpo/vpo.h"

#include <vrpipe/geometry.h>
#include <vrpipe/registry.h>

namespace vrpipe {

PrimitiveAssembly::PrimitiveAssembly(const Parameters& parameters, const RenderState& state)
    : state_(state), triangles_per_cycle_(parameters.triangles_per_cycle), latency_cycles_(parameters.latency_cycles) {}

unsigned PrimitiveAssembly::assemble(std::uint32_t splat, std::array<Primitive, 2>& out) {
  unsigned count = 0;
  for (unsigned triangle = 0; triangle < triangles_per_splat(*state_.draw); ++triangle) {
    SnappedTriangle snapped;
    if (!snap_triangle(state_, splat, triangle, snapped)) {
      ++dropped_not_finite;
      return 0;
    }
    if (doubled_area(snapped) == 0) {
      ++culled_zero_area;
      continue;
    }
    const PixelRect bounds = covered_bounds(snapped, state_.subpixel_bits, state_.draw->width, state_.draw->height);
    if (bounds.empty()) {
      ++culled_outside;
      continue;
    }
    out[count].splat = splat;
    out[count].triangle = static_cast<std::uint8_t>(triangle);
    out[count].bounds = bounds;
    ++count;
    ++primitives;
  }
  return count;
}

namespace {
const Registrar<PrimitiveAssembly, VpoBehaviour> registrar("vpo", "primitive-assembly",
                                                           "two triangles per splat, culled and boxed");
}

}  // namespace vrpipe
