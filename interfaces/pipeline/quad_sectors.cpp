#include <vrpipe/pipeline/quad_sectors.h>

#include <vrpipe/memory/sectors.h>
#include <vrpipe/pipeline/surface.h>

namespace vrpipe {

std::array<QuadSectors, positions_per_tile> sectors_of_quads(const CacheOrganization& cache,
                                                             std::uint32_t bytes_per_quad) {
  std::array<QuadSectors, positions_per_tile> places{};
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    const std::uint32_t address = morton_order[position] * bytes_per_quad;
    const std::uint32_t offset = address % cache.line_bytes;
    const std::uint32_t first = offset / cache.sector_bytes;
    const std::uint32_t last = (offset + bytes_per_quad - 1) / cache.sector_bytes;
    places[position] = {address / cache.line_bytes, sector_mask(first, last - first + 1)};
  }
  return places;
}

}  // namespace vrpipe
