#pragma once

#include <optional>

#include "z_cache.h"

#include <vrpipe/memory/cache_statistics.h>
#include <vrpipe/memory/cleared_sectors.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

struct ZCacheStatistics : SectoredCacheStatistics {
  using SectoredCacheStatistics::SectoredCacheStatistics;
  Counter sectors_as_cleared{*this, "sectors_as_cleared", "sectors",
                             "missed and not read: nothing was written back to them after a clear"};
};

/// The sectors of a GPC's surface; none where every one that is missed is read. The statistics outlive it.
inline std::optional<ClearedSectors> cleared_sectors_of(const DepthStencilSurface& surface, const ZCache& cache,
                                                        ZCacheStatistics& statistics) {
  if (!cache.fast_clear || surface.is_preset()) return std::nullopt;
  const CacheOrganization& organization = cache.organization;
  std::optional<ClearedSectors> cleared(std::in_place, surface.address(std::size_t{0}), surface.size_bytes(),
                                        organization, statistics.sectors_as_cleared);
  if (!surface.goes_on()) return cleared;
  for (std::size_t place = 0; place < surface.grid().quads(); ++place) {
    if (surface.is_as_cleared(place)) continue;
    const std::uint64_t address = surface.address(place);
    const std::uint64_t in_line = address % organization.line_bytes;
    cleared->written(address - in_line, 1U << (in_line / organization.sector_bytes));
  }
  return cleared;
}

}  // namespace vrpipe
