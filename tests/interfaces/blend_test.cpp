#include <vrpipe/arithmetic/blend.h>

#include <cmath>
#include <cstring>
#include <sstream>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>

#include "support/builders.h"
#include "support/data.h"

namespace vrpipe {
namespace {

using testing::color_of;

constexpr BlendRounding roundings[] = {BlendRounding::rne, BlendRounding::rtz};

/// What a cleared pixel holds after `count` fragments of one alpha and one grey.
struct Stack {
  Stack(ColorFormat format, BlendRounding rounding) : blend(blend_function(format, rounding)) {}
  void add(float alpha, float grey, unsigned count) {
    for (unsigned i = 0; i < count; ++i)
      pixel = blend(pixel, color_of(alpha * grey, alpha * grey, alpha * grey, alpha));
  }
  float alpha() const { return pixel.alpha[0]; }
  float grey() const { return pixel.red[0]; }
  BlendFunction blend;
  QuadColor pixel{};
};

bool terminates(ColorFormat format, BlendRounding rounding, float alpha) {
  Stack stack(format, rounding);
  stack.add(alpha, 0, 5000);
  return stack.alpha() >= 0.996F;
}

TEST(Unorm8, AllStoredValuesStay) {
  for (int level = 0; level < 256; ++level) {
    const float value = static_cast<float>(level) / 255.0F;
    ASSERT_EQ(round_to_unorm<255>(splat_lanes(value))[0], value);
    ASSERT_EQ(truncate_to_unorm<255>(splat_lanes(value))[0], value);
  }
}

// case B08
TEST(Unorm8, RoundsToTheNearestLevelAndClamps) {
  for (int level = 0; level < 255; ++level) {
    const double middle = (level + 0.5) / 255.0;
    ASSERT_EQ(round_to_unorm<255>(splat_lanes(static_cast<float>(middle - 1e-6)))[0],
              static_cast<float>(level) / 255.0F);
    ASSERT_EQ(round_to_unorm<255>(splat_lanes(static_cast<float>(middle + 1e-6)))[0],
              static_cast<float>(level + 1) / 255.0F);
    ASSERT_EQ(truncate_to_unorm<255>(splat_lanes(static_cast<float>((level + 0.99) / 255.0)))[0],
              static_cast<float>(level) / 255.0F);
  }
  EXPECT_EQ(round_to_unorm<255>(splat_lanes(-3.0F))[0], 0.0F);
  EXPECT_EQ(round_to_unorm<255>(splat_lanes(7.0F))[0], 1.0F);
  EXPECT_EQ(round_to_unorm<255>(splat_lanes(HUGE_VALF))[0], 1.0F);
  EXPECT_EQ(round_to_unorm<255>(splat_lanes(std::nanf("")))[0], 0.0F);
  EXPECT_EQ(truncate_to_unorm<255>(splat_lanes(std::nanf("")))[0], 0.0F);
}

TEST(Unorm16, AllStoredValuesStay) {
  for (int level = 0; level < 65536; ++level) {
    const float value = static_cast<float>(level) / 65535.0F;
    ASSERT_EQ(round_to_unorm<65535>(splat_lanes(value))[0], value);
    ASSERT_EQ(truncate_to_unorm<65535>(splat_lanes(value))[0], value);
  }
}

TEST(Unorm16, RoundsToTheNearestLevelAndClamps) {
  for (int level = 0; level < 65535; ++level) {
    // D3D11.3 allows 0.6 levels; single precision can say n + 1/2 within 2^-8.
    const auto at = [&](double part) { return splat_lanes(static_cast<float>((level + part) / 65535.0)); };
    ASSERT_EQ(round_to_unorm<65535>(at(0.49))[0], static_cast<float>(level) / 65535.0F);
    ASSERT_EQ(round_to_unorm<65535>(at(0.51))[0], static_cast<float>(level + 1) / 65535.0F);
    ASSERT_EQ(truncate_to_unorm<65535>(at(0.98))[0], static_cast<float>(level) / 65535.0F);
  }
  EXPECT_EQ(round_to_unorm<65535>(splat_lanes(-3.0F))[0], 0.0F);
  EXPECT_EQ(round_to_unorm<65535>(splat_lanes(HUGE_VALF))[0], 1.0F);
  EXPECT_EQ(round_to_unorm<65535>(splat_lanes(std::nanf("")))[0], 0.0F);
}

TEST(Unorm16, BlendsOfStoredValuesAreTheExactOnesWhereNoTieIsNear) {
  const BlendFunction blend = blend_function(ColorFormat::rgba16, BlendRounding::rne);
  for (std::uint64_t i = 0; i < 300'000; ++i) {
    const auto alpha = static_cast<std::int64_t>(mix(3 * i) % 65536);
    const auto source = static_cast<std::int64_t>(mix(3 * i + 1) % 65536);
    const auto as_float = [](std::int64_t level) { return static_cast<float>(level) / 65535.0F; };
    const QuadColor result = blend(color_of(0, 0, 0, as_float(alpha)), color_of(0, 0, 0, as_float(source)));
    // In levels, times 65535: exact in 64 bits.
    const std::int64_t exact = alpha * 65535 + (65535 - alpha) * source;
    const std::int64_t rest = exact % 65535;
    if (std::abs(2 * rest - 65535) < 2 * 65535 / 100) continue;
    ASSERT_EQ(result.alpha[0], as_float((exact + 32767) / 65535)) << alpha << ' ' << source;
  }
}

TEST(Unorm8, AllBlendsOfStoredValuesAreTheIntegerFormula) {
  const BlendFunction blend = blend_function(ColorFormat::rgba8, BlendRounding::rne);
  const auto level_of = [](float value) { return static_cast<int>(std::lround(value * 255.0F)); };
  for (int alpha = 0; alpha < 256; ++alpha) {
    for (int source = 0; source < 256; ++source) {
      // The four colour values of a run are checked in the four lanes.
      for (int color = 0; color < 256; color += 51) {
        const QuadColor destination =
            color_of(static_cast<float>(color) / 255.0F, 0, 0, static_cast<float>(alpha) / 255.0F);
        const auto s = static_cast<float>(source) / 255.0F;
        const QuadColor result = blend(destination, color_of(s, 0, 0, s));
        const int product = (2 * (255 - alpha) * source + 255) / 510;  // 255 is odd: no ties
        ASSERT_EQ(level_of(result.alpha[0]), alpha + product);
        ASSERT_EQ(level_of(result.red[0]), std::min(color + product, 255));
        ASSERT_EQ(result.alpha[0], static_cast<float>(alpha + product) / 255.0F);
      }
    }
  }
}

// case B01
TEST(BlendBits, StreamsOfOne255thFreezeAtTheirKnownPatterns) {
  constexpr float alpha = 1.0F / 255.0F;
  Stack nearest(ColorFormat::rgba16f, BlendRounding::rne);
  nearest.add(alpha, 0, 675);
  EXPECT_LT(half_bits(nearest.alpha()), 0x3B81);
  nearest.add(alpha, 0, 1);
  EXPECT_EQ(half_bits(nearest.alpha()), 0x3B81);
  nearest.add(alpha, 0, 99'324);
  EXPECT_EQ(half_bits(nearest.alpha()), 0x3B81);

  Stack truncated(ColorFormat::rgba16f, BlendRounding::rtz);
  truncated.add(alpha, 0, 100'000);
  EXPECT_EQ(half_bits(truncated.alpha()), 0x3B02);

  Stack unorm(ColorFormat::rgba8, BlendRounding::rne);
  unorm.add(alpha, 0, 127);
  EXPECT_EQ(unorm.alpha(), 127.0F / 255.0F);
  unorm.add(alpha, 0, 99'873);
  EXPECT_EQ(unorm.alpha(), 128.0F / 255.0F);

  Stack single(ColorFormat::rgba32f, BlendRounding::rne);
  single.add(alpha, 0, 1405);
  EXPECT_LT(single.alpha(), 0.996F);
  single.add(alpha, 0, 1);
  EXPECT_GE(single.alpha(), 0.996F);
}

// case B02
TEST(BlendBits, TheSmallestAlphaThatTerminatesIsThatOfTheFormatsRounding) {
  EXPECT_TRUE(terminates(ColorFormat::rgba16f, BlendRounding::rne, 1.0F / 18.0F));
  EXPECT_FALSE(terminates(ColorFormat::rgba16f, BlendRounding::rne, 1.0F / 18.0F - 0x1p-16F));
  EXPECT_TRUE(terminates(ColorFormat::rgba16f, BlendRounding::rtz, 1.0F / 9.0F));
  EXPECT_FALSE(terminates(ColorFormat::rgba16f, BlendRounding::rtz, 1.0F / 9.0F - 0x1p-12F));
  EXPECT_TRUE(terminates(ColorFormat::rgba8, BlendRounding::rne, 0.25F));
  EXPECT_FALSE(terminates(ColorFormat::rgba8, BlendRounding::rne, 0.25F - 0x1p-12F));
  EXPECT_TRUE(terminates(ColorFormat::srgb8, BlendRounding::rne, 0.25F)) << "its alpha is linear";
  EXPECT_FALSE(terminates(ColorFormat::srgb8, BlendRounding::rne, 0.25F - 0x1p-12F));
}

// case B02
TEST(BlendBits, OfUnorm16EveryAlphaThatSurvivesPruningTerminates) {
  // The last level below 0.996 is 65272, and it is left if (1 - 65272/65535) alpha is half a level.
  constexpr float least = 0.5F / 263.0F;
  EXPECT_NEAR(least, 0.0019, 1e-5);
  EXPECT_TRUE(terminates(ColorFormat::rgba16, BlendRounding::rne, 1.02F * least));
  EXPECT_FALSE(terminates(ColorFormat::rgba16, BlendRounding::rne, 0.98F * least));
  EXPECT_TRUE(terminates(ColorFormat::rgba16, BlendRounding::rne, 1.0F / 255.0F));
  EXPECT_TRUE(terminates(ColorFormat::rgba16, BlendRounding::rtz, 2.04F * least));
  EXPECT_FALSE(terminates(ColorFormat::rgba16, BlendRounding::rtz, 1.96F * least));
  EXPECT_TRUE(terminates(ColorFormat::rgba16, BlendRounding::rtz, 1.0F / 255.0F)) << "just: 1 of 255 is 1.03 levels";
}

// case B02
TEST(BlendBits, RoundingTwiceIsPartOfTheBlender) {
  // In single precision 2039/2048 + (9/2048) alpha is a tie, and goes to the even 2040; exactly it is just below.
  Stack stack(ColorFormat::rgba16f, BlendRounding::rne);
  stack.add(1.0F / 18.0F - 0x1p-20F, 0, 5000);
  EXPECT_EQ(stack.alpha(), 2040.0F / 2048.0F);
}

// case B02
TEST(BlendBits, EveryBlendIsSinglePrecisionMultiplyAddAndOneRounding) {
  const BlendFunction blend = blend_function(ColorFormat::rgba16f, BlendRounding::rne);
  for (unsigned half = 0; half <= 0x3c00; half += 7) {
    const float destination = half_value(static_cast<std::uint16_t>(half));
    for (unsigned k = 1; k < 255; k += 3) {
      const float source = static_cast<float>(k) / 255.0F;
      const volatile float transmittance = 1.0F - destination;
      const volatile float product = transmittance * source;
      const volatile float sum = destination + product;
      ASSERT_EQ(blend(color_of(0, 0, 0, destination), color_of(0, 0, 0, source)).alpha[0], round_to_half(sum));
    }
  }
}

// case B03
TEST(BlendBits, TheFirstStoredAlphaThatPassesTheThreshold) {
  EXPECT_GE(half_value(0x3BF8), 0.996F);
  EXPECT_LT(half_value(0x3BF7), 0.996F);
  EXPECT_GE(254.0F / 255.0F, 0.996F);
  EXPECT_LT(253.0F / 255.0F, 0.996F);
}

// case B04
TEST(BlendBits, AStuckAlphaLeaksColourByTheKnownAmounts) {
  const unsigned counts[] = {200, 800, 3200};
  const double leaks[] = {0.0389, 0.157, 0.50};
  for (unsigned i = 0; i < 3; ++i) {
    Stack stack(ColorFormat::rgba16f, BlendRounding::rne);
    stack.add(0.99F, 0, 1);
    stack.add(0.02F, 1, counts[i]);
    EXPECT_EQ(half_bits(stack.alpha()), 0x3BEC);
    EXPECT_NEAR(static_cast<double>(stack.grey()), leaks[i], 0.02 * leaks[i]);
  }
  Stack stack(ColorFormat::rgba16f, BlendRounding::rne);
  stack.add(0.99F, 0, 1);
  stack.add(0.05F, 1, 1000);
  EXPECT_EQ(half_bits(stack.alpha()), 0x3BF6);
}

// case B04
TEST(BlendBits, OfUnorm16AlphaGoesOnAndColourLeaksNothingOverThousandsOfLayers) {
  for (const unsigned count : {200U, 800U, 3200U, 20'000U}) {
    Stack stack(ColorFormat::rgba16, BlendRounding::rne);
    stack.add(0.99F, 0, 1);
    stack.add(0.02F, 1, count);
    const double exact = 0.01 * (1 - std::pow(0.98, count));
    // Both stop where half a level is left: 25 levels of alpha below 1.
    EXPECT_NEAR(static_cast<double>(stack.grey()), exact, 26.0 / 65535.0);
    EXPECT_NEAR(static_cast<double>(stack.alpha()), 0.99 + exact, 26.0 / 65535.0);
    EXPECT_EQ(stack.alpha() >= 0.996F, count >= 200);
  }
}

TEST(BlendBits, OfSrgbDarkColoursLeakWhereLinearOnesAreLost) {
  // Behind an alpha of 0.99, white at 0.02 adds 0.0002: less than half a level of UNORM8, and more than half of sRGB's first, 0.0003.
  for (const auto& [format, grows] : {std::pair{ColorFormat::rgba8, false}, {ColorFormat::srgb8, true}}) {
    Stack stack(format, BlendRounding::rne);
    stack.add(0.99F, 0, 1);
    stack.add(0.02F, 1, 800);
    EXPECT_EQ(stack.grey() > 0, grows) << name_of(format);
    EXPECT_LT(stack.grey(), 0.01F) << "a level is soon wider than twice that";
  }
}

TEST(Blend, UnormTargetsSaturateAndKeepTheirAlpha) {
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16, ColorFormat::srgb8}) {
    for (const BlendRounding rounding : roundings) {
      Stack stack(format, rounding);
      stack.add(0.5F, 4.0F, 20);
      EXPECT_EQ(stack.grey(), 1.0F) << name_of(format);
      EXPECT_LE(stack.alpha(), 1.0F) << name_of(format);
      EXPECT_GE(stack.alpha(), 0.98F) << name_of(format);
    }
  }
}

// case B05
TEST(Blend, AlphaNeverFallsAndNeverPassesOne) {
  for (const BlendRounding rounding : roundings) {
    const BlendFunction blend = blend_function(ColorFormat::rgba16f, rounding);
    for (unsigned half = 0; half <= 0x3c00; ++half) {
      const float destination = half_value(static_cast<std::uint16_t>(half));
      for (unsigned k = 0; k < 256; k += 4) {
        const Lanes source = Lanes{static_cast<float>(k), static_cast<float>(k + 1), static_cast<float>(k + 2),
                                   static_cast<float>(k + 3)} /
                             255.0F;
        QuadColor fragment{};
        fragment.alpha = source;
        const Lanes alpha = blend(color_of(0, 0, 0, destination), fragment).alpha;
        for (int lane = 0; lane < 4; ++lane) {
          ASSERT_GE(alpha[lane], destination);
          ASSERT_LE(alpha[lane], 1.0F);
        }
      }
    }
  }
}

// case B06
TEST(Blend, TheLargestColourStaysFinite) {
  for (const BlendRounding rounding : roundings) {
    Stack stack(ColorFormat::rgba16f, rounding);
    stack.add(0.99F, half_max, 50);
    EXPECT_LE(stack.grey(), half_max);
  }
}

// case B07
TEST(Blend, AnOpaquePixelTakesNothingMore) {
  for (const ColorFormat format : color_formats) {
    Stack stack(format, BlendRounding::rne);
    stack.pixel = color_of(0.5F, 0.25F, 0.125F, 1.0F);
    const QuadColor before = stack.pixel = stack.blend(stack.pixel, QuadColor{});
    stack.add(0.99F, half_max, 3);
    EXPECT_EQ(std::memcmp(&before, &stack.pixel, sizeof before), 0) << name_of(format);
  }
}

// case B08
TEST(Blend, IsWithinTheConformanceToleranceOfExactBlending) {
  // Of sRGB as of UNORM8: where a level is widest, at white, it is 2.3 of these.
  const std::pair<ColorFormat, double> tolerances[] = {{ColorFormat::rgba8, 4.0 / 255.0},
                                                       {ColorFormat::srgb8, 4.0 / 255.0},
                                                       {ColorFormat::rgba16f, 0.005},
                                                       {ColorFormat::rgba16, 4.0 / 65535.0},
                                                       {ColorFormat::rgba32f, 1e-5}};
  for (const auto& [format, tolerance] : tolerances) {
    const BlendFunction blend = blend_function(format, BlendRounding::rne);
    for (std::uint64_t i = 0; i < 20'000; ++i) {
      const QuadColor destination =
          blend(QuadColor{}, color_of(testing::uniform(1, 8 * i, 0, 1), 0, 0, testing::uniform(1, 8 * i + 1, 0, 1)));
      const float red = testing::uniform(1, 8 * i + 2, 0, 1);
      const float alpha = testing::uniform(1, 8 * i + 3, 0, 1);
      const QuadColor result = blend(destination, color_of(red, 0, 0, alpha));
      const double exact = static_cast<double>(destination.red[0]) +
                           (1.0 - static_cast<double>(destination.alpha[0])) * static_cast<double>(red);
      ASSERT_NEAR(static_cast<double>(result.red[0]), std::fmin(exact, static_cast<double>(largest_color_of(format))),
                  tolerance);
    }
  }
}

// case B09
TEST(Blend, GreyStaysGrey) {
  for (const ColorFormat format : color_formats) {
    for (const BlendRounding rounding : roundings) {
      Stack stack(format, rounding);
      for (std::uint64_t i = 0; i < 500; ++i) {
        stack.add(testing::uniform(2, 2 * i, 0.004F, 0.2F), testing::uniform(2, 2 * i + 1, 0, 1), 1);
        ASSERT_EQ(stack.pixel.red[0], stack.pixel.green[0]);
        ASSERT_EQ(stack.pixel.red[0], stack.pixel.blue[0]);
      }
    }
  }
}

// case B11
TEST(Blend, IntoAClearedPixelAFragmentIsStoredAsItIs) {
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const float value = testing::uniform(3, i, 0, 1);
    EXPECT_EQ(
        blend_function(ColorFormat::rgba16f, BlendRounding::rne)(QuadColor{}, color_of(value, 0, 0, value)).red[0],
        round_to_half(value));
    EXPECT_EQ(
        blend_function(ColorFormat::rgba32f, BlendRounding::rne)(QuadColor{}, color_of(value, 0, 0, value)).red[0],
        value);
  }
}

// case B12
TEST(Blend, TheBackgroundThatAStuckAlphaLetsThroughIsBounded) {
  const auto let_through = [](ColorFormat format, BlendRounding rounding) {
    float most = 0;
    for (int k = 1; k <= 252; ++k) {
      Stack stack(format, rounding);
      stack.add(static_cast<float>(k) / 255.0F, 0, 3000);
      most = std::fmax(most, 1.0F - stack.alpha());
    }
    return most;
  };
  EXPECT_LE(let_through(ColorFormat::rgba16f, BlendRounding::rne), 0.0623F);
  EXPECT_GE(let_through(ColorFormat::rgba16f, BlendRounding::rne), 0.06F);
  EXPECT_LE(let_through(ColorFormat::rgba16f, BlendRounding::rtz), 0.1245F);
  EXPECT_LE(let_through(ColorFormat::rgba8, BlendRounding::rne), 0.5F);
}

// case B13
TEST(Blend, ColoursHalvedAnyNumberOfTimesGiveTheImageHalvedAsOften) {
  for (int k = 1; k <= 4; ++k) {
    Stack whole(ColorFormat::rgba16f, BlendRounding::rne);
    Stack scaled(ColorFormat::rgba16f, BlendRounding::rne);
    for (std::uint64_t i = 0; i < 200; ++i) {
      const float alpha = testing::uniform(4, 2 * i, 0.004F, 0.3F);
      const float grey = testing::uniform(4, 2 * i + 1, 0.5F, 1.0F);
      whole.add(alpha, grey, 1);
      scaled.add(alpha, std::ldexp(grey, -k), 1);
      ASSERT_EQ(std::ldexp(whole.grey(), -k), scaled.grey());
      ASSERT_EQ(whole.alpha(), scaled.alpha());
    }
  }
}

// case M07
TEST(FrontToBack, APairOf99PercentIsOpaqueInHalfAndTakesNothingMore) {
  const QuadColor fragment = color_of(0.99F * half_max, 0, 0, 0.99F);
  Stack stack(ColorFormat::rgba16f, BlendRounding::rne);
  stack.pixel = stack.blend(stack.pixel, blend_front_to_back(fragment, fragment));
  EXPECT_EQ(half_bits(stack.alpha()), 0x3C00);
  const float before = stack.grey();
  EXPECT_LE(before, half_max);
  stack.add(0.99F, half_max, 5);
  EXPECT_EQ(stack.grey(), before);
}

// case M09
TEST(FrontToBack, IsAssociativeWhereNothingIsRounded) {
  const auto dyadic = [](std::uint64_t i) { return static_cast<float>(mix(i) % 17) / 16.0F; };
  for (std::uint64_t i = 0; i < 4000; i += 4) {
    const QuadColor a = color_of(dyadic(i), dyadic(i + 1), 0, dyadic(i + 2));
    const QuadColor b = color_of(dyadic(i + 3), dyadic(i + 9), 1, dyadic(i + 5));
    const QuadColor c = color_of(dyadic(i + 6), dyadic(i + 7), 0.5F, dyadic(i + 8));
    const QuadColor left = blend_front_to_back(blend_front_to_back(a, b), c);
    const QuadColor right = blend_front_to_back(a, blend_front_to_back(b, c));
    ASSERT_EQ(std::memcmp(&left, &right, sizeof left), 0);
  }
}

// case Q02
TEST(FrontToBack, ADeadFragmentIsTheExactIdentityOnEitherSide) {
  const QuadColor nothing{};
  for (const ColorFormat format : color_formats) {
    const BlendFunction store = blend_function(format, BlendRounding::rne);
    for (std::uint64_t i = 0; i < 2000; ++i) {
      const QuadColor fragment =
          color_of(testing::uniform(5, 4 * i, 0, 1), testing::uniform(5, 4 * i + 1, 0, 2),
                   testing::uniform(5, 4 * i + 2, 0, 1), testing::uniform(5, 4 * i + 3, 0, 0.99F));
      const QuadColor before = blend_front_to_back(nothing, fragment);
      const QuadColor behind = blend_front_to_back(fragment, nothing);
      ASSERT_EQ(std::memcmp(&before, &fragment, sizeof fragment), 0);
      ASSERT_EQ(std::memcmp(&behind, &fragment, sizeof fragment), 0);
      const QuadColor stored = store(nothing, fragment);
      const QuadColor again = store(stored, nothing);
      ASSERT_EQ(std::memcmp(&stored, &again, sizeof stored), 0);
    }
  }
}

// case Q08
TEST(FrontToBack, IsWithinItsArithmeticErrorOfDouble) {
  for (std::uint64_t i = 0; i < 20'000; ++i) {
    const double front_alpha = static_cast<double>(testing::uniform(6, 4 * i, 0, 1));
    const double front = static_cast<double>(testing::uniform(6, 4 * i + 1, 0, 1));
    const float back_alpha = testing::uniform(6, 4 * i + 2, 0, 0.99F);
    const float grey = testing::uniform(6, 4 * i + 3, 0, 1);
    const QuadColor result =
        blend_front_to_back(color_of(static_cast<float>(front), 0, 0, static_cast<float>(front_alpha)),
                            color_of(back_alpha * grey, 0, 0, back_alpha));
    const double exact = front + (1.0 - front_alpha) * static_cast<double>(back_alpha) * static_cast<double>(grey);
    ASSERT_NEAR(static_cast<double>(result.red[0]), exact, 4 * 0x1p-24 * std::fmax(1.0, exact));
  }
}

TEST(BlendFunctions, RoundingAsMeasuredIsRefusedForFormatsThatNobodyHasMeasured) {
  for (const ColorFormat format : color_formats) {
    if (is_measured(format)) {
      EXPECT_NE(blend_function(format, BlendRounding::measured), nullptr);
      continue;
    }
    try {
      blend_function(format, BlendRounding::measured);
      ADD_FAILURE() << name_of(format);
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find(name_of(format)), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("measured"), std::string::npos) << error.what();
    }
  }
}

TEST(ColorFormatNames, ThoseThatCannotBlendFrontToBackSayWhy) {
  EXPECT_EQ(color_format_named("rgba8"), ColorFormat::rgba8);
  EXPECT_EQ(color_format_named("rgba16f"), ColorFormat::rgba16f);
  EXPECT_EQ(color_format_named("rgba32f"), ColorFormat::rgba32f);
  EXPECT_EQ(color_format_named("rgba16"), ColorFormat::rgba16);
  EXPECT_EQ(color_format_named("srgb8"), ColorFormat::srgb8);
  for (const char* name : {"rgb10a2", "r11g11b10f", "rgba64f"}) {
    try {
      color_format_named(name);
      ADD_FAILURE() << name;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos);
      EXPECT_NE(std::string(error.what()).find("rgba16f"), std::string::npos);
    }
  }
}

/// Over one block of measured blends: source, destination and result, as a real GPU wrote them.
double share_of_exact_channels(std::istream& file, ColorFormat format) {
  std::int32_t count = 0;
  file.read(reinterpret_cast<char*>(&count), sizeof count);
  std::vector<float> block[3];
  for (auto& values : block) {
    values.resize(4 * static_cast<std::size_t>(count));
    file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(float)));
  }
  const auto pixel = [](const std::vector<float>& v, std::size_t i) {
    return color_of(v[4 * i], v[4 * i + 1], v[4 * i + 2], v[4 * i + 3]);
  };
  const BlendFunction blend = blend_function(format, BlendRounding::measured);
  std::size_t exact = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const QuadColor got = blend(pixel(block[1], i), pixel(block[0], i));
    const QuadColor want = pixel(block[2], i);
    exact += (got.red[0] == want.red[0]) + (got.green[0] == want.green[0]) + (got.blue[0] == want.blue[0]) +
             (got.alpha[0] == want.alpha[0]);
  }
  return static_cast<double>(exact) / (4.0 * count);
}

TEST(MeasuredBlending, IsThatOfARealGpuBitForBitNearlyEverywhere) {
  std::istringstream file(testing::unpacked("measured_blends.bin"));
  EXPECT_GE(share_of_exact_channels(file, ColorFormat::rgba16f), 0.998);
  EXPECT_GE(share_of_exact_channels(file, ColorFormat::rgba8), 0.9999);
}

}  // namespace
}  // namespace vrpipe
