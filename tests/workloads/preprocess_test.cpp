// Labels such as L01 or P08 number the hard cases that a splat pipeline is known to trip over.
#include <vrpipe/workloads/preprocess.h>

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <limits>
#include <random>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "workload_test_support.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;
using testing::ordinary_gaussian;
using testing::scene_of;
using Exact = boost::multiprecision::cpp_bin_float_50;

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kMax = std::numeric_limits<float>::max();

/// At the origin, looking along +z, 90 degrees of view over 64x64: focal length 32.
Camera plain_camera() { return look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64); }

Draw run(const std::vector<GaussianAttributes>& gaussians, int degree = 0, PreprocessOptions options = {},
         SceneSummary* summary = nullptr) {
  SceneSummary ignored;
  return preprocess(scene_of(gaussians, degree), plain_camera(), options, summary ? *summary : ignored);
}

bool same_bits(const Draw& a, const Draw& b) {
  return a.splats.size() == b.splats.size() &&
         (a.splats.empty() || std::memcmp(a.splats.data(), b.splats.data(), a.splats.size() * sizeof(Splat)) == 0);
}

/// Distance in representable floats.
std::int64_t ulps(float a, float b) {
  const auto ordered = [](float f) {
    std::int32_t bits;
    std::memcpy(&bits, &f, sizeof bits);
    return bits < 0 ? std::int64_t{std::numeric_limits<std::int32_t>::min()} - bits : std::int64_t{bits};
  };
  return std::llabs(ordered(a) - ordered(b));
}

/// Runs one odd Gaussian between two ordinary ones: the counts, and that the image is the one without it if dropped.
SceneSummary run_among_ordinary(const GaussianAttributes& odd, int degree = 0, PreprocessOptions options = {}) {
  GaussianAttributes other = ordinary_gaussian();
  other.position = {0.5f, 0.25f, 7};
  SceneSummary summary;
  const Draw draw = run({ordinary_gaussian(), odd, other}, degree, options, &summary);
  EXPECT_EQ(summary.gaussians_total, 3u);
  EXPECT_EQ(summary.gaussians_visible, draw.splats.size());
  if (draw.splats.size() == 2) {
    EXPECT_TRUE(same_bits(draw, run({ordinary_gaussian(), other}, degree, options)));
  }
  return summary;
}

void expect_rejected(const GaussianAttributes& odd, const char* what) {
  const SceneSummary summary = run_among_ordinary(odd);
  EXPECT_EQ(summary.gaussians_visible, 2u) << what;
  EXPECT_EQ(summary.rejected.not_finite, 1u) << what;
  EXPECT_EQ(summary.rejected.zero_quaternion, 0u) << what;
}

void expect_culled(const GaussianAttributes& odd, const char* what) {
  const SceneSummary summary = run_among_ordinary(odd);
  EXPECT_EQ(summary.gaussians_visible, 2u) << what;
  EXPECT_EQ(summary.rejected.total(), 0u) << what;
}

void expect_kept(const GaussianAttributes& odd, const char* what) {
  const SceneSummary summary = run_among_ordinary(odd);
  EXPECT_EQ(summary.gaussians_visible, 3u) << what;
}

TEST(PreprocessAttributes, L01L02NanAndInfinitePositionsAreRejected) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const float value : {kNan, -kNan, kInf, -kInf}) {
      GaussianAttributes g = ordinary_gaussian();
      g.position[axis] = value;
      expect_rejected(g, "position");
    }
  }
}

TEST(PreprocessAttributes, L02TheLargestFloatIsAPositionAndRaisesNoInvalidOperation) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const float value : {kMax, -kMax}) {
      GaussianAttributes g = ordinary_gaussian();
      g.position[axis] = value;
      std::feclearexcept(FE_ALL_EXCEPT);
      PreprocessOptions options;
      options.threads = 1;
      SceneSummary summary;
      const Draw draw = run({g}, 0, options, &summary);
      EXPECT_EQ(std::fetestexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW), 0);
      EXPECT_EQ(summary.rejected.total(), 0u);
      // Straight ahead it is a dot in the centre; aside or behind it is culled.
      EXPECT_EQ(draw.splats.size(), axis == 2 && value > 0 ? 1u : 0u);
    }
  }
}

TEST(PreprocessAttributes, L03LogScalePolicy) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    GaussianAttributes g = ordinary_gaussian();
    g.log_scale[axis] = kNan;
    expect_rejected(g, "NaN log scale");
    g.log_scale[axis] = kInf;
    expect_rejected(g, "+Inf log scale");
    g.log_scale[axis] = -kInf;
    expect_kept(g, "-Inf log scale is scale 0");
    g.log_scale[axis] = -kMax;
    expect_kept(g, "a very small scale");
  }
}

TEST(PreprocessAttributes, L03LogitPolicy) {
  GaussianAttributes g = ordinary_gaussian();
  g.opacity_logit = kNan;
  expect_rejected(g, "NaN logit");
  g.opacity_logit = kInf;
  expect_kept(g, "+Inf logit is opacity 1");
  EXPECT_EQ(run({g}).splats.at(0).opacity, 1.0f);
  g.opacity_logit = -kInf;
  expect_culled(g, "-Inf logit is opacity 0");
}

TEST(PreprocessAttributes, L04CoverageGrowsWithTheScaleBeyondEveryOverflow) {
  double last = 0;
  for (const float log_scale : {0.0f, 10.0f, 44.36f, 44.361419f, 44.37f, 88.72283f, 88.72284f, 100.0f, 1e10f, kMax}) {
    GaussianAttributes g = ordinary_gaussian();
    g.position = {1, -0.5f, 5};
    g.log_scale = {log_scale, log_scale - 1, -3};
    const Draw draw = run({g});
    ASSERT_EQ(draw.splats.size(), 1u) << log_scale;
    const Splat& s = draw.splats[0];
    const double extent = std::hypot(double{s.ax}, double{s.ay});
    EXPECT_GE(extent, last * (1 - 1e-7)) << log_scale;  // the axis is rounded to float
    EXPECT_LE(extent, kMaxHalfExtent * (1 + 1e-6));
    last = extent;
  }
  EXPECT_NEAR(last, kMaxHalfExtent, 1);
}

// L05: a splat far beyond the frame shades every pixel alike.
TEST(PreprocessAttributes, AHugeGaussianFarAsideStillCoversTheImage) {
  GaussianAttributes g = ordinary_gaussian();
  g.position = {1e20f, 3e19f, 5};
  g.log_scale = {69, 69, 69};  // e^69 = 9e29
  const Draw draw = run({g});
  ASSERT_EQ(draw.splats.size(), 1u);
  const Splat& s = draw.splats[0];
  const double u =
      ((32 - double{s.cx}) * s.ax + (32 - double{s.cy}) * s.ay) / (double{s.ax} * s.ax + double{s.ay} * s.ay);
  EXPECT_LT(std::fabs(u), 1e-3) << "the image's centre is next to the splat's centre, in half extents";
}

