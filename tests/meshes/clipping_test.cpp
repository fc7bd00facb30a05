// Clipping against oracles that know no clipping: rays through window points, and the topology of closed surfaces.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <vrpipe/workloads/mesh.h>

#include "mesh_test_support.h"
#include "meshes/clip.h"

namespace vrpipe {
namespace {

using testing::add_triangle;
using testing::doubled_area;

/// What is seen of a triangle along a ray.
struct Hit {
  double z;
  Vec3 weights;  ///< of the corners
};

/// The triangle's corners as a camera sees them.
using Corners = std::array<Vec3, 3>;

Corners seen_by(const Camera& camera, const testing::Triangle3& triangle) {
  Corners seen;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      seen[k][i] = 0;
      for (std::size_t j = 0; j < 3; ++j) {
        seen[k][i] += camera.rotation[j][i] * (static_cast<double>(triangle[k][j]) - camera.eye[j]);
      }
    }
  }
  return seen;
}

/// Where the ray through a window point meets a triangle between the near and the far plane, both faces.
std::optional<Hit> cast_ray(const Camera& camera, const Corners& corners, double x, double y) {
  const Vec3 ray = {(x - 0.5 * camera.width) / camera.fx, (y - 0.5 * camera.height) / camera.fy, 1};
  const Vec3 e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
  const Vec3 p = glm::cross(ray, e2);
  const double determinant = glm::dot(e1, p);
  if (determinant == 0) return {};
  const double u = glm::dot(-corners[0], p) / determinant;
  const Vec3 q = glm::cross(-corners[0], e1);
  const double v = glm::dot(ray, q) / determinant;
  const double z = glm::dot(e2, q) / determinant;
  if (u < 0 || v < 0 || u + v > 1) return {};
  if (z < static_cast<double>(camera.near_plane) || z > static_cast<double>(camera.far_plane)) return {};
  return Hit{z, {1 - u - v, u, v}};
}

/// Perspective-correct interpolation, if a window point lies in a piece.
std::optional<MeshVertex> interpolate(const MeshTriangle& piece, double x, double y) {
  const double area = doubled_area(piece);
  if (area == 0) return {};
  std::array<double, 3> b;
  for (std::size_t i = 0; i < 3; ++i) {
    const MeshVertex &p = piece.vertices[(i + 1) % 3], &q = piece.vertices[(i + 2) % 3];
    b[i] = ((static_cast<double>(q.x) - p.x) * (y - p.y) - (static_cast<double>(q.y) - p.y) * (x - p.x)) / area;
    if (b[i] < 0) return {};
  }
  double w = 0, depth = 0;
  Vec3 colour{};
  for (std::size_t i = 0; i < 3; ++i) {
    const MeshVertex& v = piece.vertices[i];
    w += b[i] * v.inverse_w;
    depth += b[i] * v.depth;  // linear in the window
    colour += b[i] * v.inverse_w * Vec3{v.red, v.green, v.blue};
  }
  MeshVertex result{};
  result.depth = static_cast<float>(depth);
  result.inverse_w = static_cast<float>(w);
  result.red = static_cast<float>(colour.r / w);
  result.green = static_cast<float>(colour.g / w);
  result.blue = static_cast<float>(colour.b / w);
  return result;
}

/// A corner that is often behind the eye, beyond the far plane, or far aside.
Vec3 wild_corner(testing::Numbers& random) {
  const double z = random.below(3) == 0 ? random.uniform(-5, 1) : random.uniform(0.1, 60);
  const double aside = random.below(3) == 0 ? 3000 : 2;
  return {random.uniform(-aside, aside) * std::max(1.0, z), random.uniform(-aside, aside) * std::max(1.0, z), z};
}

