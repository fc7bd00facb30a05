#pragma once

#include <array>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// Shares of cycles by state, over all units of a kind.
struct UnitShares {
  std::string unit;  ///< without its GPC
  std::array<double, unit_states> shares{};
};

/// Of a run, in the order of its units.
std::vector<UnitShares> unit_shares(const RunResult& run);

/// The same of a span of intervals, `end` excluded.
std::vector<UnitShares> unit_shares(const IntervalReport& intervals, std::size_t begin, std::size_t end);

/// Neither starved nor blocked, in [0, 1]: what a bottleneck is, since those before it are blocked and those behind it
/// starved.
double engaged(const UnitShares& unit);

}  // namespace vrpipe::tools
