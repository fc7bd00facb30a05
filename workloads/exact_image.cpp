#include <vrpipe/workloads/exact_image.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>

#include <vrpipe/arithmetic/half.h>
#include <vrpipe/workloads/portable_math.h>

#include "for_each_chunk.h"

namespace vrpipe {
namespace {

constexpr double kExactPruneThreshold = 1.0 / 255.0;
constexpr double kLargestAlpha = 0.99;
/// How far outside its box a pipeline may rasterise a splat, pixels: padded by 0.75 steps of 4 sub-pixel bits, and snapped.
constexpr double kNear = 0.1;
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

  /// A sample in the box, or up to kNear pixels outside it.
  struct Sample {
    std::uint32_t x;
    bool is_inside;
    double weight;    ///< opacity times the Gaussian
    double distance;  ///< from the centre, pixels, along x plus along y
    double u, v;      ///< sigmas

    bool is_visible() const { return is_inside && weight >= kExactPruneThreshold; }
  };
  /// Calls `visit(Sample)` for those of a row.
  template <class Visit>
  void for_each_sample(std::uint32_t y, std::uint32_t width, Visit&& visit) const {
    const double dy = y + 0.5 - cy_;
    double low = -1, high = width;
    narrow(a_, dy, low, high);
    narrow(b_, dy, low, high);
    const std::uint32_t end = clamped(high + 2, width);
    for (std::uint32_t x = clamped(low - 1, width); x < end; ++x) {
      const double dx = x + 0.5 - cx_;
      const double along_a = dx * a_.x + dy * a_.y;
      const double along_b = dx * b_.x + dy * b_.y;
      if (!(std::fabs(along_a) <= a_.extent + kNear && std::fabs(along_b) <= b_.extent + kNear)) continue;
      const bool is_inside = std::fabs(along_a) <= a_.extent && std::fabs(along_b) <= b_.extent;
      const double u = along_a * a_.sigmas_per_pixel;
      const double v = along_b * b_.sigmas_per_pixel;
      visit(Sample{x, is_inside, opacity_ * portable_exp(-0.5 * (u * u + v * v)), std::fabs(dx) + std::fabs(dy), u, v});
    }
  }
  /// Blends behind what the row holds; `transmittance` is what each pixel lets through so far.
  void blend_row(std::uint32_t y, std::uint32_t width, std::array<double, 4>* row, double* transmittance) const {
    for_each_sample(y, width, [&](const Sample& sample) {
      if (sample.is_visible()) blend(sample, row[sample.x], transmittance[sample.x]);
    });
  }
  void blend(const Sample& sample, std::array<double, 4>& pixel, double& transmittance) const {
    const double alpha = std::min(kLargestAlpha, sample.weight);
    const double share = transmittance * alpha;
    for (std::size_t i = 0; i < 3; ++i) pixel[i] += share * color_[i];
    transmittance *= 1 - alpha;
  }
  double opacity() const { return opacity_; }
  double largest_color() const { return std::max({color_[0], color_[1], color_[2]}); }
  const HalfAxis& a() const { return a_; }
  const HalfAxis& b() const { return b_; }

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
  const auto visit_bands = [&](const Splat& splat, const auto& visit) {
    const Rows rows = ExactSplat(splat).rows(draw.height);
    if (rows.begin >= rows.end) return;
    for (std::uint32_t band = rows.begin / kBandRows; band <= (rows.end - 1) / kBandRows; ++band) visit(band);
  };
  for (const Splat& splat : draw.splats) visit_bands(splat, [&](std::uint32_t band) { ++sorted.begin[band + 1]; });
  for (std::size_t band = 0; band < bands; ++band) sorted.begin[band + 1] += sorted.begin[band];
  sorted.splats.resize(sorted.begin[bands]);
  std::vector<std::size_t> next(sorted.begin.begin(), sorted.begin.end() - 1);
  for (std::size_t i = 0; i < draw.splats.size(); ++i) {
    visit_bands(draw.splats[i],
                [&](std::uint32_t band) { sorted.splats[next[band]++] = static_cast<std::uint32_t>(i); });
  }
  return sorted;
}

}  // namespace

