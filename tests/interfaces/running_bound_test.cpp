// The running bound (docs/numerics.md, F4) against blends in double of the same fragments, in every format and rounding.
#include <vrpipe/arithmetic/running_bound.h>

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::color_of;
using testing::uniform;

/// Kinds of streams: everything; low alphas, which stick; bright colours, which saturate; nearly opaque.
struct Stream {
  float least_alpha, largest_alpha, largest_color;
};
constexpr Stream streams[] = {{1.0F / 255.0F, 0.99F, 1.0F},
                              {1.0F / 255.0F, 0.03F, 1.0F},
                              {0.01F, 0.4F, 4.0F},
                              {0.9F, 0.99F, 1.0F}};

class RunningBounds : public ::testing::TestWithParam<std::tuple<ColorFormat, BlendRounding, bool>> {};
INSTANTIATE_TEST_SUITE_P(Formats, RunningBounds,
                         ::testing::Combine(::testing::ValuesIn(color_formats),
                                            ::testing::Values(BlendRounding::rne, BlendRounding::rtz,
                                                              BlendRounding::measured),
                                            ::testing::Bool()));

TEST_P(RunningBounds, HoldForEveryPrefixOfAStream) {
  const auto [format, rounding, merges] = GetParam();
  if (!can_round(format, rounding)) GTEST_SKIP() << "refused";
  const BlendFunction blend = blend_function(format, rounding);
  const auto most = static_cast<double>(largest_color_of(format));
  double tightest = 0;  // error over bound
  for (std::uint64_t trial = 0; trial < 200; ++trial) {
    const Stream& stream = streams[trial % 4];
    const RunningBound running(format, rounding, merges);
    PixelBound bound;
    QuadColor pixel{};
    QuadColor waiting{};
    double color = 0;
    double alpha = 0;
    for (std::uint64_t i = 0; i < 600; ++i) {
      const float of_fragment = uniform(trial, 2 * i, stream.least_alpha, stream.largest_alpha);
      const float grey = of_fragment * uniform(trial, 2 * i + 1, 0, stream.largest_color);
      const QuadColor fragment = color_of(grey, 0, 0, of_fragment);
      const double before = alpha;
      alpha += (1 - before) * static_cast<double>(of_fragment);
      color += (1 - before) * static_cast<double>(grey);
      running.blended(bound, static_cast<double>(of_fragment), static_cast<double>(grey), before, alpha, color);
      if (merges && i % 2 == 0) {
        waiting = fragment;
        continue;
      }
      pixel = blend(pixel, merges ? blend_front_to_back(waiting, fragment) : fragment);
      const double off_color = std::fabs(static_cast<double>(pixel.red[0]) - std::min(color, most));
      const double off_alpha = std::fabs(static_cast<double>(pixel.alpha[0]) - alpha);
      ASSERT_LE(off_color, bound.color) << trial << ' ' << i;
      ASSERT_LE(off_alpha, bound.alpha) << trial << ' ' << i;
      tightest = std::max({tightest, off_color / bound.color, off_alpha / bound.alpha});
    }
  }
  EXPECT_GT(tightest, rounding == BlendRounding::measured || format == ColorFormat::rgba32f ? 0.1 : 0.3)
      << "a bound that says nothing";
}

TEST(RunningBound, TakesInWhatTheShaderIsOff) {
  // A shader that is always off by as much as it says, in the direction that hurts.
  const RunningBound running(ColorFormat::rgba32f, BlendRounding::rne, false);
  const BlendFunction blend = blend_function(ColorFormat::rgba32f, BlendRounding::rne);
  for (const float off : {1e-4F, -1e-4F}) {
    PixelBound bound;
    QuadColor pixel{};
    double color = 0;
    double alpha = 0;
    for (int i = 0; i < 100; ++i) {
      pixel = blend(pixel, color_of(0.03F - off, 0, 0, 0.03F + off));
      const double before = alpha;
      alpha += (1 - before) * static_cast<double>(0.03F);
      color += (1 - before) * static_cast<double>(0.03F);
      const FragmentBound sent{1.0001e-4, 1.0001e-4};
      running.blended(bound, static_cast<double>(0.03F), static_cast<double>(0.03F), before, alpha, color, sent);
      ASSERT_LE(std::fabs(static_cast<double>(pixel.red[0]) - color), bound.color) << i;
      ASSERT_LE(std::fabs(static_cast<double>(pixel.alpha[0]) - alpha), bound.alpha) << i;
    }
    EXPECT_GT(std::fabs(static_cast<double>(pixel.red[0]) - color), 0.2 * bound.color);
  }
}

TEST(RoundingErrors, NeverFallAndAreAtLeastWhatStoringDoes) {
  for (const ColorFormat format : color_formats) {
    for (const BlendRounding rounding : {BlendRounding::rne, BlendRounding::rtz}) {
      const BlendFunction store = blend_function(format, rounding);
      double last = 0;
      for (int i = 0; i <= 4000; ++i) {
        const float value = static_cast<float>(i) / 4000.0F;
        const double error = color_rounding_error(format, rounding, static_cast<double>(value));
        EXPECT_GE(error, last - 0x1p-24) << name_of(format) << ' ' << value;
        last = error;
        const QuadColor stored = store(QuadColor{}, color_of(value, 0, 0, value));
        constexpr double arithmetic = 4 * 0x1p-24;
        EXPECT_LE(std::fabs(static_cast<double>(stored.red[0]) - static_cast<double>(value)), error + arithmetic);
        EXPECT_LE(std::fabs(static_cast<double>(stored.alpha[0]) - static_cast<double>(value)),
                  alpha_rounding_error(format, rounding, static_cast<double>(value)) + arithmetic);
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
