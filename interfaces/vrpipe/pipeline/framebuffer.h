#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/surface.h>

namespace vrpipe {

/// Bytes from an address on.
struct MemoryRegion {
  std::uint64_t address = 0;
  std::uint64_t bytes = 0;
  std::uint64_t end() const { return address + bytes; }
};

/// What vertex shading writes for a splat; its two triangles take half of it each (measured on a GH100: 650 to 730).
inline constexpr std::uint32_t attribute_bytes_per_splat = 704;

/// Where in the modelled memory a frame's surfaces and buffers are. Regions begin at multiples of 64 KiB, as pages of
/// GPUs do, and do not overlap; colour is at 0.
struct AddressMap {
  MemoryRegion color;
  MemoryRegion depth_stencil;
  MemoryRegion vertices;    ///< what vertex fetch reads: 48 bytes a splat of each geometry, as in a `.spl` file
  MemoryRegion primitives;  ///< explicit triangles: 24 bytes each
  MemoryRegion attributes;  ///< what vertex shading writes and fragment shading reads: 704 bytes a splat of each draw
};
AddressMap address_map(const Frame& frame, ColorFormat format);

/// A depth-stencil target of 24 bits depth and 8 bits stencil, block-linear as a ColorSurface is: two quads (4x2 pixels) are
/// one 32-byte sector, eight (8x4 pixels) are one 128-byte line, and a screen tile is 1 KiB. So far it holds of the stencil
/// the most significant bits, which early termination uses (paper 5.2).
class DepthStencilSurface {
 public:
  static constexpr std::uint32_t bytes_per_quad = 4 * 4;
  static constexpr std::uint32_t bytes_per_tile = positions_per_tile * bytes_per_quad;

  /// Cleared. width and height in pixels; `address` is that of its first byte in the modelled memory, a multiple of a tile's
  /// bytes.
  DepthStencilSurface(std::uint32_t width, std::uint32_t height, std::uint64_t address = 0);

  const ScreenTiling& grid() const { return grid_; }
  /// The termination bits of a quad's four pixels, at a place of the grid.
  std::uint8_t& terminated(std::size_t place) { return terminated_[place]; }
  std::uint8_t terminated(std::size_t place) const { return terminated_[place]; }
  /// In the screen tiles of a GPC.
  void clear_termination(const Placement& placement);
  /// Byte address of a quad in the modelled memory. Tiles, and quads in them, are naturally aligned.
  std::uint64_t address(std::size_t place) const { return address_ + block_linear(place) * bytes_per_quad; }
  std::uint64_t address(TileId tile, unsigned position) const { return address(grid_.place(tile, position)); }
  /// Of whole screen tiles.
  static std::uint64_t size_bytes(std::uint32_t width, std::uint32_t height);

 private:
  ScreenTiling grid_;
  std::uint64_t address_;
  std::vector<std::uint8_t> terminated_;
};

/// What a frame is drawn into.
struct Framebuffer {
  Framebuffer() = default;  ///< of one pixel
  /// Cleared.
  Framebuffer(const Frame& frame, ColorFormat format);
  AddressMap addresses;
  ColorSurface color{1, 1, ColorFormat::rgba16f};
  DepthStencilSurface depth_stencil{1, 1};
};

}  // namespace vrpipe
