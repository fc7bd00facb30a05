#include <vrpipe/arithmetic/exp2.h>

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

namespace vrpipe {
namespace {

float exp2_of(float x) { return exp2_nonpositive(splat_lanes(x))[0]; }

double error_in_ulp(float x) {
  const long double exact = std::exp2(static_cast<long double>(x));
  int exponent = 0;
  std::frexp(exact, &exponent);
  const long double ulp = std::ldexp(1.0L, std::max(exponent - 24, -149));
  return static_cast<double>(std::fabs(static_cast<long double>(exp2_of(x)) - exact) / ulp);
}

// case Q06
TEST(Exp2, IsWithinTwoUlpFrom0ToMinus126) {
  double worst = 0;
  for (std::uint32_t i = 0; i <= 1'500'000; ++i) {
    const float x = -126.0F * static_cast<float>(i) / 1'500'000.0F;
    const double error = error_in_ulp(x);
    worst = std::fmax(worst, error);
    ASSERT_LE(error, 2.0) << x;
  }
  EXPECT_GT(worst, 0.5) << "the samples do not reach a hard one";
}

// case Q06
TEST(Exp2, IsWithinTwoUlpOverAllSmallExponents) {
  // Floats from 2^-40 to 16, evenly in their bits.
  for (std::uint32_t bits = 0x2b800000U; bits < 0x41800000U; bits += 211) {
    float x;
    std::memcpy(&x, &bits, sizeof x);
    ASSERT_LE(error_in_ulp(-x), 2.0) << -x;
  }
}

// case Q06
TEST(Exp2, NeverRisesByMoreThanAnUlpAsAFragmentMovesOutward) {
  float previous = 1.0F;
  for (std::uint32_t i = 0; i <= 1'000'000; ++i) {
    const float value = exp2_of(-8.0F * static_cast<float>(i) / 1'000'000.0F);
    ASSERT_LE(value, std::nextafter(previous, 2.0F)) << i;
    previous = value;
  }
}

template <Exponential Kind>
void expect_each_of_a_pair_as_alone() {
  for (int i = 0; i < 10'000; ++i) {
    const Lanes x = splat_lanes(-12.0F * static_cast<float>(i) / 10'000.0F) - Lanes{0, 0.003F, 0.07F, 130.0F};
    const Lanes y = x * 0.3F;
    const LanePair together = shader_exp2<Kind>(join(x, y));
    const LanePair alone = join(shader_exp2<Kind>(x), shader_exp2<Kind>(y));
    ASSERT_EQ(std::memcmp(&together, &alone, sizeof alone), 0) << i;
  }
}

// case Q06
TEST(ShaderExp2, GivesEachOfAPairTheBitsItHasAlone) {
  expect_each_of_a_pair_as_alone<Exponential::exact>();
  expect_each_of_a_pair_as_alone<Exponential::ex2>();
  expect_each_of_a_pair_as_alone<Exponential::fp16>();
  expect_each_of_a_pair_as_alone<Exponential::table256>();
  expect_each_of_a_pair_as_alone<Exponential::table16>();
}

template <Exponential Kind>
double worst_relative_error() {
  double worst = 0;
  for (int i = 0; i <= 100'000; ++i) {
    const float x = -8.0F * static_cast<float>(i) / 100'000.0F;  // alpha from 1 to 1/256
    const double exact = std::exp2(static_cast<double>(x));
    worst = std::fmax(worst, std::fabs(static_cast<double>(shader_exp2<Kind>(splat_lanes(x))[0]) - exact) / exact);
  }
  return worst;
}

// case Q06
TEST(ShaderExp2, EachVariantHasTheErrorOfItsMake) {
  EXPECT_LE(worst_relative_error<Exponential::exact>(), 0x1.01p-24);
  EXPECT_LE(worst_relative_error<Exponential::ex2>(), 2 * 0x1p-23);
  EXPECT_LE(worst_relative_error<Exponential::fp16>(), 1.01 * 0x1p-11);
  EXPECT_LE(worst_relative_error<Exponential::table256>(), 1.01 * std::log(2.0) / 512);  // half a step of the table
  EXPECT_LE(worst_relative_error<Exponential::table16>(), 1.03 * std::log(2.0) / 32);
  EXPECT_GT(worst_relative_error<Exponential::table256>(), worst_relative_error<Exponential::fp16>());
}

// case Q06
TEST(ShaderExp2, TablesNeverRiseAsAFragmentMovesOutward) {
  float previous[2] = {1, 1};
  for (int i = 0; i <= 200'000; ++i) {
    const Lanes x = splat_lanes(-10.0F * static_cast<float>(i) / 200'000.0F);
    const float now[2] = {shader_exp2<Exponential::table256>(x)[0], shader_exp2<Exponential::table16>(x)[0]};
    for (int k = 0; k < 2; ++k) {
      ASSERT_LE(now[k], previous[k]);
      previous[k] = now[k];
    }
  }
}

TEST(Exp2, WholePowersAreExact) {
  for (int n = 0; n <= 126; ++n) ASSERT_EQ(exp2_of(static_cast<float>(-n)), std::ldexp(1.0F, -n));
}

TEST(Exp2, FarBelowItStaysAtTheSmallestNormalNumber) {
  EXPECT_EQ(exp2_of(-127.0F), std::ldexp(1.0F, -126));
  EXPECT_EQ(exp2_of(-1e30F), std::ldexp(1.0F, -126));
  EXPECT_EQ(exp2_of(-HUGE_VALF), std::ldexp(1.0F, -126));
}

TEST(Exp2, IsNeverAboveOne) {
  for (std::uint32_t bits = 1; bits < 0x3f000000U; bits += 10007) {
    float x;
    std::memcpy(&x, &bits, sizeof x);
    ASSERT_LE(exp2_of(-x), 1.0F) << x;
  }
}

}  // namespace
}  // namespace vrpipe
