// Findings that decide how the pipeline computes; docs/numerics.md names them F1 to F13.
#include <algorithm>

#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/pipeline/geometry.h>

#include "numerics_test_support.h"
#include "support/pixel_oracle.h"

namespace vrpipe {
namespace {

using namespace testing;

/// Whether a pixel that gets fragments of one alpha is terminated at some time.
bool terminates(const char* variant, ColorFormat format, const char* rounding, double alpha) {
  const Draw draw = draw_of(1, 1, std::vector<Splat>(6000, flat_box(-4, -4, 4, 4, static_cast<float>(alpha))));
  return simulate(untimed(variant, format, {{"state", "blend_rounding", rounding}}), draw).counts.termination_updates >
         0;
}

TEST(Findings, F2MergingPairsHalvesTheAlphaThatTerminates) {
  struct Limit {
    ColorFormat format;
    const char* rounding;
    double alone;
    double merged;
  };
  for (const Limit& limit :
       {Limit{ColorFormat::rgba16f, "rne", 1.0 / 18, 0.0282}, Limit{ColorFormat::rgba16f, "rtz", 1.0 / 9, 0.0572},
        Limit{ColorFormat::rgba8, "rne", 0.25, 0.134}}) {
    EXPECT_TRUE(terminates("het", limit.format, limit.rounding, limit.alone * 1.005));
    EXPECT_FALSE(terminates("het", limit.format, limit.rounding, limit.alone * 0.995));
    EXPECT_NEAR(1 - std::sqrt(1 - limit.alone), limit.merged, 1e-4);
    EXPECT_TRUE(terminates("het+qm", limit.format, limit.rounding, limit.merged * 1.005));
    EXPECT_FALSE(terminates("het+qm", limit.format, limit.rounding, limit.merged * 0.99));
  }
}

TEST(Findings, F3WhatAStuckAlphaLeaksStaysWithinTheRunningBound) {
  std::vector<Splat> splats(801, flat_box(-4, -4, 4, 4, 0.02F, 1, 1, 1));
  splats[0] = flat_box(-4, -4, 4, 4, 0.99F, 0, 0, 0);
  const Draw draw = draw_of(1, 1, std::move(splats));
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
    RenderContext context = context_of(draw);
    context.format = format;
    const OraclePixel exact = blend_exactly(fragments_of(context).at(0), context);
    const std::array<float, 4> pixel = simulate(untimed("baseline", format), draw).framebuffer.color.pixel(0, 0);
    EXPECT_LE(std::fabs(static_cast<double>(pixel[0]) - exact.rgba[0]), exact.color_bound[0]);
    EXPECT_LE(exact.rgba[0], 0.0101);
    if (format == ColorFormat::rgba16f) {
      EXPECT_NEAR(pixel[0], 0.157, 0.005);
    }
  }
}

TEST(Findings, F5WithoutPaddingSnappingLosesFragmentsAndWithItNone) {
  constexpr std::uint64_t seed = 5;
  std::uint64_t lost[2] = {};
  std::uint64_t visible = 0;
  for (unsigned i = 0; i < 300; ++i) {
    const Splat splat = splat_at(uniform(seed, 8 * i, 8, 56), uniform(seed, 8 * i + 1, 8, 56),
                                 uniform(seed, 8 * i + 2, 0.55F, 6), uniform(seed, 8 * i + 3, 0.55F, 6),
                                 uniform(seed, 8 * i + 4, 0, 6), uniform(seed, 8 * i + 5, 0.01F, 1));
    const Draw draw = draw_of(64, 64, {splat});
    RenderContext context = context_of(draw);
    // Far too much, so that nothing is lost: which fragments there are to lose.
    context.precision.subpixel_bits = 4;
    testing::change_state(context, [&](DrawState& drawn) { drawn.obb_padding = 16; });
    const auto all = fragments_of(context);
    for (const bool padded : {false, true}) {
      testing::change_state(context, [&](DrawState& drawn) { drawn.obb_padding = padded ? 0.75F : 0.0F; });
      const auto kept = fragments_of(context);
      for (std::size_t pixel = 0; pixel < all.size(); ++pixel)
        lost[padded ? 1 : 0] += all[pixel].size() - kept[pixel].size();
    }
    for (const auto& list : all) visible += list.size();
  }
  EXPECT_GT(lost[0], 0U);
  EXPECT_LT(static_cast<double>(lost[0]), 0.002 * static_cast<double>(visible));
  EXPECT_EQ(lost[1], 0U);
}

TEST(Findings, F12MergingMakesLowPrecisionTargetsMoreAccurate) {
  const Draw draw = random_draw(96, 96, 1500, 12);
  RenderContext context = context_of(draw);
  const auto fragments = fragments_of(context);
  const auto squared_error = [&](const RunResult& result) {
    double sum = 0;
    for (std::uint32_t y = 0; y < 96; ++y) {
      for (std::uint32_t x = 0; x < 96; ++x) {
        const OraclePixel exact = blend_exactly(fragments[std::size_t{y} * 96 + x], context);
        for (unsigned i = 0; i < 3; ++i) {
          sum += std::pow(static_cast<double>(result.framebuffer.color.pixel(x, y)[i]) - exact.rgba[i], 2);
        }
      }
    }
    return sum;
  };
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f}) {
    EXPECT_LT(squared_error(simulate(untimed("qm", format), draw)),
              0.9 * squared_error(simulate(untimed("baseline", format), draw)));
  }
}

// case T09
TEST(Findings, TheTimeAxisHoldsTenToTheSixteenCycles) {
  class Once : public Clocked {
   public:
    explicit Once(ClockDomain& domain, Cycle at) : at_(at) { domain.attach(*this); }
    Cycle tick(Cycle now) override {
      last = now;
      return now < at_ ? at_ : never;
    }
    Cycle last = 0;

   private:
    const Cycle at_;
  };
  fresh_simulation();
  EXPECT_EQ(sc_core::sc_get_time_resolution(), sc_core::sc_time(1, sc_core::SC_PS));
  const double slowest =
      std::min_element(platforms().begin(), platforms().end(), [](const Platform& a, const Platform& b) {
        return a.frequency_mhz < b.frequency_mhz;
      })->frequency_mhz;
  const auto period = static_cast<std::uint64_t>(1e6 / slowest + 1);
  const Cycle latest = std::numeric_limits<std::uint64_t>::max() / period - 2;
  EXPECT_GT(latest, 10'000'000'000'000'000U);  // half a year of simulated time
  ClockDomain domain("clock", period);
  const Once once(domain, latest);
  sc_core::sc_start();
  EXPECT_EQ(once.last, latest);
}

}  // namespace
}  // namespace vrpipe
