#include <vrpipe/pipeline/depth_plane.h>

#include <algorithm>
#include <cmath>
#include <string>

#include <vrpipe/component/error.h>

namespace vrpipe {

DepthPlane::DepthPlane(const RenderContext& context, DrawIndex draw, std::uint32_t splat, unsigned triangle) {
  const DrawCall& call = context.draw(draw);
  if (!call.geometry->is_mesh()) {
    nearest_ = farthest_ = static_cast<double>(call.splat(splat).depth);
    return;
  }
  SnappedTriangle snapped;
  if (!snap_triangle(context, draw, splat, triangle, snapped) || doubled_area(snapped) == 0) {
    throw SimulationFault("zrop", 0, "triangle " + std::to_string(splat) + " covers no sample");
  }
  weights_ = BarycentricWeights(snapped, context.precision.subpixel_bits);
  is_back_face_ = vrpipe::is_back_face(*call.geometry, snapped);
  for (unsigned i = 0; i < 3; ++i) {
    depth_[i] = static_cast<double>(call.mesh_triangle(splat).vertices[i].depth);
  }
  nearest_ = *std::min_element(depth_.begin(), depth_.end());
  farthest_ = *std::max_element(depth_.begin(), depth_.end());
}

double DepthPlane::nearest_in(const PixelRect& area) const {
  if (is_flat()) return nearest_;
  // A plane is nearest at a corner. A weight has three roundings, a product one and their sum two: together they are off by
  // less than 8 * 2^-53 of the magnitudes that are added, here as at a covered sample, where no weight exceeds 1.
  constexpr double rounding = 1.0 / (1ULL << 49U);
  double nearest = farthest_;
  for (const std::int32_t y : {area.y0, area.y1 - 1}) {
    for (const std::int32_t x : {area.x0, area.x1 - 1}) {
      const std::array<double, 3> weights = weights_.at(x, y);
      double depth = 0;
      double magnitude = 0;
      for (unsigned i = 0; i < 3; ++i) {
        depth += weights[i] * depth_[i];
        magnitude += (std::fabs(weights[i]) + 1) * std::fabs(depth_[i]);
      }
      nearest = std::min(nearest, depth - magnitude * rounding);
    }
  }
  return std::max(nearest, nearest_);
}

}  // namespace vrpipe
