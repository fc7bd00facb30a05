#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "image/image_error.h"
#include "image/picture.h"
#include "jobs/heat_maps.h"
#include "jobs/processes.h"

namespace vrpipe::tools {

/// What became of fragments at each pixel, or when pixels terminated, in one run.
struct HeatPicture {
  Picture picture;     ///< viridis; black where there is nothing
  double sum = 0;      ///< over all pixels
  double largest = 0;  ///< of a pixel
};

/// Maps of one name, on one scale.
struct HeatRow {
  std::string name;                                ///< as HeatMaps names it
  double brightest = 0;                            ///< value of the brightest colour; 0 where all is black
  std::vector<std::optional<HeatPicture>> of_run;  ///< one for each run; none where it does not tell
};

/// What only a page shows of the runs of a job.
struct PageMaterial {
  std::vector<Picture> pictures;                  ///< one for each run, over the background
  std::vector<std::optional<ImageError>> errors;  ///< of each against the baseline; none of that itself
  std::vector<HeatRow> heat;                      ///< empty if nobody looked

  static constexpr std::uint32_t largest_width = 1280;
  static constexpr std::uint32_t largest_heat_width = 480;
};

/// @param simulated  with their images
/// @param heat       one for each run, or none
/// @param threads    that may be at work at a time
PageMaterial page_material(const std::vector<Simulated>& simulated, std::size_t baseline,
                           const std::array<float, 3>& background, const std::vector<std::unique_ptr<HeatMaps>>& heat,
                           unsigned threads);

}  // namespace vrpipe::tools