TEST(PreprocessAttributes, AHugeGaussianWithItsCentreInTheImageIsDrawnWhereverItsLimitedAxesTakeIt) {
  std::mt19937 random(23);
  std::vector<GaussianAttributes> gaussians(2000, ordinary_gaussian());
  for (GaussianAttributes& gaussian : gaussians) {
    const auto uniform = [&random] { return static_cast<float>(random()) / 4294967296.0f - 0.5f; };
    // 90 degrees wide and high: all centres are in the image.
    gaussian.position = {9.9f * uniform(), 9.9f * uniform(), 5};
    for (float& component : gaussian.rotation) component = uniform();
    for (float& log_scale : gaussian.log_scale) log_scale = 100 * uniform();
  }
  SceneSummary summary;
  const Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64);
  EXPECT_EQ(preprocess(scene_of(gaussians), camera, {}, summary).splats.size(), gaussians.size());
}

TEST(PreprocessAttributes, L07ZeroQuaternionIsRejectedByName) {
  GaussianAttributes g = ordinary_gaussian();
  for (const float zero : {0.0f, -0.0f}) {
    g.rotation = {zero, 0, zero, 0};
    const SceneSummary summary = run_among_ordinary(g);
    EXPECT_EQ(summary.gaussians_visible, 2u);
    EXPECT_EQ(summary.rejected.zero_quaternion, 1u);
    EXPECT_EQ(summary.rejected.not_finite, 0u);
  }
  for (const float bad : {kNan, kInf, -kInf}) {
    g.rotation = {1, bad, 0, 0};
    expect_rejected(g, "rotation");
  }
}

TEST(PreprocessAttributes, L08QuaternionsOfAnyLengthAndSignGiveTheSameSplat) {
  GaussianAttributes g = ordinary_gaussian();
  g.log_scale = {0, -2, -4};
  g.rotation = {0.5f, -0.3f, 0.7f, 0.2f};
  const Splat reference = run({g}).splats.at(0);
  const auto scaled = [&](float k) {
    GaussianAttributes other = g;
    for (float& f : other.rotation) f *= k;
    return run({other}).splats.at(0);
  };
  for (const float k : {-1.0f, 2.0f, -0.25f, std::ldexp(1.0f, 60), std::ldexp(1.0f, -60), std::ldexp(1.0f, 127)}) {
    const Splat s = scaled(k);
    EXPECT_EQ(std::memcmp(&s, &reference, sizeof s), 0) << k;
  }
  for (const float k : {3.0f, 1e-20f, 1e20f, 1e38f}) {
    const Splat s = scaled(k);
    // The products are rounded to float, which turns the axes by that much.
    EXPECT_NEAR(s.ax, reference.ax, 1e-6 * std::hypot(reference.ax, reference.ay)) << k;
    EXPECT_NEAR(s.ay, reference.ay, 1e-6 * std::hypot(reference.ax, reference.ay)) << k;
  }
  GaussianAttributes tiny = g;
  tiny.rotation = {std::numeric_limits<float>::denorm_min(), 0, 0, 0};
  GaussianAttributes identity = g;
  identity.rotation = {1, 0, 0, 0};
  EXPECT_TRUE(same_bits(run({tiny}), run({identity})));
}

TEST(PreprocessAttributes, L11SigmoidIsExactAtItsEndsAndOverflowsNowhere) {
  std::feclearexcept(FE_ALL_EXCEPT);
  EXPECT_EQ(sigmoid(std::numeric_limits<double>::infinity()), 1.0);
  EXPECT_EQ(sigmoid(-std::numeric_limits<double>::infinity()), 0.0);
  EXPECT_EQ(sigmoid(0), 0.5);
  EXPECT_LE(ulps(static_cast<float>(sigmoid(17)), 1.0f), 1);
  EXPECT_EQ(sigmoid(40), 1.0);
  EXPECT_GT(sigmoid(-40), 0.0);
  EXPECT_GT(sigmoid(-90), 0.0);
  EXPECT_EQ(sigmoid(-1e30), 0.0);
  EXPECT_EQ(std::fetestexcept(FE_OVERFLOW | FE_INVALID | FE_DIVBYZERO), 0);
  for (double x = -40; x < 40; x += 0.37) {
    const Exact expected = 1 / (1 + exp(Exact(-x)));
    EXPECT_NEAR(sigmoid(x) / static_cast<double>(expected), 1.0, 2e-15) << x;
  }
}

TEST(PreprocessAttributes, L15BandsThatAreNotEvaluatedMayHoldAnything) {
  GaussianAttributes g = ordinary_gaussian();
  for (auto& channel : g.f_rest) {
    for (std::size_t c = 0; c < 3; ++c) channel[c] = 0.1f;
  }
  GaussianAttributes odd = g;
  odd.f_rest[1][12] = kNan;
  odd.f_rest[2][14] = -kInf;
  PreprocessOptions options;
  options.sh_degree = 1;
  EXPECT_TRUE(same_bits(run({odd}, 3, options), run({g}, 3, options)));
  EXPECT_EQ(run_among_ordinary(odd, 3).rejected.not_finite, 1u);
  odd = g;
  odd.f_dc[0] = kInf;
  EXPECT_EQ(run_among_ordinary(odd, 3, options).rejected.not_finite, 1u);
}

TEST(PreprocessProjection, P01AGaussianAtTheEyeIsCulledWithoutDivision) {
  GaussianAttributes g = ordinary_gaussian();
  g.position = {0, 0, 0};
  std::feclearexcept(FE_ALL_EXCEPT);
  expect_culled(g, "at the eye");
  EXPECT_EQ(std::fetestexcept(FE_DIVBYZERO | FE_INVALID), 0);
}

TEST(PreprocessProjection, P02OnlyDepthsBeyondTheNearPlaneAreKept) {
  int kept = 0;
  for (const float z : {std::nextafter(0.2f, 0.0f), 0.2f, std::nextafter(0.2f, 1.0f)}) {
    GaussianAttributes g = ordinary_gaussian();
    g.position = {0, 0, z};
    const std::size_t visible = run({g}).splats.size();
    EXPECT_EQ(visible, z > 0.2f ? 1u : 0u) << z;
    kept += static_cast<int>(visible);
  }
  EXPECT_EQ(kept, 1);
}

TEST(PreprocessProjection, DepthIsThatOfTheCentreAndGrowsInTheOrderOfTheDraw) {
  std::vector<GaussianAttributes> gaussians;
  for (const float z : {900.0f, 0.25f, 3.0f, 7.5f, 2000.0f, 0.21f}) {
    gaussians.push_back(ordinary_gaussian());
    gaussians.back().position = {0, 0, z};
  }
  const Draw draw = run(gaussians);
  ASSERT_EQ(draw.splats.size(), gaussians.size());
  for (std::size_t i = 1; i < draw.splats.size(); ++i) EXPECT_LT(draw.splats[i - 1].depth, draw.splats[i].depth);
  // Near 0.2 and far 1000: 1000 / 999.8 (1 - 0.2 / z).
  EXPECT_NEAR(draw.splats[2].depth, 1.0002 * (1 - 0.2 / 3), 1e-6);
  EXPECT_EQ(draw.splats[5].depth, 1) << "beyond the far plane";
}

TEST(PreprocessProjection, P03JustBehindTheCameraIsCulled) {
  for (const float z : {-1e-7f, -1e-30f, -0.0f, -5.0f}) {
    GaussianAttributes g = ordinary_gaussian();
    g.position = {0, 0, z};
    expect_culled(g, "behind");
  }
}

