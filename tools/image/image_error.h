#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <vrpipe/workloads/exact_image.h>

#include "image/images.h"

namespace vrpipe::tools {

/// An image as it is shown: red, green and blue over a background, clamped to [0, 1]; NaN is 0. Row by row from the top.
struct ShownImage {
  std::uint32_t width = 0, height = 0;  ///< pixels
  std::vector<double> rgb;              ///< 3 * width * height
};
ShownImage shown(const SharedImage& image, const std::array<float, 3>& background);
ShownImage shown(const ExactImage& image, const std::array<float, 3>& background);

/// How far one image is from another.
struct ImageError {
  /// Of the mean squared error over all pixels and channels, peak 1, in decibels; +Inf for equal images.
  double psnr_db = 0;
  /// Structural similarity (Wang et al. 2004), mean over channels and pixels: Gaussian windows of 11x11 pixels with
  /// sigma 1.5, at the border of what is there of them; K1 = 0.01, K2 = 0.03, peak 1. 1 for equal images.
  double ssim = 0;
  double max_abs_error = 0;            ///< over all pixels and channels
  std::uint64_t pixels_differing = 0;  ///< in any channel, once rounded to 8 bits
  double share_differing = 0;          ///< of all pixels
};
/// @throws std::invalid_argument when the sizes differ, or a side is 0
ImageError image_error(const ShownImage& image, const ShownImage& reference);

}  // namespace vrpipe::tools
