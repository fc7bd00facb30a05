#include <random>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "numerics_test_support.h"
#include "support/pixel_oracle.h"

namespace vrpipe {
namespace {

using namespace testing;
using Exact = boost::multiprecision::cpp_bin_float_50;

// case P06
TEST(Projection, AlmostParallelRaysAgreeWithFiftyDigits) {
  // Focal length 3.7e5 pixels; the same ball, as large in the image as before.
  const Camera camera = look_at({0, 0, -57295}, {0, 0, 1}, {0, -1, 0}, 0.01, 64, 64);
  GaussianAttributes g = ordinary_gaussian();
  g.position = {1.5F, -2.25F, 0.5F};
  g.log_scale = {0, 0, 0};
  const Draw draw = projected({g}, camera);
  ASSERT_EQ(draw.splats.size(), 1U);
  const Exact z = Exact(57295) + Exact(0.5);
  const Exact focal = camera.fy;
  const Splat& s = draw.splats[0];
  EXPECT_NEAR(s.cx, static_cast<double>(32 + focal * Exact(1.5) / z), 1e-5);
  EXPECT_NEAR(s.cy, static_cast<double>(32 - focal * Exact(2.25) / z), 1e-5);
  const Exact sigma = sqrt(focal * focal / (z * z) + Exact(0.3));
  EXPECT_NEAR(std::hypot(static_cast<double>(s.ax), static_cast<double>(s.ay)) / static_cast<double>(s.r),
              static_cast<double>(sigma), 1e-5);
}

// case P10
TEST(Needle, AlphaIsWithin1eMinus4OfFiftyDigits) {
  for (const float length : {100.0F, 1000.0F, 3000.0F, 20000.0F}) {
    for (const float angle : {0.7853982F, 0.3F, 2.5F}) {
      const Splat splat = splat_at(40.3F, 21.7F, length, 0.5477F, angle, 0.95F);
      const Draw draw = draw_of(64, 64, {splat});
      RenderContext context = context_of(draw);
      const auto fragments = fragments_of(context);
      unsigned compared = 0;
      for (std::uint32_t y = 0; y < 64; ++y) {
        for (std::uint32_t x = 0; x < 64; ++x) {
          const auto& list = fragments[std::size_t{y} * 64 + x];
          if (list.empty()) continue;
          const Exact dx = Exact(x) + Exact(0.5) - Exact(splat.cx);
          const Exact dy = Exact(y) + Exact(0.5) - Exact(splat.cy);
          const Exact det = Exact(splat.ax) * Exact(splat.by) - Exact(splat.ay) * Exact(splat.bx);
          const Exact u = (dx * Exact(splat.by) - dy * Exact(splat.bx)) * Exact(splat.r) / det;
          const Exact v = (dy * Exact(splat.ax) - dx * Exact(splat.ay)) * Exact(splat.r) / det;
          const auto expected = static_cast<double>(Exact(splat.opacity) * exp(-(u * u + v * v) / 2));
          ASSERT_NEAR(list[0].alpha, expected, 1e-4) << length << " at " << x << "," << y;
          ++compared;
        }
      }
      EXPECT_GT(compared, 100U);
    }
  }
}

// case P11
TEST(Needle, TheExponentIsNeverAboveZero) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> any(-1, 1);
  for (int i = 0; i < 300; ++i) {
    const float length = std::exp(8 * any(random));
    const Splat splat = splat_at(32 + 30 * any(random), 32 + 30 * any(random), length,
                                 0.3F * length * std::fabs(any(random)) + 1e-3F, 3 * any(random), 0.9F);
    const Draw draw = draw_of(64, 64, {splat});
    for (const auto& list : fragments_of(context_of(draw))) {
      for (const OracleFragment& fragment : list) ASSERT_LE(fragment.alpha, 0.9F);
    }
  }
}

// case P13
TEST(Projection, TheSmallestSplatFallsOffByAtMost6PerPixelInTheLogarithm) {
  GaussianAttributes point = ordinary_gaussian();
  point.log_scale = {-infinity, -infinity, -infinity};
  point.opacity_logit = infinity;
  const Draw draw = projected({point});
  const Splat& s = draw.splats.at(0);
  const double sigma = std::hypot(static_cast<double>(s.ax), static_cast<double>(s.ay)) / static_cast<double>(s.r);
  EXPECT_NEAR(sigma, 0.5477, 1e-4);
  // d ln alpha / dr = r / sigma^2, largest at the extent r = 3.329 sigma.
  EXPECT_NEAR(static_cast<double>(s.r) / sigma, 6.08, 0.01);
}

// case P15
TEST(Projection, AMirroredSceneGivesMirroredSplats) {
  std::mt19937 random(15);
  std::uniform_real_distribution<float> any(-1, 1);
  for (int i = 0; i < 200; ++i) {
    GaussianAttributes g = ordinary_gaussian();
    g.position = {3 * any(random), 3 * any(random), 5 + any(random)};
    g.log_scale = {-1.5F + any(random), -2 + any(random), -2.5F + any(random)};
    g.rotation = {any(random), any(random), any(random), any(random)};
    const Draw draw = projected({g});
    // x -> -x turns a rotation (w, x, y, z) into (w, x, -y, -z).
    g.position[0] = -g.position[0];
    g.rotation[2] = -g.rotation[2];
    g.rotation[3] = -g.rotation[3];
    const Draw mirrored = projected({g});
    ASSERT_EQ(draw.splats.size(), 1U);
    ASSERT_EQ(mirrored.splats.size(), 1U);
    const Splat& a = draw.splats[0];
    const Splat& b = mirrored.splats[0];
    EXPECT_NEAR(static_cast<double>(a.cx) + static_cast<double>(b.cx), 64, 0x1p-17);
    EXPECT_EQ(a.cy, b.cy);
    EXPECT_EQ(std::fabs(a.ax), std::fabs(b.ax));
    EXPECT_EQ(std::fabs(a.ay), std::fabs(b.ay));
    EXPECT_EQ(a.ax * a.ay, -(b.ax * b.ay));
  }
}

// case P15
TEST(Projection, MirroredSplatsGiveTheMirroredImageBitForBit) {
  Draw draw = random_draw(64, 64, 150, 15);
  Draw mirrored = draw;
  for (std::size_t i = 0; i < draw.splats.size(); ++i) {
    Splat& s = draw.splats[i];
    s.cx = std::round(s.cx * 512) / 512;  // so that 64 - cx is exact, and no edge meets a sample
    s.cx += 1.0F / 1024;
    mirrored.splats[i] = s;
    mirrored.splats[i].cx = 64 - s.cx;
    mirrored.splats[i].ax = -s.ax;
    mirrored.splats[i].bx = -s.bx;
  }
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
    const RunResult a = simulate(untimed("baseline", format), draw);
    const RunResult b = simulate(untimed("baseline", format), mirrored);
    unsigned different = 0;
    for (std::uint32_t y = 0; y < 64; ++y) {
      for (std::uint32_t x = 0; x < 64; ++x)
        different += a.framebuffer.color.pixel(x, y) != b.framebuffer.color.pixel(63 - x, y) ? 1U : 0U;
    }
    EXPECT_GT(a.counts.fragments_blended, 5000U);
    EXPECT_EQ(different, 0U);
  }
}

