#include <algorithm>
#include <utility>
#include <vector>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/workloads/measured_splats.h>
#include <vrpipe/workloads/microbench.h>

#include "microbench/rectangles.h"

namespace vrpipe::microbench {

namespace {

DrawState box_state(BoxesAre what) {
  DrawState state = rectangle_state();
  switch (what) {
    case BoxesAre::blended:
    case BoxesAre::unchanged: break;
    case BoxesAre::written: state.blend = false; break;
    case BoxesAre::killed:
      state.stencil.test = true;
      state.stencil.front.compare = Compare::none;
      break;
    case BoxesAre::stencil_written:
      state.shader = FragmentShader::none;
      state.stencil.test = true;
      state.stencil.front.pass = StencilOperation::increment_wrap;
      break;
  }
  return state;
}

}  // namespace

FramePointer boxes_in_turn(const std::vector<Box>& boxes, unsigned rounds, BoxesAre what) {
  // Of alpha 1 the first one makes all that follow change nothing.
  const float alpha = what == BoxesAre::unchanged ? 1.0F : 0.02F;
  std::vector<Splat> round;
  unsigned right = 0, bottom = 0;
  for (const Box& box : boxes) {
    round.push_back(rectangle(box.x, box.y, box.width, box.height, alpha));
    right = std::max(right, box.x + box.width);
    bottom = std::max(bottom, box.y + box.height);
  }
  std::vector<Splat> splats;
  for (unsigned i = 0; i < rounds; ++i) splats.insert(splats.end(), round.begin(), round.end());
  return FrameMaker(right, bottom).draw(std::move(splats), box_state(what)).take();
}

FramePointer strips(unsigned width, unsigned height, unsigned cells, unsigned rounds, BoxesAre what) {
  constexpr unsigned side = 1024;
  const auto whole_tiles = [](unsigned pixels) {
    return (pixels + screen_tile_pixels - 1) / screen_tile_pixels * screen_tile_pixels;
  };
  const unsigned in_a_row = side / whole_tiles(width);
  std::vector<Box> boxes;
  for (unsigned i = 0; i < cells; ++i)
    boxes.push_back({i % in_a_row * whole_tiles(width), i / in_a_row * whole_tiles(height), width, height});
  return boxes_in_turn(boxes, rounds, what);
}

FramePointer boxes_of_tiles(const std::vector<Box>& boxes, unsigned tiles, unsigned rounds, BoxesAre what,
                            const GpcTiles& gpc, unsigned of_the_first) {
  std::vector<Box> all;
  const auto add_round = [&](std::size_t count) {
    for (const TileId tile : tiles_of(gpc, tiles)) {
      const unsigned x = screen_tile_pixels * tile.x, y = screen_tile_pixels * tile.y;
      for (std::size_t i = 0; i < count; ++i)
        all.push_back({x + boxes[i].x, y + boxes[i].y, boxes[i].width, boxes[i].height});
    }
  };
  for (unsigned i = 0; i < of_the_first; ++i) add_round(1);
  for (unsigned i = 0; i < rounds; ++i) add_round(boxes.size());
  return boxes_in_turn(all, 1, what);
}

FramePointer scattered_boxes(unsigned side, unsigned step, unsigned region, unsigned count, BoxesAre what) {
  const unsigned places = (region - side) / step + 1;
  std::vector<Box> boxes;
  for (unsigned i = 0; i < count; ++i) {
    const auto place = [&](unsigned draw) { return static_cast<unsigned>(mix(2 * i + draw) % places) * step; };
    boxes.push_back({place(0), place(1), side, side});
  }
  return boxes_in_turn(boxes, 1, what);
}

FramePointer equal_splats(double a, double b, float opacity, unsigned count, unsigned region, SplatsAre what) {
  DrawState state;
  state.obb_padding = 0;
  state.blend = what != SplatsAre::written;
  state.stencil.test = what == SplatsAre::passed || what == SplatsAre::killed;
  if (what == SplatsAre::killed) state.stencil.front.compare = Compare::none;
  return FrameMaker(measured::equal_splats_side, measured::equal_splats_side)
      .draw(measured::equal_splats(a, b, opacity, count, region), state)
      .take();
}

}  // namespace vrpipe::microbench
