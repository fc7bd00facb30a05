#include <vrpipe/arithmetic/half.h>

#include "numerics_test_support.h"

namespace vrpipe {
namespace {

using namespace testing;

bool same_splats(const Draw& a, const Draw& b) {
  return a.splats.size() == b.splats.size() &&
         std::memcmp(a.splats.data(), b.splats.data(), a.splats.size() * sizeof(Splat)) == 0;
}

// case L05
TEST(Attributes, AScaleOf1eMinus30IsScale0BitForBit) {
  GaussianAttributes point = ordinary_gaussian();
  point.log_scale = {-infinity, -infinity, -infinity};
  GaussianAttributes tiny = ordinary_gaussian();
  tiny.log_scale = {-69.07755F, -69.07755F, -69.07755F};  // ln 1e-30
  EXPECT_TRUE(same_splats(projected({point}), projected({tiny})));
}

// case L05
TEST(Attributes, AScaleOf1e30CoversEveryPixelWithOneAlpha) {
  for (const float logit : {0.0F, 8.0F}) {
    GaussianAttributes huge = ordinary_gaussian();
    huge.log_scale = {69.07755F, 69.07755F, 69.07755F};
    huge.opacity_logit = logit;
    const RunResult result = simulate(untimed("baseline", ColorFormat::rgba32f), projected({huge}));
    const float expected = std::fmin(0.99F, static_cast<float>(sigmoid(static_cast<double>(logit))));
    for (std::uint32_t y = 0; y < 64; ++y) {
      for (std::uint32_t x = 0; x < 64; ++x) ASSERT_NEAR(result.framebuffer.color.pixel(x, y)[3], expected, 1e-7F);
    }
  }
}

// case L06
TEST(Attributes, DenormalsChangeNothingAndFlushingThemDoesNotEither) {
  if (!FlushDenormals::works()) GTEST_SKIP() << "no flushing of denormals on this processor";
  GaussianAttributes ordinary = ordinary_gaussian();
  for (const float denormal : {1e-40F, -1e-40F, 1.4e-45F}) {
    GaussianAttributes g = ordinary;
    g.position = {denormal, denormal, 5};
    g.f_dc = {denormal, denormal, denormal};
    g.rotation = {1, denormal, denormal, denormal};
    g.f_rest[0].fill(denormal);
    GaussianAttributes zero = g;
    zero.position = {0, 0, 5};
    zero.f_dc = {0, 0, 0};
    zero.rotation = {1, 0, 0, 0};
    zero.f_rest = {};
    const Draw draw = projected({g}, plain_camera(), 3);
    const RunResult normal = simulate(untimed(), draw);
    EXPECT_TRUE(same_bits(simulate(untimed(), projected({zero}, plain_camera(), 3)).framebuffer.color,
                          normal.framebuffer.color));
    const FlushDenormals flushing;
    const RunResult flushed = simulate(untimed(), projected({g}, plain_camera(), 3));
    EXPECT_TRUE(same_bits(normal.framebuffer.color, flushed.framebuffer.color));
    EXPECT_EQ(normal.counts.named(), flushed.counts.named());
  }
}

// case L06
TEST(Attributes, ADenormalColourOfBinary16SurvivesInItsTarget) {
  Splat splat = flat_box(0, 0, 16, 16, 0.5F, 0x1p-23F, 0, 0);  // 2^-24 after alpha: the smallest half
  const auto red = [&] {
    return simulate(untimed("baseline", ColorFormat::rgba16f, {{"state", "exponential", "exact"}}),
                    draw_of(16, 16, {splat}))
        .framebuffer.color.pixel(8, 8)[0];
  };
  EXPECT_EQ(red(), 0x1p-24F);
  // Denormal in binary16, normal in single precision, in which it is computed.
  const FlushDenormals flushing;
  EXPECT_EQ(red(), 0x1p-24F);
}

// case L09
TEST(Attributes, EveryCornerOfAnEightBitQuaternionIsARotationOrRejected) {
  constexpr int levels[] = {0, 1, 127, 128, 129, 255};
  for (const int w : levels) {
    for (const int x : levels) {
      for (const int y : levels) {
        for (const int z : levels) {
          const auto decoded = [](int level) { return static_cast<float>(level - 128) / 128.0F; };
          GaussianAttributes g = ordinary_gaussian();
          g.log_scale = {0, -2, -4};
          g.rotation = {decoded(w), decoded(x), decoded(y), decoded(z)};
          SceneSummary summary;
          const Draw draw = projected({g}, plain_camera(), 0, &summary);
          const bool zero = w == 128 && x == 128 && y == 128 && z == 128;
          ASSERT_EQ(summary.rejected.zero_quaternion, zero ? 1U : 0U);
          ASSERT_EQ(draw.splats.size(), zero ? 0U : 1U);
          if (zero) continue;
          const Splat& s = draw.splats[0];
          ASSERT_TRUE(std::isfinite(s.ax) && std::isfinite(s.ay) && std::isfinite(s.bx) && std::isfinite(s.by));
          // A rotation keeps the axes between the smallest and the largest scale, 32 / 5 pixels a unit, and dilated.
          const double longest = std::sqrt(0.3 + 6.4 * 6.4 * 1.001) * static_cast<double>(s.r);
          ASSERT_LE(std::hypot(static_cast<double>(s.ax), static_cast<double>(s.ay)), longest);
          ASSERT_GE(std::hypot(static_cast<double>(s.bx), static_cast<double>(s.by)),
                    std::sqrt(0.3) * static_cast<double>(s.r) * 0.999999);
        }
      }
    }
  }
}

// case L10
TEST(Attributes, ARowOfZerosIsRejectedForItsQuaternion) {
  SceneSummary summary;
  const Draw draw = projected({ordinary_gaussian(), {{}, {}, {0, 0, 0, 0}, 0, {}, {}}}, plain_camera(), 0, &summary);
  EXPECT_EQ(summary.rejected.zero_quaternion, 1U);
  EXPECT_TRUE(same_splats(draw, projected({ordinary_gaussian()})));
}

// case L13
TEST(Attributes, OpacityIsNotQuantizedSoThatOne255thStaysVisible) {
  EXPECT_EQ(round_to_half(one_255th), 0.0039215088F);
  EXPECT_LT(round_to_half(one_255th), one_255th);
  Splat kept = flat_box(4, 4, 6, 6, one_255th);
  Splat quantized = flat_box(4, 4, 6, 6, round_to_half(one_255th));
  const RunResult result = simulate(untimed(), draw_of(16, 16, {kept}));
  EXPECT_EQ(result.counts.fragments_blended, 4U);
  EXPECT_EQ(simulate(untimed(), draw_of(16, 16, {quantized})).counts.fragments_blended, 0U);
}

// case L14
TEST(Attributes, OpacitiesOutOfRangeAreClampedPrunedOrDropped) {
  const auto run = [](float opacity) {
    return simulate(untimed("baseline", ColorFormat::rgba32f), draw_of(16, 16, {flat_box(4, 4, 8, 8, opacity)}));
  };
  for (const float opacity : {1.5F, 100.0F, 3e38F}) {
    EXPECT_EQ(run(opacity).framebuffer.color.pixel(5, 5)[3], 0.99F) << opacity;
  }
  for (const float opacity : {-0.0F, -1.0F, -3e38F, 1e-40F}) {
    const RunResult result = run(opacity);
    EXPECT_EQ(result.counts.fragments_blended, 0U) << opacity;
    EXPECT_EQ(result.counts.fragments_pruned, 16U) << opacity;
  }
  for (const float opacity : {not_a_number, infinity, -infinity}) {
    const RunResult result = run(opacity);
    EXPECT_EQ(statistic(result, "vpo.dropped_not_finite"), 1U) << opacity;
    EXPECT_EQ(result.counts.fragments_rasterized, 0U) << opacity;
  }
}

// case O06
TEST(Attributes, AnOpacityBeyondOneHasAPlateauOfTheCap) {
  const float opacity = 4;
  const float sigma = 6;
  Splat splat = splat_at(32, 32, sigma, sigma, 0, opacity);
  const RunResult result = simulate(untimed("baseline", ColorFormat::rgba32f), draw_of(64, 64, {splat}));
  const double plateau = static_cast<double>(sigma) * std::sqrt(2 * std::log(4 / 0.99));
  for (std::uint32_t x = 0; x < 64; ++x) {
    const double distance = std::hypot(x + 0.5 - 32, 0.5);
    const float alpha = result.framebuffer.color.pixel(x, 32)[3];
    if (distance < plateau - 1e-3) {
      ASSERT_EQ(alpha, 0.99F) << x;
    }
    if (distance > plateau + 1e-3) {
      ASSERT_LT(alpha, 0.99F) << x;
    }
  }
}

// case S07
TEST(Attributes, ColoursBeyondTheLargestHalfAreClampedAndCounted) {
  for (const float color : {70000.0F, 3e38F}) {
    for (const char* rounding : {"rne", "rtz", "measured"}) {
      std::vector<Splat> splats(40, flat_box(0, 0, 8, 8, 1.0F, color, 1, 0));
      const RunResult result =
          simulate(untimed("baseline", ColorFormat::rgba16f, {{"state", "blend_rounding", rounding}}),
                   draw_of(16, 16, std::move(splats)));
      const std::array<float, 4> pixel = result.framebuffer.color.pixel(3, 3);
      EXPECT_LE(pixel[0], half_max);
      EXPECT_GT(pixel[0], 0.98F * half_max);
      EXPECT_GT(statistic(result, "sm.colors_clamped"), 0U);
    }
  }
}

// case S02
TEST(Attributes, ColoursBeyondOneAreKeptByFloatTargetsAndClampedByUnorm) {
  GaussianAttributes g;
  g.f_dc = {2, 4, 7};
  const std::array<float, 3> color = sh_colour(scene_of({g})[0], {0, 0, 1}, 0);
  EXPECT_NEAR(color[0], 1.0642, 5e-5);
  EXPECT_NEAR(color[1], 1.6284, 5e-5);
  EXPECT_NEAR(color[2], 2.4747, 5e-5);
  const Splat splat = flat_box(0, 0, 8, 8, 0.5F, color[0], color[1], color[2]);
  const Draw draw = draw_of(16, 16, {splat, splat});
  const RunResult wide = simulate(untimed("baseline", ColorFormat::rgba32f), draw);
  for (unsigned i = 0; i < 3; ++i) EXPECT_NEAR(wide.framebuffer.color.pixel(3, 3)[i], 0.75F * color[i], 1e-6F);
  EXPECT_EQ(wide.framebuffer.color.pixel(3, 3)[3], 0.75F);
  const RunResult unorm = simulate(untimed("baseline", ColorFormat::rgba8), draw);
  EXPECT_NEAR(unorm.framebuffer.color.pixel(3, 3)[0], 0.80F, 1.0F / 255.0F);
  EXPECT_EQ(unorm.framebuffer.color.pixel(3, 3)[1], 1.0F);
  EXPECT_EQ(unorm.framebuffer.color.pixel(3, 3)[2], 1.0F);
  EXPECT_EQ(statistic(wide, "sm.colors_clamped"), 0U);
  EXPECT_GT(statistic(unorm, "crop.colors_saturated"), 0U);
}

// case K03
TEST(Order, KeysThatAreNotFiniteNeverReachTheSorterAndDenormalsSort) {
  EXPECT_LT(depth_key(1e-40F), depth_key(1e-39F));
  EXPECT_LT(depth_key(0.0F), depth_key(1.4e-45F));
  EXPECT_LT(depth_key(-1e-39F), depth_key(-1e-40F));
  GaussianAttributes nan = ordinary_gaussian();
  nan.position[2] = not_a_number;
  GaussianAttributes far = ordinary_gaussian();
  far.position[2] = infinity;
  GaussianAttributes farthest = ordinary_gaussian();
  farthest.position[2] = std::numeric_limits<float>::max();
  const Draw draw = projected({farthest, nan, far, ordinary_gaussian()});
  ASSERT_EQ(draw.splats.size(), 2U);
  EXPECT_GT(draw.splats[0].ax, draw.splats[1].ax) << "the near one comes first";
}

// case K07
TEST(Order, IsThatOfTheCamerasZAndNotOfTheDistance) {
  GaussianAttributes aside = ordinary_gaussian();
  aside.position = {3, 0, 4};  // z 4, distance 5
  aside.f_dc = {1, 0, 0};
  GaussianAttributes ahead = ordinary_gaussian();
  ahead.position = {0, 0, 4.5F};  // z and distance 4.5
  ahead.f_dc = {0, 1, 0};
  for (const auto& scene : {std::vector<GaussianAttributes>{aside, ahead}, {ahead, aside}}) {
    const Draw draw = projected(scene);
    ASSERT_EQ(draw.splats.size(), 2U);
    EXPECT_GT(draw.splats[0].cx, draw.splats[1].cx);
  }
}

}  // namespace
}  // namespace vrpipe
