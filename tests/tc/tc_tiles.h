#pragma once

#include <cstdint>

#include <vrpipe/pipeline/payload.h>

namespace vrpipe::testing {

/// Screen tiles of an image of 640 pixels a row, in its order.
inline TileId tile(unsigned index) {
  return {static_cast<std::uint16_t>(index % 40), static_cast<std::uint16_t>(index / 40)};
}

}  // namespace vrpipe::testing
