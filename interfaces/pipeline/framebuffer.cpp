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
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  for (const Draw* geometry : geometries) {
    vertices += vertex_bytes(*geometry);
    triangles += geometry->triangles.size();
  }
  AddressMap map;
  map.color = region(ColorSurface::size_bytes(frame.width(), frame.height(), format));
  map.depth_stencil = region(DepthStencilSurface::size_bytes(frame.width(), frame.height(), frame.depth_format()));
  map.vertices = region(vertices);
  map.primitives = region(triangles * sizeof(ScreenTriangle));
  map.attributes = region(std::uint64_t{frame.splats()} * attribute_bytes_per_splat);
  return map;
}

DepthStencilSurface::DepthStencilSurface(std::uint32_t width, std::uint32_t height, std::uint64_t address,
                                         DepthFormat format, bool stores_depth_stencil)
    : grid_(width, height), address_(address), format_(format), terminated_(grid_.quads()) {
  if (!stores_depth_stencil) return;
  quads_.resize(grid_.quads());
  Clear all;
  all.depth = true;
  all.stencil = true;
  clear(all, {});
}

void DepthStencilSurface::preset_stencil(const std::vector<std::uint8_t>& values, std::uint32_t width) {
  is_preset_ = true;
  for (std::size_t tile = 0; tile < grid_.tiles(); ++tile) {
    const TileId of = grid_.tile(tile);
    for (unsigned position = 0; position < positions_per_tile; ++position) {
      DepthStencilQuad& quad = quads_[tile * positions_per_tile + position];
      for (unsigned lane = 0; lane < 4; ++lane) {
        const std::size_t x = of.x * screen_tile_pixels + 2U * (position % quads_per_tile_row) + lane % 2;
        const std::size_t y = of.y * screen_tile_pixels + 2U * (position / quads_per_tile_row) + lane / 2;
        if (x < width && y * width < values.size()) quad.stencil[lane] = values[y * width + x];
      }
    }
  }
}

bool DepthStencilSurface::is_as_cleared(std::size_t place) const {
  if (terminated_[place] != 0) return false;
  if (quads_.empty()) return true;
  const std::uint32_t depth = store_depth(format_, static_cast<double>(Clear().depth_value));
  const DepthStencilQuad& quad = quads_[place];
  return std::all_of(quad.depth.begin(), quad.depth.end(), [depth](std::uint32_t value) { return value == depth; }) &&
         std::all_of(quad.stencil.begin(), quad.stencil.end(), [](std::uint8_t value) { return value == 0; });
}

void DepthStencilSurface::clear(const Clear& clear, const Placement& placement) {
  const std::uint32_t depth = store_depth(format_, static_cast<double>(clear.depth_value));
  for (std::size_t tile = 0; tile < grid_.tiles(); ++tile) {
    if (!placement.owns(grid_.tile(tile))) continue;
    const std::size_t first = tile * positions_per_tile;
    for (std::size_t place = first; place < first + positions_per_tile; ++place) {
      if (clear.termination) terminated_[place] = 0;
      if (quads_.empty()) continue;
      if (clear.depth) quads_[place].depth.fill(depth);
      if (clear.stencil) quads_[place].stencil.fill(clear.stencil_value);
    }
  }
}

std::uint64_t DepthStencilSurface::size_bytes(std::uint32_t width, std::uint32_t height, DepthFormat format) {
  return ScreenTiling(width, height).quads() * bytes_per_quad(format);
}

Framebuffer::Framebuffer(const Frame& frame, ColorFormat format)
    : addresses(address_map(frame, format)),
      color(frame.width(), frame.height(), format),
      depth_stencil(frame.width(), frame.height(), addresses.depth_stencil.address, frame.depth_format(),
                    frame.tests_depth_stencil()) {
  if (frame.stencil_preset() != nullptr && frame.tests_depth_stencil()) {
    depth_stencil.preset_stencil(*frame.stencil_preset(), frame.width());
  }
}

}  // namespace vrpipe