TEST(PreprocessProjection, P04TheRayClampIsContinuousAndMirrorsExactly) {
  // tan(fov/2) = 1, so the clamp is at x/z = 1.3.
  const auto at = [](float x) {
    GaussianAttributes g = ordinary_gaussian();
    g.position = {x, 0.5f, 1};
    g.log_scale = {1, 0, -1};
    return run({g}).splats.at(0);
  };
  const Splat edge = at(1.3f);
  for (const float x : {std::nextafter(1.3f, 0.0f), std::nextafter(1.3f, 2.0f)}) {
    const Splat near_edge = at(x);
    EXPECT_LE(ulps(edge.ax, near_edge.ax), 8);
    EXPECT_LE(ulps(edge.ay, near_edge.ay), 8);
    EXPECT_LE(ulps(edge.bx, near_edge.bx), 8);
    EXPECT_LE(ulps(edge.by, near_edge.by), 8);
  }
  for (const float x : {0.3f, 1.3f, 2.0f}) {
    const Splat right = at(x), left = at(-x);
    EXPECT_EQ(std::fabs(right.ax), std::fabs(left.ax));
    EXPECT_EQ(std::fabs(right.ay), std::fabs(left.ay));
    EXPECT_EQ(right.ax * right.ay, -left.ax * left.ay);
    EXPECT_NEAR(right.cx - 32, 32 - left.cx, 1e-5);
    EXPECT_EQ(right.cy, left.cy);
  }
  EXPECT_EQ(at(2.0f).ax, at(1.5f).ax) << "beyond the clamp the shape stays";
}

// P05: the widest view that is allowed.
TEST(PreprocessProjection, P05AnAlmostFlatFieldOfViewStaysFinite) {
  const Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 179.99, 64, 64);
  std::vector<GaussianAttributes> gaussians(3, ordinary_gaussian());
  gaussians[1].position = {4000, 10, 1};
  gaussians[2].position = {-1e30f, 10, 1};
  SceneSummary summary;
  for (const Splat& s : preprocess(scene_of(gaussians), camera, {}, summary).splats) {
    EXPECT_TRUE(std::isfinite(s.cx) && std::isfinite(s.ax) && std::isfinite(s.by));
  }
  EXPECT_GE(summary.gaussians_visible, 1u);
}

/// Compares random Gaussians with the formulas of EWA splatting, the limits of rays being gsplat's, in 50 digits.
void expect_textbook(const Camera& camera) {
  const bool is_perspective = camera.projection == Projection::perspective;
  std::mt19937 random(7);
  const auto uniform = [&random](double low, double high) {
    return static_cast<float>(low + (high - low) * (static_cast<double>(random()) / 4294967296.0));
  };
  const Exact fx = camera.fx, fy = camera.fy, cx = camera.cx(), cy = camera.cy();
  const Exact width = camera.width, height = camera.height;
  int compared = 0;
  for (int trial = 0; trial < 500; ++trial) {
    GaussianAttributes g = ordinary_gaussian();
    g.position = {uniform(-2, 2), uniform(-2, 2), uniform(-1, 5)};
    g.log_scale = {uniform(-5, 0), uniform(-5, 0), uniform(-5, 0)};
    g.rotation = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    SceneSummary summary;
    const Draw draw = preprocess(scene_of({g}), camera, {}, summary);
    if (draw.splats.empty()) continue;
    ++compared;
    const Splat& s = draw.splats[0];

    Exact t[3], q[4], length = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      t[i] = 0;
      for (std::size_t k = 0; k < 3; ++k)
        t[i] += Exact(camera.rotation[k][i]) * (Exact(g.position[k]) - Exact(camera.eye[k]));
    }
    const Exact w_of_clip = is_perspective ? t[2] : Exact(1);
    EXPECT_NEAR(s.cx, static_cast<double>(cx + fx * t[0] / w_of_clip), 1e-4);
    EXPECT_NEAR(s.cy, static_cast<double>(cy + fy * t[1] / w_of_clip), 1e-4);
    for (std::size_t i = 0; i < 4; ++i) length += Exact(g.rotation[i]) * g.rotation[i];
    for (std::size_t i = 0; i < 4; ++i) q[i] = Exact(g.rotation[i]) / sqrt(length);
    const Exact w = q[0], x = q[1], y = q[2], z = q[3];
    const Exact r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    const auto clamp = [](const Exact& v, const Exact& focal, const Exact& centre, const Exact& side) {
      const Exact more = Exact(3) / 10 * side / (2 * focal);
      return std::min(Exact((side - centre) / focal + more), std::max(Exact(-centre / focal - more), v));
    };
    const Exact rx = is_perspective ? clamp(t[0] / t[2], fx, cx, width) : Exact(0);
    const Exact ry = is_perspective ? clamp(t[1] / t[2], fy, cy, height) : Exact(0);
    Exact sigma[2][2] = {{Exact(3) / 10, 0}, {0, Exact(3) / 10}};
    for (std::size_t k = 0; k < 3; ++k) {
      Exact axis[3];
      for (std::size_t i = 0; i < 3; ++i) {
        axis[i] = 0;
        for (std::size_t j = 0; j < 3; ++j) axis[i] += Exact(camera.rotation[j][i]) * r[j][k];
        axis[i] *= exp(Exact(g.log_scale[k]));
      }
      const Exact m[2] = {fx / w_of_clip * (axis[0] - rx * axis[2]), fy / w_of_clip * (axis[1] - ry * axis[2])};
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) sigma[i][j] += m[i] * m[j];
      }
    }
    // The covariance back from the box: sum of (axis / r)(axis / r)^T.
    const double scale = static_cast<double>(sigma[0][0] + sigma[1][1]);
    const double rr = double{s.r} * s.r;
    EXPECT_NEAR((double{s.ax} * s.ax + double{s.bx} * s.bx) / rr, static_cast<double>(sigma[0][0]), 1e-6 * scale);
    EXPECT_NEAR((double{s.ax} * s.ay + double{s.bx} * s.by) / rr, static_cast<double>(sigma[0][1]), 1e-6 * scale);
    EXPECT_NEAR((double{s.ay} * s.ay + double{s.by} * s.by) / rr, static_cast<double>(sigma[1][1]), 1e-6 * scale);
    EXPECT_NEAR(double{s.ax} * s.bx + double{s.ay} * s.by, 0, 1e-6 * rr * scale) << "axes at right angles";
  }
  EXPECT_GT(compared, 40);
}

TEST(PreprocessProjection, AgreesWithTheTextbookFormulaInExtendedPrecision) {
  Camera camera = look_at({1, -2, -3}, {0.2, 0.1, 2}, {0.1, -1, 0.05}, 50, 200, 120);
  expect_textbook(camera);
  camera.projection = Projection::orthographic;
  camera.fx = 40;
  camera.fy = 44;
  expect_textbook(camera);
}

