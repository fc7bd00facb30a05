// The shader in lower precision, against the same operations in double, each rounded to 11 bits here.
#include <cmath>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/half.h>

#include "sm/sm.h"
#include "support/builders.h"
#include "support/floating_point.h"

namespace vrpipe {
namespace {

using testing::draw_of;
using testing::flat_box;
using testing::splat_at;
using testing::uniform;

/// To the nearest binary16, ties to even.
double half_of(double value) {
  int exponent = 0;
  std::frexp(value, &exponent);
  const double unit = std::ldexp(1.0, std::max(exponent - 11, -24));
  return std::nearbyint(value / unit) * unit;
}

/// One splat, or a merged pair, at the first quad.
struct Shaded {
  template <class Change>
  Shaded(std::vector<Splat> splats, const Change& change, bool merges = false)
      : draw(draw_of(16, 16, std::move(splats))), context(testing::context_of(draw)) {
    change(context.precision);
    SplatShader sm(parameters, context);
    Warp warp;
    for (std::uint32_t i = 0; i < (merges ? 2U : 1U); ++i) warp.quads[warp.count++] = {i, 0, all_lanes, 0, 0};
    warp.merge_pairs = merges ? 1 : 0;
    sm.shade(warp, out);
    attribute_bytes = sm.time().fetch.attribute_bytes;
  }
  double alpha(unsigned lane = 0) const { return static_cast<double>(out.color[0].alpha[lane]); }
  double red(unsigned lane = 0) const { return static_cast<double>(out.color[0].red[lane]); }

  Draw draw;
  RenderContext context;
  SplatShader::Parameters parameters;
  ShadedWarp out;
  std::uint32_t attribute_bytes = 0;
};

const auto as_it_is = [](DevicePrecision&) {};

Splat some_splat(std::uint64_t i) {
  Splat splat = splat_at(uniform(i, 0, -4, 6), uniform(i, 1, -4, 6), uniform(i, 2, 1, 8), uniform(i, 3, 1, 8),
                         uniform(i, 4, 0, 6), uniform(i, 5, 0.2F, 1));
  splat.red = uniform(i, 6, 0, 1);
  return splat;
}

TEST(ShaderPrecision, ShadingInHalfRoundsEachOperationToElevenBits) {
  unsigned compared = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const Splat splat = some_splat(i);
    const Shaded shaded({splat}, [](DevicePrecision& p) {
      p.shading = NumberFormat::fp16;
      p.exponential = Exponential::exact;
    });
    if (shaded.out.count == 0) continue;
    const float determinant = splat.ax * splat.by - splat.ay * splat.bx;
    const float scale = splat.r / determinant;
    const auto m = [&](float value) { return half_of(static_cast<double>(value * scale)); };
    const double dx = half_of(static_cast<double>(0.5F - splat.cx)), dy = half_of(static_cast<double>(0.5F - splat.cy));
    const double u = half_of(half_of(dx * m(splat.by)) + dy * m(-splat.bx));
    const double v = half_of(half_of(dx * m(-splat.ay)) + dy * m(splat.ax));
    const double power = half_of(half_of(half_of(u * u) + v * v) * half_of(-0.72134752));
    const double opacity = half_of(static_cast<double>(splat.opacity));
    const double alpha = std::min(half_of(half_of(std::exp2(power)) * opacity), half_of(0.99));
    if ((shaded.out.live[0] & 1U) == 0) {
      EXPECT_LT(alpha, half_of(1.0 / 255));
      continue;
    }
    ++compared;
    // A sum of a product of 22 bits is rounded to 24 bits on its way, which decides a tie now and then.
    EXPECT_NEAR(shaded.alpha(), alpha, 0.002 * alpha) << i;
    EXPECT_EQ(shaded.alpha(), half_of(shaded.alpha())) << "a half";
    EXPECT_EQ(shaded.red(), half_of(shaded.alpha() * half_of(static_cast<double>(splat.red))));
  }
  EXPECT_GT(compared, 250U);
}

// case L13
TEST(ShaderPrecision, AnOpacityOfOne255thSurvivesInEveryPrecision) {
  const Splat splat = flat_box(-4, -4, 12, 12, 1.0F / 255.0F);
  EXPECT_LT(half_of(1.0 / 255.0), static_cast<double>(1.0F / 255.0F)) << "which would prune it";
  EXPECT_EQ(Shaded({splat}, as_it_is).out.live[0], all_lanes);
  EXPECT_EQ(Shaded({splat}, [](DevicePrecision& p) { p.shading = NumberFormat::fp16; }).out.live[0], all_lanes);
  EXPECT_EQ(Shaded({splat}, [](DevicePrecision& p) { p.attributes = AttributeFormat::quantized; }).out.live[0],
            all_lanes);
  EXPECT_EQ(Shaded({splat}, [](DevicePrecision& p) { p.attributes = AttributeFormat::fp16; }).out.count, 0)
      << "an opacity in binary16 is below a threshold in single precision";
}

TEST(ShaderPrecision, MergingInHalfIsElevenBitsOfTheFormula) {
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Splat front = flat_box(-4, -4, 12, 12, uniform(i, 0, 0.01F, 0.98F), uniform(i, 1, 0, 1));
    const Splat back = flat_box(-4, -4, 12, 12, uniform(i, 2, 0.01F, 0.98F), uniform(i, 3, 0, 1));
    const Shaded single({front, back}, as_it_is, true);
    const Shaded half(
        {front, back}, [](DevicePrecision& p) { p.merging = NumberFormat::fp16; }, true);
    const Shaded first({front}, as_it_is), second({back}, as_it_is);
    const double transmittance = half_of(1 - half_of(first.alpha()));
    EXPECT_EQ(half.alpha(), half_of(half_of(first.alpha()) + transmittance * half_of(second.alpha()))) << i;
    EXPECT_NEAR(half.red(), half_of(half_of(first.red()) + transmittance * half_of(second.red())), 0x1p-11);
    EXPECT_NEAR(half.alpha(), single.alpha(), 3 * 0x1p-11);
  }
}

