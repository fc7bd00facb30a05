#include <vrpipe/pipeline/depth_plane.h>

#include <algorithm>
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

}  // namespace vrpipe