TEST(PreprocessProjection, AgreesWithItWhereverThePrincipalPointIs) {
  for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
    // The last is outside the image, which then shows what is aside.
    for (const std::array<double, 2>& at : {std::array<double, 2>{-43, 17.5}, {90, -55}, {60, 130}}) {
      Camera camera = look_at({1, -2, -3}, {0.2, 0.1, 2}, {0.1, -1, 0.05}, 50, 200, 120);
      camera.projection = projection;
      if (projection == Projection::orthographic) camera.fx = camera.fy = 40;
      camera.principal_x = at[0];
      camera.principal_y = at[1];
      expect_textbook(camera);
    }
  }
}

/// A crowd in front of plain_camera(), half of it beyond its sides.
std::vector<GaussianAttributes> crowd() {
  std::mt19937 random(29);
  std::vector<GaussianAttributes> gaussians(500, ordinary_gaussian());
  for (GaussianAttributes& gaussian : gaussians) {
    const auto uniform = [&random] { return static_cast<float>(random()) / 4294967296.0f - 0.5f; };
    const float z = 6 + 8 * uniform();
    gaussian.position = {2.6f * z * uniform(), 2.6f * z * uniform(), z};
    for (float& component : gaussian.rotation) component = uniform();
    for (float& log_scale : gaussian.log_scale) log_scale = -1.5f + 2 * uniform();
  }
  return gaussians;
}

TEST(PreprocessProjection, AnImageCutOffACornerIsThatOfAPrincipalPointOffTheCentre) {
  for (const bool is_perspective : {true, false}) {
    Camera whole = plain_camera();
    if (!is_perspective) {
      whole.projection = Projection::orthographic;
      whole.fx = whole.fy = 4;
    }
    Camera part = whole;
    part.width = 40;
    part.height = 30;
    part.principal_x = 32 - 20;
    part.principal_y = 32 - 15;
    SceneSummary summary;
    const Draw all = preprocess(scene_of(crowd()), whole, {}, summary);
    const Draw there = preprocess(scene_of(crowd()), part, {}, summary);
    EXPECT_LT(there.splats.size(), all.splats.size());
    // Those of the part are among all, in their order, but for the shape of those beyond the part's own limit of rays.
    std::size_t next = 0, same = 0;
    for (const Splat& splat : there.splats) {
      while (next < all.splats.size() && (all.splats[next].cx != splat.cx || all.splats[next].cy != splat.cy)) ++next;
      ASSERT_LT(next, all.splats.size());
      const double limit_x = is_perspective ? 40 + 0.3 * 20 : 1e9, limit_y = is_perspective ? 30 + 0.3 * 15 : 1e9;
      if (splat.cx > limit_x || splat.cy > limit_y || splat.cx < -0.3 * 20 || splat.cy < -0.3 * 15) continue;
      EXPECT_EQ(std::memcmp(&all.splats[next], &splat, sizeof splat), 0) << splat.cx << "," << splat.cy;
      ++same;
    }
    EXPECT_GT(same, 40U) << is_perspective;
    // What is left out misses the part.
    for (const Splat& splat : all.splats) {
      const bool is_there = splat.cx > 0 && splat.cx < 40 && splat.cy > 0 && splat.cy < 30;
      if (!is_there) continue;
      EXPECT_TRUE(std::any_of(there.splats.begin(), there.splats.end(),
                              [&](const Splat& each) { return each.cx == splat.cx && each.cy == splat.cy; }));
    }
  }
}

TEST(PreprocessProjection, AHugeGaussianIsShortenedTowardsTheImagesCentreWhereverThePrincipalPointIs) {
  Camera camera = plain_camera();
  camera.principal_x = 5000;
  GaussianAttributes g = ordinary_gaussian();
  g.position = {-700, 0, 5};
  g.log_scale = {15, 15, -kInf};
  SceneSummary summary;
  const Splat s = preprocess(scene_of({g}), camera, {}, summary).splats.at(0);
  const double extent = 32 / 5.0 * std::exp(15.0) * double{s.r};
  EXPECT_GT(extent, 10 * kMaxHalfExtent);
  EXPECT_NEAR(s.cx, 32 + (5000 - 700 / 5.0 * 32) * kMaxHalfExtent / extent, 1e-3);
}

TEST(PreprocessOrthographic, ACovarianceIsTimesTheSquareOfTheScaleAndTheDilation) {
  // 64 pixels over 16 units: 4 pixels a unit, at whatever depth.
  View view;
  view.eye = {0, 0, 0};
  view.look_at = {0, 0, 1};
  view.orthographic_height = 16;
  const Camera camera = look_at(view, {64, 64});
  for (const float z : {0.5f, 5.0f, 500.0f, 5000.0f}) {
    GaussianAttributes g = ordinary_gaussian();
    g.position = {3.5f, -2, z};
    g.log_scale = {1, 0, 3};
    SceneSummary summary;
    const Splat s = preprocess(scene_of({g}), camera, {}, summary).splats.at(0);
    EXPECT_EQ(s.cx, 32 + 4 * 3.5f);
    EXPECT_EQ(s.cy, 32 - 4 * 2.0f);
    EXPECT_NEAR(std::fabs(s.ax / s.r), std::sqrt(16 * std::exp(2.0) + 0.3), 1e-5);
    EXPECT_NEAR(std::fabs(s.by / s.r), std::sqrt(16 + 0.3), 1e-6);
    EXPECT_EQ(s.ay, 0);
    EXPECT_EQ(s.bx, 0);
    EXPECT_NEAR(s.depth, std::min(1.0, (z - double{camera.near_plane}) / (1000 - double{camera.near_plane})), 1e-7);
  }
}

TEST(PreprocessOrthographic, IsWhatPerspectiveFromFarAwayComesTo) {
  View view;
  view.look_at = {0, 0, 6};
  view.eye = {0, 0, 0};
  view.orthographic_height = 16;
  SceneSummary summary;
  const Draw parallel = preprocess(scene_of(crowd()), look_at(view, {64, 64}), {}, summary);
  double last = 1e9;
  for (const double distance : {1e3, 1e5, 1e7}) {
    Camera far_away = look_at(view, {64, 64});
    far_away.projection = Projection::perspective;
    far_away.eye = {0, 0, 6 - distance};
    far_away.fx = far_away.fy = 4 * distance;
    const Draw draw = preprocess(scene_of(crowd()), far_away, {}, summary);
    double most = 0;
    unsigned compared = 0;
    for (const Splat& splat : parallel.splats) {
      double nearest = 1e9;
      for (const Splat& other : draw.splats) {
        nearest = std::min(nearest, std::hypot(double{splat.cx} - other.cx, double{splat.cy} - other.cy) +
                                        std::fabs(std::hypot(double{splat.ax}, double{splat.ay}) -
                                                  std::hypot(double{other.ax}, double{other.ay})));
      }
      // At the image's border one of the two may be culled.
      if (splat.cx < 1 || splat.cx > 63 || splat.cy < 1 || splat.cy > 63) continue;
      most = std::max(most, nearest);
      ++compared;
    }
    EXPECT_GT(compared, 100U);
    EXPECT_LT(most, std::min(last / 50, 300 / distance + 2e-5));
    last = std::max(most, 1e-3);
  }
}

