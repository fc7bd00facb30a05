#pragma once

#include <array>
#include <cstdint>

namespace vrpipe::tools {

/// Viridis, for a share from 0 to 1: equal steps look equal, also in grey and to the colour-blind.
std::array<std::uint8_t, 3> viridis(double share);

}  // namespace vrpipe::tools
