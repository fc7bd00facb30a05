#pragma once

#include <cstdint>
#include <initializer_list>

#include <vrpipe/pipeline/payload.h>

namespace vrpipe::testing {

/// Terminations at these positions of a screen tile.
inline TerminationBeat signals(std::initializer_list<unsigned> positions, LaneMask pixels = all_lanes,
                               TileId tile = {0, 0}) {
  TerminationBeat beat;
  for (const unsigned position : positions)
    beat.signals[beat.count++] = {tile, static_cast<std::uint8_t>(position), pixels};
  return beat;
}
inline TerminationBeat signals(std::initializer_list<unsigned> positions, TileId tile) {
  return signals(positions, all_lanes, tile);
}

}  // namespace vrpipe::testing
