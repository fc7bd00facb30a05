#pragma once

#include <cstdint>
#include <cstring>

#include <vrpipe/arithmetic/lanes.h>

namespace vrpipe {

/// IEEE binary16, as a register of the colour target holds it; arithmetic happens in float.
constexpr float half_max = 65504.0F;

/// Rounds what is left without the sign, given as bits, and gives the sign back.
template <class Floats, class Round>
inline Floats round_magnitude(Floats value, Round round) {
  const BitsOf<Floats> sign = bits_of(value) & (BitsOf<Floats>{} + INT32_MIN);
  return floats_of<Floats>(round(bits_of(value) & 0x7fffffff) | sign);
}

/// `round_to_half` for every processor.
template <class Floats>
inline Floats round_to_half_by_integers(Floats value) {
  using Bits = BitsOf<Floats>;
  return round_magnitude(value, [](Bits magnitude) {
    const Bits odd = (magnitude >> 13) & 1;
    const Bits normal = (magnitude + 0xfff + odd) & ~0x1fff;
    // Below 2^-14 the quantum is fixed at 2^-24, which is the ulp of floats in [0.5, 1).
    const Floats shifted = floats_of<Floats>(magnitude) + 0.5F;
    const Floats subnormal = shifted - 0.5F;
    const Bits is_small = magnitude < 0x38800000;
    const Bits is_nan = magnitude > 0x7f800000;
    Bits rounded = is_small ? bits_of(subnormal) : normal;
    rounded = normal > 0x477fe000 ? Bits{} + 0x7f800000 : rounded;
    return is_nan ? (magnitude & ~0x1fff) | 0x400000 : rounded;
  });
}

/// Rounds to the nearest value that binary16 represents, ties to even; beyond 65519.99 gives infinity, NaN a quiet NaN.
/// The result is a float, so that a surface can keep binary16 values without converting at every blend.
template <class Floats>
inline Floats round_to_half(Floats value) {
#if defined(__F16C__) && !defined(__clang__)
  // The same bits. Clang has these only behind a header that takes long to read.
  if constexpr (sizeof(Floats) == sizeof(LanePair)) {
    return __builtin_ia32_vcvtph2ps256(__builtin_ia32_vcvtps2ph256(value, 0));
  } else {
    return __builtin_ia32_vcvtph2ps(__builtin_ia32_vcvtps2ph(value, 0));
  }
#else
  return round_to_half_by_integers(value);
#endif
}

/// Rounds towards zero; beyond 65504 gives 65504 (D3D11.3 functional specification, float to lower-precision float).
template <class Floats>
inline Floats truncate_to_half(Floats value) {
  using Bits = BitsOf<Floats>;
  return round_magnitude(value, [](Bits magnitude) {
    const Bits normal = magnitude & ~0x1fff;
    const auto exact = floats_of<Floats>(magnitude);
    const Floats shifted = exact + 0.5F;
    Floats subnormal = shifted - 0.5F;
    subnormal = select(subnormal > exact, subnormal - 5.9604645e-8F, subnormal);
    const Bits is_small = magnitude < 0x38800000;
    const Bits saturates = (normal > 0x477fe000) & (magnitude <= 0x7f800000);
    const Bits truncated = is_small ? bits_of(subnormal) : normal;
    return saturates ? Bits{} + 0x477fe000 : truncated;
  });
}

inline float round_to_half(float value) { return round_to_half(splat_lanes(value))[0]; }

/// The 16 bits of a float that binary16 represents exactly.
inline std::uint16_t half_bits(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  const std::uint32_t sign = (bits >> 16) & 0x8000U;
  const std::uint32_t magnitude = bits & 0x7fffffffU;
  if (magnitude > 0x7f800000U) return static_cast<std::uint16_t>(sign | 0x7e00U);
  if (magnitude >= 0x47800000U) return static_cast<std::uint16_t>(sign | 0x7c00U);
  if (magnitude >= 0x38800000U) return static_cast<std::uint16_t>(sign | ((magnitude - 0x38000000U) >> 13));
  float absolute;
  std::memcpy(&absolute, &magnitude, sizeof absolute);
  return static_cast<std::uint16_t>(sign | static_cast<std::uint32_t>(absolute * 16777216.0F));
}

/// The value of 16 bits as binary16.
inline float half_value(std::uint16_t half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000U) << 16;
  const std::uint32_t exponent = (half >> 10) & 0x1fU;
  const std::uint32_t fraction = half & 0x3ffU;
  if (exponent == 0) {
    const float magnitude = static_cast<float>(fraction) * 5.9604645e-8F;
    return sign != 0 ? -magnitude : magnitude;
  }
  const std::uint32_t bits =
      exponent == 31 ? sign | 0x7f800000U | (fraction << 13) : sign | ((exponent + 112) << 23) | (fraction << 13);
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

}  // namespace vrpipe
