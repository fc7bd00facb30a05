#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/workloads/mesh.h>

#include "clip.h"
#include "triangle_check.h"

namespace vrpipe {
namespace {

constexpr char kCannotProject[] = "cannot project mesh";

/// A colour as the pipeline takes it: not below 0, finite.
float colour_of(double value) {
  constexpr float kMaxFloat = std::numeric_limits<float>::max();
  return static_cast<float>(std::min<double>(kMaxFloat, std::max(0.0, value)));
}

/// The division by w and the viewport transform.
class Viewport {
 public:
  explicit Viewport(const Camera& camera) : camera_(camera) {}

  MeshVertex operator()(const ClipVertex& vertex) const {
    const Vec3& p = vertex.position;
    // As Gaussians are projected, to the bit.
    const double w = clip_w(camera_, p.z);
    const double x = 0.5 * camera_.width + (camera_.principal_x + camera_.fx * (p.x / w));
    const double y = 0.5 * camera_.height + (camera_.principal_y + camera_.fy * (p.y / w));
    MeshVertex out{};
    out.x = within_guard_band(x);
    out.y = within_guard_band(y);
    out.depth = static_cast<float>(window_depth(camera_, p.z));
    out.inverse_w = static_cast<float>(1.0 / w);
    out.red = colour_of(vertex.colour.r);
    out.green = colour_of(vertex.colour.g);
    out.blue = colour_of(vertex.colour.b);
    out.nx = static_cast<float>(vertex.normal.x);
    out.ny = static_cast<float>(vertex.normal.y);
    out.nz = static_cast<float>(vertex.normal.z);
    return out;
  }

 private:
  /// A crossing with the border may be rounded to beyond it.
  static float within_guard_band(double pixels) {
    return static_cast<float>(std::min(guard_band_pixels, std::max(-guard_band_pixels, pixels)));
  }

  const Camera& camera_;
};

}  // namespace

Draw project_mesh(const Mesh& mesh, const Camera& camera, RejectedTriangles& rejected) {
  check_camera(camera, kCannotProject);
  check_mesh(mesh);
  const ClipVolume volume(camera);
  const Viewport viewport(camera);
  // Every triangle makes the same of a position, so those that share an edge share it to the bit.
  const auto shaded = [&](std::uint32_t index) {
    const auto& position = mesh.positions[index];
    const auto& colour = mesh.colours[index];
    const auto& normal = mesh.normals[index];
    return ClipVertex{camera_space(camera, {position[0], position[1], position[2]}),
                      {colour[0], colour[1], colour[2]},
                      {normal[0], normal[1], normal[2]}};
  };
  Draw draw;
  draw.width = camera.width;
  draw.height = camera.height;
  constexpr std::size_t kMostTriangles = std::size_t{1} << 31;
  for (const auto& triangle : mesh.triangles) {
    if (!can_be_drawn(mesh, triangle, rejected)) continue;
    const ClipPolygon polygon = volume.clip({shaded(triangle[0]), shaded(triangle[1]), shaded(triangle[2])});
    if (polygon.size() < 3) continue;
    const MeshVertex apex = viewport(polygon[0]);
    MeshVertex previous = viewport(polygon[1]);
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      const MeshVertex next = viewport(polygon[i]);
      draw.mesh.push_back({{apex, previous, next}});
      previous = next;
    }
    if (draw.mesh.size() > kMostTriangles) {
      throw UserError(kCannotProject, "size", "clipping makes more than 2^31 triangles of it", "use a smaller mesh");
    }
  }
  return draw;
}

}  // namespace vrpipe