TEST(Clipping, PiecesCoverWhatRaysHitAndInterpolateWhatTheyHit) {
  Camera camera = testing::tilted_camera();
  camera.near_plane = 0.5f;
  camera.far_plane = 40;
  testing::Numbers random(11);
  int inside = 0, outside = 0, most_pieces = 0;
  for (int n = 0; n < 3000; ++n) {
    testing::Triangle3 triangle;
    for (auto& corner : triangle) corner = testing::world_of(camera, wild_corner(random));
    const Corners corners = seen_by(camera, triangle);
    Mesh mesh;
    add_triangle(mesh, triangle);
    RejectedTriangles rejected;
    const Draw draw = project_mesh(mesh, camera, rejected);
    most_pieces = std::max(most_pieces, static_cast<int>(draw.mesh.size()));
    for (int k = 0; k < 60; ++k) {
      // In the image, around it, or anywhere in the guard band.
      const double reach = k % 3 == 0 ? 32 : k % 3 == 1 ? 400 : 32767;
      double x = 32 + random.uniform(-reach, reach), y = 24 + random.uniform(-reach, reach);
      if (k % 2 == 0 && !draw.mesh.empty()) {  // in a piece, or beside it
        const auto& v = draw.mesh[random.below(static_cast<std::uint32_t>(draw.mesh.size()))].vertices;
        const double b0 = random.uniform(-0.1, 1.1), b1 = random.uniform(-0.1, 1.1);
        x = b0 * v[0].x + b1 * v[1].x + (1 - b0 - b1) * v[2].x;
        y = b0 * v[0].y + b1 * v[1].y + (1 - b0 - b1) * v[2].y;
      }
      if (std::fabs(x) > 32767 || std::fabs(y) > 32767) continue;
      const std::optional<Hit> hit = cast_ray(camera, corners, x, y);
      // Vertices are stored to 1/512 pixel: what differs within 1/50 is not decided.
      bool decided = true;
      Vec3 least{1e9, 1e9, 1e9}, most{-1e9, -1e9, -1e9};
      double nearest = 1e9, furthest = 0;
      for (int i = 0; i < 9; ++i) {
        const auto beside = cast_ray(camera, corners, x + 0.02 * (i % 3 - 1), y + 0.02 * (i / 3 - 1));
        decided = decided && beside.has_value() == hit.has_value();
        if (!beside) continue;
        least = glm::min(least, beside->weights);
        most = glm::max(most, beside->weights);
        nearest = std::min(nearest, beside->z);
        furthest = std::max(furthest, beside->z);
      }
      if (!decided) continue;
      std::optional<MeshVertex> shown;
      for (const MeshTriangle& piece : draw.mesh) {
        if (const auto found = interpolate(piece, x, y)) shown = found;
      }
      if (!hit) {
        ++outside;
        EXPECT_FALSE(shown) << n << " at " << x << ", " << y;
        continue;
      }
      ++inside;
      ASSERT_TRUE(shown) << n << " at " << x << ", " << y;
      const Vec3 colour = {shown->red, shown->green, shown->blue};
      for (std::size_t i = 0; i < 3; ++i) {
        const double slack = 1e-4 + (most[i] - least[i]);
        EXPECT_NEAR(colour[i], hit->weights[i], slack) << n << " at " << x << ", " << y;
      }
      const double low = window_depth(camera, nearest), high = window_depth(camera, furthest);
      EXPECT_NEAR(shown->depth, window_depth(camera, hit->z), 1e-6 + (high - low));
      EXPECT_NEAR(1 / static_cast<double>(shown->inverse_w), hit->z, 1e-5 * hit->z + (furthest - nearest));
    }
  }
  EXPECT_GT(inside, 10000);
  EXPECT_GT(outside, 10000);
  EXPECT_GE(most_pieces, 4) << "several planes cut some triangle";
}

