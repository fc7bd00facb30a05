#include "mesh_painter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

namespace vrpipe {
namespace {

std::array<float, 3> to_float(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

Vec3 turned_down(const Vec3& v) { return {v.x, -v.y, v.z}; }

Vec3 to_double(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

void MeshPainter::surface(const Surface& surface, const Paint& paint, int columns, int rows) {
  const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const double u = static_cast<double>(column) / columns, v = static_cast<double>(row) / rows;
      const SurfacePoint point = surface(u, v);
      mesh_.positions.push_back(to_float(turned_down(point.position)));
      mesh_.normals.push_back(to_float(turned_down(point.normal)));
      mesh_.colours.push_back(to_float(paint(point.position, u, v)));
    }
  }
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vec3 corner = to_double(mesh_.positions[a]);
    const Vec3 area = glm::cross(to_double(mesh_.positions[b]) - corner, to_double(mesh_.positions[c]) - corner);
    const Vec3 normal = to_double(mesh_.normals[a]) + to_double(mesh_.normals[b]) + to_double(mesh_.normals[c]);
    const double facing = glm::dot(area, normal);
    if (facing == 0) return;  // at the centre of a disc
    if (facing < 0) std::swap(b, c);
    mesh_.triangles.push_back({a, b, c});
  };
  const auto width = static_cast<std::uint32_t>(columns + 1);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const std::uint32_t here = first + static_cast<std::uint32_t>(row) * width + static_cast<std::uint32_t>(column);
      add(here, here + 1, here + width + 1);
      add(here, here + width + 1, here + width);
    }
  }
}

void MeshPainter::box(const Vec3& centre, const Vec3& half, const Paint& paint, double cell) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t second = (axis + 1) % 3, third = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      Vec3 corner = centre - half, edge_u{}, edge_v{};
      corner[axis] = centre[axis] + side * half[axis];
      const std::size_t along_u = side > 0 ? second : third, along_v = side > 0 ? third : second;
      edge_u[along_u] = 2 * half[along_u];
      edge_v[along_v] = 2 * half[along_v];
      const auto cells = [&](std::size_t along) {
        return std::max(1, static_cast<int>(std::ceil(2 * half[along] / cell - 1e-9)));
      };
      surface(quad_surface(corner, edge_u, edge_v), paint, cells(along_u), cells(along_v));
    }
  }
}

void MeshPainter::cylinder(const Vec3& base, const Vec3& top, double base_radius, double top_radius, const Paint& paint,
                           int sectors, int rings) {
  const Vec3 axis = unit(top - base);
  surface(frustum_surface(base, top, base_radius, top_radius), paint, sectors, rings);
  surface(disc_surface(base, axis * -1.0, 0, base_radius), paint, sectors, 1);
  surface(disc_surface(top, axis, 0, top_radius), paint, sectors, 1);
}

}  // namespace vrpipe
