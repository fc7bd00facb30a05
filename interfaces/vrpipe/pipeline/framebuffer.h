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
  MemoryRegion vertices;  ///< what vertex fetch reads: 48 bytes a splat, as in a `.spl` file, 120 a triangle of a mesh
  MemoryRegion primitives;  ///< explicit triangles: 24 bytes each
  MemoryRegion attributes;  ///< what vertex shading writes and fragment shading reads: 704 bytes a splat of each draw
};
AddressMap address_map(const Frame& frame, ColorFormat format);

/// Depth and stencil of a quad's four pixels.
struct DepthStencilQuad {
  std::array<std::uint32_t, 4> depth;   ///< as store_depth has it
  std::array<std::uint8_t, 4> stencil;  ///< without the termination bit, which is kept apart
};

/// A depth-stencil target, block-linear as a ColorSurface is: of 4 bytes a pixel two quads (4x2 pixels) are one 32-byte
/// sector, eight (8x4 pixels) are one 128-byte line, and a screen tile is 1 KiB; D32F has twice as many bytes. The most
/// significant bits of the stencil are early termination's (paper 5.2), and kept apart.
class DepthStencilSurface {
 public:
  static constexpr std::uint32_t bytes_per_quad(DepthFormat format) { return 4 * bytes_per_pixel(format); }

  /// Cleared: depth 1, stencil 0. width and height in pixels; `address` is that of its first byte in the modelled memory, a
  /// multiple of a tile's bytes. Where nothing is tested but termination, depth and stencil need not be stored.
  DepthStencilSurface(std::uint32_t width, std::uint32_t height, std::uint64_t address = 0,
                      DepthFormat format = DepthFormat::d24, bool stores_depth_stencil = true);
  DepthFormat format() const { return format_; }

  const ScreenTiling& grid() const { return grid_; }
  /// The termination bits of a quad's four pixels, at a place of the grid.
  std::uint8_t& terminated(std::size_t place) { return terminated_[place]; }
  std::uint8_t terminated(std::size_t place) const { return terminated_[place]; }
  DepthStencilQuad& quad(std::size_t place) { return quads_[place]; }
  const DepthStencilQuad& quad(std::size_t place) const { return quads_[place]; }
  /// The stencil of each pixel, row by row of so many pixels.
  void preset_stencil(const std::vector<std::uint8_t>& values, std::uint32_t width);
  /// Whether it was not cleared at first.
  bool is_preset() const { return is_preset_; }
  /// It holds what was drawn before, so that not all of it is as a clear has left it.
  void go_on() { goes_on_ = true; }
  bool goes_on() const { return goes_on_; }
  /// Whether a quad is as the first clear has left it.
  bool is_as_cleared(std::size_t place) const;
  /// In the screen tiles of a GPC.
  void clear(const Clear& clear, const Placement& placement);
  /// Byte address of a quad in the modelled memory. Tiles, and quads in them, are naturally aligned.
  std::uint64_t address(std::size_t place) const { return address_ + block_linear(place) * bytes_per_quad(format_); }
  std::uint64_t address(TileId tile, unsigned position) const { return address(grid_.place(tile, position)); }
  /// Of whole screen tiles.
  std::uint64_t size_bytes() const {
    return std::uint64_t{grid_.tiles()} * positions_per_tile * bytes_per_quad(format_);
  }
  static std::uint64_t size_bytes(std::uint32_t width, std::uint32_t height, DepthFormat format = DepthFormat::d24);

 private:
  ScreenTiling grid_;
  std::uint64_t address_;
  DepthFormat format_;
  std::vector<std::uint8_t> terminated_;
  std::vector<DepthStencilQuad> quads_;  ///< or none
  bool is_preset_ = false;
  bool goes_on_ = false;
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
