#include <cmath>
#include <cstring>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include <vrpipe/workloads/mesh.h>
#include <vrpipe/workloads/preprocess.h>

#include "../workloads/workload_test_support.h"
#include "mesh_test_support.h"

namespace vrpipe {
namespace {

using testing::add_triangle;
using testing::expect_user_error;
using testing::tilted_camera;
using Exact = boost::multiprecision::cpp_bin_float_50;

TEST(WindowDepth, IsThatOfAPerspectiveMatrixInExtendedPrecision) {
  Camera camera;
  testing::Numbers random(1);
  for (int i = 0; i < 2000; ++i) {
    camera.near_plane = static_cast<float>(random.uniform(1e-3, 2));
    camera.far_plane = static_cast<float>(random.uniform(3, 5000));
    const double z = random.uniform(camera.near_plane, camera.far_plane);
    const Exact near_plane = camera.near_plane, far_plane = camera.far_plane;
    // Third row of the matrix over the fourth: (z f / (f - n) - f n / (f - n)) / z.
    const Exact range = far_plane - near_plane;
    const Exact expected = (z * far_plane / range - far_plane * near_plane / range) / z;
    EXPECT_NEAR(window_depth(camera, z), expected.convert_to<double>(), 1e-15);
  }
}

TEST(WindowDepth, IsExactlyZeroAndOneAtThePlanesAndClampedBeyond) {
  Camera camera;
  for (const float far_plane : {0.3f, 7.7f, 1000.0f, 1e30f}) {
    camera.far_plane = far_plane;
    EXPECT_EQ(window_depth(camera, camera.near_plane), 0);
    EXPECT_EQ(static_cast<float>(window_depth(camera, far_plane)), 1);
    EXPECT_LE(window_depth(camera, far_plane), 1);
    EXPECT_EQ(window_depth(camera, 0.5 * camera.near_plane), 0);
    EXPECT_EQ(window_depth(camera, 2.0 * far_plane), 1);
  }
}

/// A vertex and a Gaussian's centre, at one point of the world.
void expect_at_the_same_pixel(const Camera& camera) {
  const bool is_perspective = camera.projection == Projection::perspective;
  testing::Numbers random(2);
  int compared = 0;
  for (int i = 0; i < 500; ++i) {
    const double z = random.uniform(0.5, 40);
    const double wide = is_perspective ? z : 1;
    const auto seen = [&] { return Vec3{random.uniform(-0.4, 0.4) * wide, random.uniform(-0.4, 0.4) * wide, z}; };
    GaussianAttributes gaussian = testing::ordinary_gaussian();
    gaussian.position = testing::world_of(camera, seen());
    SceneSummary summary;
    const Draw splats = preprocess(testing::scene_of({gaussian}), camera, {}, summary);
    Mesh mesh;
    add_triangle(mesh, {gaussian.position, testing::world_of(camera, seen()), testing::world_of(camera, seen())});
    RejectedTriangles rejected;
    const Draw draw = project_mesh(mesh, camera, rejected);
    ASSERT_EQ(splats.splats.size(), 1u);
    ASSERT_EQ(draw.mesh.size(), 1u);
    EXPECT_EQ(draw.mesh[0].vertices[0].x, splats.splats[0].cx);
    EXPECT_EQ(draw.mesh[0].vertices[0].y, splats.splats[0].cy);
    EXPECT_EQ(draw.mesh[0].vertices[0].depth, splats.splats[0].depth);
    EXPECT_GT(splats.splats[0].depth, 0);
    ++compared;
  }
  EXPECT_EQ(compared, 500);
}

TEST(ProjectMesh, PutsAVertexAndAGaussiansCentreAtTheSamePixelAndDepthToTheBit) {
  Camera camera = tilted_camera();
  expect_at_the_same_pixel(camera);
  camera.principal_x = 5.25;
  camera.principal_y = -7.5;
  expect_at_the_same_pixel(camera);
  camera.projection = Projection::orthographic;
  expect_at_the_same_pixel(camera);
}

TEST(ProjectMesh, WithoutPerspectiveWIsOneAndTheGuardBandIsCutParallel) {
  Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64);
  camera.projection = Projection::orthographic;
  camera.fx = camera.fy = 4;
  camera.principal_x = 10;
  camera.near_plane = 1;
  camera.far_plane = 9;
  Mesh mesh;
  add_triangle(mesh, {{{-1, -1, 3}, {1, -1, 5}, {0, 1, 9}}});
  add_triangle(mesh, {{{-1, -1, 0}, {1, -1, 0}, {0, 1, 2}}});       // cut by the near plane
  add_triangle(mesh, {{{0, 0, 2}, {90000, 0, 4}, {0, 90000, 4}}});  // and by the guard band
  RejectedTriangles rejected;
  const Draw draw = project_mesh(mesh, camera, rejected);
  ASSERT_GE(draw.mesh.size(), 3U);
  const auto& v = draw.mesh[0].vertices;
  EXPECT_EQ(v[0].x, 38);  // 42 - 4
  EXPECT_EQ(v[0].y, 28);
  EXPECT_EQ(v[1].x, 46);
  EXPECT_EQ(v[0].depth, 0.25F);
  EXPECT_EQ(v[1].depth, 0.5F);
  EXPECT_EQ(v[2].depth, 1);
  double least_depth = 1;
  float farthest = 0;
  for (const MeshTriangle& triangle : draw.mesh) {
    for (const MeshVertex& vertex : triangle.vertices) {
      EXPECT_EQ(vertex.inverse_w, 1);
      least_depth = std::min<double>(least_depth, vertex.depth);
      farthest = std::max({farthest, vertex.x, vertex.y});
    }
  }
  EXPECT_EQ(least_depth, 0);
  EXPECT_EQ(farthest, 32768);
}

TEST(ProjectMesh, APrincipalPointMovesTheGuardBandWithTheImage) {
  Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64);
  camera.principal_x = 1000;
  Mesh mesh;
  add_triangle(mesh, {{{-90000, -1, 4}, {90000, -1, 4}, {0, 1, 4}}});
  RejectedTriangles rejected;
  float left = 0, right = 0;
  for (const MeshTriangle& triangle : project_mesh(mesh, camera, rejected).mesh) {
    for (const MeshVertex& vertex : triangle.vertices) {
      left = std::min(left, vertex.x);
      right = std::max(right, vertex.x);
    }
  }
  EXPECT_EQ(left, -32768);
  EXPECT_EQ(right, 32768);
}

