#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// Of a frame: each but the last is two draws.
constexpr std::uint32_t most_passes = most_draws / 2 + 1;

/// Early termination by software (paper IV-B, algorithm 1), for hardware without that extension: the splats, front to back, in
/// batches as equal as can be. Each is drawn where the stencil is 0. After each but the last, two triangles as large as the
/// screen read the alpha of the colour target, discard where a pixel would go on, by the threshold of `state`, and set the
/// stencil to 1 elsewhere. In one pass it is Frame::of().
/// It refers to the splats, which outlive it. A state that terminates early as well does both.
/// @param passes  1 to as many as there are splats, most_passes at most
/// @throws UserError for another number of passes, a state that tests the stencil itself, and as Frame::draw()
std::shared_ptr<Frame> multi_pass_frame(const Draw& splats, const DrawState& state, std::uint32_t passes);

/// The same as draws of a frame, whose stencil is 0: splats `first` to `first` + `count` - 1, called `name`.
void draw_in_passes(Frame& frame, std::shared_ptr<const Draw> splats, const DrawState& state, std::uint32_t passes,
                    const std::string& name = {}, std::uint32_t first = 0, std::uint32_t count = ~0U);

}  // namespace vrpipe
