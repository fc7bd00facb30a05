#pragma once

#include <cstddef>
#include <cstdint>

#include <vrpipe/payload.h>

namespace vrpipe {

/// The quads of a frame, numbered screen tile by screen tile: what is kept for each has its place in a vector.
class QuadGrid {
 public:
  /// width and height in pixels; tiles at the right and the lower edge count whole.
  QuadGrid(std::uint32_t width, std::uint32_t height)
      : tiles_x_(tiles(width)), size_(std::size_t{tiles_x_} * tiles(height) * positions_per_tile) {}
  std::size_t size() const { return size_; }
  std::size_t place(TileId tile, unsigned position) const {
    return (std::size_t{tile.y} * tiles_x_ + tile.x) * positions_per_tile + position;
  }

 private:
  static constexpr std::uint32_t tiles(std::uint32_t pixels) {
    return (pixels + screen_tile_pixels - 1) / screen_tile_pixels;
  }
  std::uint32_t tiles_x_;
  std::size_t size_;
};

}  // namespace vrpipe
