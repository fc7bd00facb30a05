#pragma once

#include <array>
#include <cstdint>

#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// Opaque colours of a mesh: vertex attributes interpolated perspective-correct, in double, and lit where the draw says so.
class MeshShader {
 public:
  explicit MeshShader(const RenderContext& context) : context_(context) {}
  /// At the covered samples of a quad, whose upper left pixel is (x, y); 0 elsewhere.
  QuadColor shade(const Quad& quad, std::int32_t x, std::int32_t y);

 private:
  struct Entry {
    std::uint32_t splat = ~0U;  ///< none yet
    BarycentricWeights weights;
  };
  const RenderContext& context_;
  std::array<Entry, 32> entries_;  ///< of the triangles shaded last
};

}  // namespace vrpipe