TEST(ProjectMesh, AGaussianBeyondTheFarPlaneHasDepthOne) {
  Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64);
  camera.far_plane = 4;
  SceneSummary summary;
  const Draw draw = preprocess(testing::scene_of({testing::ordinary_gaussian()}), camera, {}, summary);
  ASSERT_EQ(draw.splats.size(), 1u);
  EXPECT_EQ(draw.splats[0].depth, 1);
}

TEST(ProjectMesh, StoresOneOverWColourAndNormalAsTheyAre) {
  const Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64);
  Mesh mesh;
  add_triangle(mesh, {{{-1, -1, 4}, {1, -1, 8}, {0, 1, 16}}});
  mesh.normals[1] = {3, -4, 5};
  mesh.colours[2] = {-0.5f, 0.25f, 7};
  RejectedTriangles rejected;
  const Draw draw = project_mesh(mesh, camera, rejected);
  EXPECT_EQ(draw.width, 64u);
  EXPECT_EQ(draw.height, 64u);
  EXPECT_TRUE(draw.splats.empty());
  ASSERT_EQ(draw.mesh.size(), 1u);
  const auto& v = draw.mesh[0].vertices;
  EXPECT_EQ(v[0].x, 24);  // 32 - 32 / 4
  EXPECT_EQ(v[0].y, 24);
  EXPECT_EQ(v[1].x, 36);
  EXPECT_EQ(v[2].y, 34);
  EXPECT_EQ(v[0].inverse_w, 0.25f);
  EXPECT_EQ(v[1].inverse_w, 0.125f);
  EXPECT_EQ(v[2].inverse_w, 0.0625f);
  EXPECT_EQ(v[1].nx, 3);
  EXPECT_EQ(v[1].ny, -4);
  EXPECT_EQ(v[1].nz, 5);
  EXPECT_EQ(v[0].red, 1);
  EXPECT_EQ(v[2].red, 0) << "a colour below 0";
  EXPECT_EQ(v[2].green, 0.25f);
  EXPECT_EQ(v[2].blue, 7);
}

TEST(ProjectMesh, KeepsWhatFacesAwayAndWhatMissesTheImage) {
  const Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64);
  Mesh mesh;
  add_triangle(mesh, {{{-1, -1, 4}, {1, -1, 4}, {0, 1, 4}}});
  add_triangle(mesh, {{{-1, -1, 4}, {0, 1, 4}, {1, -1, 4}}});
  add_triangle(mesh, {{{99, -1, 4}, {98, 1, 4}, {97, -1, 4}}});
  RejectedTriangles rejected;
  EXPECT_EQ(project_mesh(mesh, camera, rejected).mesh.size(), 3u);
  EXPECT_EQ(rejected.total(), 0u);
}

