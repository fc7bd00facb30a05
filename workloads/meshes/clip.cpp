#include "clip.h"

#include <algorithm>

#include <glm/geometric.hpp>

#include <vrpipe/pipeline/geometry.h>

namespace vrpipe {
namespace {

/// An order of the ends of an edge that all triangles agree on: by position, which they share, not by attributes.
bool comes_first(const Vec3& a, const Vec3& b) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (a[i] != b[i]) return a[i] < b[i];
  }
  return true;
}

/// Where an edge crosses a plane, at distances of opposite signs from it.
ClipVertex crossing(const ClipVertex& from, double from_distance, const ClipVertex& to, double to_distance) {
  const bool keep = comes_first(from.position, to.position);
  const ClipVertex &a = keep ? from : to, &b = keep ? to : from;
  const double a_distance = keep ? from_distance : to_distance, b_distance = keep ? to_distance : from_distance;
  const double t = a_distance / (a_distance - b_distance);
  return {a.position + t * (b.position - a.position), a.colour + t * (b.colour - a.colour),
          a.normal + t * (b.normal - a.normal)};
}

}  // namespace

ClipVolume::ClipVolume(const Camera& camera) : near_plane_(camera.near_plane), far_plane_(camera.far_plane) {
  // Window x = cx + fx x / w lies in the guard band where fx x + (cx +- guard) w has the right sign.
  const bool is_perspective = camera.projection == Projection::perspective;
  const auto side = [is_perspective](double x, double y, double of_w) {
    return is_perspective ? Plane{{x, y, of_w}, 0} : Plane{{x, y, 0}, of_w};
  };
  planes_ = {{{{0, 0, 1}, -near_plane_},
              {{0, 0, -1}, far_plane_},
              side(camera.fx, 0, guard_band_pixels + camera.cx()),
              side(-camera.fx, 0, guard_band_pixels - camera.cx()),
              side(0, camera.fy, guard_band_pixels + camera.cy()),
              side(0, -camera.fy, guard_band_pixels - camera.cy())}};
}

ClipPolygon ClipVolume::clip(const std::array<ClipVertex, 3>& triangle) const {
  ClipPolygon polygon;
  for (const ClipVertex& vertex : triangle) polygon.add(vertex);
  for (std::size_t p = 0; p < planes_.size() && polygon.size() > 0; ++p) {
    std::array<double, ClipPolygon::most_vertices + 1> distance{};
    bool all_inside = true;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      distance[i] = glm::dot(planes_[p].normal, polygon[i].position) + planes_[p].offset;
      all_inside = all_inside && distance[i] >= 0;
    }
    if (all_inside) continue;
    distance[polygon.size()] = distance[0];
    ClipPolygon inside;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      if (distance[i] >= 0) inside.add(polygon[i]);
      // A vertex on the plane is there already.
      if ((distance[i] > 0 && distance[i + 1] < 0) || (distance[i] < 0 && distance[i + 1] > 0)) {
        ClipVertex vertex = crossing(polygon[i], distance[i], polygon.cyclic(i + 1), distance[i + 1]);
        // Rounding must not leave it beyond: depth is 0 and 1 there.
        if (p == 0) vertex.position.z = near_plane_;
        if (p == 1) vertex.position.z = far_plane_;
        inside.add(vertex);
      }
    }
    polygon = inside;
  }
  return polygon;
}

}  // namespace vrpipe
