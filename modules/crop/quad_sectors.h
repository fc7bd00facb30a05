#pragma once

#include <array>
#include <cstdint>

#include <vrpipe/pipeline/units.h>

namespace vrpipe {

/// Where a quad stands in the modelled memory.
struct QuadSectors {
  std::uint32_t line;     ///< of those of its screen tile, from 0
  std::uint32_t sectors;  ///< of this line, a bit each
};
/// By position in a screen tile; every tile is the same, since they are naturally aligned. For sizes that a cache has.
std::array<QuadSectors, positions_per_tile> sectors_of_quads(const CropBehaviour::TimingParameters& timing,
                                                             const ColorSurface& surface);

}  // namespace vrpipe
