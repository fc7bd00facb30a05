#include <vrpipe/arithmetic/running_bound.h>

#include <algorithm>
#include <cmath>

namespace vrpipe {

namespace {

/// A unit in the last place of a binary format; `least_exponent` is that of its least normal number.
double ulp(double magnitude, int fraction_bits, int least_exponent) {
  int exponent = 0;
  std::frexp(magnitude, &exponent);  // magnitude = m 2^exponent, m in [0.5, 1)
  return std::ldexp(1.0, (magnitude == 0 ? least_exponent : std::max(exponent - 1, least_exponent)) - fraction_bits);
}

/// Of a channel that is not sRGB's.
double linear_rounding_error(ColorFormat format, BlendRounding rounding, double magnitude) {
  const double of_a_step = rounding == BlendRounding::rtz ? 1.0 : 0.5;
  switch (format) {
    case ColorFormat::rgba8:
    case ColorFormat::srgb8: return of_a_step / 255.0;
    case ColorFormat::rgba16: return of_a_step / 65535.0;
    case ColorFormat::rgba16f: return of_a_step * ulp(magnitude, 10, -14);
    case ColorFormat::rgba32f: break;
  }
  return 0.5 * ulp(magnitude, 23, -126);  // the single-precision result itself
}

}  // namespace

double alpha_rounding_error(ColorFormat format, BlendRounding rounding, double magnitude) {
  return linear_rounding_error(format, rounding, magnitude);
}

double color_rounding_error(ColorFormat format, BlendRounding rounding, double magnitude) {
  if (format != ColorFormat::srgb8) return linear_rounding_error(format, rounding, magnitude);
  // Levels are the farther apart the brighter: what is just below the threshold of the next one is farthest off.
  const SrgbLevels& levels = rounding == BlendRounding::rtz ? srgb_truncated : srgb_nearest;
  const std::size_t level = std::min<std::size_t>(levels.level_of(static_cast<float>(magnitude)), 254);
  return static_cast<double>(levels.least[level + 1]) - static_cast<double>(levels.value[level]);
}

void RunningBound::blended(PixelBound& bound, double fragment_alpha, double fragment_color, double pixel_alpha_before,
                           double pixel_alpha, double pixel_color, const FragmentBound& off) const {
  const double alpha_off = bound.alpha;
  const double transmittance = std::min(1.0, 1.0 - pixel_alpha_before + alpha_off);
  FragmentBound sent{transmittance * off.color, transmittance * off.alpha};
  if (rounding_ == BlendRounding::measured && format_ != ColorFormat::rgba32f) {
    // The source is truncated first and 1 - alpha rounded; or the source is clamped, cut to 12 bits and rounded to 8, and
    // the product is rounded. A merged pair's value has an ulp of up to four times its fragments', what is clamped of it is
    // at most what theirs are above 1/2, and nothing if they are not above alpha, and what is behind one fragment takes the pair's error whole.
    const auto rounded = [&](double exact, double off_by, bool may_be_clamped) {
      const double value = exact + off_by;
      const double of_the_source =
          format_ == ColorFormat::rgba8
              ? 0.5 / 255.0 + 1.0 / 4096.0 + (may_be_clamped ? std::max(0.0, value - (merges_ ? 0.5 : 1.0)) : 0.0)
              : (merges_ ? 4.0 : 1.0) * ulp(value, 10, -14) + value * 0.5 * ulp(1.0, 10, -14);
      return (merges_ ? 1.0 : transmittance) * of_the_source;
    };
    sent.color += rounded(fragment_color, off.color, fragment_color + off.color > fragment_alpha);
    sent.alpha += rounded(fragment_alpha, off.alpha, false);
  }
  bound.color += fragment_color * alpha_off + sent.color + sent_error_ * transmittance * fragment_color;
  const double reach = pixel_color + bound.color;
  bound.color += color_rounding_error(format_, rounding_, reach) + arithmetic_ * std::max(1.0, reach);
  // Of what is sent, the errors add up to no more than that share of alpha itself: apart, since what is behind the first of a
  // pair does not lessen the pair's error.
  const double apart = sent_error_ * pixel_alpha_before;
  bound.alpha = (1.0 - fragment_alpha) * (alpha_off - apart) + sent.alpha + sent_error_ * alpha_off * fragment_alpha;
  bound.alpha += sent_error_ * pixel_alpha;
  bound.alpha += alpha_rounding_error(format_, rounding_, std::min(1.0, pixel_alpha + bound.alpha)) + arithmetic_;
}

}  // namespace vrpipe
