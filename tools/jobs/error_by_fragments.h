#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <vrpipe/workloads/exact_image.h>

#include "image/image_error.h"

namespace vrpipe::tools {

/// The pixels with so many fragments, and how far an image is off there, as it is shown.
struct ErrorOfRange {
  std::uint32_t from = 0, to = 0;  ///< fragments, both ends included
  std::uint64_t pixels = 0;
  double mean_abs_error = 0;  ///< over pixels and channels
  double max_abs_error = 0;
  std::optional<double> proved_max_error;  ///< none where nothing is proved
};

/// In ranges that double: 0, 1, 2 to 3, 4 to 7 and so on, without those that no pixel is in.
/// @param fragments  of each pixel, exactly
/// @param proved     of each pixel as it is shown; empty where nothing is proved
std::vector<ErrorOfRange> error_by_fragments(const ShownImage& image, const ShownImage& reference,
                                             const std::vector<std::uint32_t>& fragments,
                                             const std::vector<double>& proved);

}  // namespace vrpipe::tools
