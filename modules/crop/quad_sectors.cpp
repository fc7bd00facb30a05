#include "crop/quad_sectors.h"

#include <vrpipe/memory/sectors.h>

namespace vrpipe {

std::array<QuadSectors, positions_per_tile> sectors_of_quads(const CropBehaviour::TimingParameters& timing,
                                                             const ColorSurface& surface) {
  const std::uint32_t bytes_per_quad = 4 * bytes_per_pixel(surface.format());
  std::array<QuadSectors, positions_per_tile> places{};
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    const auto address = static_cast<std::uint32_t>(surface.address({0, 0}, position));
    const std::uint32_t offset = address % timing.line_bytes;
    const std::uint32_t first = offset / timing.sector_bytes;
    const std::uint32_t last = (offset + bytes_per_quad - 1) / timing.sector_bytes;
    places[position] = {address / timing.line_bytes, sector_mask(first, last - first + 1)};
  }
  return places;
}

}  // namespace vrpipe