// case O11
TEST(Splat, DepositsItsIntegralFlatOrTurned) {
  for (const float opacity : {0.5F, 0.9F}) {
    const double expected = 2 * 3.14159265358979 * 4 * 3 * (static_cast<double>(opacity) - 1.0 / 255);
    double flat = 0;
    for (const float angle : {0.0F, 0.78539816F, 1.1F}) {
      const Draw draw = draw_of(96, 96, {splat_at(47.3F, 48.9F, 4, 3, angle, opacity)});
      const RunResult result = simulate(untimed("baseline", ColorFormat::rgba32f), draw);
      double sum = 0;
      for (std::uint32_t y = 0; y < 96; ++y) {
        for (std::uint32_t x = 0; x < 96; ++x) sum += static_cast<double>(result.framebuffer.color.pixel(x, y)[3]);
      }
      EXPECT_NEAR(sum, expected, 0.01 * expected);
      if (angle == 0) flat = sum;
      EXPECT_NEAR(sum, flat, 0.005 * expected);
    }
  }
}

// case E03
TEST(Splat, ARoundOneCoversTheSameHoweverItsAxesAreTurned) {
  const auto covered = [](float angle) {
    return simulate(untimed("baseline", ColorFormat::rgba32f),
                    draw_of(32, 32, {splat_at(15.9F, 16.2F, 2.5F, 2.5F, angle, 0.8F)}));
  };
  const RunResult flat = covered(0);
  for (const float angle : {0.2F, 0.78539816F, 1.3F}) {
    const RunResult turned = covered(angle);
    EXPECT_EQ(flat.counts.fragments_blended, turned.counts.fragments_blended);
    for (std::uint32_t y = 0; y < 32; ++y) {
      for (std::uint32_t x = 0; x < 32; ++x) {
        ASSERT_NEAR(flat.framebuffer.color.pixel(x, y)[3], turned.framebuffer.color.pixel(x, y)[3], 2e-6F);
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
