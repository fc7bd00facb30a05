#include "vpo/vpo.h"

#include <algorithm>
#include <cmath>

#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

/// In millionths of a square pixel.
std::uint64_t determinant(const Splat& splat) {
  const double area = std::fabs(static_cast<double>(splat.ax) * static_cast<double>(splat.by) -
                                static_cast<double>(splat.ay) * static_cast<double>(splat.bx));
  const double squared_extent = static_cast<double>(splat.r) * static_cast<double>(splat.r);
  if (!(area > 0) || !(squared_extent > 0)) return 0;
  return static_cast<std::uint64_t>(std::min(area / squared_extent * 1e6, 1e18));
}

}  // namespace

PrimitiveAssembly::PrimitiveAssembly(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      triangles_per_cycle_(parameters.triangles_per_cycle),
      latency_cycles_(parameters.latency_cycles) {}

unsigned PrimitiveAssembly::assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) {
  const DrawCall& call = context_.draw(draw);
  if (!is_finite(call, splat)) {
    ++dropped_not_finite;
    return 0;
  }
  // A splat at opacity 1/255 has no extent by design, and triangles of their own have no axes.
  if (call.geometry->triangles.empty() && !call.geometry->is_mesh()) {
    const Splat& given = call.splat(splat);
    if (given.r > 0) smallest_determinant.see(determinant(given));
  }
  unsigned count = 0;
  for (unsigned triangle = 0; triangle < triangles_per_splat(*call.geometry); ++triangle) {
    PixelRect bounds;
    switch (cull_triangle(context_, draw, splat, triangle, bounds)) {
      case Culling::not_finite: ++dropped_not_finite; return 0;
      case Culling::zero_area: ++culled_zero_area; continue;
      case Culling::facing: ++culled_facing; continue;
      case Culling::outside: ++culled_outside; continue;
      case Culling::none: break;
    }
    out[count].splat = splat;
    out[count].triangle = static_cast<std::uint8_t>(triangle);
    out[count].draw = draw;
    out[count].bounds = bounds;
    ++count;
  }
  primitives.add(draw, count);
  return count;
}

namespace {
const SlotRegistrar slot{{"vpo", 20, "primitive-assembly", "", false, check_vpo}};
const Registrar<PrimitiveAssembly, VpoBehaviour> registrar("vpo", "primitive-assembly",
                                                           "two triangles per splat, culled and boxed", false,
                                                           Trust::trusted);
}  // namespace

}  // namespace vrpipe
