#include <algorithm>
#include <utility>

#include <vrpipe/workloads/microbench.h>

#include "microbench/rectangles.h"

namespace vrpipe::microbench {

namespace {

FramePointer frame_of(std::vector<Splat> splats, unsigned width, unsigned height) {
  return FrameMaker(width, height).draw(std::move(splats), rectangle_state()).take();
}

}  // namespace

FramePointer quads_in_tiles(const std::vector<unsigned>& tiles, const GpcTiles& gpc) {
  const std::vector<TileId> all = tiles_of(gpc, *std::max_element(tiles.begin(), tiles.end()) + 1);
  std::vector<Splat> splats;
  for (const unsigned tile : tiles) {
    splats.push_back(rectangle(screen_tile_pixels * all[tile].x + 4, screen_tile_pixels * all[tile].y + 6, 2, 2));
  }
  return frame_of(std::move(splats), 16 * gpc.gpcs * screen_tile_pixels, (all.back().y + 1U) * screen_tile_pixels);
}

FramePointer rounds_over_tiles(unsigned tiles, unsigned rounds, const GpcTiles& gpc) {
  std::vector<unsigned> order;
  for (unsigned i = 0; i < tiles * rounds; ++i) order.push_back(i % tiles);
  return quads_in_tiles(order, gpc);
}

FramePointer pair_at_distance(unsigned pixels) {
  return frame_of({rectangle(0, 4, 2, 2), rectangle(pixels, 4, 2, 2)}, 64, 16);
}

FramePointer pair_with_gap(unsigned culled) {
  std::vector<Splat> splats(culled + std::size_t{2}, rectangle(-64, 4, 2, 2));
  splats.front() = splats.back() = rectangle(4, 4, 2, 2);
  return frame_of(std::move(splats), 16, 16);
}

}  // namespace vrpipe::microbench
