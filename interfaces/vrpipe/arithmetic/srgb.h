#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace vrpipe {

/// The 256 levels of an sRGB channel of 8 bits, as their linear values, and which of them stands for a linear value
/// (D3D11.3 3.2.3.7, Khronos Data Format 13.3: linear up to 0.04045, then to the power of 2.4). Comparisons with
/// single-precision thresholds decide, so no result depends on a library's pow.
struct SrgbLevels {
  /// Values of one bucket have the same sign, exponent and upper 7 bits of the significand; no two thresholds are in one.
  static constexpr unsigned bucket_shift = 16;
  static constexpr std::uint32_t first_bucket = 0x39000000U >> bucket_shift;  ///< 2^-13, below the first threshold
  static constexpr std::uint32_t last_bucket = 0x3f800000U >> bucket_shift;   ///< 1

  std::array<float, 256> value{};  ///< linear
  std::array<float, 257> least{};  ///< from which on a level stands for a value; after the last, infinity
  std::array<std::uint8_t, last_bucket - first_bucket + 1> level_of_bucket{};  ///< of its least value

  /// NaN and negatives give 0, above 1 gives 255.
  std::uint8_t level_of(float linear) const {
    if (!(linear >= 0x1p-13F)) return 0;
    if (linear >= 1.0F) return 255;
    std::uint32_t bits;
    std::memcpy(&bits, &linear, sizeof bits);
    const std::uint8_t level = level_of_bucket[(bits >> bucket_shift) - first_bucket];
    return static_cast<std::uint8_t>(level + (linear >= least[level + std::size_t{1}] ? 1 : 0));
  }
  /// The linear value that is stored for each.
  template <class Floats>
  Floats stored(Floats linear) const {
    for (std::size_t lane = 0; lane < sizeof(Floats) / sizeof(float); ++lane)
      linear[lane] = value[level_of(linear[lane])];
    return linear;
  }
};

/// The level that is nearest where they are evenly spaced, halves up; and the largest that is not above.
extern const SrgbLevels srgb_nearest;
extern const SrgbLevels srgb_truncated;

}  // namespace vrpipe
