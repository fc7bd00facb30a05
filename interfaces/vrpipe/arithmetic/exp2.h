#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <vrpipe/arithmetic/half.h>
#include <vrpipe/arithmetic/lanes.h>

namespace vrpipe {

/// The exponential of the fragment shader.
enum class Exponential : std::uint8_t { exact, ex2, fp16, table256, table16 };

/// 2^x for x <= 0 within 2 ulp, the accuracy of a GPU's ex2.approx; x below -126 gives 2^-126.
/// A polynomial of our own: libm's exp2 depends on whether the processor has FMA.
template <class Floats>
inline Floats exp2_nonpositive(Floats x) {
  x = select(x < -126.0F, Floats{} - 126.0F, x);
  // Adding 1.5 * 2^23 leaves the nearest integer in the low bits of the significand.
  const Floats shifted = x + 12582912.0F;
  const BitsOf<Floats> exponent = bits_of(shifted) - 0x4b400000;
  const Floats f = x - (shifted - 12582912.0F);
  // Cephes' minimax coefficients; Taylor's leave 2.9 ulp at f = -1/2.
  Floats p = f * 1.535336188319500e-4F + 1.339887440266574e-3F;
  p = p * f + 9.618437357674640e-3F;
  p = p * f + 5.550332471162809e-2F;
  p = p * f + 2.402264791363012e-1F;
  p = p * f + 6.931472028550421e-1F;
  p = p * f + 1.0F;
  return floats_of<Floats>(bits_of(p) + (exponent << 23));
}

/// 2^x for x <= 0, the double-precision value rounded to single: within 0.5001 ulp.
inline float exp2_exact(float x) {
  if (x < -126.0F) x = -126.0F;
  const double n = std::floor(static_cast<double>(x) + 0.5);
  const double f = (static_cast<double>(x) - n) * 0.6931471805599453;
  double term = 1.0;
  double sum = 1.0;
  // |f| <= 0.35: the 14th term is below 2^-56.
  for (int i = 1; i <= 14; ++i) {
    term *= f / i;
    sum += term;
  }
  return static_cast<float>(std::ldexp(sum, static_cast<int>(n)));
}

/// 2^x for x <= 0 from a table of 2^(-i / entries), the nearest entry taken.
template <int Entries>
inline float exp2_table(float x) {
  struct Table {
    float value[Entries];
    Table() {
      for (int i = 0; i < Entries; ++i) value[i] = exp2_exact(-static_cast<float>(i) / static_cast<float>(Entries));
    }
  };
  static const Table table;
  if (x < -126.0F) x = -126.0F;
  const auto steps = static_cast<int>(-x * static_cast<float>(Entries) + 0.5F);
  return std::ldexp(table.value[steps % Entries], -(steps / Entries));
}

/// The fragment shader's exponential, 2^x for x <= 0.
template <Exponential Kind, class Floats>
inline Floats shader_exp2(Floats x) {
  if constexpr (Kind == Exponential::ex2) return exp2_nonpositive(x);
  if constexpr (Kind == Exponential::fp16) return round_to_half(exp2_nonpositive(x));
  Floats result{};
  for (std::size_t lane = 0; lane < sizeof(Floats) / sizeof(float); ++lane) {
    if constexpr (Kind == Exponential::exact) result[lane] = exp2_exact(x[lane]);
    if constexpr (Kind == Exponential::table256) result[lane] = exp2_table<256>(x[lane]);
    if constexpr (Kind == Exponential::table16) result[lane] = exp2_table<16>(x[lane]);
  }
  return result;
}

}  // namespace vrpipe
