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

/// A depth-stencil target of 24 bits depth and 8 bits stencil. So far it holds of the stencil the most significant bits,
/// which early termination uses (paper 5.2).
class DepthStencilSurface {
 public:
  /// Cleared. width and height in pixels.
  DepthStencilSurface(std::uint32_t width, std::uint32_t height);

  const ScreenTiling& grid() const { return grid_; }
  /// The termination bits of a quad's four pixels, at a place of the grid.
  std::uint8_t& terminated(std::size_t place) { return terminated_[place]; }
  std::uint8_t terminated(std::size_t place) const { return terminated_[place]; }
  /// In the screen tiles of a GPC.
  void clear_termination(const Placement& placement);
  static std::uint64_t size_bytes(std::uint32_t width, std::uint32_t height);

 private:
  ScreenTiling grid_;
  std::vector<std::uint8_t> terminated_;
};

/// What a frame is drawn into.
struct Framebuffer {
  Framebuffer() = default;  ///< of one pixel
  /// Cleared.
  Framebuffer(const Frame& frame, ColorFormat format);
  ColorSurface color{1, 1, ColorFormat::rgba16f};
  DepthStencilSurface depth_stencil{1, 1};
  AddressMap addresses;
};

}  // namespace vrpipe
