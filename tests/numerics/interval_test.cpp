// What interval arithmetic proves. Its exponential and logarithm are not rounded outwards here, so each is widened.
#include <boost/numeric/interval.hpp>

#include <vrpipe/pipeline/registry.h>

#include "numerics_test_support.h"
#include "support/pixel_oracle.h"

namespace vrpipe {
namespace {

using namespace testing;
namespace bni = boost::numeric;
template <class T>
using Interval =
    bni::interval<T,
                  bni::interval_lib::policies<bni::interval_lib::rounded_math<T>, bni::interval_lib::checking_base<T>>>;

// case P08
TEST(Interval, ADeterminantOfDifferencesIsUndecidedWhereTheFactorFormIsCertain) {
  for (const float length : {3000.0F, 10000.0F}) {
    const float half = length * 0.70710678F;
    const Interval<float> m(half);
    const Interval<float> dilation(0.3F);
    const Interval<float> a = m * m + dilation;
    const Interval<float> d = m * m + dilation;
    const Interval<float> b = m * m;
    EXPECT_TRUE(zero_in(a * d - b * b)) << length;
    // |m1 x m2|^2 + e (|m1|^2 + |m2|^2) + e^2 of the rows (half, 0, 0) and (half, 0, 0).
    const Interval<float> factor = dilation * (m * m + m * m) + dilation * dilation;
    EXPECT_GT(factor.lower(), 0.0F);
    EXPECT_LT(width(factor) / factor.lower(), 1e-5F);
    const double determinant =
        covariance_determinant({static_cast<double>(half), 0, 0}, {static_cast<double>(half), 0, 0});
    EXPECT_GE(determinant, 0.999999 * static_cast<double>(factor.lower()));
    EXPECT_LE(determinant, 1.000001 * static_cast<double>(factor.upper()));
  }
}

// case O10
TEST(Interval, WithPaddingEverySampleThatIsCertainlyVisibleIsBlended) {
  constexpr std::uint64_t seed = 10;
  for (unsigned i = 0; i < 100; ++i) {
    const Splat splat = splat_at(uniform(seed, 8 * i, 4, 60), uniform(seed, 8 * i + 1, 4, 60),
                                 uniform(seed, 8 * i + 2, 0.55F, 9), uniform(seed, 8 * i + 3, 0.55F, 4),
                                 uniform(seed, 8 * i + 4, 0, 6), uniform(seed, 8 * i + 5, 0.005F, 1));
    const Draw draw = draw_of(64, 64, {splat});
    constexpr unsigned all_bits[] = {4, 8, 12};
    std::vector<decltype(fragments_of(context_of(draw)))> fragments;
    for (const unsigned bits : all_bits) {
      RenderContext context = context_of(draw);
      context.precision.subpixel_bits = bits;
      fragments.push_back(fragments_of(context));
    }
    for (std::uint32_t y = 0; y < 64; ++y) {
      for (std::uint32_t x = 0; x < 64; ++x) {
        using I = Interval<double>;
        const I dx = I(x) + I(0.5) - I(splat.cx);
        const I dy = I(y) + I(0.5) - I(splat.cy);
        const I det = I(splat.ax) * I(splat.by) - I(splat.ay) * I(splat.bx);
        const I u = (dx * I(splat.by) - dy * I(splat.bx)) * I(splat.r) / det;
        const I v = (dy * I(splat.ax) - dx * I(splat.ay)) * I(splat.r) / det;
        const I exponent = -(square(u) + square(v)) / 2.0;
        // 2^-20: the shader's single precision and its two ulp of exponential.
        const I weight =
            I(splat.opacity) * I(std::exp(exponent.lower()), std::exp(exponent.upper())) * I(1 - 0x1p-20, 1 + 0x1p-20);
        for (std::size_t k = 0; k < fragments.size(); ++k) {
          const bool blended = !fragments[k][std::size_t{y} * 64 + x].empty();
          if (weight.lower() >= static_cast<double>(one_255th)) {
            ASSERT_TRUE(blended) << i << " at " << x << "," << y << ", " << all_bits[k] << " bits";
          }
          if (weight.upper() < static_cast<double>(one_255th)) {
            ASSERT_FALSE(blended) << i << " at " << x << "," << y << ", " << all_bits[k] << " bits";
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
