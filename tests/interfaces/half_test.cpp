#include <vrpipe/arithmetic/half.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace vrpipe {
namespace {

/// Value of the bits of a binary16, from its definition.
double value_of(unsigned half) {
  const double sign = (half & 0x8000U) != 0 ? -1.0 : 1.0;
  const int exponent = static_cast<int>((half >> 10) & 31U);
  const double fraction = half & 0x3ffU;
  if (exponent == 31) return fraction == 0 ? sign * HUGE_VAL : std::nan("");
  return sign * (exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024 + fraction, exponent - 25));
}

double quantum_of(double magnitude) {
  int exponent = 0;
  std::frexp(magnitude, &exponent);
  return std::ldexp(1.0, std::max(exponent - 11, -24));
}

double nearest_half(double value) {
  if (std::isinf(value)) return value;
  const double magnitude = std::fabs(value);
  const double quantum = quantum_of(magnitude);
  const double rounded = std::nearbyint(magnitude / quantum) * quantum;
  return std::copysign(rounded > 65504 ? HUGE_VAL : rounded, value);
}

double truncated_half(double value) {
  if (std::isinf(value)) return std::copysign(65504.0, value);
  const double magnitude = std::fabs(value);
  const double quantum = quantum_of(magnitude);
  return std::copysign(std::fmin(std::floor(magnitude / quantum) * quantum, 65504.0), value);
}

std::uint32_t bits_of_float(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// Every half, the midpoint to the next one, and the floats on both sides of each; of both signs.
std::vector<float> halves_midpoints_and_neighbours() {
  std::vector<float> values;
  for (unsigned half = 0; half < 0x7c00; ++half) {
    const double value = value_of(half);
    const double next = half == 0x7bff ? 65536.0 : value_of(half + 1);
    for (const double point : {value, (value + next) / 2}) {
      const auto exact = static_cast<float>(point);
      for (const float f : {std::nextafter(exact, -1.0F), exact, std::nextafter(exact, 1e30F)}) {
        values.push_back(f);
        values.push_back(-f);
      }
    }
  }
  for (const float f :
       {65535.0F, 65536.0F, 1e6F, 3.4e38F, 1e-40F, 1e-45F, 5.9e-8F, std::numeric_limits<float>::infinity()}) {
    values.push_back(f);
    values.push_back(-f);
  }
  return values;
}

TEST(Half, AllBitPatternsHaveTheValueOfTheirDefinition) {
  for (unsigned half = 0; half < 0x10000; ++half) {
    const double expected = value_of(half);
    const float value = half_value(static_cast<std::uint16_t>(half));
    if (std::isnan(expected)) {
      ASSERT_TRUE(std::isnan(value)) << half;
    } else {
      ASSERT_EQ(static_cast<double>(value), expected) << half;
      ASSERT_EQ(std::signbit(value), std::signbit(expected)) << half;
    }
  }
}

TEST(Half, AllBitPatternsComeBackFromTheirValue) {
  for (unsigned half = 0; half < 0x10000; ++half) {
    const std::uint16_t back = half_bits(half_value(static_cast<std::uint16_t>(half)));
    const bool is_nan = (half & 0x7fffU) > 0x7c00U;
    ASSERT_EQ(back, is_nan ? (half & 0x8000U) | 0x7e00U : half);
  }
}

TEST(Half, RoundingIsToNearestEvenAtEveryHalfMidpointAndNeighbour) {
  for (const float value : halves_midpoints_and_neighbours()) {
    ASSERT_EQ(bits_of_float(round_to_half(value)), bits_of_float(static_cast<float>(nearest_half(value)))) << value;
  }
}

TEST(Half, TruncationIsTowardsZeroAtEveryHalfMidpointAndNeighbour) {
  for (const float value : halves_midpoints_and_neighbours()) {
    ASSERT_EQ(bits_of_float(truncate_to_half(splat_lanes(value))[0]),
              bits_of_float(static_cast<float>(truncated_half(value))))
        << value;
  }
}

TEST(Half, RoundingIsTheOracleOverAllExponentsOfFloat) {
  for (std::uint32_t bits = 0; bits < 0x7f800000U; bits += 4999) {
    float value;
    std::memcpy(&value, &bits, sizeof value);
    ASSERT_EQ(static_cast<double>(round_to_half(value)), nearest_half(value)) << value;
    ASSERT_EQ(static_cast<double>(truncate_to_half(splat_lanes(value))[0]), truncated_half(value)) << value;
  }
}

TEST(Half, NotANumberStaysOne) {
  EXPECT_TRUE(std::isnan(round_to_half(std::nanf(""))));
  EXPECT_TRUE(std::isnan(truncate_to_half(splat_lanes(std::nanf("")))[0]));
}

TEST(Half, TheProcessorsRoundingHasTheBitsOfTheIntegersOne) {
  std::vector<float> values = halves_midpoints_and_neighbours();
  for (std::uint64_t bits = 0; bits < 0x100000000ULL; bits += 4999) {
    const auto low = static_cast<std::uint32_t>(bits);
    std::memcpy(&values.emplace_back(), &low, sizeof low);
  }
  for (const std::uint32_t nan : {0x7f800001U, 0x7fc00000U, 0x7fffffffU, 0xffffffffU, 0xff801fffU}) {
    std::memcpy(&values.emplace_back(), &nan, sizeof nan);
  }
  for (const float value : values) {
    const Lanes lanes = splat_lanes(value);
    ASSERT_EQ(bits_of_float(round_to_half(lanes)[0]), bits_of_float(round_to_half_by_integers(lanes)[0]))
        << std::hex << bits_of_float(value);
  }
}

TEST(Half, EachOfAPairRoundsAsAlone) {
  const std::vector<float> values = halves_midpoints_and_neighbours();
  for (std::size_t i = 0; i + 8 <= values.size(); i += 8) {
    Lanes halves[2];
    std::memcpy(halves, &values[i], sizeof halves);
    const LanePair pair = join(halves[0], halves[1]);
    for (const auto& [wide, first, second] :
         {std::tuple(round_to_half(pair), round_to_half(halves[0]), round_to_half(halves[1])),
          std::tuple(round_to_half_by_integers(pair), round_to_half(halves[0]), round_to_half(halves[1])),
          std::tuple(truncate_to_half(pair), truncate_to_half(halves[0]), truncate_to_half(halves[1]))}) {
      const LanePair alone = join(first, second);
      ASSERT_EQ(std::memcmp(&wide, &alone, sizeof wide), 0) << values[i];
    }
  }
}

TEST(Half, OneTwoHundredFiftyFifthIsBelowItselfInHalf) { EXPECT_LT(round_to_half(1.0F / 255.0F), 1.0F / 255.0F); }

TEST(Half, EachLaneRoundsOnItsOwn) {
  const Lanes rounded = round_to_half(Lanes{0.1F, -2049.0F, 1e-8F, 70000.0F});
  EXPECT_EQ(rounded[0], round_to_half(0.1F));
  EXPECT_EQ(rounded[1], -2048.0F);
  EXPECT_EQ(rounded[2], 0.0F);
  EXPECT_TRUE(std::isinf(rounded[3]));
}

}  // namespace
}  // namespace vrpipe
