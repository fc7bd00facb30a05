#include <vrpipe/workloads/microbench.h>

#include "microbench/rectangles.h"

namespace vrpipe::microbench {

FramePointer small_primitives(Small kind, unsigned count) {
  constexpr unsigned side = 64;
  std::vector<Splat> splats;
  for (unsigned i = 0; i < count; ++i) {
    // Tile by tile, so that none of the places is special.
    const double x = kind == Small::culled ? -64.0 : 16.0 * (i % 4) + 2 * (i / 16 % 8);
    splats.push_back(rectangle(x, 16 * (i / 4 % 4) + 2 * (i / 128 % 8), 2, 2));
  }
  DrawState state = rectangle_state();
  if (kind == Small::two_triangles) state.splat_extent = SplatExtent::axis_aligned_box;
  state.stencil.test = true;
  state.stencil.front.compare = Compare::none;
  return FrameMaker(side, side).draw(std::move(splats), state).take();
}

}  // namespace vrpipe::microbench
