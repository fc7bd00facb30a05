#include <vrpipe/workloads/preprocess.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/portable_math.h>

#include "for_each_chunk.h"
#include "spherical_harmonics.h"

namespace vrpipe {
namespace {

/// Gaussians that a thread takes at a time.
constexpr std::uint64_t kChunk = 4096;
/// Larger log scales are taken as this one: e^100 times any focal length, to the fourth power, still fits a double.
constexpr double kMaxLogScale = 100.0;
constexpr float kMaxFloat = std::numeric_limits<float>::max();
constexpr float kPruneThreshold = 1.0f / 255.0f;

template <std::size_t N>
bool all_finite(const std::array<float, N>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

/// Casts a double of any size to a finite float.
float to_float(double value) {
  if (value >= kMaxFloat) return kMaxFloat;
  if (value <= -kMaxFloat) return -kMaxFloat;
  return static_cast<float>(value);
}

/// Rotation matrix, rows, of a quaternion (w, x, y, z) of any length but zero. The squares of the smallest and of the
/// largest float are normal doubles, so no scaling is needed.
std::array<Vec3, 3> rotation_matrix(const std::array<float, 4>& quaternion) {
  const double w = quaternion[0], x = quaternion[1], y = quaternion[2], z = quaternion[3];
  const double k = 2.0 / (w * w + x * x + y * y + z * z);
  return {{{1.0 - k * (y * y + z * z), k * (x * y - w * z), k * (x * z + w * y)},
           {k * (x * y + w * z), 1.0 - k * (x * x + z * z), k * (y * z - w * x)},
           {k * (x * z - w * y), k * (y * z + w * x), 1.0 - k * (x * x + y * y)}}};
}

/// Projects Gaussians for one camera. Stateless between calls: any thread, any order, the same bits.
class Projector {
 public:
  /// @param origin  of the scene's positions
  Projector(const Camera& camera, const std::array<double, 3>& origin, double dilation, bool compensates_opacity)
      : camera_(camera),
        eye_{camera.eye[0] - origin[0], camera.eye[1] - origin[1], camera.eye[2] - origin[2]},
        dilation_(dilation),
        compensates_opacity_(compensates_opacity) {
    for (std::size_t i = 0; i < 3; ++i) {
      world_to_camera_[i] = {camera.rotation[0][i], camera.rotation[1][i], camera.rotation[2][i]};
    }
    // Without perspective, a projection has no third column: the ray is taken as 0.
    if (camera.projection == Projection::orthographic) return;
    limit_x_ = 1.3 * (0.5 * camera.width / camera.fx);
    limit_y_ = 1.3 * (0.5 * camera.height / camera.fy);
    middle_x_ = -camera.principal_x / camera.fx;
    middle_y_ = -camera.principal_y / camera.fy;
  }

  /// Whether a Gaussian is visible, and its camera z. Does without its ellipse where its centre is in the image.
  /// @pre rejection_of() found none
  bool is_visible(const GaussianRef& gaussian, float& depth) const {
    if (compensates_opacity_) {
      Splat splat;
      return project(gaussian, splat, depth);
    }
    const Vec3 offset = eye_to(gaussian);
    const double z = dot(world_to_camera_[2], offset);
    if (!(z > static_cast<double>(camera_.near_plane))) return false;
    const double w = clip_w(camera_, z);
    const double x = camera_.principal_x + camera_.fx * (dot(world_to_camera_[0], offset) / w);
    const double y = camera_.principal_y + camera_.fy * (dot(world_to_camera_[1], offset) / w);
    // An extent that is limited moves the centre less than it still reaches, so project() says the same.
    if (std::fabs(x) < 0.5 * camera_.width && std::fabs(y) < 0.5 * camera_.height) {
      depth = to_float(z);
      return opacity_of(gaussian) >= kPruneThreshold;
    }
    Splat splat;
    return project(gaussian, splat, depth);
  }

  /// Fills the geometry and the opacity of `splat` and the camera z, if the Gaussian is visible.
  /// @pre rejection_of() found none
  bool project(const GaussianRef& gaussian, Splat& splat, float& depth) const {
    // The eye is subtracted in double, so a scene far from the origin loses nothing.
    const Vec3 offset = eye_to(gaussian);
    const double z = dot(world_to_camera_[2], offset);
    if (!(z > static_cast<double>(camera_.near_plane))) return false;
    float opacity = opacity_of(gaussian);
    if (!(opacity >= kPruneThreshold)) return false;

    const double w = clip_w(camera_, z);
    const double ray_x = dot(world_to_camera_[0], offset) / w;
    const double ray_y = dot(world_to_camera_[1], offset) / w;
    Vec3 m1, m2;
    covariance_factor(gaussian, w, ray_x, ray_y, m1, m2);
    const EllipseAxes ellipse = decompose_covariance(m1, m2, dilation_);
    if (compensates_opacity_) {
      opacity = compensated_opacity(gaussian, m1, m2);
      if (!(opacity >= kPruneThreshold)) return false;
    }

    const double r = half_extent_in_sigmas(opacity);
    const double half_width = 0.5 * camera_.width, half_height = 0.5 * camera_.height;
    // Centre relative to the image's centre, along the ellipse's axes: there an extent can be limited exactly.
    const double x = camera_.principal_x + camera_.fx * ray_x, y = camera_.principal_y + camera_.fy * ray_y;
    double along_a = x * ellipse.axis_x + y * ellipse.axis_y;
    double along_b = y * ellipse.axis_x - x * ellipse.axis_y;
    double extent_a = std::sqrt(ellipse.lambda1) * r;
    double extent_b = std::sqrt(ellipse.lambda2) * r;
    const bool limited = extent_a > kMaxHalfExtent;
    limit_extent(extent_a, along_a);
    limit_extent(extent_b, along_b);
    const double cx = half_width + (limited ? along_a * ellipse.axis_x - along_b * ellipse.axis_y : x);
    const double cy = half_height + (limited ? along_a * ellipse.axis_y + along_b * ellipse.axis_x : y);
    const double ax = extent_a * ellipse.axis_x, ay = extent_a * ellipse.axis_y;
    const double bx = -extent_b * ellipse.axis_y, by = extent_b * ellipse.axis_x;

    const double reach_x = std::fabs(ax) + std::fabs(bx), reach_y = std::fabs(ay) + std::fabs(by);
    if (!(cx + reach_x >= 0 && cx - reach_x <= camera_.width)) return false;
    if (!(cy + reach_y >= 0 && cy - reach_y <= camera_.height)) return false;

    splat.cx = static_cast<float>(cx);
    splat.cy = static_cast<float>(cy);
    splat.ax = static_cast<float>(ax);
    splat.ay = static_cast<float>(ay);
    splat.bx = static_cast<float>(bx);
    splat.by = static_cast<float>(by);
    splat.r = static_cast<float>(r);
    splat.depth = static_cast<float>(window_depth(camera_, z));
    splat.opacity = opacity;
    depth = to_float(z);
    return true;
  }

  void colour(const GaussianRef& gaussian, int degree, Splat& splat) const {
    const Vec3 offset = eye_to(gaussian);
    const double length = glm::length(offset);
    const Vec3 direction = length > 0 ? offset / length : Vec3{};
    const std::array<float, 3> rgb = sh_colour(gaussian, direction, degree);
    splat.red = rgb[0];
    splat.green = rgb[1];
    splat.blue = rgb[2];
  }

 private:
  static float opacity_of(const GaussianRef& gaussian) {
    return static_cast<float>(sigmoid(static_cast<double>(gaussian.opacity_logit())));
  }

  float compensated_opacity(const GaussianRef& gaussian, const Vec3& m1, const Vec3& m2) const {
    const double share = covariance_determinant(m1, m2, 0) / covariance_determinant(m1, m2, dilation_);
    return static_cast<float>(sigmoid(static_cast<double>(gaussian.opacity_logit())) * std::sqrt(share));
  }

  Vec3 eye_to(const GaussianRef& gaussian) const {
    const std::array<float, 3> position = gaussian.position();
    return {static_cast<double>(position[0]) - eye_[0], static_cast<double>(position[1]) - eye_[1],
            static_cast<double>(position[2]) - eye_[2]};
  }

  /// Rows of M = J W R S with Sigma = M M^T: the Jacobian of the projection, the view, the Gaussian's axes.
  void covariance_factor(const GaussianRef& gaussian, double w, double ray_x, double ray_y, Vec3& m1, Vec3& m2) const {
    const double x = std::min(middle_x_ + limit_x_, std::max(middle_x_ - limit_x_, ray_x));
    const double y = std::min(middle_y_ + limit_y_, std::max(middle_y_ - limit_y_, ray_y));
    const double focal_x = camera_.fx / w, focal_y = camera_.fy / w;
    // Rows of J W.
    const Vec3 j1 = focal_x * (world_to_camera_[0] - x * world_to_camera_[2]);
    const Vec3 j2 = focal_y * (world_to_camera_[1] - y * world_to_camera_[2]);
    const std::array<Vec3, 3> rotation = rotation_matrix(gaussian.rotation());
    const std::array<float, 3> log_scale = gaussian.log_scale();
    for (std::size_t k = 0; k < 3; ++k) {
      const double scale = portable_exp(std::min(static_cast<double>(log_scale[k]), kMaxLogScale));
      const Vec3 axis = {rotation[0][k], rotation[1][k], rotation[2][k]};
      m1[k] = dot(j1, axis) * scale;
      m2[k] = dot(j2, axis) * scale;
    }
  }

  /// See kMaxHalfExtent.
  static void limit_extent(double& extent, double& offset) {
    if (!(extent > kMaxHalfExtent)) return;
    offset *= kMaxHalfExtent / extent;
    extent = kMaxHalfExtent;
  }

  const Camera& camera_;
  const Vec3 eye_;
  std::array<Vec3, 3> world_to_camera_;  ///< rows: right, down, forward
  /// INRIA's limit of rays in the Jacobian, 1.3 times the tangent of half the field of view on both sides of the image's middle.
  double middle_x_ = 0, middle_y_ = 0, limit_x_ = 0, limit_y_ = 0;
  const double dilation_;  ///< pixels^2
  const bool compensates_opacity_;
};

void check_options(const GaussianScene& scene, const Camera& camera, const PreprocessOptions& options) {
  constexpr char kCannot[] = "cannot preprocess the scene";
  if (options.sh_degree < 0 || options.sh_degree > 3) {
    throw UserError(kCannot, "SH degree", "it is " + std::to_string(options.sh_degree), "give 0 to 3");
  }
  const int bits = options.depth_key_bits;
  if (bits != 32 && bits != 24 && bits != 16 && bits != 12) {
    throw UserError(kCannot, "depth key bits", "there are " + std::to_string(bits), "give 32, 24, 16 or 12");
  }
  if (!(options.dilation >= 0.001 && options.dilation <= 100)) {
    throw UserError(kCannot, "dilation", fmt::format("it is {} pixels^2", options.dilation), "give 0.001 to 100");
  }
  // Indices are 32 bits beside the key.
  if (scene.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw UserError(kCannot, "scene", "it has " + std::to_string(scene.size()) + " Gaussians", "use at most 2^32-1");
  }
  check_camera(camera, kCannot);
}

void reduce_keys(std::vector<std::uint64_t>& entries, int bits) {
  if (bits == 32 || entries.empty()) return;
  std::uint64_t low = std::numeric_limits<std::uint64_t>::max(), high = 0;
  for (const std::uint64_t entry : entries) {
    low = std::min(low, entry >> 32);
    high = std::max(high, entry >> 32);
  }
  const std::uint64_t range = high - low + 1;
  for (std::uint64_t& entry : entries) {
    const std::uint64_t key = (((entry >> 32) - low) << bits) / range;
    entry = (key << 32) | (entry & 0xffffffffu);
  }
}

}  // namespace

Rejection rejection_of(const GaussianRef& gaussian, int degree) {
  if (!all_finite(gaussian.position()) || !all_finite(gaussian.rotation()) || !all_finite(gaussian.f_dc())) {
    return Rejection::not_finite;
  }
  for (const float log_scale : gaussian.log_scale()) {
    // Minus infinity is scale 0.
    if (!(log_scale <= kMaxFloat)) return Rejection::not_finite;
  }
  if (std::isnan(gaussian.opacity_logit())) return Rejection::not_finite;
  // Bands that are not evaluated may hold anything.
  const std::uint32_t coefficients = kShRestPerChannel[static_cast<std::size_t>(degree)];
  for (std::uint32_t channel = 0; channel < 3; ++channel) {
    for (std::uint32_t c = 1; c <= coefficients; ++c) {
      if (!std::isfinite(gaussian.f_rest(channel, c))) return Rejection::not_finite;
    }
  }
  const std::array<float, 4> q = gaussian.rotation();
  if (q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0) return Rejection::zero_quaternion;
  return Rejection::none;
}

double covariance_determinant(const Vec3& m1, const Vec3& m2, double dilation) {
  const Vec3 c = cross(m1, m2);
  return dot(c, c) + dilation * (dot(m1, m1) + dot(m2, m2)) + dilation * dilation;
}

EllipseAxes decompose_covariance(const Vec3& m1, const Vec3& m2, double dilation) {
  // Sigma = [a b; b d]
  const double a = dot(m1, m1), b = dot(m1, m2), d = dot(m2, m2);
  // Axis-aligned, or turned by less than a double resolves beside the dilation (by a denormal, say): no square root and
  // no division, so exact.
  if (std::fabs(b) <= 0x1p-53 * (a + d + dilation)) {
    if (a >= d) return {a + dilation, d + dilation, 1.0, 0.0};
    return {d + dilation, a + dilation, 0.0, 1.0};
  }
  const double half_difference = 0.5 * (a - d);
  const double radius = std::sqrt(half_difference * half_difference + b * b);
  const double lambda1 = 0.5 * (a + d) + radius + dilation;
  // det / lambda1 keeps a small lambda2 that lambda1 - 2 radius would lose; rounding must not leave the dilation.
  const double quotient = covariance_determinant(m1, m2, dilation) / lambda1;
  const double lambda2 = std::min(lambda1, std::max(dilation, quotient));
  // Of the two rows of Sigma - lambda2 I, the one whose terms do not cancel.
  double x = b, y = b;
  if (a >= d) {
    x = half_difference + radius;
  } else {
    y = radius - half_difference;
  }
  // Denormal b: its square vanished, and with it the length of (x, y).
  const double largest = std::max(std::fabs(x), std::fabs(y));
  x /= largest;
  y /= largest;
  const double length = std::sqrt(x * x + y * y);
  return {lambda1, lambda2, x / length, y / length};
}

double half_extent_in_sigmas(float opacity) {
  // 1/255 rounded to float is a little more than 1/255; the splat reaches its centre alone.
  if (opacity <= kPruneThreshold) return 0.0;
  return std::sqrt(2.0 * portable_log(255.0 * static_cast<double>(opacity)));
}

double sigmoid(double logit) {
  // The exponential's argument is never positive, so it never overflows.
  if (logit >= 0) return 1.0 / (1.0 + portable_exp(-logit));
  const double e = portable_exp(logit);
  return e / (1.0 + e);
}

std::array<float, 3> sh_colour(const GaussianRef& gaussian, const Vec3& direction, int degree) {
  const std::array<float, 3> f_dc = gaussian.f_dc();
  degree = std::min(degree, gaussian.sh_degree());
  if (direction == Vec3{}) degree = 0;
  const std::array<double, 15> basis = sh_basis(direction, degree);
  std::array<float, 3> rgb{};
  for (std::uint32_t channel = 0; channel < 3; ++channel) {
    // Left to right whatever the degree: a band of zeros changes no bit.
    double sum = kShC0 * static_cast<double>(f_dc[channel]);
    for (std::uint32_t c = 1; c <= kShRestPerChannel[static_cast<std::size_t>(degree)]; ++c) {
      sum += basis[c - 1] * static_cast<double>(gaussian.f_rest(channel, c));
    }
    sum += 0.5;
    rgb[channel] = sum > 0 ? to_float(sum) : 0.0f;  // also NaN becomes 0
  }
  return rgb;
}

std::uint32_t depth_key(float depth) {
  depth += 0.0f;  // -0 becomes +0
  std::uint32_t bits;
  std::memcpy(&bits, &depth, sizeof bits);
  return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}

void sort_by_key(std::vector<std::uint64_t>& entries, unsigned threads) {
  // Each thread has a part of the entries, and of each digit's places those that follow the earlier parts'.
  constexpr std::size_t kLeastPart = 65536;
  const std::size_t count = entries.size();
  const std::size_t parts = std::min<std::size_t>(std::max(1U, threads), count / kLeastPart + 1);
  const auto part_begin = [&](std::size_t part) { return count / parts * part + std::min(part, count % parts); };
  std::vector<std::array<std::size_t, 256>> next(parts);
  std::vector<std::uint64_t> other(count);
  for (unsigned shift = 32; shift < 64; shift += 8) {
    const auto digit = [shift](std::uint64_t entry) { return (entry >> shift) & 0xffU; };
    for_each_chunk(parts, threads, [&](std::uint64_t part) {
      next[part].fill(0);
      for (std::size_t i = part_begin(part); i < part_begin(part + 1); ++i) ++next[part][digit(entries[i])];
    });
    std::size_t sum = 0;
    bool is_sorted = false;  // all have one value
    for (std::size_t value = 0; value < 256; ++value) {
      const std::size_t before = sum;
      for (auto& places : next) {
        const std::size_t of_part = places[value];
        places[value] = sum;
        sum += of_part;
      }
      is_sorted = is_sorted || (count > 0 && sum - before == count);
    }
    if (is_sorted) continue;
    for_each_chunk(parts, threads, [&](std::uint64_t part) {
      for (std::size_t i = part_begin(part); i < part_begin(part + 1); ++i) {
        other[next[part][digit(entries[i])]++] = entries[i];
      }
    });
    entries.swap(other);
  }
}

Draw preprocess(const GaussianScene& scene, const Camera& camera, const PreprocessOptions& options,
                SceneSummary& summary) {
  check_options(scene, camera, options);
  const int degree = std::min(options.sh_degree, scene.sh_degree());
  const unsigned threads = options.threads > 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  const bool compensates_opacity = options.opacity_compensation.value_or(scene.compensates_opacity());
  const Projector projector(camera, scene.origin(), options.dilation, compensates_opacity);

  // First which are visible, and their keys; the splats only once their places are known. That is cheaper than a second copy
  // of the splats, and keeps the memory per Gaussian small.
  const std::uint64_t chunks = (scene.size() + kChunk - 1) / kChunk;
  struct ChunkResult {
    std::vector<std::uint64_t> entries;  ///< key << 32 | index
    RejectedGaussians rejected;
  };
  std::vector<ChunkResult> results(static_cast<std::size_t>(chunks));
  for_each_chunk(chunks, threads, [&](std::uint64_t chunk) {
    std::vector<std::uint64_t> entries;
    RejectedGaussians rejected;
    const std::uint64_t end = std::min(scene.size(), (chunk + 1) * kChunk);
    for (std::uint64_t i = chunk * kChunk; i < end; ++i) {
      const GaussianRef gaussian = scene[i];
      const Rejection rejection = rejection_of(gaussian, degree);
      rejected.not_finite += rejection == Rejection::not_finite;
      rejected.zero_quaternion += rejection == Rejection::zero_quaternion;
      if (rejection != Rejection::none) continue;
      float depth = 0;
      if (!projector.is_visible(gaussian, depth)) continue;
      entries.push_back((std::uint64_t{depth_key(depth)} << 32) | i);
    }
    entries.shrink_to_fit();
    results[static_cast<std::size_t>(chunk)] = {std::move(entries), rejected};
  });

  RejectedGaussians rejected;
  std::vector<std::uint64_t> order;
  std::size_t visible = 0;
  for (const ChunkResult& result : results) visible += result.entries.size();
  order.reserve(visible);
  for (ChunkResult& result : results) {
    order.insert(order.end(), result.entries.begin(), result.entries.end());
    rejected.not_finite += result.rejected.not_finite;
    rejected.zero_quaternion += result.rejected.zero_quaternion;
    result.entries = {};
  }
  results = {};
  reduce_keys(order, options.depth_key_bits);
  sort_by_key(order, threads);

  Draw draw;
  draw.width = camera.width;
  draw.height = camera.height;
  draw.splats.resize(order.size());
  constexpr std::uint64_t kAhead = 8;  // in order of depth, Gaussians lie anywhere
  for_each_chunk((order.size() + kChunk - 1) / kChunk, threads, [&](std::uint64_t chunk) {
    const std::uint64_t end = std::min<std::uint64_t>(order.size(), (chunk + 1) * kChunk);
    for (std::uint64_t rank = chunk * kChunk; rank < end; ++rank) {
      if (rank + kAhead < end) scene.prefetch(order[static_cast<std::size_t>(rank + kAhead)] & 0xffffffffu);
      const GaussianRef gaussian = scene[order[static_cast<std::size_t>(rank)] & 0xffffffffu];
      Splat& splat = draw.splats[static_cast<std::size_t>(rank)];
      float depth = 0;
      if (!projector.project(gaussian, splat, depth)) {
        throw SimulationFault("preprocess", 0,
                              "a Gaussian that is visible and is not, of rank " + std::to_string(rank));
      }
      projector.colour(gaussian, degree, splat);
    }
  });

  summary.gaussians_total = scene.size();
  summary.gaussians_visible = draw.splats.size();
  summary.gaussians_compensated = compensates_opacity ? scene.size() : 0;
  summary.rejected = rejected;
  return draw;
}

}  // namespace vrpipe
