#include <algorithm>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/workloads/microbench.h>

#include "microbench/rectangles.h"

namespace vrpipe::microbench {

FramePointer overlapping_layers(unsigned layers, unsigned side) {
  std::vector<Splat> splats;
  for (unsigned i = 0; i < layers; ++i) {
    const auto random = [&](unsigned key) {
      return static_cast<float>(mix(4 * std::uint64_t{i} + key) >> 40U) / 16777216.0F;
    };
    Splat layer = rectangle(0, 0, side, side, 0.05F + 0.2F * random(0));
    layer.red = random(1);
    layer.green = random(2);
    layer.blue = random(3);
    splats.push_back(layer);
  }
  DrawState state = rectangle_state();
  state.splat_extent = SplatExtent::axis_aligned_box;
  return FrameMaker(side, side).draw(std::move(splats), state).take();
}

std::array<float, 4> blended_in_order(const Frame& frame, ColorFormat format, BlendRounding rounding) {
  QuadColor pixel{};
  for (const Splat& layer : frame.draw_call(0).geometry->splats) {
    const float alpha = layer.opacity;
    const QuadColor fragment{splat_lanes(layer.red * alpha), splat_lanes(layer.green * alpha),
                             splat_lanes(layer.blue * alpha), splat_lanes(alpha)};
    pixel = blend_function(format, rounding)(pixel, fragment);
  }
  return {pixel.red[0], pixel.green[0], pixel.blue[0], pixel.alpha[0]};
}

}  // namespace vrpipe::microbench
