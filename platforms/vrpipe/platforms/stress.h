#pragma once

#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// A configuration far from the defaults in one respect, on which the fidelities are compared: docs/accuracy.md lists
/// how far they are off, and tests hold them to it.
struct StressConfiguration {
  std::string name;   ///< of the platform, or the setting that it is about
  Platform platform;  ///< perhaps with short links
  std::vector<Setting> settings;
  bool quick = false;  ///< one of the few that a quick look takes
};
const std::vector<StressConfiguration>& stress_configurations();

}  // namespace vrpipe