TEST(ProjectMesh, LeavesOutWhatCannotBeDrawnAndCountsItByReason) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const testing::Triangle3 good = {{{-1, -1, 4}, {1, -1, 4}, {0, 1, 4}}};
  const Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64);
  Mesh mesh;
  for (int i = 0; i < 8; ++i) add_triangle(mesh, good);
  mesh.positions[1][2] = nan;
  mesh.positions[5][0] = -infinity;
  mesh.normals[6][1] = nan;
  mesh.colours[9][0] = infinity;
  mesh.triangles[4][2] = 24;
  mesh.triangles[5] = {15, 16, 15};
  mesh.positions[20] = {3, -1, 4};  // in line with the first two
  mesh.triangles.push_back({~0U, ~0U, ~0U});
  RejectedTriangles rejected;
  const Draw draw = project_mesh(mesh, camera, rejected);
  EXPECT_EQ(draw.mesh.size(), 1u);
  EXPECT_EQ(rejected.not_finite, 4u);
  EXPECT_EQ(rejected.index_out_of_range, 2u);
  EXPECT_EQ(rejected.degenerate, 2u);
  EXPECT_EQ(rejected.total(), 8u);

  RejectedTriangles again;
  reject_triangles(mesh, again);
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<std::uint32_t, 3>>{{21, 22, 23}}));
  EXPECT_EQ(again.total(), 8u);
}

TEST(ProjectMesh, TheLargestAndTheSmallestFloatsStayFinite) {
  const Camera camera = tilted_camera();
  testing::Numbers random(3);
  const float values[] = {0, 1, -1, 3e38f, -3e38f, 1e-45f, -1e-38f, 1e20f};
  Mesh mesh;
  for (int i = 0; i < 3000; ++i) {
    testing::Triangle3 corners{};
    for (auto& corner : corners) {
      for (float& coordinate : corner) coordinate = values[random.below(8)];
    }
    add_triangle(mesh, corners);
    mesh.colours.back() = {3e38f, -3e38f, 1};
    mesh.normals.back() = {-3e38f, 3e38f, 1};
  }
  RejectedTriangles rejected;
  const Draw draw = project_mesh(mesh, camera, rejected);
  EXPECT_GT(draw.mesh.size(), 100u);
  for (const MeshTriangle& triangle : draw.mesh) {
    for (const MeshVertex& v : triangle.vertices) {
      for (const float f : {v.x, v.y, v.depth, v.inverse_w, v.red, v.green, v.blue, v.nx, v.ny, v.nz}) {
        ASSERT_TRUE(std::isfinite(f));
      }
      ASSERT_LE(std::fabs(v.x), 32768);
      ASSERT_LE(std::fabs(v.y), 32768);
      ASSERT_GE(v.depth, 0);
      ASSERT_LE(v.depth, 1);
      ASSERT_GT(v.inverse_w, 0);
      ASSERT_GE(v.green, 0);
    }
  }
}

TEST(ProjectMesh, ImpossibleMeshesAndCamerasAreRefused) {
  RejectedTriangles rejected;
  Camera camera = tilted_camera();
  Mesh mesh;
  add_triangle(mesh, {{{0, 0, 4}, {1, 0, 4}, {0, 1, 4}}});
  mesh.normals.pop_back();
  expect_user_error([&] { project_mesh(mesh, camera, rejected); }, {"cannot use mesh", "3 positions, 2 normals"});
  mesh.normals.resize(3);
  mesh.triangles.resize(kMaxMeshElements + 1);
  expect_user_error([&] { project_mesh(mesh, camera, rejected); }, {"cannot use mesh", "16777217 triangles"});
  mesh.triangles.resize(1);
  for (const float far_plane : {0.2f, 0.1f, std::numeric_limits<float>::infinity(), std::nanf("")}) {
    camera.far_plane = far_plane;
    expect_user_error([&] { project_mesh(mesh, camera, rejected); }, {"cannot project mesh (camera)", "far plane"});
  }
}

TEST(ProjectMesh, AnEmptyMeshIsAnEmptyDraw) {
  RejectedTriangles rejected;
  const Draw draw = project_mesh({}, tilted_camera(), rejected);
  EXPECT_EQ(draw.size(), 0u);
  EXPECT_EQ(draw.width, 64u);
}

TEST(ProjectMesh, GivesTheSameBitsEverywhere) {
  const Camera camera = tilted_camera();
  testing::Numbers random(4);
  Mesh mesh;
  for (int i = 0; i < 400; ++i) {
    testing::Triangle3 corners{};
    for (auto& corner : corners) {
      for (float& coordinate : corner) coordinate = static_cast<float>(random.uniform(-30, 30));
    }
    add_triangle(mesh, corners);
  }
  RejectedTriangles rejected;
  std::uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a
  const Draw draw = project_mesh(mesh, camera, rejected);
  for (const MeshTriangle& triangle : draw.mesh) {
    std::uint32_t words[30];
    std::memcpy(words, &triangle, sizeof words);
    for (const std::uint32_t word : words) hash = (hash ^ word) * 0x100000001b3u;
  }
  EXPECT_EQ(draw.mesh.size(), 495u);
  EXPECT_EQ(hash, 0xddaebea104fe9992u) << std::hex << hash;
}

}  // namespace
}  // namespace vrpipe