TEST(PreprocessOrthographic, TheNearPlaneCullsAndDepthOrders) {
  Camera camera = plain_camera();
  camera.projection = Projection::orthographic;
  std::vector<GaussianAttributes> gaussians(4, ordinary_gaussian());
  gaussians[0].position = {0, 0, 9};
  gaussians[1].position = {0, 0, 0.1f};
  gaussians[2].position = {0, 0, -5};
  gaussians[3].position = {0.1f, 0, 3};
  SceneSummary summary;
  const Draw draw = preprocess(scene_of(gaussians), camera, {}, summary);
  ASSERT_EQ(draw.splats.size(), 2U);
  EXPECT_GT(draw.splats[0].cx, 32);
  EXPECT_EQ(draw.splats[1].cx, 32);
}

TEST(PreprocessOrthographic, ColoursAreSeenFromTheEyeAsInGsplat) {
  std::mt19937 random(31);
  GaussianAttributes g = ordinary_gaussian();
  g.position = {0.4f, -0.3f, 2};
  for (auto& channel : g.f_rest) {
    for (float& coefficient : channel) coefficient = static_cast<float>(random()) / 4294967296.0f;
  }
  Camera camera = plain_camera();
  SceneSummary summary;
  const Splat perspective = preprocess(scene_of({g}, 3), camera, {}, summary).splats.at(0);
  camera.projection = Projection::orthographic;
  const Splat orthographic = preprocess(scene_of({g}, 3), camera, {}, summary).splats.at(0);
  EXPECT_EQ(perspective.red, orthographic.red);
  EXPECT_EQ(perspective.green, orthographic.green);
  EXPECT_EQ(perspective.blue, orthographic.blue);
}

TEST(PreprocessProjection, P07FarFromTheOriginNothingIsLost) {
  GaussianAttributes g = ordinary_gaussian();
  g.position = {1, 2, 7};
  const Camera here = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64);
  GaussianAttributes moved = g;
  for (float& f : moved.position) f += 1e6f;
  const Camera there = look_at({1e6, 1e6, 1e6}, {1e6, 1e6, 1e6 + 1}, {0, -1, 0}, 90, 64, 64);
  SceneSummary summary;
  EXPECT_TRUE(
      same_bits(preprocess(scene_of({g}), here, {}, summary), preprocess(scene_of({moved}), there, {}, summary)));
}

TEST(PreprocessCovariance, P08ANeedleKeepsItsDeterminantAndItsMinorAxis) {
  for (const double length : {1e2, 1e3, 3e3, 1e4, 1e6, 1e12}) {
    const double side = length * std::sqrt(0.5);
    for (const double wobble : {0.0, 1e-3, 1.0}) {
      const Vec3 m1 = {side, wobble, 0}, m2 = {side, -wobble, 0.25 * wobble};
      const auto dot = [](const Vec3& a, const Vec3& b) {
        return Exact(a[0]) * b[0] + Exact(a[1]) * b[1] + Exact(a[2]) * b[2];
      };
      const Exact e(kDilation), a = dot(m1, m1) + e, b = dot(m1, m2), d = dot(m2, m2) + e;
      const Exact det = a * d - b * b;
      EXPECT_LE(abs(Exact(covariance_determinant(m1, m2)) / det - 1), Exact(8 * 2.22e-16)) << length;
      const Exact lambda1 = (a + d) / 2 + sqrt((a - d) * (a - d) / 4 + b * b);
      const EllipseAxes ellipse = decompose_covariance(m1, m2);
      EXPECT_LE(abs(Exact(ellipse.lambda1) / lambda1 - 1), Exact(8 * 2.22e-16)) << length;
      EXPECT_LE(abs(Exact(ellipse.lambda2) / (det / lambda1) - 1), Exact(16 * 2.22e-16)) << length;
      EXPECT_GE(ellipse.lambda2, kDilation);
    }
  }
}

TEST(PreprocessCovariance, P09APointIsExactlyTheDilation) {
  const EllipseAxes ellipse = decompose_covariance({0, 0, 0}, {0, 0, 0});
  EXPECT_EQ(ellipse.lambda1, kDilation);
  EXPECT_EQ(ellipse.lambda2, kDilation);
  GaussianAttributes g = ordinary_gaussian();
  g.log_scale = {-kInf, -kInf, -kInf};
  g.opacity_logit = kInf;
  const Splat s = run({g}).splats.at(0);
  EXPECT_NEAR(s.ax, std::sqrt(0.3 * 2 * std::log(255.0)), 1e-6);  // 1.8234
  EXPECT_EQ(s.ax, s.by);
  EXPECT_EQ(s.ay, 0);
}

TEST(PreprocessCovariance, E01E02AxisAlignedEllipsesAreExactWhicheverAxisIsLonger) {
  EllipseAxes ellipse = decompose_covariance({3, 0, 0}, {0, 2, 0});
  EXPECT_EQ(ellipse.lambda1, 9 + kDilation);
  EXPECT_EQ(ellipse.lambda2, 4 + kDilation);
  EXPECT_EQ(std::fabs(ellipse.axis_x), 1);
  EXPECT_EQ(ellipse.axis_y, 0);
  ellipse = decompose_covariance({2, 0, 0}, {0, 3, 0});
  EXPECT_EQ(ellipse.lambda1, 9 + kDilation);
  EXPECT_EQ(ellipse.lambda2, 4 + kDilation);
  EXPECT_EQ(ellipse.axis_x, 0);
  EXPECT_EQ(std::fabs(ellipse.axis_y), 1);
}

TEST(PreprocessCovariance, E02DirectionAgreesWithHalfTheArcTangent) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    Vec3 m1, m2;
    for (auto* m : {&m1, &m2}) {
      for (std::size_t k = 0; k < 3; ++k) (*m)[k] = static_cast<double>(random()) / 2147483648.0 - 1;
    }
    const auto dot = [](const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    const double angle = 0.5 * std::atan2(2 * dot(m1, m2), dot(m1, m1) - dot(m2, m2));
    const EllipseAxes e = decompose_covariance(m1, m2);
    const double sine = e.axis_x * std::sin(angle) - e.axis_y * std::cos(angle);
    EXPECT_LE(std::fabs(sine), 1e-14 * e.lambda1 / (e.lambda1 - e.lambda2));
  }
}

TEST(PreprocessCovariance, E03SmallRoundSplatsStayRound) {
  for (const double variance : {0.0, 0.05, 0.2, 1.0, 1e-300}) {
    const double m = std::sqrt(variance);
    const EllipseAxes e = decompose_covariance({m, 0, 0}, {0, m, 0});
    EXPECT_EQ(e.lambda1, e.lambda2);
    EXPECT_NEAR(e.lambda1, variance + kDilation, 1e-15);
    EXPECT_NEAR(e.axis_x * e.axis_x + e.axis_y * e.axis_y, 1, 1e-15);
  }
}

