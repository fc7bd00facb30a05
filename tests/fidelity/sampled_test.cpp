// Windows of a frame at cycle: what they say of themselves holds, of frames that all is simulated of as well.
#include <cmath>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

#include "support/mixed_frames.h"
#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

RunRequest sampled(RunRequest request, std::uint64_t seed = 1, std::uint64_t windows = 0) {
  request.fidelity = Fidelity::cycle;
  request.sampling = Sampling{windows, seed};
  return request;
}

/// Splats whose size, opacity and place change in the course of the draw, as those of a scene do from front to back.
Draw changing_draw(std::uint32_t splats, std::uint64_t seed) {
  Draw draw = random_draw(256, 192, splats, seed);
  for (std::uint32_t i = 0; i < splats; ++i) {
    Splat& splat = draw.splats[i];
    const float along = static_cast<float>(i) / static_cast<float>(splats);
    const float size = (0.5F + along) * (seed % 2 == 0 ? 1.0F : 1.5F - along);
    for (float* const extent : {&splat.ax, &splat.ay, &splat.bx, &splat.by}) *extent *= size;
    if (seed % 3 == 0) splat.cx *= 0.4F + 0.6F * along;
  }
  return draw;
}

}  // namespace
}  // namespace vrpipe
