#pragma once

#include <array>
#include <cstdint>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/workloads/gaussian_scene.h>

namespace vrpipe {

/// Shares of a distribution, percent: the smallest, quantiles, the largest.
constexpr std::array<unsigned, 9> kDescribedPercents = {0, 1, 10, 25, 50, 75, 90, 99, 100};

/// Values at kDescribedPercents of a distribution: at p percent of n values in order, the one at place floor(p (n - 1) / 100).
using DescribedQuantiles = std::array<double, kDescribedPercents.size()>;

/// What is in a set of Gaussians, without a camera. All but `rejected` is of those that can be drawn.
struct SceneDescription {
  std::uint64_t count = 0;                            ///< of all
  RejectedGaussians rejected;                         ///< with every coefficient of the SH degree looked at
  std::array<double, 3> low{}, high{};                ///< bounds of the positions, world units
  std::array<double, 3> low_middle{}, high_middle{};  ///< of each coordinate's middle 98 %: a few Gaussians lie far out
  DescribedQuantiles opacity{};                       ///< 0 to 1
  DescribedQuantiles scale{};                         ///< of a Gaussian's longest axis: one sigma, world units
  DescribedQuantiles anisotropy{};                    ///< longest axis over shortest, 1 and more
};

SceneDescription describe(const GaussianScene& scene);

}  // namespace vrpipe