TEST(PreprocessCovariance, E04NearlyRoundSplatsHaveSmallResiduals) {
  for (int k = 20; k < 60; ++k) {
    const double delta = std::ldexp(1.0, -k);
    for (const Vec3& m2 :
         {Vec3{delta, 1 + delta, 0}, Vec3{-delta, 1, 0}, Vec3{delta, 1 - delta, delta}, Vec3{5e-324, 1, 0}}) {
      const Vec3 m1 = {1, 0, 0};
      const auto dot = [](const Vec3& a, const Vec3& b) {
        return Exact(a[0]) * b[0] + Exact(a[1]) * b[1] + Exact(a[2]) * b[2];
      };
      const Exact a = dot(m1, m1) + kDilation, b = dot(m1, m2), d = dot(m2, m2) + kDilation;
      const EllipseAxes e = decompose_covariance(m1, m2);
      const Exact vx = e.axis_x, vy = e.axis_y;
      const Exact limit = Exact(8 * 1.2e-16) * e.lambda1;
      EXPECT_LE(abs(a * vx + b * vy - e.lambda1 * vx), limit) << k;
      EXPECT_LE(abs(b * vx + d * vy - e.lambda1 * vy), limit) << k;
      EXPECT_LE(abs(vx * vx + vy * vy - 1), Exact(4.5e-16)) << k;
    }
  }
}

TEST(PreprocessCovariance, E05MirrorAndTransposeAreExact) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 1000; ++trial) {
    Vec3 m1, m2;
    for (auto* m : {&m1, &m2}) {
      for (std::size_t k = 0; k < 3; ++k) (*m)[k] = static_cast<double>(random()) / 2147483648.0 - 1;
    }
    const EllipseAxes e = decompose_covariance(m1, m2);
    const EllipseAxes mirrored = decompose_covariance(m1, {-m2[0], -m2[1], -m2[2]});
    EXPECT_EQ(mirrored.lambda1, e.lambda1);
    EXPECT_EQ(mirrored.lambda2, e.lambda2);
    EXPECT_EQ(std::fabs(mirrored.axis_x), std::fabs(e.axis_x));
    EXPECT_EQ(mirrored.axis_x * mirrored.axis_y, -(e.axis_x * e.axis_y));
    const EllipseAxes transposed = decompose_covariance(m2, m1);
    EXPECT_EQ(transposed.lambda1, e.lambda1);
    EXPECT_EQ(std::fabs(transposed.axis_x), std::fabs(e.axis_y));
    EXPECT_EQ(std::fabs(transposed.axis_y), std::fabs(e.axis_x));
  }
}

TEST(PreprocessOpacity, O01O02BelowOne255thIsCulledNotRejected) {
  GaussianAttributes g = ordinary_gaussian();
  for (const float logit : {-kInf, -90.0f, -10.0f, -5.538f, -5.6f}) {
    g.opacity_logit = logit;
    expect_culled(g, "opacity below 1/255");
  }
}

TEST(PreprocessOpacity, O03O04AtOne255thTheExtentIsZeroAndGrowsFromThere) {
  const float edge = 1.0f / 255;
  EXPECT_EQ(half_extent_in_sigmas(edge), 0);
  EXPECT_EQ(half_extent_in_sigmas(0), 0);
  const double above = half_extent_in_sigmas(std::nextafter(edge, 1.0f));
  EXPECT_GT(above, 0);
  EXPECT_LT(above, 1e-3);
}

TEST(PreprocessOpacity, L12TheFirstLogitsOnEitherSideOfOne255th) {
  GaussianAttributes g = ordinary_gaussian();
  float logit = -5.5374f;
  while (static_cast<float>(sigmoid(double{logit})) < 1.0f / 255) {
    g.opacity_logit = logit;
    logit = std::nextafter(logit, kInf);
  }
  EXPECT_TRUE(run({g}).splats.empty());
  g.opacity_logit = logit;
  const Splat s = run({g}).splats.at(0);
  EXPECT_LT(s.r, 2e-3f);
  EXPECT_EQ(s.cx, 32);
}

TEST(PreprocessOpacity, O04O05TheExtentEndsWhereAlphaIsOne255th) {
  GaussianAttributes g = ordinary_gaussian();
  float last = 0;
  for (const float logit : {-5.5f, -5.0f, -3.0f, 0.0f, 2.0f, 8.0f, kInf}) {
    g.opacity_logit = logit;
    const Splat s = run({g}).splats.at(0);
    EXPECT_GT(s.r, last);
    last = s.r;
    EXPECT_NEAR(s.opacity * std::exp(-0.5 * double{s.r} * s.r) * 255, 1, 2e-6);
    const double sigma = std::sqrt(std::pow(32.0 / 5 * std::exp(-2.0), 2) + 0.3);
    EXPECT_NEAR(s.ax, sigma * s.r, 1e-5);
    EXPECT_NEAR(s.by, sigma * s.r, 1e-5);
  }
  EXPECT_NEAR(last, 3.3290, 1e-4);
}

TEST(PreprocessCulling, ABoxThatMissesTheImageIsDropped) {
  // A point: its box is a square of this half extent.
  const double half = std::sqrt(0.3) * std::sqrt(2 * std::log(255 * sigmoid(3)));
  GaussianAttributes g = ordinary_gaussian();
  g.log_scale = {-kInf, -kInf, -kInf};
  for (const double sign : {-1.0, 1.0}) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      for (const double gap : {-0.01, 0.01}) {
        g.position = {0, 0, 5};
        g.position[axis] = static_cast<float>(sign * (32 + half + gap) / 32 * 5);
        EXPECT_EQ(run({g}).splats.size(), gap < 0 ? 1u : 0u);
      }
    }
  }
}

TEST(PreprocessColour, S01ColoursNeverFallBelowZero) {
  GaussianAttributes g = ordinary_gaussian();
  g.f_dc = {-1.7724539f, -3, 0};
  const Splat s = run({g}).splats.at(0);
  EXPECT_NEAR(s.red, 0, 1e-7);
  EXPECT_GE(s.red, 0);
  EXPECT_EQ(s.green, 0);
  EXPECT_EQ(s.blue, 0.5f);
}

TEST(PreprocessColour, HugeCoefficientsGiveFiniteColours) {
  GaussianAttributes g = ordinary_gaussian();
  g.f_dc = {kMax, -kMax, 1};
  for (auto& channel : g.f_rest) channel.fill(kMax);
  const Splat s = run({g}, 3).splats.at(0);
  EXPECT_TRUE(std::isfinite(s.red) && std::isfinite(s.green) && std::isfinite(s.blue));
  const GaussianScene scene = scene_of({g}, 3);
  g.f_dc = {kNan, 0, 0};
  EXPECT_EQ(sh_colour(scene_of({g}, 0)[0], {0, 0, 1}, 0)[0], 0) << "NaN becomes 0";
}

TEST(PreprocessColour, S03AZeroDirectionGivesTheConstantTerm) {
  GaussianAttributes g = ordinary_gaussian();
  for (auto& channel : g.f_rest) channel.fill(3);
  EXPECT_EQ(sh_colour(scene_of({g}, 3)[0], {0, 0, 0}, 3), sh_colour(scene_of({g}, 3)[0], {0, 0, 1}, 0));
}

/// Value of basis function `index` (0 to 15) in a direction, read back from the colour.
double basis(std::size_t index, const Vec3& direction) {
  GaussianAttributes g;
  constexpr float kAmplitude = 0.125f;
  if (index == 0) {
    g.f_dc[1] = kAmplitude;
  } else {
    g.f_rest[1][index - 1] = kAmplitude;
  }
  const GaussianScene scene = scene_of({g}, 3);
  const std::array<float, 3> rgb = sh_colour(scene[0], direction, 3);
  EXPECT_EQ(rgb[0], 0.5f) << "coefficients of green leave red alone";
  EXPECT_EQ(rgb[2], 0.5f);
  return (static_cast<double>(rgb[1]) - 0.5) / static_cast<double>(kAmplitude);
}