TEST(Clipping, KeepsTheWinding) {
  Camera camera = testing::tilted_camera();
  testing::Numbers random(12);
  int pieces = 0;
  for (int n = 0; n < 3000; ++n) {
    testing::Triangle3 triangle;
    for (auto& corner : triangle) corner = testing::world_of(camera, wild_corner(random));
    const Corners corners = seen_by(camera, triangle);
    // Which side the eye is on. In the window, where y points down, this is the sign of the area.
    const double facing = glm::dot(corners[0], glm::cross(corners[1], corners[2]));
    Mesh mesh;
    add_triangle(mesh, triangle);
    RejectedTriangles rejected;
    for (const MeshTriangle& piece : project_mesh(mesh, camera, rejected).mesh) {
      const double area = doubled_area(piece);
      if (std::fabs(area) < 512) continue;  // 65536 pixels long and 1/128 wide: rounding decides
      EXPECT_EQ(area > 0, facing > 0) << n;
      ++pieces;
    }
  }
  EXPECT_GT(pieces, 1000);
}

TEST(Clipping, EndsExactlyAtThePlanes) {
  Camera camera = testing::tilted_camera();
  testing::Numbers random(13);
  std::array<int, 6> at{};
  for (int n = 0; n < 3000; ++n) {
    Mesh mesh;
    testing::Triangle3 triangle;
    for (auto& corner : triangle) corner = testing::world_of(camera, wild_corner(random) * (n % 2 == 0 ? 1.0 : 40.0));
    add_triangle(mesh, triangle);
    RejectedTriangles rejected;
    for (const MeshTriangle& piece : project_mesh(mesh, camera, rejected).mesh) {
      for (const MeshVertex& v : piece.vertices) {
        ASSERT_GE(v.depth, 0);
        ASSERT_LE(v.depth, 1);
        ASSERT_LE(std::fabs(v.x), 32768);
        ASSERT_LE(std::fabs(v.y), 32768);
        ASSERT_LE(v.inverse_w, 1 / camera.near_plane);
        ASSERT_GE(v.inverse_w, (1 - 1e-6f) / camera.far_plane);
        at[0] += v.depth == 0;
        at[1] += v.depth == 1;
        at[2] += v.x == -32768;
        at[3] += v.x == 32768;
        at[4] += v.y == -32768;
        at[5] += v.y == 32768;
      }
    }
  }
  for (const int vertices : at) EXPECT_GT(vertices, 50);
}

/// 90 degrees over 64 pixels: window x = 32 + 32 x / z, exactly.
Camera straight_camera() {
  Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64);
  camera.fx = camera.fy = 32;
  return camera;
}

std::size_t pieces_of(const testing::Triangle3& triangle, const Camera& camera = straight_camera()) {
  Mesh mesh;
  add_triangle(mesh, triangle);
  RejectedTriangles rejected;
  return project_mesh(mesh, camera, rejected).mesh.size();
}

TEST(Clipping, AVertexOrAnEdgeOnAPlaneMakesNoFurtherVertices) {
  Camera camera = straight_camera();
  camera.near_plane = 1;
  camera.far_plane = 8;
  const auto pieces = [&](const testing::Triangle3& triangle) { return pieces_of(triangle, camera); };
  EXPECT_EQ(pieces({{{0, 0, 1}, {1, 0, 2}, {0, 1, 2}}}), 1u) << "a corner on the near plane, the rest within";
  EXPECT_EQ(pieces({{{0, 0, 1}, {1, 0, 1}, {0, 1, 2}}}), 1u) << "an edge on it";
  EXPECT_EQ(pieces({{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}}), 1u) << "all of it";
  EXPECT_EQ(pieces({{{0, 0, 1}, {1, 0, 0.5f}, {0, 1, 0.5f}}}), 0u) << "a corner on it, the rest before it";
  EXPECT_EQ(pieces({{{0, 0, 1}, {1, 0, 1}, {0, 1, 0.5f}}}), 0u) << "an edge on it, the rest before it";
  EXPECT_EQ(pieces({{{0, 0, 1}, {1, 0, 2}, {0, 1, 0.5f}}}), 1u) << "a corner on it, one on either side";
  EXPECT_EQ(pieces({{{0, 0, 0.5f}, {1, 0, 2}, {0, 1, 2}}}), 2u);
  EXPECT_EQ(pieces({{{0, 0, 2}, {1, 0, 0.5f}, {0, 1, 0.5f}}}), 1u);
  EXPECT_EQ(pieces({{{0, 0, 8}, {1, 0, 8}, {0, 1, 8}}}), 1u) << "on the far plane";
  EXPECT_EQ(pieces({{{0, 0, 9}, {1, 0, 9}, {0, 1, 9}}}), 0u);
  EXPECT_EQ(pieces({{{0, 0, 9}, {1, 0, 2}, {0, 1, 0.5f}}}), 3u) << "across both: five corners";
  EXPECT_EQ(pieces({{{0, 0, -1}, {1, 0, -2}, {0, 1, -2}}}), 0u) << "behind";
}

