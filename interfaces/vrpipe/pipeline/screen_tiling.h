#pragma once

#include <cstddef>
#include <cstdint>

#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// The screen tiles of a frame, numbered row by row, and its quads, tile by tile: what is kept for each has its place in
/// a vector.
class ScreenTiling {
 public:
  /// width and height in pixels; tiles at the right and the lower edge count whole.
  ScreenTiling(std::uint32_t width, std::uint32_t height)
      : tiles_x_(tiles_along(width)), tiles_(std::size_t{tiles_x_} * tiles_along(height)) {}
  std::size_t tiles() const { return tiles_; }
  std::size_t index(TileId tile) const { return std::size_t{tile.y} * tiles_x_ + tile.x; }
  TileId tile(std::size_t index) const {
    return {static_cast<std::uint16_t>(index % tiles_x_), static_cast<std::uint16_t>(index / tiles_x_)};
  }
  std::size_t quads() const { return tiles_ * positions_per_tile; }
  std::size_t place(TileId tile, unsigned position) const { return index(tile) * positions_per_tile + position; }

 private:
  static constexpr std::uint32_t tiles_along(std::uint32_t pixels) {
    return (pixels + screen_tile_pixels - 1) / screen_tile_pixels;
  }
  std::uint32_t tiles_x_;
  std::size_t tiles_;
};

}  // namespace vrpipe
