#pragma once

#include <array>
#include <cstddef>

#include <vrpipe/workloads/camera.h>

namespace vrpipe {

/// A vertex between vertex shading and the division by w: clip space is camera space, where w is z, or 1 without perspective.
struct ClipVertex {
  Vec3 position{};  ///< camera space
  Vec3 colour{};
  Vec3 normal{};
};

/// A convex polygon: a triangle that six planes have cut at most.
class ClipPolygon {
 public:
  /// 9, were it not for rounding, which may leave a polygon not quite convex: then a plane takes every other vertex and makes
  /// two for each. From 3: 4, 6, 9, 13, 19, 28.
  static constexpr std::size_t most_vertices = 28;

  std::size_t size() const { return size_; }
  const ClipVertex& operator[](std::size_t i) const { return vertices_[i]; }
  const ClipVertex& cyclic(std::size_t i) const { return vertices_[i == size_ ? 0 : i]; }
  void add(const ClipVertex& vertex) { vertices_[size_++] = vertex; }

 private:
  std::array<ClipVertex, most_vertices> vertices_;
  std::size_t size_ = 0;
};

/// The volume that triangles are clipped to: the near and the far plane, and the guard band around the image.
class ClipVolume {
 public:
  explicit ClipVolume(const Camera& camera);

  /// What of a triangle lies in the volume, borders included, with its winding; fewer than 3 vertices where nothing does.
  ClipPolygon clip(const std::array<ClipVertex, 3>& triangle) const;

 private:
  /// Inside where normal . position + offset >= 0.
  struct Plane {
    Vec3 normal{};
    double offset = 0;
  };
  double near_plane_, far_plane_;
  std::array<Plane, 6> planes_;  ///< near, far, left, right, top, bottom
};

}  // namespace vrpipe
