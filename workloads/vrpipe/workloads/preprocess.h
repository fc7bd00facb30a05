#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/gaussian_scene.h>

namespace vrpipe {

/// What a splat's 2-D covariance is dilated by unless something else is said, pixels^2 (INRIA).
constexpr double kDilation = 0.3;

struct PreprocessOptions {
  int sh_degree = 3;  ///< highest SH degree evaluated, 0 to 3; a scene of a lower degree uses its own
  /// 32, 24, 16 or 12. Below 32 the order-preserving keys k of the visible splats are reduced to
  /// floor((k - min) * 2^bits / (max - min + 1)); splats of equal reduced keys keep the scene's order.
  int depth_key_bits = 32;
  double dilation = kDilation;  ///< of 2-D covariances Sigma, pixels^2, 0.001 to 100
  /// Whether opacities are those of splats without dilation: times sqrt(det Sigma / det(Sigma + dilation I)), as anti-aliased
  /// models are trained (Yu et al., "Mip-Splatting", CVPR 2024; gsplat, INRIA's --antialiasing). None: as the scene says.
  std::optional<bool> opacity_compensation;
  unsigned threads = 0;  ///< 0: one per hardware thread. The result does not depend on it.

  auto key() const { return std::tie(sh_degree, depth_key_bits, dilation, opacity_compensation, threads); }
  bool operator==(const PreprocessOptions& other) const { return key() == other.key(); }
  bool operator<(const PreprocessOptions& other) const { return key() < other.key(); }
  /// The same model with all bands and in exact order, for images that others are measured against.
  PreprocessOptions exact() const {
    PreprocessOptions all = *this;
    all.sh_degree = 3;
    all.depth_key_bits = 32;
    return all;
  }
};

/// Largest half extent of a splat along one axis, pixels. A longer axis is shortened to it, and the offset of the
/// centre from the image's centre along this axis shrinks by the same factor: the alpha at the image's centre stays
/// what it was, and coverage never shrinks when a scale grows. So every corner lies within +-2^22 pixels.
constexpr double kMaxHalfExtent = 1e6;

/// Projects a scene to what the vertex shader takes in, as the INRIA renderer does, and off the centre or without perspective as
/// gsplat does: frustum and off-screen culling,
/// EWA projection (dilated; view rays clamped at 1.3 tan(fov/2)), SH colour + 0.5 clamped at 0, sigmoid
/// opacity, stable sort by camera z, equal depths in the scene's order. Computed in double, stored as float; every
/// splat that leaves is finite.
/// Dropped and counted in summary.rejected: Gaussians with a NaN or infinite position, a NaN or +Inf log scale, a NaN
/// logit, a NaN or infinite rotation or (used) SH coefficient; and those with an all-zero quaternion. Log scale -Inf
/// is scale 0, logit +-Inf is opacity 1 or 0. Dropped as culled: camera z <= near plane, opacity < 1/255, an oriented
/// box whose bounding box misses the image. Opacities are those after compensation. Fills gaussians_total, gaussians_visible,
/// gaussians_compensated and rejected of `summary`.
/// Needs at most 64 bytes per Gaussian beside the scene.
/// @throws UserError when an option or the camera is out of range
Draw preprocess(const GaussianScene& scene, const Camera& camera, const PreprocessOptions& options,
                SceneSummary& summary);

// The steps, for tests and for units that need them.

/// Why a Gaussian cannot be drawn; its attributes alone decide, so counts do not change with the view.
enum class Rejection { none, not_finite, zero_quaternion };
/// @param degree  SH bands that are looked at, at most those of the Gaussian
Rejection rejection_of(const GaussianRef& gaussian, int degree);

/// A 2-D covariance M M^T + dilation I in factor form, decomposed. `m1`, `m2` are the rows of M, pixels.
/// `lambda1` >= `lambda2` >= dilation are the eigenvalues, (`axis_x`, `axis_y`) the unit eigenvector of lambda1; that of
/// lambda2 is (-axis_y, axis_x).
struct EllipseAxes {
  double lambda1, lambda2;
  double axis_x, axis_y;
};
EllipseAxes decompose_covariance(const Vec3& m1, const Vec3& m2, double dilation = kDilation);
/// Determinant of that covariance: |m1 x m2|^2 + e (|m1|^2 + |m2|^2) + e^2, which never cancels.
double covariance_determinant(const Vec3& m1, const Vec3& m2, double dilation = kDilation);

/// Opacity from its logit, exactly 0 and 1 at -+Inf; overflows nowhere.
double sigmoid(double logit);

/// How far a splat of this opacity reaches along either axis, in sigmas; 0 at opacity 1/255 (and below).
double half_extent_in_sigmas(float opacity);

/// Colour (RGB) of a Gaussian seen along the unit vector `direction` (from the camera to the Gaussian), SH bands up to
/// `degree`: 0.5 added, negative values and NaN become 0, at most FLT_MAX. A zero direction gives the DC term.
std::array<float, 3> sh_colour(const GaussianRef& gaussian, const Vec3& direction, int degree);

/// Sort key: orders like the depths themselves, -0 equal to +0.
std::uint32_t depth_key(float depth);

/// (key << 32 | index) entries in stable ascending order of key; a least-significant-digit radix sort on up to `threads` threads.
void sort_by_key(std::vector<std::uint64_t>& entries, unsigned threads = 1);

}  // namespace vrpipe
