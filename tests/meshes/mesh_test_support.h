#pragma once

#include <array>
#include <cmath>
#include <random>

#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/mesh.h>

namespace vrpipe::testing {

using Triangle3 = std::array<std::array<float, 3>, 3>;

/// Appends a triangle with vertices of its own, in red, green and blue, its normals along z.
inline void add_triangle(Mesh& mesh, const Triangle3& corners) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::size_t i = 0; i < 3; ++i) {
    mesh.positions.push_back(corners[i]);
    mesh.normals.push_back({0, 0, -1});
    std::array<float, 3> colour{};
    colour[i] = 1;
    mesh.colours.push_back(colour);
  }
  mesh.triangles.push_back({first, first + 1, first + 2});
}

/// On the screen, where y points down: below 0 of one that faces the camera.
inline double doubled_area(const MeshTriangle& t) {
  const auto& v = t.vertices;
  return (static_cast<double>(v[1].x) - v[0].x) * (static_cast<double>(v[2].y) - v[0].y) -
         (static_cast<double>(v[1].y) - v[0].y) * (static_cast<double>(v[2].x) - v[0].x);
}

/// The same numbers with every standard library.
class Numbers {
 public:
  explicit Numbers(std::uint32_t seed) : engine_(seed) {}
  double uniform(double low, double high) { return low + (high - low) * (static_cast<double>(engine_()) * 0x1p-32); }
  std::uint32_t below(std::uint32_t end) { return static_cast<std::uint32_t>(engine_() % end); }

 private:
  std::mt19937 engine_;
};

/// Somewhere, turned somehow, so that every element of the rotation is in use.
inline Camera tilted_camera(std::uint32_t width = 64, std::uint32_t height = 48) {
  return look_at({1, -2, 3}, {2.5, 1, 4.2}, {0.2, -1, 0.1}, 70, width, height);
}

/// The point of the world that a camera sees at (right, down, forward).
inline std::array<float, 3> world_of(const Camera& camera, const Vec3& seen) {
  std::array<float, 3> world{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3& row = camera.rotation[i];
    world[i] = static_cast<float>(camera.eye[i] + row[0] * seen[0] + row[1] * seen[1] + row[2] * seen[2]);
  }
  return world;
}

}  // namespace vrpipe::testing
