#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/simulation.h>

#include "host/output_file.h"
#include "image/images.h"

namespace vrpipe::tools {

/// What became of the fragments of each pixel and of each screen tile in one run, and when pixels terminated. Kept in
/// memory that processes forked later share.
class HeatMaps {
 public:
  static constexpr const char* option = "--heat-maps";

  HeatMaps(std::uint32_t width, std::uint32_t height, const RunRequest& request);

  /// For one run, which must not outlive this.
  /// @param terminates  whether pixels may terminate in it: if not, nobody looks at what would make units that a run is
  ///                    without part of it
  void attach(Observers& observers, bool terminates);
  /// Once the run is done: writes `files` of what of_pixels() has. Throws UserError.
  void write(const std::string& stem, ResultFiles& files) const;

  /// All that may be written, by a path without extension.
  static std::vector<std::filesystem::path> files(const std::string& stem, Fidelity fidelity);

  /// Once the run is done: a value of each pixel, of each thing that is looked at. Kernels neither merge nor tell when pixels
  /// terminated, and accelerators tell nothing.
  std::vector<NamedChannel> of_pixels() const;

 private:
  std::vector<NamedChannel> of_tiles(const std::vector<NamedChannel>& pixels) const;

  const DrawnBy drawn_by_;
  const bool has_time_;
  SharedImage fates_;   ///< fragments of each pixel, a channel for each FragmentFate
  SharedImage cycles_;  ///< in the first channel: in which a pixel terminated, 0 if it did not
};

}  // namespace vrpipe::tools