TEST(PreprocessColour, S04BasisValuesAlongTheAxes) {
  const double pi = 3.14159265358979323846;
  const double y00 = std::sqrt(1 / (4 * pi)), y1 = std::sqrt(3 / (4 * pi));
  EXPECT_NEAR(basis(0, {1, 0, 0}), y00, 1e-6);
  for (const double sign : {-1.0, 1.0}) {
    const Vec3 x = {sign, 0, 0}, y = {0, sign, 0}, z = {0, 0, sign};
    // Band 1 holds y, z, x with INRIA's signs - + -.
    EXPECT_NEAR(basis(1, y), -sign * y1, 1e-6);
    EXPECT_NEAR(basis(2, z), sign * y1, 1e-6);
    EXPECT_NEAR(basis(3, x), -sign * y1, 1e-6);
    for (const auto& [index, direction] :
         {std::pair<std::size_t, Vec3>{1, x}, {1, z}, {2, x}, {2, y}, {3, y}, {3, z}}) {
      EXPECT_NEAR(basis(index, direction), 0, 1e-6);
    }
    EXPECT_NEAR(basis(6, z), std::sqrt(5 / (4 * pi)), 1e-6);  // (3 z^2 - 1) / 2
    EXPECT_NEAR(basis(6, x), -0.5 * std::sqrt(5 / (4 * pi)), 1e-6);
    EXPECT_NEAR(basis(8, x), std::sqrt(15 / (16 * pi)), 1e-6);  // x^2 - y^2
    EXPECT_NEAR(basis(8, y), -std::sqrt(15 / (16 * pi)), 1e-6);
    EXPECT_NEAR(basis(12, z), sign * std::sqrt(7 / (4 * pi)), 1e-6);  // (5 z^3 - 3 z) / 2
    EXPECT_NEAR(basis(15, x), -sign * std::sqrt(35 / (32 * pi)), 1e-6);
    EXPECT_NEAR(basis(9, y), sign * std::sqrt(35 / (32 * pi)), 1e-6);
  }
}

TEST(PreprocessColour, S04TheBasisIsOrthonormalOverTheSphere) {
  const int rings = 48, spokes = 32;
  const double pi = 3.14159265358979323846;
  std::array<std::array<double, 16>, 16> products{};
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < spokes; ++j) {
      const double z = -1 + (i + 0.5) * 2 / rings, angle = (j + 0.3) * 2 * pi / spokes, ring = std::sqrt(1 - z * z);
      std::array<double, 16> values;
      for (std::size_t k = 0; k < 16; ++k) values[k] = basis(k, {ring * std::cos(angle), ring * std::sin(angle), z});
      for (std::size_t a = 0; a < 16; ++a) {
        for (std::size_t b = 0; b < 16; ++b) products[a][b] += values[a] * values[b] * 4 * pi / (rings * spokes);
      }
    }
  }
  for (std::size_t a = 0; a < 16; ++a) {
    for (std::size_t b = 0; b < 16; ++b) EXPECT_NEAR(products[a][b], a == b ? 1 : 0, 0.01) << a << " " << b;
  }
}

TEST(PreprocessColour, S05ColoursTurnWithTheScene) {
  std::mt19937 random(11);
  const auto uniform = [&random] { return static_cast<float>(random()) / 2147483648.0f - 1; };
  for (int trial = 0; trial < 100; ++trial) {
    GaussianAttributes g = ordinary_gaussian();
    g.position = {uniform(), uniform(), 5 + uniform()};
    for (auto& channel : g.f_rest) {
      for (std::size_t c = 0; c < 3; ++c) channel[c] = 0.2f * uniform();
    }
    // A quarter turn about z: (x, y, z) -> (-y, x, z). Band 1 is the vector (-x: c3, -y: c1, z: c2).
    GaussianAttributes turned = g;
    turned.position = {-g.position[1], g.position[0], g.position[2]};
    for (auto& channel : turned.f_rest) {
      const float vx = -channel[2], vy = -channel[0];
      channel[2] = vy;   // -(new x) = -(-vy)
      channel[0] = -vx;  // -(new y)
    }
    Camera camera = plain_camera();
    Camera turned_camera = camera;
    turned_camera.rotation = {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}};
    SceneSummary summary;
    for (const int degree : {0, 1}) {
      PreprocessOptions options;
      options.sh_degree = degree;
      const Splat a = preprocess(scene_of({g}, 1), camera, options, summary).splats.at(0);
      const Splat b = preprocess(scene_of({turned}, 1), turned_camera, options, summary).splats.at(0);
      EXPECT_NEAR(a.red, b.red, degree == 0 ? 0 : 1e-5);
      EXPECT_NEAR(a.green, b.green, degree == 0 ? 0 : 1e-5);
      EXPECT_NEAR(a.blue, b.blue, degree == 0 ? 0 : 1e-5);
      EXPECT_NEAR(a.cx, b.cx, 1e-5);
    }
  }
}

TEST(PreprocessColour, S06BandsOfZerosChangeNoBit) {
  std::mt19937 random(13);
  for (int degree = 0; degree < 3; ++degree) {
    GaussianAttributes g = ordinary_gaussian();
    g.position = {0.7f, -0.4f, 3};
    for (auto& channel : g.f_rest) {
      for (std::size_t c = 0; c < kShRestPerChannel[static_cast<std::size_t>(degree)]; ++c) {
        channel[c] = static_cast<float>(random()) / 4294967296.0f - 0.5f;
      }
    }
    PreprocessOptions truncated;
    truncated.sh_degree = degree;
    EXPECT_TRUE(same_bits(run({g}, 3), run({g}, 3, truncated)));
    EXPECT_TRUE(same_bits(run({g}, 3), run({g}, degree)));
  }
}

TEST(PreprocessOrder, K01EqualDepthsKeepTheScenesOrder) {
  std::vector<GaussianAttributes> gaussians(1000, ordinary_gaussian());
  for (std::size_t i = 0; i < gaussians.size(); ++i) gaussians[i].f_dc[0] = 0.001f * static_cast<float>(i);
  const Draw draw = run(gaussians);
  ASSERT_EQ(draw.splats.size(), 1000u);
  EXPECT_TRUE(std::is_sorted(draw.splats.begin(), draw.splats.end(),
                             [](const Splat& a, const Splat& b) { return a.red < b.red; }));
}

TEST(PreprocessOrder, K02KeysOrderLikeDepthsAndBothZerosTie) {
  EXPECT_EQ(depth_key(-0.0f), depth_key(0.0f));
  const std::vector<float> ascending = {
      -kInf, -kMax, -1, -1e-40f, 0, 1e-45f, 1e-40f, 1e-39f, 0.2f, 1, std::nextafter(1.0f, 2.0f), kMax, kInf};
  for (std::size_t i = 1; i < ascending.size(); ++i)
    EXPECT_LT(depth_key(ascending[i - 1]), depth_key(ascending[i])) << i;
}

