// sRGB levels against the standard's formulas in 50 digits.
#include <vrpipe/arithmetic/srgb.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <boost/multiprecision/cpp_bin_float.hpp>

#include <vrpipe/arithmetic/blend.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using Exact = boost::multiprecision::cpp_bin_float_50;

Exact decoded(const Exact& encoded) {
  if (encoded <= Exact("0.04045")) return encoded / Exact("12.92");
  return pow((encoded + Exact("0.055")) / Exact("1.055"), Exact("2.4"));
}
/// From 0 to 255, by the formula for encoding.
Exact encoded_level(float linear) {
  const Exact value(linear);
  const Exact encoded = value <= Exact("0.0031308")
                            ? Exact(value * Exact("12.92"))
                            : Exact(Exact("1.055") * pow(value, 1 / Exact("2.4")) - Exact("0.055"));
  return 255 * encoded;
}

TEST(Srgb, EveryLevelIsTheNearestFloatToTheStandardsLinearValue) {
  for (unsigned level = 0; level < 256; ++level) {
    const auto exact = static_cast<float>(decoded(Exact(level) / 255));
    EXPECT_EQ(srgb_nearest.value[level], exact) << level;
    EXPECT_EQ(srgb_truncated.value[level], exact) << level;
  }
}

TEST(Srgb, EveryThresholdIsTheFirstFloatThatEncodesToALevelAndAHalf) {
  for (unsigned level = 1; level < 256; ++level) {
    const float first = srgb_nearest.least[level];
    EXPECT_GE(encoded_level(first), Exact(level) - Exact("0.5")) << level;
    EXPECT_LT(encoded_level(std::nextafter(first, 0.0F)), Exact(level) - Exact("0.5")) << level;
  }
}

/// All that are neighbours of a threshold or of a stored value, and many between.
std::vector<float> linear_values() {
  std::vector<float> values{0.0F, 1.0F, 1e-30F, 0x1p-13F};
  for (const SrgbLevels* levels : {&srgb_nearest, &srgb_truncated}) {
    for (unsigned level = 1; level < 256; ++level) {
      for (const float middle : {levels->least[level], levels->value[level]}) {
        for (const float value : {std::nextafter(middle, 0.0F), middle, std::nextafter(middle, 2.0F)})
          values.push_back(value);
      }
    }
  }
  for (std::uint64_t i = 0; i < 500; ++i) {
    const float value = testing::uniform(31, i, 0, 1);
    values.push_back(value);
    values.push_back(value * value * value * value);
  }
  return values;
}

TEST(Srgb, ValuesAreStoredByBruteForceOverAllLevels) {
  std::vector<float> stored(256);
  for (unsigned level = 0; level < 256; ++level) stored[level] = static_cast<float>(decoded(Exact(level) / 255));
  for (const float linear : linear_values()) {
    const auto nearest = static_cast<unsigned>(floor(encoded_level(linear) + Exact("0.5")));
    unsigned below = 0;
    while (below < 255 && stored[below + 1] <= linear) ++below;
    const unsigned clamped = std::min(nearest, 255U);
    ASSERT_EQ(srgb_nearest.level_of(linear), clamped) << linear;
    ASSERT_EQ(srgb_truncated.level_of(linear), below) << linear;
    ASSERT_EQ(srgb_nearest.stored(splat_pair(linear))[5], stored[clamped]);
  }
}

TEST(Srgb, WhatIsNoColourIsClamped) {
  for (const SrgbLevels* levels : {&srgb_nearest, &srgb_truncated}) {
    EXPECT_EQ(levels->level_of(std::nanf("")), 0U);
    EXPECT_EQ(levels->level_of(-1.0F), 0U);
    EXPECT_EQ(levels->level_of(-0.0F), 0U);
    EXPECT_EQ(levels->level_of(1.5F), 255U);
    EXPECT_EQ(levels->level_of(HUGE_VALF), 255U);
  }
}

TEST(Srgb, AlphaIsLinear) {
  for (int level = 0; level < 256; ++level) {
    const float alpha = static_cast<float>(level) / 255.0F;
    for (const BlendRounding rounding : {BlendRounding::rne, BlendRounding::rtz}) {
      const QuadColor stored =
          blend_function(ColorFormat::srgb8, rounding)(QuadColor{}, testing::color_of(0.2F, 0.2F, 0.2F, alpha));
      ASSERT_EQ(stored.alpha[3], alpha);
      ASSERT_EQ(stored.blue[3],
                (rounding == BlendRounding::rtz ? srgb_truncated : srgb_nearest).stored(splat_lanes(0.2F))[0]);
    }
  }
}

}  // namespace
}  // namespace vrpipe
