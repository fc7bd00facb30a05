#include <vrpipe/pipeline/framebuffer.h>

#include <algorithm>
#include <set>

namespace vrpipe {

AddressMap address_map(const Frame& frame, ColorFormat format) {
  constexpr std::uint64_t page_bytes = 64 * 1024;
  std::uint64_t next = 0;
  const auto region = [&](std::uint64_t bytes) {
    const MemoryRegion made{next, bytes};
    next += (bytes + page_bytes - 1) / page_bytes * page_bytes;
    return made;
  };
  std::set<const Draw*> geometries;
  for (const DrawCall& call : frame.draws()) geometries.insert(call.geometry.get());
  std::uint64_t splats = 0;
  std::uint64_t triangles = 0;
  for (const Draw* geometry : geometries) {
    splats += geometry->splats.size();
    triangles += geometry->triangles.size();
  }
  AddressMap map;
  map.color = region(ColorSurface::size_bytes(frame.width(), frame.height(), format));
  map.depth_stencil = region(DepthStencilSurface::size_bytes(frame.width(), frame.height()));
  map.vertices = region(splats * sizeof(Splat));
  map.primitives = region(triangles * sizeof(ScreenTriangle));
  map.attributes = region(std::uint64_t{frame.splats()} * attribute_bytes_per_splat);
  return map;
}

DepthStencilSurface::DepthStencilSurface(std::uint32_t width, std::uint32_t height, std::uint64_t address)
    : grid_(width, height), address_(address), terminated_(grid_.quads()) {}

void DepthStencilSurface::clear_termination(const Placement& placement) {
  for (std::size_t tile = 0; tile < grid_.tiles(); ++tile) {
    if (!placement.owns(grid_.tile(tile))) continue;
    const auto first = terminated_.begin() + static_cast<std::ptrdiff_t>(tile * positions_per_tile);
    std::fill_n(first, positions_per_tile, std::uint8_t{0});
  }
}

std::uint64_t DepthStencilSurface::size_bytes(std::uint32_t width, std::uint32_t height) {
  return ScreenTiling(width, height).quads() * bytes_per_quad;
}

Framebuffer::Framebuffer(const Frame& frame, ColorFormat format)
    : addresses(address_map(frame, format)),
      color(frame.width(), frame.height(), format),
      depth_stencil(frame.width(), frame.height(), addresses.depth_stencil.address) {}

}  // namespace vrpipe
