#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/screen_tiling.h>

namespace vrpipe {

/// Where a quad position of a screen tile stands in Morton order.
inline constexpr std::array<std::uint8_t, positions_per_tile> morton_order = [] {
  std::array<std::uint8_t, positions_per_tile> order{};
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    const unsigned x = position % quads_per_tile_row;
    const unsigned y = position / quads_per_tile_row;
    unsigned code = 0;
    for (unsigned bit = 0; bit < 3; ++bit) code |= (((x >> bit) & 1U) | (((y >> bit) & 1U) << 1U)) << (2 * bit);
    order[position] = static_cast<std::uint8_t>(code);
  }
  return order;
}();

/// Where a quad at a place of the grid comes in memory: screen tile by screen tile, in each in Morton order, so that four
/// quads in a row are 4x4 pixels.
inline std::uint64_t block_linear(std::size_t place) {
  const std::size_t position = place % positions_per_tile;
  return std::uint64_t{place} - position + morton_order[position];
}

/// A colour target, block-linear: screen tile by screen tile, quad by quad, so that a quad is one 32-byte sector of
/// RGBA16F and four quads (4x4 pixels) are one 128-byte line. Holds the stored values as floats.
class ColorSurface {
 public:
  /// Cleared to (0, 0, 0, 0). width and height in pixels.
  ColorSurface(std::uint32_t width, std::uint32_t height, ColorFormat format);
  static std::uint64_t size_bytes(std::uint32_t width, std::uint32_t height, ColorFormat format);

  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  ColorFormat format() const { return format_; }

  const ScreenTiling& grid() const { return grid_; }
  QuadColor& quad(std::size_t place) { return quads_[place]; }
  const QuadColor& quad(std::size_t place) const { return quads_[place]; }
  QuadColor& quad(TileId tile, unsigned position) { return quads_[grid_.place(tile, position)]; }
  const QuadColor& quad(TileId tile, unsigned position) const { return quads_[grid_.place(tile, position)]; }

  /// To (0, 0, 0, 0), one screen tile.
  void clear(TileId tile);

  /// Byte address of a quad in the modelled memory, where colour is at 0 (AddressMap). Tiles, and quads in them, are
  /// naturally aligned.
  std::uint64_t address(std::size_t place) const { return block_linear(place) * bytes_per_quad_; }
  std::uint64_t address(TileId tile, unsigned position) const { return address(grid_.place(tile, position)); }
  std::uint64_t size_bytes() const;

  /// Red, green, blue, alpha of a pixel, premultiplied.
  std::array<float, 4> pixel(std::uint32_t x, std::uint32_t y) const;

 private:
  std::uint32_t width_;
  std::uint32_t height_;
  ColorFormat format_;
  ScreenTiling grid_;
  std::uint32_t bytes_per_quad_;
  std::vector<QuadColor> quads_;
};

}  // namespace vrpipe
