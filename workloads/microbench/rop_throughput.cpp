#include <vrpipe/workloads/microbench.h>

#include "microbench/rectangles.h"

namespace vrpipe::microbench {

FramePointer stacked_layers(unsigned side, unsigned layers, bool blend) {
  DrawState state = rectangle_state();
  state.blend = blend;
  return FrameMaker(side, side).draw(std::vector<Splat>(layers, rectangle(0, 0, side, side)), state).take();
}

}  // namespace vrpipe::microbench