TEST(Clipping, TheGuardBandIsAHalfSpaceBelowEachOfItsBorders) {
  // At z = 1, 32768 is at x = 1023, -32768 at -1025.
  EXPECT_EQ(pieces_of({{{1023, 0, 1}, {0, 0, 1}, {0, 1, 1}}}), 1u);
  EXPECT_EQ(pieces_of({{{1024, 0, 1}, {0, 0, 1}, {0, 1, 1}}}), 2u);
  EXPECT_EQ(pieces_of({{{-1025, 0, 1}, {0, 0, 1}, {0, 1, 1}}}), 1u);
  EXPECT_EQ(pieces_of({{{-1026, 0, 1}, {0, 0, 1}, {0, 1, 1}}}), 2u);
  EXPECT_EQ(pieces_of({{{0, 1024, 1}, {0, 0, 1}, {1, 0, 1}}}), 2u);
  EXPECT_EQ(pieces_of({{{0, -1026, 1}, {0, 0, 1}, {1, 0, 1}}}), 2u);
  EXPECT_EQ(pieces_of({{{-9e6f, 0, 1}, {9e6f, -9e6f, 1}, {9e6f, 9e6f, 1}}}), 2u) << "all of the band: a quad";
  EXPECT_EQ(pieces_of({{{1024, 0, 1}, {1025, 0, 1}, {1025, 1, 1}}}), 0u);
}

TEST(Clipping, ATriangleTurnedOverHasTheSameVerticesToTheLastBitOfADouble) {
  // Stored as float, what rounding does to one direction alone would hardly ever show.
  Camera camera = testing::tilted_camera();
  camera.far_plane = 40;
  const ClipVolume volume(camera);
  testing::Numbers random(15);
  int made = 0;
  const auto sorted = [](const ClipPolygon& polygon) {
    std::vector<std::tuple<double, double, double, double>> vertices;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const ClipVertex& v = polygon[i];
      vertices.emplace_back(v.position.x, v.position.y, v.position.z, v.colour.r);
    }
    std::sort(vertices.begin(), vertices.end());
    return vertices;
  };
  for (int n = 0; n < 3000; ++n) {
    std::array<ClipVertex, 3> triangle;
    for (ClipVertex& corner : triangle) corner = {wild_corner(random), {random.uniform(0, 1), 0, 0}, {}};
    const ClipPolygon polygon = volume.clip(triangle);
    EXPECT_EQ(sorted(polygon), sorted(volume.clip({triangle[0], triangle[2], triangle[1]}))) << n;
    made += polygon.size() > 3;
  }
  EXPECT_GT(made, 300);
}

/// A window position to the bit.
using Place = std::tuple<float, float, float>;
Place place_of(const MeshVertex& v) { return {v.x, v.y, v.depth}; }