namespace {

/// Calls `draw_band(first row, end row, splats of the band, how many)` for each band of rows, on several threads.
template <class DrawBand>
void for_each_band(const Draw& draw, unsigned threads, const DrawBand& draw_band) {
  if (!draw.triangles.empty() || draw.is_mesh()) throw std::invalid_argument("only splats can be rendered exactly");
  if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
  const Bands bands = sort_into_bands(draw);
  // A band belongs to one thread, which blends its splats in order: no result depends on the threads.
  for_each_chunk(bands.begin.size() - 1, threads, [&](std::uint64_t band) {
    const auto first_row = static_cast<std::uint32_t>(band) * kBandRows;
    draw_band(first_row, std::min(draw.height, first_row + kBandRows), bands.splats.data() + bands.begin[band],
              bands.begin[band + 1] - bands.begin[band]);
  });
}

ExactImage empty_image(const Draw& draw) {
  ExactImage image;
  image.width = draw.width;
  image.height = draw.height;
  image.rgba.resize(std::size_t{draw.width} * draw.height);
  return image;
}

constexpr double kSingle = 1.0 / 16777216.0;  // half an ulp of 1
constexpr double kHalf = 1.0 / 2048.0;

/// Of the shader's exponential, relative.
double error_of_exponential(Exponential exponential) {
  switch (exponential) {
    case Exponential::exact: return 2 * kSingle;
    case Exponential::ex2: return 4 * kSingle;  // 2 ulp
    case Exponential::fp16: return 4 * kSingle + kHalf;
    case Exponential::table256: return 0.0013547;  // 2^(1/512) - 1
    case Exponential::table16: return 0.0219;      // 2^(1/32) - 1
  }
  return 1;
}

/// Relative, of what is sent to be blended: in binary16 a merge rounds both fragments, 1 - alpha and the result, and sending rounds once.
double error_of_sending(const DrawnPrecision& drawn) {
  const bool merges_in_half = drawn.merges && drawn.device.merging == NumberFormat::fp16;
  return (merges_in_half ? 5 * kHalf : 0) + (drawn.device.export_format == NumberFormat::fp16 ? 2 * kHalf : 0);
}

/// A pixel's bound on its way, in one precision.
struct BoundOnItsWay {
  PixelBound bound;
  double largest_alpha_bound = 0;
  double left = 0;           ///< transmittance where the pixel may have terminated first; 0: not yet
  double largest_color = 0;  ///< from then on
};

/// Takes bounds along with fragments, in one precision.
class BoundPrecision {
 public:
  explicit BoundPrecision(const DrawnPrecision& drawn)
      : drawn_(drawn),
        running_(drawn.format, drawn.device.blend_rounding, drawn.merges, error_of_sending(drawn)),
        exponential_(error_of_exponential(drawn.device.exponential)),
        is_half_(drawn.device.shading == NumberFormat::fp16),
        half_attributes_(is_half_ || drawn.device.attributes != AttributeFormat::fp32),
        alpha_max_(static_cast<double>(drawn.device.alpha_max)) {
    const AttributeFormat attributes = drawn.device.attributes;
    // Roundings of u and v beside single precision's: of a difference, a product and a sum; and of the matrix.
    of_position_ = 16 * kSingle + (is_half_ ? 4 * kHalf : 0) + (half_attributes_ ? kHalf : 0);
    of_power_ = 6 * kSingle + (is_half_ ? 5 * kHalf : 0);
    // Of the exponential's result, and of the product with opacity.
    exponential_ += is_half_ ? 3 * kHalf : 0;
    const bool is_unorm = attributes == AttributeFormat::quantized;
    of_opacity_ = (attributes == AttributeFormat::fp16 || is_half_ ? 2 * kHalf : 0);
    opacity_step_ = is_unorm ? 0.51 / 255.0 : 0;
    of_color_ = 4 * kSingle + of_opacity_ + (is_half_ ? 2 * kHalf : 0);
    color_step_ = is_unorm ? 0.51 / 255.0 : 0;
  }

