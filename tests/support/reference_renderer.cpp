#include "reference_renderer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vrpipe::testing {
namespace {

constexpr double kPrune = 1.0 / 255.0;

/// One axis of an oriented box.
struct Axis {
  double x, y;       ///< unit direction
  double extent;     ///< half extent, pixels
  double per_pixel;  ///< sigmas per pixel; 0 for a box without extent
};

Axis make_axis(double x, double y, double r, double fallback_x, double fallback_y) {
  const double length = std::sqrt(x * x + y * y);
  if (length == 0) return {fallback_x, fallback_y, 0, 0};
  return {x / length, y / length, length, r / length};
}

/// Narrows [low, high] to the x with |(x - cx) ax + offset| <= extent.
void narrow(const Axis& axis, double cx, double offset, double extent, double& low, double& high) {
  if (std::fabs(axis.x) < 1e-12) {
    if (std::fabs(offset) > extent + 1e-3) high = low - 1;  // the exact test follows per sample
    return;
  }
  const double a = cx + (-extent - offset) / axis.x, b = cx + (extent - offset) / axis.x;
  low = std::max(low, std::min(a, b));
  high = std::min(high, std::max(a, b));
}

}  // namespace

ReferenceImage render_reference(const Draw& draw, const ReferenceOptions& options) {
  if (!draw.triangles.empty()) throw std::invalid_argument("the reference renderer draws splats only");
  ReferenceImage image;
  image.width = draw.width;
  image.height = draw.height;
  const std::size_t pixels = static_cast<std::size_t>(draw.width) * draw.height;
  image.rgba.resize(pixels);
  image.near_edge_per_pixel.resize(pixels);
  const RunningBound running(options.bound_format.value_or(ColorFormat::rgba32f), BlendRounding::rne, false);
  if (options.bound_format) image.bound.resize(pixels);
  const double threshold = options.termination_threshold.value_or(2.0);
  const double width = draw.width, height = draw.height;

  for (const Splat& splat : draw.splats) {
    const double cx = splat.cx, cy = splat.cy, r = splat.r, opacity = splat.opacity;
    const Axis a = make_axis(splat.ax, splat.ay, r, 1, 0);
    const Axis b = make_axis(splat.bx, splat.by, r, -a.y, a.x);
    const double extent_a = a.extent + options.box_padding, extent_b = b.extent + options.box_padding;
    const double reach_y = std::fabs(a.y) * extent_a + std::fabs(b.y) * extent_b;
    const double y_begin = std::max(0.0, std::floor(cy - reach_y - 0.5));
    const double y_end = std::min(height - 1, std::ceil(cy + reach_y - 0.5));
    const double colour[3] = {splat.red, splat.green, splat.blue};
    const double largest_colour = std::max(colour[0], std::max(colour[1], colour[2]));

    for (double row = y_begin; row <= y_end; ++row) {
      const double dy = row + 0.5 - cy;
      double low = 0, high = width;
      narrow(a, cx, dy * a.y, extent_a, low, high);
      narrow(b, cx, dy * b.y, extent_b, low, high);
      if (!(low <= high)) continue;
      const double x_end = std::min(width - 1, std::ceil(high));
      for (double column = std::max(0.0, std::floor(low) - 1); column <= x_end; ++column) {
        const double dx = column + 0.5 - cx;
        const double along_a = dx * a.x + dy * a.y, along_b = dx * b.x + dy * b.y;
        if (std::fabs(along_a) > extent_a || std::fabs(along_b) > extent_b) continue;
        const std::size_t pixel = static_cast<std::size_t>(row) * draw.width + static_cast<std::size_t>(column);
        std::array<double, 4>& rgba = image.rgba[pixel];
        if (rgba[3] >= threshold) continue;
        ++image.fragments_covered;
        const double u = along_a * a.per_pixel, v = along_b * b.per_pixel;
        const double weight = opacity * std::exp(-0.5 * (u * u + v * v));
        if (std::fabs(weight - kPrune) <= 1e-5 * kPrune) {
          ++image.fragments_near_prune_edge;
          ++image.near_edge_per_pixel[pixel];
        }
        if (weight < kPrune) continue;
        ++image.fragments_blended;
        const double alpha = std::min(0.99, weight);
        const double transmitted = 1.0 - rgba[3];
        for (std::size_t i = 0; i < 3; ++i) rgba[i] += transmitted * alpha * colour[i];
        rgba[3] += transmitted * alpha;
        if (options.bound_format) {
          running.blended(image.bound[pixel], alpha, alpha * largest_colour, 1.0 - transmitted, rgba[3],
                          std::max(rgba[0], std::max(rgba[1], rgba[2])));
        }
      }
    }
  }
  return image;
}

}  // namespace vrpipe::testing
