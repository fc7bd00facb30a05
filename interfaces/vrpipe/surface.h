#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/blend.h>
#include <vrpipe/payload.h>

namespace vrpipe {

/// A colour target, block-linear: screen tile by screen tile, quad by quad, so that a quad is one 32-byte sector of
/// RGBA16F and four quads (4x4 pixels) are one 128-byte line. Holds the stored values as floats.
class ColorSurface {
 public:
  /// Cleared to (0, 0, 0, 0). width and height in pixels.
  ColorSurface(std::uint32_t width, std::uint32_t height, ColorFormat format);

  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  ColorFormat format() const { return format_; }

  QuadColor& quad(TileId tile, unsigned position) {
    return quads_[(std::size_t{tile.y} * tiles_x_ + tile.x) * positions_per_tile + position];
  }
  const QuadColor& quad(TileId tile, unsigned position) const {
    return quads_[(std::size_t{tile.y} * tiles_x_ + tile.x) * positions_per_tile + position];
  }

  /// Byte address of a quad in the modelled memory. Quads of a tile follow in Morton order, 4x4 pixels a 4-quad group.
  std::uint64_t address(TileId tile, unsigned position) const {
    const std::uint64_t tile_index = std::uint64_t{tile.y} * tiles_x_ + tile.x;
    return (tile_index * positions_per_tile + morton(position)) * bytes_per_quad_;
  }
  std::uint64_t size_bytes() const;

  /// Red, green, blue, alpha of a pixel, premultiplied.
  std::array<float, 4> pixel(std::uint32_t x, std::uint32_t y) const;

 private:
  static unsigned morton(unsigned position) {
    const unsigned x = position & 7U;
    const unsigned y = position >> 3U;
    return (x & 1U) | ((y & 1U) << 1U) | ((x & 2U) << 1U) | ((y & 2U) << 2U) | ((x & 4U) << 2U) | ((y & 4U) << 3U);
  }

  std::uint32_t width_;
  std::uint32_t height_;
  ColorFormat format_;
  std::uint32_t tiles_x_;
  std::uint32_t bytes_per_quad_;
  std::vector<QuadColor> quads_;
};

}  // namespace vrpipe
