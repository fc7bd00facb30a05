#include "jobs/error_by_fragments.h"

#include <algorithm>
#include <cmath>

namespace vrpipe::tools {

std::vector<ErrorOfRange> error_by_fragments(const ShownImage& image, const ShownImage& reference,
                                             const std::vector<std::uint32_t>& fragments,
                                             const std::vector<double>& proved) {
  std::vector<ErrorOfRange> ranges(33);
  for (std::size_t pixel = 0; pixel < fragments.size(); ++pixel) {
    unsigned doublings = 0;
    while (fragments[pixel] >> doublings != 0) ++doublings;
    ErrorOfRange& range = ranges[doublings];
    ++range.pixels;
    for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
      const double error = std::fabs(image.rgb[i] - reference.rgb[i]);
      range.mean_abs_error += error;
      range.max_abs_error = std::max(range.max_abs_error, error);
    }
    if (!proved.empty()) range.proved_max_error = std::max(range.proved_max_error.value_or(0), proved[pixel]);
  }
  for (unsigned doublings = 0; doublings < ranges.size(); ++doublings) {
    ErrorOfRange& range = ranges[doublings];
    range.from = doublings == 0 ? 0 : 1U << (doublings - 1);
    range.to = static_cast<std::uint32_t>((std::uint64_t{1} << doublings) - 1);
    if (range.pixels > 0) range.mean_abs_error /= 3.0 * static_cast<double>(range.pixels);
  }
  ranges.erase(std::remove_if(ranges.begin(), ranges.end(),
                              [](const ErrorOfRange& range) { return range.pixels == 0; }),
               ranges.end());
  return ranges;
}

}  // namespace vrpipe::tools