bool on_one_plane(const Place& a, const Place& b) {
  const auto both = [&](auto axis, float value) {
    return std::get<axis.value>(a) == value && std::get<axis.value>(b) == value;
  };
  const std::integral_constant<std::size_t, 0> x;
  const std::integral_constant<std::size_t, 1> y;
  const std::integral_constant<std::size_t, 2> depth;
  return both(x, -32768) || both(x, 32768) || both(y, -32768) || both(y, 32768) || both(depth, 0) || both(depth, 1);
}

/// A closed surface around a point: a sphere whose vertices are moved to and fro. Every triangle has vertices of its own,
/// with attributes of its own, in an order of its own.
Mesh bumpy_ball(const Vec3& centre, double radius, double bumps, testing::Numbers& random) {
  constexpr std::size_t rings = 9, sectors = 12;
  std::vector<std::array<float, 3>> points;
  for (std::size_t ring = 0; ring <= rings; ++ring) {
    for (std::size_t sector = 0; sector < sectors; ++sector) {
      if ((ring == 0 || ring == rings) && sector > 0) {
        points.push_back(points.back());
        continue;
      }
      const double a = 3.14159265358979 * static_cast<double>(ring) / rings;
      const double b = 6.28318530717959 * static_cast<double>(sector) / sectors;
      const double r = radius * (1 + random.uniform(-bumps, bumps));
      points.push_back({static_cast<float>(centre.x + r * std::sin(a) * std::cos(b)),
                        static_cast<float>(centre.y + r * std::cos(a)),
                        static_cast<float>(centre.z + r * std::sin(a) * std::sin(b))});
    }
  }
  Mesh mesh;
  const auto triangle = [&](std::size_t a, std::size_t b, std::size_t c) {
    if (points[a] == points[b] || points[b] == points[c] || points[c] == points[a]) return;
    const std::array<std::size_t, 3> corners = {a, b, c};
    const std::uint32_t turn = random.below(3);
    testing::Triangle3 positions;
    for (std::size_t i = 0; i < 3; ++i) positions[i] = points[corners[(i + turn) % 3]];
    add_triangle(mesh, positions);
  };
  for (std::size_t ring = 0; ring < rings; ++ring) {
    for (std::size_t sector = 0; sector < sectors; ++sector) {
      const std::size_t here = ring * sectors, below = here + sectors, next = (sector + 1) % sectors;
      triangle(here + sector, here + next, below + next);
      triangle(here + sector, below + next, below + sector);
    }
  }
  return mesh;
}

TEST(Clipping, AClosedSurfaceStaysClosedButForTheClipPlanes) {
  testing::Numbers random(14);
  int open_edges = 0, inner_edges = 0;
  for (int n = 0; n < 400; ++n) {
    Camera camera = testing::tilted_camera();
    camera.far_plane = static_cast<float>(random.uniform(2, 100));
    // Around the eye or beside it; from smaller than the near plane's distance to beyond the far plane.
    const double radius = std::exp(random.uniform(-1, 6));
    const Vec3 centre = camera.eye + radius * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const Mesh mesh = bumpy_ball(centre, radius, random.uniform(0, 0.6), random);
    RejectedTriangles rejected;
    std::map<std::pair<Place, Place>, int> edges;  // there, less those that come back
    for (const MeshTriangle& piece : project_mesh(mesh, camera, rejected).mesh) {
      for (std::size_t i = 0; i < 3; ++i) {
        const Place a = place_of(piece.vertices[i]), b = place_of(piece.vertices[(i + 1) % 3]);
        if (a == b) continue;
        if (a < b) {
          ++edges[{a, b}];
        } else {
          --edges[{b, a}];
        }
      }
    }
    ASSERT_EQ(rejected.total(), 0u);
    for (const auto& [edge, count] : edges) {
      inner_edges += count == 0;
      if (count == 0) continue;
      ++open_edges;
      ASSERT_TRUE(on_one_plane(edge.first, edge.second)) << "a crack in ball " << n;
    }
  }
  EXPECT_GT(inner_edges, 10000);
  EXPECT_GT(open_edges, 1000);
}

}  // namespace
}  // namespace vrpipe