TEST(PreprocessOrder, K08RadixSortEqualsAStableSortAtEverySize) {
  std::mt19937 random(17);
  for (const std::size_t size : {0u, 1u, 2u, 255u, 256u, 257u, 65535u, 65536u, 65537u, 262145u}) {
    for (int pattern = 0; pattern < 5; ++pattern) {
      std::vector<std::uint64_t> entries(size);
      for (std::size_t i = 0; i < size; ++i) {
        const std::uint32_t number = static_cast<std::uint32_t>(random());
        const std::uint32_t keys[] = {number, number & 7u, 42, static_cast<std::uint32_t>(size - i),
                                      static_cast<std::uint32_t>(i)};
        entries[i] = (std::uint64_t{keys[pattern]} << 32) | (size - i);
      }
      std::vector<std::uint64_t> expected = entries;
      std::stable_sort(expected.begin(), expected.end(),
                       [](std::uint64_t a, std::uint64_t b) { return (a >> 32) < (b >> 32); });
      for (const unsigned threads : {1U, 3U, 64U}) {
        std::vector<std::uint64_t> sorted = entries;
        sort_by_key(sorted, threads);
        EXPECT_EQ(sorted, expected) << size << " " << pattern << " " << threads;
      }
    }
  }
}

TEST(PreprocessOrder, K04FewerKeyBitsMergeNeighbouringDepthsAsDocumented) {
  std::mt19937 random(19);
  std::vector<GaussianAttributes> gaussians(5000, ordinary_gaussian());
  for (std::size_t i = 0; i < gaussians.size(); ++i) {
    gaussians[i].position[2] = 1 + 9 * static_cast<float>(random()) / 4294967296.0f;
    gaussians[i].f_dc[0] = 0.0001f * static_cast<float>(i);
  }
  for (const int bits : {32, 24, 16, 12}) {
    std::vector<std::size_t> order(gaussians.size());
    std::vector<std::uint64_t> keys;
    for (std::size_t i = 0; i < order.size(); ++i) {
      order[i] = i;
      keys.push_back(depth_key(gaussians[i].position[2]));
    }
    const std::uint64_t low = *std::min_element(keys.begin(), keys.end()),
                        high = *std::max_element(keys.begin(), keys.end());
    if (bits < 32) {
      for (std::uint64_t& key : keys) key = ((key - low) << bits) / (high - low + 1);
    }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
    PreprocessOptions options;
    options.depth_key_bits = bits;
    const Draw draw = run(gaussians, 0, options);
    ASSERT_EQ(draw.splats.size(), order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      ASSERT_EQ(draw.splats[i].red, run({gaussians[order[i]]}).splats[0].red) << bits << " " << i;
      if (i > 50) break;
    }
    std::size_t inversions = 0;
    for (std::size_t i = 1; i < order.size(); ++i)
      inversions += gaussians[order[i]].position[2] < gaussians[order[i - 1]].position[2];
    EXPECT_EQ(inversions > 0, bits <= 16);
  }
}

TEST(Preprocess, IsTheSameForAnyNumberOfThreads) {
  std::mt19937 random(23);
  const auto uniform = [&random] { return static_cast<float>(random()) / 2147483648.0f - 1; };
  std::vector<GaussianAttributes> gaussians(20000);
  for (GaussianAttributes& g : gaussians) {
    g.position = {6 * uniform(), 6 * uniform(), 5 + 6 * uniform()};
    g.log_scale = {uniform() - 3, uniform() - 3, uniform() - 3};
    g.rotation = {uniform(), uniform(), uniform(), uniform()};
    g.opacity_logit = 6 * uniform();
    g.f_dc = {uniform(), uniform(), uniform()};
    if (random() % 50 == 0) g.rotation = {0, 0, 0, 0};
    if (random() % 50 == 0) g.log_scale[1] = kNan;
  }
  PreprocessOptions options;
  options.threads = 1;
  SceneSummary first;
  const Draw expected = run(gaussians, 0, options, &first);
  EXPECT_GT(first.gaussians_visible, 1000u);
  for (const unsigned threads : {0u, 2u, 3u, 7u}) {
    options.threads = threads;
    SceneSummary summary;
    EXPECT_TRUE(same_bits(run(gaussians, 0, options, &summary), expected));
    EXPECT_EQ(summary.rejected.not_finite, first.rejected.not_finite);
    EXPECT_EQ(summary.rejected.zero_quaternion, first.rejected.zero_quaternion);
  }
}

TEST(Preprocess, WhateverTheBitsOfAFileEverySplatIsFinite) {
  std::mt19937 random(29);
  const auto any_float = [&random] {
    const std::uint32_t bits = static_cast<std::uint32_t>(random());
    float f;
    std::memcpy(&f, &bits, sizeof f);
    return f;
  };
  std::vector<GaussianAttributes> gaussians(50000);
  for (GaussianAttributes& g : gaussians) {
    for (auto* attribute : {&g.position, &g.log_scale, &g.f_dc}) {
      for (float& f : *attribute) f = any_float();
    }
    for (float& f : g.rotation) f = any_float();
    g.position[2] = std::fabs(g.position[2]);
    g.opacity_logit = any_float();
    for (auto& channel : g.f_rest) {
      for (float& f : channel) f = any_float();
    }
  }
  SceneSummary summary;
  const Draw draw = run(gaussians, 3, {}, &summary);
  EXPECT_GT(draw.splats.size(), 100u);
  EXPECT_GT(summary.rejected.not_finite, 100u);
  for (const Splat& s : draw.splats) {
    for (const float f : {s.cx, s.cy, s.ax, s.ay, s.bx, s.by, s.r, s.red, s.green, s.blue, s.opacity})
      ASSERT_TRUE(std::isfinite(f));
    ASSERT_TRUE(s.red >= 0 && s.green >= 0 && s.blue >= 0 && s.opacity >= 1.0f / 255 && s.opacity <= 1);
    ASSERT_LE(std::fabs(s.cx) + std::fabs(s.ax) + std::fabs(s.bx), 4194304.0f);
    ASSERT_LE(std::fabs(s.cy) + std::fabs(s.ay) + std::fabs(s.by), 4194304.0f);
  }
}

TEST(Preprocess, Z01NoGaussiansGiveAnEmptyDraw) {
  SceneSummary summary;
  const Draw draw = run({}, 0, {}, &summary);
  EXPECT_TRUE(draw.splats.empty());
  EXPECT_EQ(draw.width, 64u);
  EXPECT_EQ(summary.gaussians_total, 0u);
  EXPECT_TRUE(preprocess(GaussianScene(), plain_camera(), {}, summary).splats.empty());
}

TEST(Preprocess, OptionsOutOfRangeAreRefused) {
  PreprocessOptions options;
  options.sh_degree = 4;
  expect_user_error([&] { run({}, 0, options); }, {"SH degree", "0 to 3"});
  options = {};
  options.depth_key_bits = 20;
  expect_user_error([&] { run({}, 0, options); }, {"depth key bits", "32, 24, 16 or 12"});
  Camera camera = plain_camera();
  camera.near_plane = 0;
  SceneSummary summary;
  expect_user_error([&] { preprocess(GaussianScene(), camera, {}, summary); }, {"camera", "near plane"});
}

}  // namespace
}  // namespace vrpipe
