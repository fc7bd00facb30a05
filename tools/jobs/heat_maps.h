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
  /// Once the run is done: writes `files`; of what is drawn outside the pipeline not those of merging and of when pixels
  /// terminated, which it does not know. Throws UserError.
  void write(const std::string& stem, ResultFiles& files) const;

  /// All that may be written, by a path without extension.
  static std::vector<std::filesystem::path> files(const std::string& stem, Fidelity fidelity);

  /// Once the run is done: a value of each pixel, of each thing that is looked at.
  std::vector<NamedChannel> of_pixels() const;

 private:
  std::vector<NamedChannel> of_tiles(const std::vector<NamedChannel>& pixels) const;

  const bool has_time_, is_of_pipeline_;
  SharedImage fates_;   ///< fragments of each pixel, a channel for each FragmentFate
  SharedImage cycles_;  ///< in the first channel: in which a pixel terminated, 0 if it did not
};

}  // namespace vrpipe::tools
