#pragma once

#include <cstdint>

#include <vrpipe/pipeline/payload.h>

namespace vrpipe::testing {

inline PrimitiveItem item_in(std::uint32_t splat, PixelRect bounds) {
  PrimitiveItem item;
  item.primitive.splat = splat;
  item.primitive.bounds = bounds;
  return item;
}

}  // namespace vrpipe::testing
