#include <vrpipe/pipeline/surface.h>

#include <algorithm>
#include <cstddef>

namespace vrpipe {

ColorSurface::ColorSurface(std::uint32_t width, std::uint32_t height, ColorFormat format)
    : width_(width),
      height_(height),
      format_(format),
      grid_(width, height),
      bytes_per_quad_(4 * bytes_per_pixel(format)),
      quads_(grid_.quads()) {}

std::uint64_t ColorSurface::size_bytes(std::uint32_t width, std::uint32_t height, ColorFormat format) {
  return std::uint64_t{ScreenTiling(width, height).quads()} * 4 * bytes_per_pixel(format);
}

void ColorSurface::clear(TileId tile) {
  const auto first = quads_.begin() + static_cast<std::ptrdiff_t>(grid_.place(tile, 0));
  std::fill_n(first, positions_per_tile, QuadColor{});
}

std::uint64_t ColorSurface::size_bytes() const { return std::uint64_t{quads_.size()} * bytes_per_quad_; }

std::array<float, 4> ColorSurface::pixel(std::uint32_t x, std::uint32_t y) const {
  const TileId tile{static_cast<std::uint16_t>(x / screen_tile_pixels),
                    static_cast<std::uint16_t>(y / screen_tile_pixels)};
  const unsigned position = (y % screen_tile_pixels) / 2 * quads_per_tile_row + (x % screen_tile_pixels) / 2;
  const unsigned lane = (y % 2) * 2 + x % 2;
  const QuadColor& color = quad(tile, position);
  return {color.red[lane], color.green[lane], color.blue[lane], color.alpha[lane]};
}

}  // namespace vrpipe
