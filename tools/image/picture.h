#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "image/image_error.h"

namespace vrpipe::tools {

/// A picture for people: 8-bit RGB, row by row from the top.
struct Picture {
  std::uint32_t width = 0, height = 0;  ///< pixels
  std::vector<std::uint8_t> rgb;        ///< 3 * width * height
};

/// An image, made smaller by a whole factor until it is at most `largest_width` wide; pixels are averaged.
Picture picture_of(const ShownImage& image, std::uint32_t largest_width);

// Errors are coloured by their magnitude, from dark to bright, in powers of ten.
constexpr double smallest_mapped_error = 1e-5;
constexpr double largest_mapped_error = 1e-1;
std::array<std::uint8_t, 3> error_color(double error);

// Counts of a pixel likewise, from 1 to 1000; none is black.
constexpr double smallest_mapped_count = 1;
constexpr double largest_mapped_count = 1000;
std::array<std::uint8_t, 3> count_color(double count);

/// The largest error of a channel at each pixel, made smaller in the same way; the largest error is what remains.
Picture error_map(const ShownImage& image, const ShownImage& reference, std::uint32_t largest_width);

/// Counts of pixels, row by row from the top, made smaller in the same way; their mean is what remains.
Picture count_map(std::uint32_t width, std::uint32_t height, const std::vector<std::uint32_t>& counts,
                  std::uint32_t largest_width);

}  // namespace vrpipe::tools
