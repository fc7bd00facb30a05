#include <vrpipe/pipeline/quad_sectors.h>

#include <vrpipe/memory/sectors.h>
#include <vrpipe/pipeline/surface.h>

namespace vrpipe {

namespace {
/// Where a quad is in the tile's memory, in quads.
unsigned place_in_gobs(unsigned position, std::uint32_t bytes_per_quad) {
  constexpr unsigned rows = 4;  // of quads
  const unsigned columns = 64 / bytes_per_quad;
  const unsigned x = position % quads_per_tile_row;
  const unsigned y = position / quads_per_tile_row;
  const unsigned block = y / rows * (quads_per_tile_row / columns) + x / columns;
  return (block * rows + y % rows) * columns + x % columns;
}
}  // namespace

std::array<QuadSectors, positions_per_tile> sectors_of_quads(const CacheOrganization& cache,
                                                             std::uint32_t bytes_per_quad, TileOrder order) {
  std::array<QuadSectors, positions_per_tile> places{};
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    const unsigned place =
        order == TileOrder::morton ? morton_order[position] : place_in_gobs(position, bytes_per_quad);
    const std::uint32_t address = place * bytes_per_quad;
    const std::uint32_t offset = address % cache.line_bytes;
    const std::uint32_t first = offset / cache.sector_bytes;
    const std::uint32_t last = (offset + bytes_per_quad - 1) / cache.sector_bytes;
    places[position] = {address / cache.line_bytes, sector_mask(first, last - first + 1)};
  }
  return places;
}

}  // namespace vrpipe
