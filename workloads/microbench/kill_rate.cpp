#include <vrpipe/workloads/microbench.h>

#include "microbench/rectangles.h"

namespace vrpipe::microbench {

FramePointer killed_rectangles(KilledBy killer, unsigned side, unsigned count, unsigned image, unsigned offset) {
  DrawState state = rectangle_state();
  Clear clear;
  switch (killer) {
    case KilledBy::stencil:
      state.stencil.test = true;
      state.stencil.front.compare = Compare::none;
      break;
    case KilledBy::depth:
      // Nothing passes, and Hi-Z knows nothing of this comparison.
      state.depth = {true, Compare::none, false};
      break;
    case KilledBy::hi_z:
      state.depth = {true, Compare::less, false};
      clear.depth = true;
      clear.depth_value = 0.25F;
      break;
    case KilledBy::shader: state.pruning_threshold = 1; break;
  }
  const unsigned in_a_row = image / side;
  std::vector<Splat> splats;
  for (unsigned i = 0; i < count; ++i) {
    splats.push_back(rectangle(side * (i % in_a_row) + offset, side * (i / in_a_row % in_a_row) + offset, side, side));
  }
  for (Splat& splat : splats) splat.depth = 0.75F;  // behind what Hi-Z has been cleared to
  FrameMaker maker(image + offset, image + offset);
  if (clear.depth) maker.clear(clear);
  return maker.draw(std::move(splats), state).take();
}

}  // namespace vrpipe::microbench
