#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include <vrpipe/arithmetic/half.h>
#include <vrpipe/arithmetic/lanes.h>
#include <vrpipe/arithmetic/srgb.h>

namespace vrpipe {

/// What a colour target stores per channel: unorm 8 bit, binary16 or binary32, unorm 16 bit; or unorm 8 bit of which the
/// colours, not alpha, are sRGB's: decoded before the blend, encoded after it (D3D11.3, Vulkan).
enum class ColorFormat : std::uint8_t { rgba8, rgba16f, rgba32f, rgba16, srgb8 };
/// All of them, in the order of their bytes.
inline constexpr std::array<ColorFormat, 5> color_formats{ColorFormat::rgba8, ColorFormat::srgb8, ColorFormat::rgba16f,
                                                          ColorFormat::rgba16, ColorFormat::rgba32f};

/// How the blender rounds to the format.
/// `rne` nearest even (unorm: nearest), `rtz` towards zero,
/// `measured` as a real GPU does: source truncated to the format, 1 - destination alpha rounded, one fused multiply-add.
enum class BlendRounding : std::uint8_t { rne, rtz, measured };

constexpr unsigned bytes_per_pixel(ColorFormat format) {
  switch (format) {
    case ColorFormat::rgba8:
    case ColorFormat::srgb8: return 4;
    case ColorFormat::rgba16f:
    case ColorFormat::rgba16: return 8;
    case ColorFormat::rgba32f: break;
  }
  return 16;
}

/// The largest colour that it holds; larger ones are clamped to it, or become infinite.
constexpr float largest_color_of(ColorFormat format) {
  if (format == ColorFormat::rgba16f) return half_max;
  return format == ColorFormat::rgba32f ? std::numeric_limits<float>::infinity() : 1.0F;
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

/// The value n/Levels of the whole number n of levels, once `added` levels are added; NaN and negatives give 0, above 1
/// gives 1.
template <int Levels, class Floats>
inline Floats to_unorm(Floats value, float added) {
  value = select(value > 0.0F, value, Floats{});
  value = select(value < 1.0F, value, Floats{} + 1.0F);
  const Floats scaled = value * static_cast<float>(Levels) + added;
  const Floats level = __builtin_convertvector(__builtin_convertvector(scaled, BitsOf<Floats>), Floats);
  return level / static_cast<float>(Levels);
}

/// The nearest value n/Levels, halves up (D3D11.3, float to UNORM); of 16 bits within 0.51 levels, since n + 1/2 has
/// to be said in single precision (D3D11.3 allows 0.6).
template <int Levels, class Floats>
inline Floats round_to_unorm(Floats value) {
  return to_unorm<Levels>(value, 0.5F);
}

/// The largest n/Levels that is not above the value, with a guard for stored values' own rounding: 2^-12 levels of 8
/// bits, 2^-7 of 16.
template <int Levels, class Floats>
inline Floats truncate_to_unorm(Floats value) {
  return to_unorm<Levels>(value, Levels == 255 ? 0x1p-12F : 0x1p-7F);
}

/// Rounds to what a format of linear channels stores; the result is the stored value as a float.
template <ColorFormat Format, BlendRounding Rounding, class Floats>
inline Floats store_linear(Floats value) {
  constexpr bool truncates = Rounding == BlendRounding::rtz;
  if constexpr (Format == ColorFormat::rgba32f) return value;
  if constexpr (Format == ColorFormat::rgba16f) return truncates ? truncate_to_half(value) : round_to_half(value);
  constexpr int levels = Format == ColorFormat::rgba16 ? 65535 : 255;
  return truncates ? truncate_to_unorm<levels>(value) : round_to_unorm<levels>(value);
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

/// Rounds channels to what the format stores.
template <ColorFormat Format, BlendRounding Rounding>
inline ChannelPairs store_channels(const ChannelPairs& exact) {
  if constexpr (Format == ColorFormat::srgb8) {
    const SrgbLevels& levels = Rounding == BlendRounding::rtz ? srgb_truncated : srgb_nearest;
    return {levels.stored(exact.red_green),
            join(first_of(levels.stored(exact.blue_alpha)),
                 store_linear<ColorFormat::rgba8, Rounding>(second_of(exact.blue_alpha)))};
  } else {
    return {store_linear<Format, Rounding>(exact.red_green), store_linear<Format, Rounding>(exact.blue_alpha)};
  }
}

/// A blend into a target: single-precision multiply, single-precision add, then one rounding to the format.
template <ColorFormat Format, BlendRounding Rounding>
inline ChannelPairs blend_into_target(const ChannelPairs& destination, const ChannelPairs& source) {
  return store_channels<Format, Rounding>(blend_front_to_back(destination, source));
}

/// Whether a real GPU's blender into the format has been measured.
constexpr bool is_measured(ColorFormat format) { return format != ColorFormat::rgba16 && format != ColorFormat::srgb8; }
constexpr bool can_round(ColorFormat format, BlendRounding rounding) {
  return rounding != BlendRounding::measured || is_measured(format);
}
/// Throws UserError where it cannot.
void check_rounding(ColorFormat format, BlendRounding rounding);

/// The same for a rounding known only at run time; the measured model of a real GPU's blender is here alone. Throws
/// UserError as check_rounding().
using BlendFunction = QuadColor (*)(const QuadColor& destination, const QuadColor& source);
BlendFunction blend_function(ColorFormat format, BlendRounding rounding);

}  // namespace vrpipe
