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
  return std::optional<ClearedSectors>(std::in_place, surface.address(std::size_t{0}), surface.size_bytes(),
                                       cache.organization, statistics.sectors_as_cleared);
}

}  // namespace vrpipe
