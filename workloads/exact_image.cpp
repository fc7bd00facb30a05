#include <vrpipe/workloads/exact_image.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>

#include <vrpipe/workloads/portable_math.h>

#include "for_each_chunk.h"

namespace vrpipe {
namespace {

constexpr double kExactPruneThreshold = 1.0 / 255.0;
constexpr double kLargestAlpha = 0.99;
/// Rows that a thread takes at a time.
constexpr std::uint32_t kBandRows = 16;

/// Half an oriented box along one of its axes.
struct HalfAxis {
  double x, y;    ///< unit direction
  double extent;  ///< pixels
  double sigmas_per_pixel;
};

/// @param r  half extent in sigmas
HalfAxis half_axis(double x, double y, double r, double x_without_extent, double y_without_extent) {
  const double length = std::sqrt(x * x + y * y);
  if (!(length > 0)) return {x_without_extent, y_without_extent, 0, 0};
  return {x / length, y / length, length, r / length};
}

/// Rows from `begin` to `end` - 1.
struct Rows {
  std::uint32_t begin = 0, end = 0;
};

/// The whole number of pixels at or below a coordinate, within 0 to `size`; 0 for NaN.
std::uint32_t clamped(double coordinate, std::uint32_t size) {
  if (!(coordinate > 0)) return 0;
  return coordinate >= size ? size : static_cast<std::uint32_t>(coordinate);
}

class ExactSplat {
 public:
  explicit ExactSplat(const Splat& splat)
      : cx_(splat.cx),
        cy_(splat.cy),
        opacity_(splat.opacity),
        color_{splat.red, splat.green, splat.blue},
        a_(half_axis(splat.ax, splat.ay, splat.r, 1, 0)),
        b_(half_axis(splat.bx, splat.by, splat.r, -a_.y, a_.x)) {}

  /// Rows in which the box may hold a sample.
  Rows rows(std::uint32_t height) const {
    const double reach = std::fabs(a_.y) * a_.extent + std::fabs(b_.y) * b_.extent;
    return {clamped(cy_ - reach - 1, height), clamped(cy_ + reach + 2, height)};
  }

  /// Blends behind what the row holds; `transmittance` is what each pixel lets through so far.
  void blend_row(std::uint32_t y, std::uint32_t width, std::array<double, 4>* row, double* transmittance) const {
    const double dy = y + 0.5 - cy_;
    double low = -1, high = width;
    narrow(a_, dy, low, high);
    narrow(b_, dy, low, high);
    const std::uint32_t end = clamped(high + 2, width);
    for (std::uint32_t x = clamped(low - 1, width); x < end; ++x) {
      const double dx = x + 0.5 - cx_;
      const double along_a = dx * a_.x + dy * a_.y;
      const double along_b = dx * b_.x + dy * b_.y;
      if (!(std::fabs(along_a) <= a_.extent && std::fabs(along_b) <= b_.extent)) continue;
      const double u = along_a * a_.sigmas_per_pixel;
      const double v = along_b * b_.sigmas_per_pixel;
      const double weight = opacity_ * portable_exp(-0.5 * (u * u + v * v));
      if (!(weight >= kExactPruneThreshold)) continue;
      const double alpha = std::min(kLargestAlpha, weight);
      const double share = transmittance[x] * alpha;
      for (std::size_t i = 0; i < 3; ++i) row[x][i] += share * color_[i];
      transmittance[x] *= 1 - alpha;
    }
  }

 private:
  /// Narrows [low, high] to the x of a row that lie within an axis's extent; the exact test follows for each sample.
  void narrow(const HalfAxis& axis, double dy, double& low, double& high) const {
    if (std::fabs(axis.x) < 1e-9) return;
    const double middle = cx_ - dy * axis.y / axis.x;
    const double reach = axis.extent / std::fabs(axis.x);
    low = std::max(low, middle - reach);
    high = std::min(high, middle + reach);
  }

  double cx_, cy_, opacity_;
  std::array<double, 3> color_;
  HalfAxis a_, b_;
};

/// For each band of rows the splats that reach into it, in draw order.
struct Bands {
  std::vector<std::size_t> begin;  ///< of a band in `splats`; one more than there are bands
  std::vector<std::uint32_t> splats;
};

Bands sort_into_bands(const Draw& draw) {
  const std::uint32_t bands = (draw.height + kBandRows - 1) / kBandRows;
  Bands sorted;
  sorted.begin.assign(std::size_t{bands} + 1, 0);
  const auto for_each_band = [&](const Splat& splat, const auto& visit) {
    const Rows rows = ExactSplat(splat).rows(draw.height);
    if (rows.begin >= rows.end) return;
    for (std::uint32_t band = rows.begin / kBandRows; band <= (rows.end - 1) / kBandRows; ++band) visit(band);
  };
  for (const Splat& splat : draw.splats) for_each_band(splat, [&](std::uint32_t band) { ++sorted.begin[band + 1]; });
  for (std::size_t band = 0; band < bands; ++band) sorted.begin[band + 1] += sorted.begin[band];
  sorted.splats.resize(sorted.begin[bands]);
  std::vector<std::size_t> next(sorted.begin.begin(), sorted.begin.end() - 1);
  for (std::size_t i = 0; i < draw.splats.size(); ++i) {
    for_each_band(draw.splats[i],
                  [&](std::uint32_t band) { sorted.splats[next[band]++] = static_cast<std::uint32_t>(i); });
  }
  return sorted;
}

}  // namespace

ExactImage render_exactly(const Draw& draw, unsigned threads) {
  if (!draw.triangles.empty() || draw.is_mesh()) throw std::invalid_argument("only splats can be rendered exactly");
  if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
  ExactImage image;
  image.width = draw.width;
  image.height = draw.height;
  image.rgba.resize(std::size_t{draw.width} * draw.height);
  const Bands bands = sort_into_bands(draw);
  // A band belongs to one thread, which blends its splats in order: no result depends on the threads.
  for_each_chunk(bands.begin.size() - 1, threads, [&](std::uint64_t band) {
    const auto first_row = static_cast<std::uint32_t>(band) * kBandRows;
    const std::uint32_t end_row = std::min(draw.height, first_row + kBandRows);
    std::vector<double> transmittance(std::size_t{end_row - first_row} * draw.width, 1.0);
    std::array<double, 4>* const pixels = image.rgba.data() + std::size_t{first_row} * draw.width;
    for (std::size_t i = bands.begin[band]; i < bands.begin[band + 1]; ++i) {
      const ExactSplat splat(draw.splats[bands.splats[i]]);
      const Rows rows = splat.rows(draw.height);
      for (std::uint32_t y = std::max(rows.begin, first_row); y < std::min(rows.end, end_row); ++y) {
        const std::size_t offset = std::size_t{y - first_row} * draw.width;
        splat.blend_row(y, draw.width, pixels + offset, transmittance.data() + offset);
      }
    }
    for (std::size_t i = 0; i < transmittance.size(); ++i) pixels[i][3] = 1 - transmittance[i];
  });
  return image;
}

}  // namespace vrpipe
