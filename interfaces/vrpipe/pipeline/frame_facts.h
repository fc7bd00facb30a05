#pragma once

#include <cstdint>

#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// What is known of a frame before it is simulated, from one pass over its commands and its geometry. What geometry is
/// bounded by is no smaller than what will be drawn.
struct FrameFacts {
  /// Of a frame in its variant's states.
  FrameFacts(const RenderContext& context);

  // Draws, and how many of them:
  unsigned draws = 0;
  unsigned of_splats = 0;
  unsigned of_meshes = 0;
  unsigned testing_depth_stencil = 0;
  unsigned tested_late = 0;
  unsigned terminating = 0;
  unsigned shading_nothing = 0;
  unsigned reading_color = 0;
  unsigned culling_faces = 0;  ///< of meshes
  unsigned clears = 0;

  std::uint64_t primitives = 0;  ///< splats, and triangles of meshes
  std::uint64_t not_finite = 0;  ///< of these; the bounds do not hold for them
  float largest_opacity = 0;
  float largest_color = 0;
  double widest_edge = 0;           ///< of a primitive: |x| + |y| from corner to corner, pixels
  std::uint32_t tiles = 0;          ///< of the screen, 16x16 pixels
  std::uint32_t tiles_touched = 0;  ///< by boxes around primitives
  AddressMap addresses;

 private:
  class Boxes;
  void add(const RenderContext& context, const DrawCall& call, Boxes& boxes);
};

}  // namespace vrpipe
