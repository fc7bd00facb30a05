#pragma once

#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// The quads of a shaded warp as those of a beat, so far as none is merged.
inline QuadBeat quads_of(const ShadedWarp& warp) {
  QuadBeat beat;
  beat.tile = warp.tile;
  beat.count = warp.count;
  for (unsigned i = 0; i < warp.count; ++i) {
    Quad quad{};
    quad.splat = warp.first_primitive[i] / 2;
    quad.triangle = warp.first_primitive[i] & 1U;
    quad.position = warp.position[i];
    quad.coverage = warp.live[i];
    quad.draw = warp.draw[i] & 0x7fffU;
    beat.quads[i] = quad;
  }
  return beat;
}

}  // namespace vrpipe
