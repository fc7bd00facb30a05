#include <vrpipe/arithmetic/srgb.h>

#include <limits>

namespace vrpipe {

namespace {

/// The linear value of an encoded one, both from 0 to 1, within some ulps.
constexpr double decoded(double encoded) {
  if (encoded <= 0.04045) return encoded / 12.92;
  const double base = (encoded + 0.055) / 1.055;
  const double third = base * base * base;
  const double twelfth = third * third * third * third;
  // Newton's method for the fifth root, from above, where it only falls.
  double root = base;
  while (true) {
    const double fourth = root * root * root * root;
    const double next = root - (root * fourth - twelfth) / (5.0 * fourth);
    if (!(next < root)) return root;
    root = next;
  }
}

/// The least float that is not below.
constexpr float rounded_up(double value) {
  auto rounded = static_cast<float>(value);
  if (static_cast<double>(rounded) >= value) return rounded;
  // Of normal numbers below 1: half an ulp and more takes the sum to the next.
  return rounded + rounded * 0x1.8p-24F;
}

constexpr SrgbLevels levels_from(bool truncates) {
  SrgbLevels levels;
  for (std::size_t level = 0; level < 256; ++level) {
    levels.value[level] = static_cast<float>(decoded(static_cast<double>(level) / 255.0));
    const double half_below = (static_cast<double>(level) - 0.5) / 255.0;
    levels.least[level] = truncates ? levels.value[level] : level == 0 ? 0.0F : rounded_up(decoded(half_below));
  }
  levels.least[256] = std::numeric_limits<float>::infinity();
  // The least value of a bucket, counted up without reading bits.
  std::size_t bucket = 0;
  std::uint8_t level = 0;
  for (float octave = 0x1p-13F; octave < 1.0F; octave *= 2.0F) {
    for (unsigned part = 0; part < 128; ++part) {
      const float value = octave * (1.0F + static_cast<float>(part) / 128.0F);
      while (value >= levels.least[level + std::size_t{1}]) ++level;
      levels.level_of_bucket[bucket++] = level;
    }
  }
  levels.level_of_bucket[bucket] = 255;
  return levels;
}

}  // namespace

constexpr SrgbLevels srgb_nearest = levels_from(false);
constexpr SrgbLevels srgb_truncated = levels_from(true);

}  // namespace vrpipe