TEST(ShaderPrecision, WhatIsNotMergedIsNotRounded) {
  const Splat splat = flat_box(-4, -4, 12, 12, 0.3F, 0.7F);
  const Shaded usual({splat}, as_it_is);
  const Shaded half({splat}, [](DevicePrecision& p) { p.merging = NumberFormat::fp16; });
  EXPECT_EQ(half.alpha(), usual.alpha());
  EXPECT_NE(half.alpha(), half_of(half.alpha()));
}

TEST(ShaderPrecision, ExportsAreRoundedOnceAfterMerging) {
  for (std::uint64_t i = 0; i < 100; ++i) {
    const std::vector<Splat> pair{flat_box(-4, -4, 12, 12, uniform(i, 0, 0.01F, 0.98F), 0.7F),
                                  flat_box(-4, -4, 12, 12, uniform(i, 1, 0.01F, 0.98F), 0.4F)};
    const Shaded usual(pair, as_it_is, true);
    const Shaded half(
        pair, [](DevicePrecision& p) { p.export_format = NumberFormat::fp16; }, true);
    EXPECT_EQ(half.alpha(), half_of(usual.alpha()));
    EXPECT_EQ(half.red(), half_of(usual.red()));
  }
}

TEST(ShaderPrecision, AttributesAreKeptInTheirFormat) {
  for (std::uint64_t i = 0; i < 100; ++i) {
    Splat splat = flat_box(-4, -4, 12, 12, uniform(i, 0, 0.01F, 0.98F), uniform(i, 1, 0, 1.3F));
    const auto opacity = static_cast<double>(splat.opacity), red = static_cast<double>(splat.red);
    const Shaded half({splat}, [](DevicePrecision& p) { p.attributes = AttributeFormat::fp16; });
    EXPECT_NEAR(half.alpha(), half_of(opacity), 1e-6);
    EXPECT_NEAR(half.red(), half_of(opacity) * half_of(red), 1e-6);
    const auto level = [](double value) { return std::min(std::floor(value * 255 + 0.5), 255.0) / 255; };
    const Shaded quantized({splat}, [](DevicePrecision& p) { p.attributes = AttributeFormat::quantized; });
    EXPECT_NEAR(quantized.alpha(), level(opacity), 1e-6);
    EXPECT_NEAR(quantized.red(), level(opacity) * level(red), 1e-6) << "colours beyond 1 are clamped";
  }
}

