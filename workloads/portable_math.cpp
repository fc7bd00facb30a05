#include <vrpipe/workloads/portable_math.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace vrpipe {
namespace {

// ln 2 = high + low; high has 32 trailing zero bits, so k * high is exact for every exponent k.
constexpr double kLn2High = 6.93147180369123816490e-01;
constexpr double kLn2Low = 1.90821492927058770002e-10;
// pi/2 in three parts of 33 bits, so k * part is exact for |k| < 2^20.
constexpr double kHalfPi1 = 1.57079632673412561417e+00;
constexpr double kHalfPi2 = 6.07710050630396597660e-11;
constexpr double kHalfPi3 = 2.02226624879595063154e-21;

double from_bits(std::uint64_t bits) {
  double value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

std::uint64_t to_bits(double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// 2^exponent for a normal result.
double power_of_two(int exponent) { return from_bits(static_cast<std::uint64_t>(exponent + 1023) << 52); }

/// Sine by its series, |x| <= pi/4.
double sine_kernel(double x) {
  const double z = x * x;
  double sum = 1.0 / 355687428096000.0;  // 1 / 17!
  sum = -1.0 / 1307674368000.0 + z * sum;
  sum = 1.0 / 6227020800.0 + z * sum;
  sum = -1.0 / 39916800.0 + z * sum;
  sum = 1.0 / 362880.0 + z * sum;
  sum = -1.0 / 5040.0 + z * sum;
  sum = 1.0 / 120.0 + z * sum;
  sum = -1.0 / 6.0 + z * sum;
  return x + x * z * sum;
}

/// Cosine by its series, |x| <= pi/4.
double cosine_kernel(double x) {
  const double z = x * x;
  double sum = 1.0 / 20922789888000.0;  // 1 / 16!
  sum = -1.0 / 87178291200.0 + z * sum;
  sum = 1.0 / 479001600.0 + z * sum;
  sum = -1.0 / 3628800.0 + z * sum;
  sum = 1.0 / 40320.0 + z * sum;
  sum = -1.0 / 720.0 + z * sum;
  sum = 1.0 / 24.0 + z * sum;
  return 1.0 - (0.5 * z - z * z * sum);
}

/// The sine of angle + quarters * pi/2.
double sine_from(double angle, int quarters) {
  const double k = std::floor(angle * (2.0 / kPi) + 0.5);
  const double x = ((angle - k * kHalfPi1) - k * kHalfPi2) - k * kHalfPi3;
  switch ((static_cast<std::int64_t>(k) + quarters) & 3) {
    case 0: return sine_kernel(x);
    case 1: return cosine_kernel(x);
    case 2: return -sine_kernel(x);
    default: return -cosine_kernel(x);
  }
}

}  // namespace

double portable_exp(double x) {
  if (!(x == x)) return x;
  if (x > 709.782712893384) return std::numeric_limits<double>::infinity();
  if (x < -745.14) return 0.0;
  const double k = std::floor(x * (1.0 / (kLn2High + kLn2Low)) + 0.5);
  const double r = (x - k * kLn2High) - k * kLn2Low;  // |r| <= ln(2) / 2
  double sum = 1.0 / 87178291200.0;                   // 1 / 14!
  sum = 1.0 / 6227020800.0 + r * sum;
  sum = 1.0 / 479001600.0 + r * sum;
  sum = 1.0 / 39916800.0 + r * sum;
  sum = 1.0 / 3628800.0 + r * sum;
  sum = 1.0 / 362880.0 + r * sum;
  sum = 1.0 / 40320.0 + r * sum;
  sum = 1.0 / 5040.0 + r * sum;
  sum = 1.0 / 720.0 + r * sum;
  sum = 1.0 / 120.0 + r * sum;
  sum = 1.0 / 24.0 + r * sum;
  sum = 1.0 / 6.0 + r * sum;
  sum = 0.5 + r * sum;
  const double mantissa = 1.0 + (r + r * r * sum);
  // In two steps, as the power alone may be outside the range of normal numbers.
  const int exponent = static_cast<int>(k);
  const int half = exponent / 2;
  return mantissa * power_of_two(half) * power_of_two(exponent - half);
}

double portable_log(double x) {
  if (!(x == x) || x < 0) return std::numeric_limits<double>::quiet_NaN();
  if (x == 0) return -std::numeric_limits<double>::infinity();
  if (x > std::numeric_limits<double>::max()) return x;
  int exponent = 0;
  if (x < std::numeric_limits<double>::min()) {
    x *= 18014398509481984.0;  // 2^54: out of the denormal range
    exponent = -54;
  }
  std::uint64_t bits = to_bits(x);
  exponent += static_cast<int>(bits >> 52) - 1023;
  bits = (bits & 0x000fffffffffffffu) | 0x3ff0000000000000u;
  double mantissa = from_bits(bits);  // in [1, 2)
  if (mantissa > 1.4142135623730951) {
    mantissa *= 0.5;
    ++exponent;
  }
  // ln(m) = 2 atanh((m - 1) / (m + 1)); the argument is at most 0.1716.
  const double f = mantissa - 1.0;
  const double s = f / (2.0 + f);
  const double z = s * s;
  double sum = 1.0 / 23.0;
  sum = 1.0 / 21.0 + z * sum;
  sum = 1.0 / 19.0 + z * sum;
  sum = 1.0 / 17.0 + z * sum;
  sum = 1.0 / 15.0 + z * sum;
  sum = 1.0 / 13.0 + z * sum;
  sum = 1.0 / 11.0 + z * sum;
  sum = 1.0 / 9.0 + z * sum;
  sum = 1.0 / 7.0 + z * sum;
  sum = 1.0 / 5.0 + z * sum;
  sum = 1.0 / 3.0 + z * sum;
  const double k = exponent;
  return k * kLn2High + (2.0 * s + (2.0 * s * z * sum + k * kLn2Low));
}

double portable_sin(double angle) { return sine_from(angle, 0); }
double portable_cos(double angle) { return sine_from(angle, 1); }

double portable_tan_degrees(double degrees) {
  // From the nearer axis: the complement to 90 degrees is exact, that to pi/2 is not.
  const bool steep = degrees > 45.0;
  const double x = (steep ? 90.0 - degrees : degrees) * (kPi / 180.0);
  const double tangent = sine_kernel(x) / cosine_kernel(x);
  return steep ? 1.0 / tangent : tangent;
}

}  // namespace vrpipe
