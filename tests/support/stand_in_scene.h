#pragma once

#include <cstdint>
#include <string>

#include <vrpipe/pipeline/draw.h>

namespace vrpipe::testing {

/// Of what splats a stand-in is made: centres, sizes and opacities are drawn independently of each other and of the order.
struct StandIn {
  std::uint64_t seed = 1;
  double size = 1;        ///< median of the deviation, geometric mean of both axes, pixels
  double sigma = 0.5;     ///< deviation of its logarithm
  double anisotropy = 0;  ///< deviation of the logarithm of the ratio of the axes
  double low_opacity = 0.1, high_opacity = 0.9;
  double margin = 0;  ///< centres lie that far outside, in widths and heights
  unsigned clusters = 0;
  double spread = 0.1;     ///< deviation within a cluster, in widths and heights
  double clustered = 0.5;  ///< share of the splats in clusters; the rest is uniform, or
  double ball = 0;         ///< if above 0, uniform in a ball in the middle, of that radius in widths and heights
};

/// The same bits everywhere. The splats of a smaller count are the first of a larger one.
Draw stand_in_scene(const StandIn& parameters, std::uint64_t splats, std::uint32_t width, std::uint32_t height);

}  // namespace vrpipe::testing