  /// A sample in a splat's box; `before` and `after` are the exact pixel's alpha, `color_after` its largest channel.
  void add(const ExactSplat& splat, const ExactSplat::Sample& sample, double before, double after, double color_after,
           BoundOnItsWay& pixel) const {
    const double off = error_of_alpha(splat, sample);
    const bool is_exactly_there = sample.is_visible();
    const bool may_be_there = sample.weight + off >= drawn_.pruning_threshold;
    const bool may_be_missing = sample.weight - off < drawn_.pruning_threshold ||
                                std::max(std::fabs(sample.u), std::fabs(sample.v)) > drawn_.sigmas_covered;
    if (!is_exactly_there && !may_be_there) return;
    const bool is_certain = is_exactly_there && !may_be_missing;
    const double alpha = is_exactly_there ? std::min(kLargestAlpha, sample.weight) : 0.0;
    // What is blended on one side alone is off by all of it.
    const double sent = is_certain ? off : sample.weight + off;
    const double color = splat.largest_color();
    const double color_off = of_color_ * color + color_step_ + (color_step_ > 0 ? std::max(0.0, color - 1) : 0);
    const FragmentBound sent_off{color * sent + color_off * (alpha + sent), sent};
    running_.blended(pixel.bound, alpha, alpha * color, before, after, color_after, sent_off);
    pixel.largest_alpha_bound = std::max(pixel.largest_alpha_bound, pixel.bound.alpha);
    if (!drawn_.termination_threshold) return;
    if (pixel.left > 0) pixel.largest_color = std::max(pixel.largest_color, color);
    if (pixel.left == 0 && after + pixel.bound.alpha >= *drawn_.termination_threshold)
      pixel.left = std::max(1 - after, 1e-300);
  }
  PixelBound at_end(const BoundOnItsWay& pixel) const {
    // Whichever of the fragments behind are left out, the rest and all of them come to something between nothing and this.
    return {pixel.bound.color +
                (pixel.left + pixel.largest_alpha_bound * (pixel.left > 0 ? 1 : 0)) * pixel.largest_color,
            pixel.largest_alpha_bound + pixel.left};
  }

 private:
  double error_of_alpha(const ExactSplat& splat, const ExactSplat::Sample& sample) const {
    // u and v are sums of two products of a rounded difference and a rounded element of the axes' inverse, at most 1/|axis|.
    const double reach_u = sample.distance * splat.a().sigmas_per_pixel;
    const double reach_v = sample.distance * splat.b().sigmas_per_pixel;
    const double off_u = of_position_ * reach_u + of_matrix(splat.a().sigmas_per_pixel) * sample.distance;
    const double off_v = of_position_ * reach_v + of_matrix(splat.b().sigmas_per_pixel) * sample.distance;
    const double squared = sample.u * sample.u + sample.v * sample.v;
    const double power = 0.5 * (2 * (std::fabs(sample.u) * off_u + std::fabs(sample.v) * off_v) + off_u * off_u +
                                off_v * off_v + of_power_ * squared);
    // e^power - 1, rounded up; beyond e^700 nothing is known, and at most all of alpha is wrong.
    const double of_power = power < 1 ? power * (1 + power) : portable_exp(std::min(power, 700.0));
    const double of_gauss = of_power + (1 + of_power) * (exponential_ + 2 * kSingle);
    const double gauss = sample.weight / splat.opacity();
    const double off = power > 700 ? 1
                                   : sample.weight * (of_gauss + (1 + of_gauss) * of_opacity_) +
                                         opacity_step_ * std::min(1.0, gauss * (1 + of_gauss)) + (is_half_ ? 1e-6 : 0);
    const double of_clamp = std::max(0.0, std::min(sample.weight, std::max(kLargestAlpha, alpha_max_)) -
                                              std::min(kLargestAlpha, alpha_max_));
    const double most = splat.opacity() + opacity_step_ + 4 * kHalf * (is_half_ || of_opacity_ > 0 ? 1 : 0);
    return std::min(off, std::max(most - sample.weight, sample.weight) + 1e-6) + of_clamp +
           (is_half_ && sample.weight > 0.5 * alpha_max_ ? kHalf : 0);  // of the clamp itself
  }

