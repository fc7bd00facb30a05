#include <vrpipe/workloads/microbench.h>

#include "microbench/rectangles.h"

namespace vrpipe::microbench {

FramePointer rectangles_in_turn(unsigned tiles, unsigned rounds, unsigned width, unsigned height, bool blend,
                                const GpcTiles& gpc) {
  const std::vector<TileId> all = tiles_of(gpc, tiles);
  std::vector<Splat> splats;
  for (unsigned i = 0; i < tiles * rounds; ++i) {
    const TileId tile = all[i % tiles];
    splats.push_back(rectangle(screen_tile_pixels * tile.x, screen_tile_pixels * tile.y, width, height));
  }
  DrawState state = rectangle_state();
  state.blend = blend;
  return FrameMaker(16 * gpc.gpcs * screen_tile_pixels, (all.back().y + 1U) * screen_tile_pixels)
      .draw(std::move(splats), state)
      .take();
}

}  // namespace vrpipe::microbench
