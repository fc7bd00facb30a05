#include "sm/mesh_shader.h"

#include <cmath>

#include <gtest/gtest.h>

#include "sm/sm.h"
#include "support/builders.h"

namespace vrpipe {
namespace {

struct Vec {
  double x, y, z;
};
double dot(const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(const Vec& a, const Vec& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

constexpr double focal = 40;
constexpr double middle = 32;

/// A triangle in front of a camera at the origin that looks along z, as it is projected; its vertices are snapped already.
struct Projected {
  Vec corner[3];
  MeshTriangle triangle{};
  explicit Projected(std::uint64_t seed) {
    for (unsigned i = 0; i < 3; ++i) {
      MeshVertex& vertex = triangle.vertices[i];
      const double z = static_cast<double>(testing::uniform(seed, 10 * i, 1, 40));
      // Sub-pixel positions, so that what is drawn is this triangle.
      vertex.x = std::floor(testing::uniform(seed, 10 * i + 1, -40, 100) * 256) / 256;
      vertex.y = std::floor(testing::uniform(seed, 10 * i + 2, -40, 100) * 256) / 256;
      vertex.inverse_w = static_cast<float>(1 / z);
      const double exact_z = 1 / static_cast<double>(vertex.inverse_w);
      corner[i] = {(static_cast<double>(vertex.x) - middle) / focal * exact_z,
                   (static_cast<double>(vertex.y) - middle) / focal * exact_z, exact_z};
      float* const attributes[] = {&vertex.red, &vertex.green, &vertex.blue, &vertex.nx, &vertex.ny, &vertex.nz};
      for (unsigned k = 0; k < 6; ++k) *attributes[k] = testing::uniform(seed, 10 * i + 3 + k, k < 3 ? 0.0F : -1.0F, 1);
    }
  }
  /// How much of each corner is where the ray through a point of the image meets the triangle's plane.
  Vec shares_at(double px, double py) const {
    const Vec ray{(px - middle) / focal, (py - middle) / focal, 1};
    const Vec normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    const double t = dot(normal, corner[0]) / dot(normal, ray);
    const Vec point{ray.x * t, ray.y * t, ray.z * t};
    const double all = dot(normal, normal);
    return {dot(cross(corner[2] - corner[1], point - corner[1]), normal) / all,
            dot(cross(corner[0] - corner[2], point - corner[2]), normal) / all,
            dot(cross(corner[1] - corner[0], point - corner[0]), normal) / all};
  }
};

Draw draw_of(const MeshTriangle& triangle) {
  Draw draw = testing::draw_of(64, 64);
  draw.mesh.push_back(triangle);
  return draw;
}

DrawState state_of(FragmentShader shader, Light light = {}) {
  DrawState state;
  state.shader = shader;
  state.light = light;
  return state;
}

TEST(MeshShader, AttributesAreThoseWhereTheRayMeetsTheTriangle) {
  unsigned samples = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Projected projected(seed);
    const Draw draw = draw_of(projected.triangle);
    const RenderContext context = testing::context_of(draw, state_of(FragmentShader::vertex));
    SnappedTriangle snapped;
    ASSERT_TRUE(snap_triangle(context, 0, 0, 0, snapped));
    // Thin ones have rays that graze them: there the oracle, not the shader, is inexact.
    if (std::abs(doubled_area(snapped)) < 200 * 65536) continue;
    MeshShader shader(context);
    const auto& vertices = projected.triangle.vertices;
    for (int y = 0; y < 64; y += 2) {
      for (int x = 0; x < 64; x += 2) {
        for (unsigned lane = 0; lane < 4; ++lane) {
          const double px = x + static_cast<int>(lane & 1U) + 0.5;
          const double py = y + static_cast<int>(lane >> 1U) + 0.5;
          const Vec shares = projected.shares_at(px, py);
          if (!(shares.x > 0.001 && shares.y > 0.001 && shares.z > 0.001)) continue;
          Quad quad{};
          quad.coverage = static_cast<LaneMask>(1U << lane);
          const QuadColor color = shader.shade(quad, x, y);
          const auto expected = [&](float MeshVertex::*member) {
            return shares.x * static_cast<double>(vertices[0].*member) +
                   shares.y * static_cast<double>(vertices[1].*member) +
                   shares.z * static_cast<double>(vertices[2].*member);
          };
          ++samples;
          EXPECT_NEAR(color.red[lane], expected(&MeshVertex::red), 1e-6) << "seed " << seed;
          EXPECT_NEAR(color.green[lane], expected(&MeshVertex::green), 1e-6) << "seed " << seed;
          EXPECT_NEAR(color.blue[lane], expected(&MeshVertex::blue), 1e-6) << "seed " << seed;
          EXPECT_EQ(color.alpha[lane], 1.0F);
          EXPECT_EQ(color.alpha[lane ^ 1U], 0.0F) << "not covered";
        }
      }
    }
  }
  EXPECT_GT(samples, 5000U);
}

TEST(MeshShader, LightIsAmbientAndTheCosineOfWhatFacesIt) {
  MeshTriangle triangle{};
  const float x[] = {-10, -10, 200};
  const float y[] = {-10, 200, -10};
  for (unsigned i = 0; i < 3; ++i) triangle.vertices[i] = {x[i], y[i], 0.5F, 1, 0.8F, 0.4F, 0.2F, 0, 0, 2};
  const Draw draw = draw_of(triangle);
  Quad quad{};
  quad.coverage = all_lanes;
  const auto red_in = [&](Light light) {
    const RenderContext context = testing::context_of(draw, state_of(FragmentShader::lit, light));
    return MeshShader(context).shade(quad, 30, 30).red[3];
  };
  EXPECT_FLOAT_EQ(red_in({0, 0, 1, 0}), 0.8F) << "a normal need not be of unit length";
  EXPECT_FLOAT_EQ(red_in({0, 0.6F, 0.8F, 0}), 0.8F * 0.8F);
  EXPECT_FLOAT_EQ(red_in({0, 0.6F, 0.8F, 0.5F}), 0.8F * (0.5F + 0.5F * 0.8F));
  EXPECT_FLOAT_EQ(red_in({0, 0, -1, 0.25F}), 0.8F * 0.25F) << "turned away";
}

TEST(MeshShader, WithoutANormalThereIsAmbientLightAlone) {
  MeshTriangle triangle{};
  const float x[] = {-10, -10, 200};
  const float y[] = {-10, 200, -10};
  for (unsigned i = 0; i < 3; ++i) triangle.vertices[i] = {x[i], y[i], 0.5F, 1, 1, 1, 1, 0, 0, 0};
  const Draw draw = draw_of(triangle);
  const RenderContext context = testing::context_of(draw, state_of(FragmentShader::lit, {0, 0, 1, 0.3F}));
  Quad quad{};
  quad.coverage = all_lanes;
  EXPECT_FLOAT_EQ(MeshShader(context).shade(quad, 30, 30).green[0], 0.3F);
}

TEST(SplatShader, AWarpOfAMeshIsOpaqueAndNothingIsPruned) {
  MeshTriangle triangle{};
  const float x[] = {-10, -10, 200};
  const float y[] = {-10, 200, -10};
  for (unsigned i = 0; i < 3; ++i) triangle.vertices[i] = {x[i], y[i], 0.5F, 1, 0.5F, 0, 0, 0, 0, 1};
  const Draw draw = draw_of(triangle);
  const RenderContext context = testing::context_of(draw, state_of(FragmentShader::vertex));
  const SplatShader::Parameters parameters;
  SplatShader sm(parameters, context);
  Warp warp;
  warp.count = 3;
  for (unsigned i = 0; i < 3; ++i)
    warp.quads[i] = {0, static_cast<std::uint8_t>(i), static_cast<LaneMask>(i + 1), 0, 0};
  ShadedWarp out;
  sm.shade(warp, out);
  ASSERT_EQ(out.count, 3);
  for (unsigned i = 0; i < 3; ++i) {
    EXPECT_EQ(out.live[i], i + 1);
    EXPECT_EQ(out.color[i].alpha[0], ((i + 1) & 1U) != 0 ? 1.0F : 0.0F);
  }
  EXPECT_EQ(sm.fragments_shaded.value(), 1U + 1 + 2);
  EXPECT_EQ(sm.fragments_pruned.value(), 0U);
}

}  // namespace
}  // namespace vrpipe
