#include "zrop/z_cache.h"

#include <fmt/format.h>

#include "zrop/block_price.h"

#include <vrpipe/component/error.h>

namespace vrpipe {

unsigned halves_of_blocks(const Quad* quads, unsigned count) {
  unsigned halves = 0;  // a bit each
  for (unsigned i = 0; i < count; ++i) halves |= 1U << half_of_block(quads[i].position);
  return static_cast<unsigned>(__builtin_popcount(halves));
}

ZCache::ZCache(const ZropParameters& parameters, DepthFormat format)
    : organization(parameters.cache.organization()),
      mshrs(parameters.mshrs),
      input_quads(parameters.input_quads),
      input_halves(parameters.input_halves),
      input_updates(parameters.input_updates),
      sectors_per_cycle(parameters.sectors_per_cycle),
      fast_clear(parameters.fast_clear),
      fetch_ahead_lines(parameters.fetch_ahead_lines) {
  const std::uint32_t quad = DepthStencilSurface::bytes_per_quad(format);
  organization.check("z-cache", "zrop", "cache_bytes");
  if (organization.sector_bytes < quad) {
    throw UserError("unusable z-cache", "zrop.sector_bytes",
                    fmt::format("a quad of {} bytes does not fit into a sector of {}", quad, organization.sector_bytes),
                    "use larger sectors");
  }
}

}  // namespace vrpipe
