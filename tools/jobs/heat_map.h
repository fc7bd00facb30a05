#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include <vrpipe/platforms/observers.h>

#include "image/images.h"

namespace vrpipe::tools {

/// How many fragments were blended at each pixel, as a picture.
struct HeatMap {
  std::uint32_t width = 0, height = 0;  ///< of the image that was counted, pixels
  std::uint64_t sum = 0;                ///< fragments blended
  std::uint64_t largest = 0;            ///< of a pixel
  std::string png;                      ///< no wider than `largest_width`

  static constexpr std::uint32_t largest_width = 640;
};

/// Counts, in memory that processes forked later share, what CROP is given at `functional`.
class FragmentCounter {
 public:
  FragmentCounter(std::uint32_t width, std::uint32_t height) : counts_(width, height) {}

  /// For one run, which must not outlive this.
  std::shared_ptr<Observers> observers();
  /// Once the run is done.
  HeatMap map() const;

 private:
  /// Whole numbers up to 2^24 are exact in its floats; a value a pixel is used.
  SharedImage counts_;
};

nlohmann::json to_json(const HeatMap& map);
/// Throws json::exception for what to_json() cannot have made.
HeatMap heat_map_from_json(const nlohmann::json& json);

}  // namespace vrpipe::tools
