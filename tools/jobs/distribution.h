#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace vrpipe::tools {

/// Of some values above 0. The quantile p of n values is at p (n - 1) among them in ascending order, counted from 0, linear
/// between its neighbours (type 7 of Hyndman and Fan, as numpy has it).
struct Distribution {
  std::size_t count = 0;
  double minimum = 0, lower_quartile = 0, median = 0, upper_quartile = 0, maximum = 0;
  double geometric_mean = 0;
  std::size_t least = 0, most = 0;  ///< where the minimum and the maximum are in what was given; the first of several
};

/// Of those that are there; none if there are none.
std::optional<Distribution> distribution_of(const std::vector<std::optional<double>>& values);

}  // namespace vrpipe::tools
