#include "triangle_check.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <glm/geometric.hpp>

#include <vrpipe/component/error.h>

namespace vrpipe {
namespace {

bool is_finite(const std::array<float, 3>& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

Vec3 to_vector(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

void check_mesh(const Mesh& mesh) {
  constexpr char kCannot[] = "cannot use mesh";
  const std::size_t vertices = mesh.positions.size();
  if (mesh.normals.size() != vertices || mesh.colours.size() != vertices) {
    throw UserError(kCannot, "vertices",
                    "there are " + std::to_string(vertices) + " positions, " + std::to_string(mesh.normals.size()) +
                        " normals and " + std::to_string(mesh.colours.size()) + " colours",
                    "give each vertex one of each");
  }
  if (std::max(vertices, mesh.triangles.size()) > kMaxMeshElements) {
    throw UserError(kCannot, "size",
                    "it has " + std::to_string(vertices) + " vertices and " + std::to_string(mesh.triangles.size()) +
                        " triangles",
                    "use at most " + std::to_string(kMaxMeshElements) + " of each");
  }
}

bool can_be_drawn(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle, RejectedTriangles& rejected) {
  for (const std::uint32_t vertex : triangle) {
    if (vertex < mesh.positions.size()) continue;
    ++rejected.index_out_of_range;
    return false;
  }
  for (const std::uint32_t vertex : triangle) {
    if (is_finite(mesh.positions[vertex]) && is_finite(mesh.normals[vertex]) && is_finite(mesh.colours[vertex]))
      continue;
    ++rejected.not_finite;
    return false;
  }
  // No square of a difference of floats overflows a double; a product that vanishes is of sides of 1e-40 and less.
  const Vec3 corner = to_vector(mesh.positions[triangle[0]]);
  const Vec3 normal =
      glm::cross(to_vector(mesh.positions[triangle[1]]) - corner, to_vector(mesh.positions[triangle[2]]) - corner);
  if (normal == Vec3{0, 0, 0}) {
    ++rejected.degenerate;
    return false;
  }
  return true;
}

void reject_triangles(Mesh& mesh, RejectedTriangles& rejected) {
  check_mesh(mesh);
  auto& triangles = mesh.triangles;
  triangles.erase(std::remove_if(triangles.begin(), triangles.end(),
                                 [&](const auto& triangle) { return !can_be_drawn(mesh, triangle, rejected); }),
                  triangles.end());
}

}  // namespace vrpipe
