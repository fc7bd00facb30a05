#include <vrpipe/arithmetic/blend.h>

#include <cmath>

#include <vrpipe/component/error.h>

namespace vrpipe {

const char* name_of(ColorFormat format) {
  switch (format) {
    case ColorFormat::rgba8: return "rgba8";
    case ColorFormat::rgba16f: return "rgba16f";
    case ColorFormat::rgba32f: return "rgba32f";
    case ColorFormat::rgba16: return "rgba16";
    case ColorFormat::srgb8: return "srgb8";
  }
  return "";
}

ColorFormat color_format_named(const std::string& name) {
  for (const ColorFormat format : color_formats) {
    if (name == name_of(format)) return format;
  }
  const std::string remedy = "use rgba8, srgb8, rgba16f, rgba16 or rgba32f";
  if (name == "rgb10a2") {
    throw UserError("cannot render to rgb10a2", "--format", "its 2-bit alpha cannot accumulate front to back", remedy);
  }
  if (name == "r11g11b10f") {
    throw UserError("cannot render to r11g11b10f", "--format", "it has no alpha to blend front to back with", remedy);
  }
  throw UserError("unknown format '" + name + "'", "--format", "no such colour format", remedy);
}

void check_rounding(ColorFormat format, BlendRounding rounding) {
  if (can_round(format, rounding)) return;
  throw UserError(std::string("cannot round to ") + name_of(format) + " as measured", "state.blend_rounding, --format",
                  "no GPU's blender into that format has been measured", "use rne or rtz, or another format");
}

namespace {

/// Rounds a double to binary16, ties to even, without going through float (no double rounding).
float double_to_half(double value) {
  const double magnitude = std::fabs(value);
  int exponent = 0;
  std::frexp(magnitude, &exponent);
  const double quantum = std::ldexp(1.0, std::max(exponent - 11, -24));
  const double rounded = std::nearbyint(magnitude / quantum) * quantum;
  return static_cast<float>(std::copysign(rounded, value));
}

/// RGBA16F as measured on a GH100: 99.83 % of channel values bit for bit.
Lanes measured_half_channel(Lanes destination, Lanes source, Lanes transmittance) {
  const Lanes truncated = truncate_to_half(source);
  Lanes result;
  for (int lane = 0; lane < 4; ++lane) {
    // Two 11-bit significands multiply exactly in double, and the sum with a third is exact or far below half an ulp.
    const double sum = static_cast<double>(transmittance[lane]) * static_cast<double>(truncated[lane]) +
                       static_cast<double>(destination[lane]);
    result[lane] = double_to_half(sum);
  }
  return result;
}

/// RGBA8 as measured: source cut to 12 fraction bits and rounded to 8, product / 255 rounded to nearest, added.
Lanes measured_unorm8_channel(Lanes destination, Lanes source, Lanes destination_alpha) {
  Lanes result;
  for (int lane = 0; lane < 4; ++lane) {
    const double clamped = std::fmin(std::fmax(static_cast<double>(source[lane]), 0.0), 1.0);
    const double cut = std::floor(clamped * 4096.0) / 4096.0;
    const int source_level = static_cast<int>(std::floor(cut * 255.0 + 0.5));
    const int destination_level = static_cast<int>(std::floor(static_cast<double>(destination[lane]) * 255.0 + 0.5));
    const int alpha_level = static_cast<int>(std::floor(static_cast<double>(destination_alpha[lane]) * 255.0 + 0.5));
    const int product = (2 * (255 - alpha_level) * source_level + 255) / 510;
    const int sum = std::min(destination_level + product, 255);
    result[lane] = static_cast<float>(sum) / 255.0F;
  }
  return result;
}

QuadColor measured_half(const QuadColor& destination, const QuadColor& source) {
  const Lanes transmittance = round_to_half(1.0F - destination.alpha);
  return {measured_half_channel(destination.red, source.red, transmittance),
          measured_half_channel(destination.green, source.green, transmittance),
          measured_half_channel(destination.blue, source.blue, transmittance),
          measured_half_channel(destination.alpha, source.alpha, transmittance)};
}

QuadColor measured_unorm8(const QuadColor& destination, const QuadColor& source) {
  return {measured_unorm8_channel(destination.red, source.red, destination.alpha),
          measured_unorm8_channel(destination.green, source.green, destination.alpha),
          measured_unorm8_channel(destination.blue, source.blue, destination.alpha),
          measured_unorm8_channel(destination.alpha, source.alpha, destination.alpha)};
}

/// RGBA32F as measured: one fused multiply-add.
QuadColor measured_float(const QuadColor& destination, const QuadColor& source) {
  const Lanes transmittance = 1.0F - destination.alpha;
  QuadColor result;
  for (int lane = 0; lane < 4; ++lane) {
    result.red[lane] = std::fma(transmittance[lane], source.red[lane], destination.red[lane]);
    result.green[lane] = std::fma(transmittance[lane], source.green[lane], destination.green[lane]);
    result.blue[lane] = std::fma(transmittance[lane], source.blue[lane], destination.blue[lane]);
    result.alpha[lane] = std::fma(transmittance[lane], source.alpha[lane], destination.alpha[lane]);
  }
  return result;
}

template <ColorFormat Format, BlendRounding Rounding>
QuadColor blend_as_specified(const QuadColor& destination, const QuadColor& source) {
  QuadColor blended;
  store(blend_into_target<Format, Rounding>(channel_pairs(destination), channel_pairs(source)), blended);
  return blended;
}

}  // namespace

BlendFunction blend_function(ColorFormat format, BlendRounding rounding) {
  using F = ColorFormat;
  using R = BlendRounding;
  check_rounding(format, rounding);
  const bool truncates = rounding == R::rtz;
  switch (format) {
    case F::rgba8:
      if (rounding == R::measured) return measured_unorm8;
      return truncates ? blend_as_specified<F::rgba8, R::rtz> : blend_as_specified<F::rgba8, R::rne>;
    case F::rgba16f:
      if (rounding == R::measured) return measured_half;
      return truncates ? blend_as_specified<F::rgba16f, R::rtz> : blend_as_specified<F::rgba16f, R::rne>;
    case F::rgba32f:
      if (rounding == R::measured) return measured_float;
      return blend_as_specified<F::rgba32f, R::rne>;
    case F::rgba16: return truncates ? blend_as_specified<F::rgba16, R::rtz> : blend_as_specified<F::rgba16, R::rne>;
    case F::srgb8: return truncates ? blend_as_specified<F::srgb8, R::rtz> : blend_as_specified<F::srgb8, R::rne>;
  }
  return nullptr;
}

}  // namespace vrpipe
