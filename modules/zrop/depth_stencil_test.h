#pragma once

#include <array>
#include <cstdint>

#include <vrpipe/pipeline/depth_plane.h>
#include <vrpipe/pipeline/framebuffer.h>

namespace vrpipe {

/// Depth and stencil test of quads, with what they write (OpenGL 4.6, 17.3.5 and 17.3.6): first the stencil test, then that of
/// depth; the stencil operation is that of the first test that fails, or of both passed. The termination bit is no part of it.
class DepthStencilTest {
 public:
  explicit DepthStencilTest(const RenderContext& context) : context_(context) {}

  struct Outcome {
    LaneMask passed;
    bool wrote;  ///< some stored depth or stencil is another one than before
  };
  /// Of a quad's covered samples. `x` and `y` are its upper left pixel.
  Outcome test(const Quad& quad, std::int32_t x, std::int32_t y, DepthFormat format, DepthStencilQuad& stored);

 private:
  struct Entry {
    std::uint32_t primitive = ~0U;  ///< none yet
    DepthPlane plane;
    std::uint32_t flat_depth = 0;  ///< as stored, where it is everywhere the same
  };
  const Entry& entry_of(const Quad& quad, DepthFormat format);

  const RenderContext& context_;
  std::array<Entry, 64> entries_;  ///< of the primitives tested last
};

}  // namespace vrpipe
