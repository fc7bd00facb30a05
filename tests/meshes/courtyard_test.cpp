#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/scene.h>

#include "mesh_test_support.h"

namespace vrpipe {
namespace {

using testing::doubled_area;

LoadedScene load_courtyard() {
  SceneRequest request;
  request.scene = "builtin:courtyard";
  return load_scene(request);
}

/// Depth of the meshes at every pixel's sample, front faces alone; 1 where there is none.
std::vector<double> depth_image(const std::vector<Draw>& meshes, std::uint32_t width, std::uint32_t height) {
  std::vector<double> image(std::size_t{width} * height, 1.0);
  for (const Draw& mesh : meshes) {
    for (const MeshTriangle& t : mesh.mesh) {
      const double area = doubled_area(t);
      if (area >= 0) continue;  // y points down
      const auto& v = t.vertices;
      const auto [left, right] = std::minmax({v[0].x, v[1].x, v[2].x});
      const auto [top, bottom] = std::minmax({v[0].y, v[1].y, v[2].y});
      for (int y = std::max(0, static_cast<int>(top)); y < static_cast<int>(height) && y <= static_cast<int>(bottom);
           ++y) {
        for (int x = std::max(0, static_cast<int>(left)); x < static_cast<int>(width) && x <= static_cast<int>(right);
             ++x) {
          double depth = 0;
          bool inside = true;
          for (std::size_t i = 0; i < 3; ++i) {
            const MeshVertex &p = v[(i + 1) % 3], &q = v[(i + 2) % 3];
            const double b = ((static_cast<double>(q.x) - p.x) * (y + 0.5 - p.y) -
                              (static_cast<double>(q.y) - p.y) * (x + 0.5 - p.x)) /
                             area;
            inside = inside && b >= 0;
            depth += b * v[i].depth;
          }
          double& stored = image[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)];
          if (inside) stored = std::min(stored, depth);
        }
      }
    }
  }
  return image;
}

TEST(Courtyard, EachKindHidesTheOtherFromItsCamera) {
  const LoadedScene scene = load_courtyard();
  ASSERT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.meshes[0].width, scene.draw.width);
  EXPECT_EQ(scene.meshes[0].height, scene.draw.height);
  EXPECT_EQ(scene.rejected_triangles.total(), 0u);
  EXPECT_EQ(scene.summary.rejected.total(), 0u);
  const std::uint32_t width = scene.draw.width, height = scene.draw.height;
  const std::vector<double> depth = depth_image(scene.meshes, width, height);
  const double pixels = static_cast<double>(depth.size());
  const double opaque = static_cast<double>(std::count_if(depth.begin(), depth.end(), [](double d) { return d < 1; }));
  EXPECT_GT(opaque, 0.4 * pixels);
  EXPECT_LT(opaque, 0.8 * pixels);

  std::uint64_t before = 0, behind = 0, beside = 0;
  for (const Splat& splat : scene.draw.splats) {
    if (!(splat.cx >= 0 && splat.cy >= 0)) continue;
    const auto x = static_cast<std::uint32_t>(splat.cx), y = static_cast<std::uint32_t>(splat.cy);
    if (x >= width || y >= height) continue;
    const double there = depth[std::size_t{y} * width + x];
    ++(there == 1 ? beside : static_cast<double>(splat.depth) < there ? before : behind);
  }
  EXPECT_GT(before, 3000u);
  EXPECT_GT(behind, 10000u);
  EXPECT_GT(beside, 3000u);
}

TEST(Courtyard, IsAFewThousandTrianglesAndTensOfThousandsOfSplats) {
  const BuiltinScene scene = make_builtin_scene("courtyard");
  ASSERT_EQ(scene.meshes.size(), 1u);
  const Mesh& mesh = *scene.meshes[0];
  EXPECT_GT(mesh.triangles.size(), 1000u);
  EXPECT_LT(mesh.triangles.size(), 5000u);
  EXPECT_GT(scene.gaussians.size(), 20000u);
  EXPECT_LT(scene.gaussians.size(), 100000u);
  // Front faces, counter-clockwise in a right-handed world, are where the normals point to.
  for (const auto& triangle : mesh.triangles) {
    const auto vec = [](const std::array<float, 3>& f) { return Vec3{f[0], f[1], f[2]}; };
    const Vec3 corner = vec(mesh.positions[triangle[0]]);
    const Vec3 area = glm::cross(vec(mesh.positions[triangle[1]]) - corner, vec(mesh.positions[triangle[2]]) - corner);
    for (const std::uint32_t v : triangle) {
      EXPECT_GT(glm::dot(area, vec(mesh.normals[v])), 0);
      EXPECT_NEAR(glm::length(vec(mesh.normals[v])), 1, 1e-6);
      for (const float c : mesh.colours[v]) EXPECT_TRUE(c > 0 && c < 1);
    }
  }
}

TEST(Courtyard, HasTheSameBitsEverywhere) {
  const LoadedScene scene = load_courtyard();
  std::uint64_t splats = 0xcbf29ce484222325u, triangles = splats;  // FNV-1a
  const auto add = [](std::uint64_t& hash, const auto& record) {
    std::array<std::uint32_t, sizeof record / 4> words;
    std::memcpy(words.data(), &record, sizeof record);
    for (const std::uint32_t word : words) hash = (hash ^ word) * 0x100000001b3u;
  };
  for (const Splat& splat : scene.draw.splats) add(splats, splat);
  for (const MeshTriangle& triangle : scene.meshes[0].mesh) add(triangles, triangle);
  EXPECT_EQ(splats, 0x65c925231f0c26a0u) << std::hex << splats;
  EXPECT_EQ(triangles, 0xc33dadcd613eba82u) << std::hex << triangles;
}

}  // namespace
}  // namespace vrpipe
