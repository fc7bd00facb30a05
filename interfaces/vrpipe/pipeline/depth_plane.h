#pragma once

#include <array>
#include <cstdint>

#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// The depth of a primitive at samples: that of its splat's centre, or, of a mesh, on the plane through its snapped vertices.
/// Computed in double, the same for every draw of the triangle, so that one draw's depth equals another's; never outside the
/// range of the vertices, however thin the triangle.
class DepthPlane {
 public:
  DepthPlane() = default;
  /// @throws SimulationFault for a primitive that has no vertices
  DepthPlane(const RenderContext& context, DrawIndex draw, std::uint32_t splat, unsigned triangle);

  /// At the sample of a pixel.
  double at(std::int32_t x, std::int32_t y) const {
    const std::array<double, 3> weights = weights_.at(x, y);
    const double depth = weights[0] * depth_[0] + weights[1] * depth_[1] + weights[2] * depth_[2];
    return depth < nearest_ ? nearest_ : (depth > farthest_ ? farthest_ : depth);
  }
  /// A bound: nothing in a rectangle of pixels is nearer, as `at` has it.
  double nearest_in(const PixelRect& area) const;
  bool is_flat() const { return nearest_ == farthest_; }
  double nearest() const { return nearest_; }
  double farthest() const { return farthest_; }
  bool is_back_face() const { return is_back_face_; }

 private:
  BarycentricWeights weights_;
  std::array<double, 3> depth_{};
  double nearest_ = 0;
  double farthest_ = 0;
  bool is_back_face_ = false;
};

}  // namespace vrpipe
