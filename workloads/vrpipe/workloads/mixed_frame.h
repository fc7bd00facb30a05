#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/frame.h>

namespace vrpipe {

struct MixedFrameOptions {
  DrawState splats;                                  ///< but for its depth test, which mixed_frame() sets
  FragmentShader mesh_shader = FragmentShader::lit;  ///< `lit` or `vertex`
  std::uint32_t passes = 1;                          ///< in which the splats are drawn (draw_in_passes)
  Light light{0.36F, -0.8F, -0.48F, 0.4F};           ///< from above right behind the viewer, where y points down
};

/// Splats in a scene of opaque meshes, as one frame:
/// 1. depth of the meshes: nothing is shaded, test `less`, written;
/// 2. the splats, front to back into the cleared target, test `less`, depth not written, early termination as their state says;
/// 3. colour of the meshes under what the splats left, test `equal`, alpha 1, no early termination.
/// Of meshes, back faces are culled. A mesh of which the camera sees nothing draws nothing. Without meshes it is Frame::of().
/// It refers to the draws, which outlive it.
/// @throws UserError for another shader, a light that is not of unit length or whose ambient share is not 0 to 1, and as
///         Frame::draw()
std::shared_ptr<Frame> mixed_frame(const Draw& splats, const std::vector<Draw>& meshes,
                                   const MixedFrameOptions& options = {});

/// The same as draws of a frame: splats `first` to `first` + `count` - 1, called `name`. Without meshes, that draw alone.
void draw_mixed(Frame& frame, std::shared_ptr<const Draw> splats,
                const std::vector<std::shared_ptr<const Draw>>& meshes, const MixedFrameOptions& options,
                const std::string& name = {}, std::uint32_t first = 0, std::uint32_t count = ~0U);

}  // namespace vrpipe
