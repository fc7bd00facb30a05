#include "image/picture.h"

#include <algorithm>
#include <cmath>

#include <vrpipe/workloads/portable_math.h>

namespace vrpipe::tools {
namespace {

/// A picture of which color(left, right, top, bottom) gives each pixel: for the square of the image that it stands for,
/// `right` and `bottom` excluded.
template <class Color>
Picture smaller(std::uint32_t width, std::uint32_t height, std::uint32_t largest_width, const Color& color_of) {
  const std::uint32_t factor = std::max(1U, (width + largest_width - 1) / largest_width);
  Picture picture;
  picture.width = (width + factor - 1) / factor;
  picture.height = (height + factor - 1) / factor;
  picture.rgb.reserve(std::size_t{3} * picture.width * picture.height);
  for (std::uint32_t y = 0; y < picture.height; ++y) {
    for (std::uint32_t x = 0; x < picture.width; ++x) {
      const std::array<std::uint8_t, 3> color =
          color_of(x * factor, std::min(width, (x + 1) * factor), y * factor, std::min(height, (y + 1) * factor));
      picture.rgb.insert(picture.rgb.end(), color.begin(), color.end());
    }
  }
  return picture;
}

/// By powers of ten, from black over purple and orange to light yellow: brightness rises all the way.
std::array<std::uint8_t, 3> heat_color(double value, double smallest, double largest) {
  constexpr std::array<std::array<double, 3>, 6> stops{
      {{8, 6, 20}, {60, 15, 110}, {145, 40, 110}, {220, 80, 60}, {250, 160, 20}, {252, 250, 190}}};
  const double range = portable_log(largest / smallest);
  const double at = value > 0 ? portable_log(value / smallest) / range : 0;
  const double place = std::min(std::max(at, 0.0), 1.0) * (stops.size() - 1);
  const std::size_t below = std::min<std::size_t>(static_cast<std::size_t>(place), stops.size() - 2);
  const double share = place - static_cast<double>(below);
  std::array<std::uint8_t, 3> color{};
  for (std::size_t i = 0; i < 3; ++i) {
    color[i] = static_cast<std::uint8_t>(stops[below][i] + share * (stops[below + 1][i] - stops[below][i]) + 0.5);
  }
  return color;
}

}  // namespace

Picture picture_of(const ShownImage& image, std::uint32_t largest_width) {
  return smaller(image.width, image.height, largest_width,
                 [&](std::uint32_t left, std::uint32_t right, std::uint32_t top, std::uint32_t bottom) {
                   std::array<double, 3> sum{};
                   for (std::uint32_t y = top; y < bottom; ++y) {
                     for (std::uint32_t x = left; x < right; ++x) {
                       const double* const pixel = &image.rgb[(std::size_t{y} * image.width + x) * 3];
                       for (std::size_t channel = 0; channel < 3; ++channel) sum[channel] += pixel[channel];
                     }
                   }
                   const double pixels = static_cast<double>(right - left) * (bottom - top);
                   std::array<std::uint8_t, 3> color{};
                   for (std::size_t channel = 0; channel < 3; ++channel) {
                     color[channel] = static_cast<std::uint8_t>(sum[channel] / pixels * 255 + 0.5);
                   }
                   return color;
                 });
}

std::array<std::uint8_t, 3> error_color(double error) {
  return heat_color(error, smallest_mapped_error, largest_mapped_error);
}

std::array<std::uint8_t, 3> count_color(double count) {
  if (count <= 0) return {0, 0, 0};
  return heat_color(count, smallest_mapped_count, largest_mapped_count);
}

Picture error_map(const ShownImage& image, const ShownImage& reference, std::uint32_t largest_width) {
  return smaller(image.width, image.height, largest_width,
                 [&](std::uint32_t left, std::uint32_t right, std::uint32_t top, std::uint32_t bottom) {
                   double largest = 0;
                   for (std::uint32_t y = top; y < bottom; ++y) {
                     for (std::size_t i = (std::size_t{y} * image.width + left) * 3;
                          i < (std::size_t{y} * image.width + right) * 3; ++i) {
                       largest = std::max(largest, std::fabs(image.rgb[i] - reference.rgb[i]));
                     }
                   }
                   return error_color(largest);
                 });
}

Picture count_map(std::uint32_t width, std::uint32_t height, const std::vector<std::uint32_t>& counts,
                  std::uint32_t largest_width) {
  return smaller(width, height, largest_width,
                 [&](std::uint32_t left, std::uint32_t right, std::uint32_t top, std::uint32_t bottom) {
                   std::uint64_t sum = 0;
                   for (std::uint32_t y = top; y < bottom; ++y) {
                     for (std::uint32_t x = left; x < right; ++x) sum += counts[std::size_t{y} * width + x];
                   }
                   const double pixels = static_cast<double>(right - left) * (bottom - top);
                   return count_color(static_cast<double>(sum) / pixels);
                 });
}

}  // namespace vrpipe::tools
