#include "image/image_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <vrpipe/workloads/portable_math.h>

namespace vrpipe::tools {
namespace {

constexpr int window_reach = 5;
constexpr std::size_t window_rows = 2 * window_reach + 1;
using Kernel = std::array<double, window_rows>;

Kernel gaussian_kernel() {
  Kernel kernel{};
  for (std::size_t i = 0; i < window_rows; ++i) {
    const double offset = static_cast<double>(i) - window_reach;
    kernel[i] = portable_exp(-0.5 * offset * offset / (1.5 * 1.5));
  }
  return kernel;
}

/// Window means of x, y, x^2, y^2 and x y.
using Moments = std::array<double, 5>;

/// A weighted mean of those of `size` moments that are around `at`.
template <class At>
Moments windowed(const Kernel& kernel, std::size_t at, std::size_t size, const At& moments_at) {
  const std::size_t first = at < window_reach ? 0 : at - window_reach;
  const std::size_t last = std::min(size - 1, at + window_reach);
  Moments sum{};
  double weights = 0;
  for (std::size_t i = first; i <= last; ++i) {
    const double weight = kernel[i + window_reach - at];
    const Moments& moments = moments_at(i);
    weights += weight;
    for (std::size_t m = 0; m < sum.size(); ++m) sum[m] += weight * moments[m];
  }
  for (double& mean : sum) mean /= weights;
  return sum;
}

double similarity(const Moments& m) {
  constexpr double c1 = 0.01 * 0.01;
  constexpr double c2 = 0.03 * 0.03;
  const double variance_x = m[2] - m[0] * m[0];
  const double variance_y = m[3] - m[1] * m[1];
  const double covariance = m[4] - m[0] * m[1];
  return ((2 * m[0] * m[1] + c1) * (2 * covariance + c2)) /
         ((m[0] * m[0] + m[1] * m[1] + c1) * (variance_x + variance_y + c2));
}

/// Sum over the pixels of one channel. Windows are separable: rows first, of which eleven are kept.
double similarity_sum(const ShownImage& a, const ShownImage& b, std::size_t channel) {
  const std::size_t width = a.width;
  const std::size_t height = a.height;
  static const Kernel kernel = gaussian_kernel();
  std::vector<std::vector<Moments>> rows(window_rows, std::vector<Moments>(width));
  std::vector<Moments> products(width);
  const auto filter_row = [&](std::size_t y) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t index = (y * width + x) * 3 + channel;
      const double p = a.rgb[index];
      const double q = b.rgb[index];
      products[x] = {p, q, p * p, q * q, p * q};
    }
    std::vector<Moments>& row = rows[y % window_rows];
    const auto product = [&](std::size_t i) -> const Moments& { return products[i]; };
    for (std::size_t x = 0; x < width; ++x) row[x] = windowed(kernel, x, width, product);
  };
  double sum = 0;
  std::size_t filtered = 0;
  for (std::size_t y = 0; y < height; ++y) {
    while (filtered < height && filtered <= y + window_reach) filter_row(filtered++);
    for (std::size_t x = 0; x < width; ++x) {
      const auto of_row = [&](std::size_t i) -> const Moments& { return rows[i % window_rows][x]; };
      sum += similarity(windowed(kernel, y, height, of_row));
    }
  }
  return sum;
}

double clamped(double value) { return value > 0 ? std::min(value, 1.0) : 0.0; }

template <class Pixel>
ShownImage over_background(std::uint32_t width, std::uint32_t height, const std::array<float, 3>& background,
                           const Pixel& pixel) {
  ShownImage image;
  image.width = width;
  image.height = height;
  const std::size_t pixels = std::size_t{width} * height;
  image.rgb.resize(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto* const rgba = pixel(i);
    const double transmittance = 1.0 - static_cast<double>(rgba[3]);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      image.rgb[3 * i + channel] =
          clamped(static_cast<double>(rgba[channel]) + transmittance * static_cast<double>(background[channel]));
    }
  }
  return image;
}

}  // namespace

ShownImage shown(const SharedImage& image, const std::array<float, 3>& background) {
  return over_background(image.width(), image.height(), background,
                         [&](std::size_t i) { return image.values() + 4 * i; });
}

ShownImage shown(const ExactImage& image, const std::array<float, 3>& background) {
  return over_background(image.width, image.height, background, [&](std::size_t i) { return image.rgba[i].data(); });
}

ImageError image_error(const ShownImage& image, const ShownImage& reference) {
  if (image.width != reference.width || image.height != reference.height || image.rgb.empty()) {
    throw std::invalid_argument("images of different sizes, or of none, cannot be compared");
  }
  ImageError error;
  double squares = 0;
  const std::size_t pixels = image.rgb.size() / 3;
  for (std::size_t i = 0; i < pixels; ++i) {
    bool differs = false;
    for (std::size_t value = 3 * i; value < 3 * i + 3; ++value) {
      const double difference = std::fabs(image.rgb[value] - reference.rgb[value]);
      squares += difference * difference;
      error.max_abs_error = std::max(error.max_abs_error, difference);
      differs |= std::floor(image.rgb[value] * 255 + 0.5) != std::floor(reference.rgb[value] * 255 + 0.5);
    }
    error.pixels_differing += differs ? 1U : 0U;
  }
  error.share_differing = static_cast<double>(error.pixels_differing) / static_cast<double>(pixels);
  const double mean_square = squares / static_cast<double>(image.rgb.size());
  constexpr double decibels_per_neper = 10 / 2.302585092994046;
  error.psnr_db =
      squares > 0 ? -decibels_per_neper * portable_log(mean_square) : std::numeric_limits<double>::infinity();
  double similarity = 0;
  for (std::size_t channel = 0; channel < 3; ++channel) similarity += similarity_sum(image, reference, channel);
  error.ssim = similarity / static_cast<double>(image.rgb.size());
  return error;
}

}  // namespace vrpipe::tools