TEST(ShaderPrecision, AttributesOfFewerBitsAreFewerBytes) {
  const std::vector<Splat> splat{flat_box(-4, -4, 12, 12, 0.5F)};
  EXPECT_EQ(Shaded(splat, as_it_is).attribute_bytes, 40U);
  // The centre in single precision; 8 values of 2 bytes; 4 of 2 bytes and 4 of one.
  EXPECT_EQ(Shaded(splat, [](DevicePrecision& p) { p.attributes = AttributeFormat::fp16; }).attribute_bytes, 8U + 16);
  EXPECT_EQ(Shaded(splat, [](DevicePrecision& p) { p.attributes = AttributeFormat::quantized; }).attribute_bytes,
            8U + 8 + 4);
}

/// Sigmas below 1/65504 px, whose inverse no half holds.
TEST(ShaderPrecision, AnInverseThatNoHalfHoldsSaturatesAndMakesNoNan) {
  const testing::TrapInvalid trap;
  for (const float sigma : {1.6e-5F, 1.4e-5F, 3e-6F, 1e-10F}) {
    for (const float angle : {0.0F, 0.7F}) {
      const Splat at_the_sample = splat_at(0.5F, 0.5F, sigma, sigma, angle, 0.75F);
      const Splat beside_it = splat_at(0.51F, 0.5F, sigma, sigma, angle, 0.75F);
      for (const AttributeFormat format : {AttributeFormat::fp16, AttributeFormat::quantized}) {
        const auto attributes = [&](DevicePrecision& p) { p.attributes = format; };
        const Shaded shaded({at_the_sample}, attributes);
        ASSERT_EQ(shaded.out.count, 1) << sigma;
        EXPECT_EQ(shaded.out.live[0], 1) << "only there";
        EXPECT_NEAR(shaded.alpha(), 0.75, 1.0 / 255);
        EXPECT_EQ(Shaded({beside_it}, attributes).out.count, 0);
      }
      const auto computes_in_half = [](DevicePrecision& p) { p.shading = NumberFormat::fp16; };
      EXPECT_EQ(Shaded({at_the_sample}, computes_in_half).alpha(), 0.75);
      EXPECT_EQ(Shaded({beside_it}, computes_in_half).out.count, 0);
    }
  }
}

TEST(ShaderPrecision, AlphaIsClampedWhereItIsAsked) {
  const std::vector<Splat> splat{flat_box(-4, -4, 12, 12, 1.0F)};
  EXPECT_EQ(Shaded(splat, as_it_is).out.color[0].alpha[0], 0.99F);
  for (const float most : {0.5F, 0.999F, 1.0F})
    EXPECT_EQ(Shaded(splat, [&](DevicePrecision& p) { p.alpha_max = most; }).out.color[0].alpha[0], most);
  EXPECT_EQ(Shaded(splat, [](DevicePrecision& p) { p.shading = NumberFormat::fp16; }).alpha(), half_of(0.99));
}

TEST(ShaderPrecision, NanIsPrunedInHalfToo) {
  Splat splat = flat_box(-4, -4, 12, 12, 0.5F);
  splat.opacity = std::nanf("");
  EXPECT_EQ(Shaded({splat}, [](DevicePrecision& p) { p.shading = NumberFormat::fp16; }).out.count, 0);
  // An inverse beyond the largest half: nothing but its very centre, and no NaN.
  Splat needle = splat_at(5, 5, 3e-6F, 3e-6F, 0, 0.9F);
  const Shaded half({needle}, [](DevicePrecision& p) { p.shading = NumberFormat::fp16; });
  for (unsigned i = 0; i < half.out.count; ++i) EXPECT_FALSE(std::isnan(half.out.color[i].alpha[0]));
}

}  // namespace
}  // namespace vrpipe
