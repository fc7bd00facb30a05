#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// A change in one respect, far from what is usual, under which the fidelities are compared: docs/accuracy.md lists how far
/// they are off, and tests hold them to it.
struct StressConfiguration {
  std::string name;  ///< mostly of its settings
  std::vector<Setting> settings;
  std::optional<std::uint32_t> link_depth;  ///< of every link, at most
  bool quick = false;                       ///< one of the few that a quick look takes
};
/// The first changes nothing.
const std::vector<StressConfiguration>& stress_configurations();

/// The same run with a change, which comes after the run's own settings. Throws UserError where that cannot be: the platform
/// has no such unit, what is in its slot no such parameter, or other parameters do not go with it.
RunRequest stressed(RunRequest request, const StressConfiguration& configuration);

}  // namespace vrpipe