  /// Absolute, of an element of the axes' inverse in binary16: it saturates, and below 2^-14 its steps are no longer relative.
  double of_matrix(double sigmas_per_pixel) const {
    if (!half_attributes_) return 0;
    return std::max(0.0, sigmas_per_pixel - static_cast<double>(half_max)) + 0x1p-25;
  }

  DrawnPrecision drawn_;
  RunningBound running_;
  double exponential_;  ///< relative
  bool is_half_;
  bool half_attributes_;
  double alpha_max_;
  double of_position_ = 0, of_power_ = 0, of_opacity_ = 0, of_color_ = 0;  ///< relative
  double opacity_step_ = 0, color_step_ = 0;                               ///< absolute
};

}  // namespace

ExactImage render_exactly(const Draw& draw, unsigned threads) {
  ExactImage image = empty_image(draw);
  for_each_band(draw, threads,
                [&](std::uint32_t first_row, std::uint32_t end_row, const std::uint32_t* splats, std::size_t count) {
                  std::vector<double> transmittance(std::size_t{end_row - first_row} * draw.width, 1.0);
                  std::array<double, 4>* const pixels = image.rgba.data() + std::size_t{first_row} * draw.width;
                  for (std::size_t i = 0; i < count; ++i) {
                    const ExactSplat splat(draw.splats[splats[i]]);
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

BoundedImage render_with_bounds(const Draw& draw, const std::vector<DrawnPrecision>& precisions, unsigned threads) {
  BoundedImage image;
  image.exact = empty_image(draw);
  image.fragments.resize(image.exact.rgba.size());
  image.bounds.resize(precisions.size());
  for (std::vector<PixelBound>& bounds : image.bounds) bounds.resize(image.exact.rgba.size());
  const std::vector<BoundPrecision> taken(precisions.begin(), precisions.end());
  for_each_band(draw, threads,
                [&](std::uint32_t first_row, std::uint32_t end_row, const std::uint32_t* splats, std::size_t count) {
                  const std::size_t first = std::size_t{first_row} * draw.width;
                  std::vector<double> transmittance(std::size_t{end_row - first_row} * draw.width, 1.0);
                  std::vector<BoundOnItsWay> on_the_way(transmittance.size() * taken.size());
                  for (std::size_t i = 0; i < count; ++i) {
                    const ExactSplat splat(draw.splats[splats[i]]);
                    const Rows rows = splat.rows(draw.height);
                    for (std::uint32_t y = std::max(rows.begin, first_row); y < std::min(rows.end, end_row); ++y) {
                      const std::size_t offset = std::size_t{y - first_row} * draw.width;
                      splat.for_each_sample(y, draw.width, [&](const ExactSplat::Sample& sample) {
                        const std::size_t place = offset + sample.x;
                        std::array<double, 4>& pixel = image.exact.rgba[first + place];
                        const double before = 1 - transmittance[place];
                        if (sample.is_visible()) {
                          splat.blend(sample, pixel, transmittance[place]);
                          ++image.fragments[first + place];
                        }
                        const double color = std::max({pixel[0], pixel[1], pixel[2]});
                        for (std::size_t p = 0; p < taken.size(); ++p)
                          taken[p].add(splat, sample, before, 1 - transmittance[place], color,
                                       on_the_way[place * taken.size() + p]);
                      });
                    }
                  }
                  for (std::size_t place = 0; place < transmittance.size(); ++place) {
                    image.exact.rgba[first + place][3] = 1 - transmittance[place];
                    for (std::size_t p = 0; p < taken.size(); ++p)
                      image.bounds[p][first + place] = taken[p].at_end(on_the_way[place * taken.size() + p]);
                  }
                });
  return image;
}

}  // namespace vrpipe
