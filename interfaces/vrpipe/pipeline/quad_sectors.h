#pragma once

#include <array>
#include <cstdint>

#include <vrpipe/memory/cache_organization.h>
#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// Where a quad of a block-linear surface stands in the lines of a cache.
struct QuadSectors {
  std::uint32_t line;     ///< of those of its screen tile, from 0
  std::uint32_t sectors;  ///< of this line, a bit each
};
/// How quads of a screen tile follow one another in memory.
enum class TileOrder : std::uint8_t {
  morton,  ///< block-linear: in Morton order
  gobs,    ///< in blocks of 32 bytes by 8 rows, row by row: halves of a GOB of 64 bytes by 8 rows
};
/// By position in a screen tile; every tile is the same, since they are naturally aligned. For a cache whose lines hold a
/// quad, and whose lines do not hold more than a tile; in `gobs` a quad's rows are at most 32 bytes.
std::array<QuadSectors, positions_per_tile> sectors_of_quads(const CacheOrganization& cache,
                                                             std::uint32_t bytes_per_quad,
                                                             TileOrder order = TileOrder::morton);

}  // namespace vrpipe
