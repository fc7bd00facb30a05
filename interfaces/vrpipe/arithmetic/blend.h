#pragma once

#include <cstdint>
#include <string>

#include <vrpipe/arithmetic/half.h>
#include <vrpipe/arithmetic/lanes.h>

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

/// The value n/255 of the whole number n of levels, once `added` levels are added; NaN and negatives give 0, above 1
/// gives 1.
template <class Floats>
inline Floats to_unorm8(Floats value, float added) {
  value = select(value > 0.0F, value, Floats{});
  value = select(value < 1.0F, value, Floats{} + 1.0F);
  const Floats scaled = value * 255.0F + added;
  const Floats level = __builtin_convertvector(__builtin_convertvector(scaled, BitsOf<Floats>), Floats);
  return level / 255.0F;
}

/// The nearest value n/255, halves up (D3D11.3, float to UNORM).
template <class Floats>
inline Floats round_to_unorm8(Floats value) {
  return to_unorm8(value, 0.5F);
}

/// The largest n/255 that is not above the value, with a guard of 2^-12 level for stored values' own rounding.
template <class Floats>
inline Floats truncate_to_unorm8(Floats value) {
  return to_unorm8(value, 2.44140625e-4F);
}

/// Rounds a channel to what the format stores; the result is the stored value as a float.
template <ColorFormat Format, BlendRounding Rounding, class Floats>
inline Floats store_channel(Floats value) {
  if constexpr (Format == ColorFormat::rgba32f) return value;
  if constexpr (Format == ColorFormat::rgba16f) {
    return Rounding == BlendRounding::rtz ? truncate_to_half(value) : round_to_half(value);
  }
  return Rounding == BlendRounding::rtz ? truncate_to_unorm8(value) : round_to_unorm8(value);
}

/// A quad's channels two by two, as a host's wider registers hold them.
struct ChannelPairs {
  LanePair red_green, blue_alpha;
};
static_assert(sizeof(ChannelPairs) == sizeof(QuadColor));
// In whole registers; copying bytes would go through memory.
using LanePairInMemory = float __attribute__((vector_size(32), may_alias));
inline ChannelPairs channel_pairs(const QuadColor& color) {
  const auto* const pairs = reinterpret_cast<const LanePairInMemory*>(&color);
  return {pairs[0], pairs[1]};
}
inline void store(const ChannelPairs& pairs, QuadColor& out) {
  auto* const to = reinterpret_cast<LanePairInMemory*>(&out);
  to[0] = pairs.red_green;
  to[1] = pairs.blue_alpha;
}

/// The same of pairs of channels.
inline ChannelPairs blend_front_to_back(const ChannelPairs& front, const ChannelPairs& back) {
  const LanePair transmittance = second_twice(1.0F - front.blue_alpha);
  return {front.red_green + transmittance * back.red_green, front.blue_alpha + transmittance * back.blue_alpha};
}

/// A blend into a target: single-precision multiply, single-precision add, then one rounding to the format.
template <ColorFormat Format, BlendRounding Rounding>
inline ChannelPairs blend_into_target(const ChannelPairs& destination, const ChannelPairs& source) {
  const ChannelPairs exact = blend_front_to_back(destination, source);
  return {store_channel<Format, Rounding>(exact.red_green), store_channel<Format, Rounding>(exact.blue_alpha)};
}

/// The same for a rounding known only at run time; the measured model of a real GPU's blender is here alone.
using BlendFunction = QuadColor (*)(const QuadColor& destination, const QuadColor& source);
BlendFunction blend_function(ColorFormat format, BlendRounding rounding);

}  // namespace vrpipe
