#pragma once

#include <cstdint>

#include <vrpipe/platforms/simulation.h>

#include "support/builders.h"

namespace vrpipe::testing {

/// Splats whose size and place change in the course of the draw, as those of a scene do from front to back.
inline Draw changing_draw(std::uint32_t splats, std::uint64_t seed) {
  Draw draw = random_draw(256, 192, splats, seed);
  for (std::uint32_t i = 0; i < splats; ++i) {
    Splat& splat = draw.splats[i];
    const float along = static_cast<float>(i) / static_cast<float>(splats);
    const float size = seed % 2 == 0 ? 1.0F + along : 2.0F - along;
    for (float* const extent : {&splat.ax, &splat.ay, &splat.bx, &splat.by}) *extent *= size;
    if (seed % 3 == 0) splat.cx *= 0.4F + 0.6F * along;
  }
  return draw;
}

inline RunRequest sampled(RunRequest request, std::uint64_t seed = 1) {
  request.sampling = Sampling{16, seed};
  return request;
}

}  // namespace vrpipe::testing
