#pragma once

#include <cstdint>
#include <string>

#include <vrpipe/half.h>
#include <vrpipe/lanes.h>

namespace vrpipe {

/// What a colour target stores per channel: unorm 8 bit, binary16 or binary32.
enum class ColorFormat : std::uint8_t { rgba8, rgba16f, rgba32f };

/// How the blender rounds to the format.
/// `rne` nearest even (unorm: nearest), `rtz` towards zero,
/// `measured` as a real GPU does: source truncated to the format, 1 - destination alpha rounded, one fused multiply-add.
enum class BlendRounding : std::uint8_t { rne, rtz, measured };

constexpr unsigned bytes_per_pixel(ColorFormat format) {
  return format == ColorFormat::rgba8 ? 4U : format == ColorFormat::rgba16f ? 8U : 16U;
}

const char* name_of(ColorFormat format);
/// Throws UserError naming the formats for an unknown name, and why for a format that cannot blend front to back.
ColorFormat color_format_named(const std::string& name);

/// The premultiplied colours of a quad's four samples, channel by channel.
struct alignas(64) QuadColor {
  Lanes red, green, blue, alpha;
};

/// f_fb(front, back) = front + (1 - front.alpha) back (paper, eq. 2), in single precision: multiply, add, no fusing.
inline QuadColor blend_front_to_back(const QuadColor& front, const QuadColor& back) {
  const Lanes transmittance = 1.0F - front.alpha;
  return {front.red + transmittance * back.red, front.green + transmittance * back.green,
          front.blue + transmittance * back.blue, front.alpha + transmittance * back.alpha};
}

inline QuadColor select(LaneBits condition, const QuadColor& if_true, const QuadColor& if_false) {
  return {select(condition, if_true.red, if_false.red), select(condition, if_true.green, if_false.green),
          select(condition, if_true.blue, if_false.blue), select(condition, if_true.alpha, if_false.alpha)};
}

/// The nearest value n/255, halves up; NaN and negatives give 0, above 1 gives 1 (D3D11.3, float to UNORM).
inline Lanes round_to_unorm8(Lanes value) {
  value = select(value > 0.0F, value, splat_lanes(0.0F));
  value = select(value < 1.0F, value, splat_lanes(1.0F));
  const Lanes scaled = value * 255.0F + 0.5F;
  const Lanes level = __builtin_convertvector(__builtin_convertvector(scaled, LaneBits), Lanes);
  return level / 255.0F;
}

/// The largest n/255 that is not above the value, with a guard of 2^-12 level for stored values' own rounding.
inline Lanes truncate_to_unorm8(Lanes value) {
  value = select(value > 0.0F, value, splat_lanes(0.0F));
  value = select(value < 1.0F, value, splat_lanes(1.0F));
  const Lanes scaled = value * 255.0F + 2.44140625e-4F;
  const Lanes level = __builtin_convertvector(__builtin_convertvector(scaled, LaneBits), Lanes);
  return level / 255.0F;
}

/// Rounds a channel to what the format stores; the result is the stored value as a float.
template <ColorFormat Format, BlendRounding Rounding>
inline Lanes store_channel(Lanes value) {
  if constexpr (Format == ColorFormat::rgba32f) return value;
  if constexpr (Format == ColorFormat::rgba16f) {
    return Rounding == BlendRounding::rtz ? truncate_to_half(value) : round_to_half(value);
  }
  return Rounding == BlendRounding::rtz ? truncate_to_unorm8(value) : round_to_unorm8(value);
}

/// A blend into a target: single-precision multiply, single-precision add, then one rounding to the format.
template <ColorFormat Format, BlendRounding Rounding>
inline QuadColor blend_into_target(const QuadColor& destination, const QuadColor& source) {
  const QuadColor sum = blend_front_to_back(destination, source);
  return {store_channel<Format, Rounding>(sum.red), store_channel<Format, Rounding>(sum.green),
          store_channel<Format, Rounding>(sum.blue), store_channel<Format, Rounding>(sum.alpha)};
}

/// The same for a rounding known only at run time; the measured model of a real GPU's blender is here alone.
using BlendFunction = QuadColor (*)(const QuadColor& destination, const QuadColor& source);
BlendFunction blend_function(ColorFormat format, BlendRounding rounding);

}  // namespace vrpipe
