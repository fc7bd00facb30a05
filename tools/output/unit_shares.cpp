#include "output/unit_shares.h"

#include <algorithm>

#include <vrpipe/platforms/netlist.h>

namespace vrpipe::tools {
namespace {

using StateCycles = std::array<std::uint64_t, unit_states>;

/// @param cycles_of  gives the cycles of a unit
template <class Units, class CyclesOf>
std::vector<UnitShares> summed(const Units& units, const CyclesOf& cycles_of) {
  std::vector<UnitShares> all;
  for (const auto& unit : units) {
    const std::string kind = without_gpc(unit.name);
    auto place = std::find_if(all.begin(), all.end(), [&](const UnitShares& each) { return each.unit == kind; });
    if (place == all.end()) place = all.insert(all.end(), UnitShares{kind});
    const StateCycles cycles = cycles_of(unit);
    for (unsigned state = 0; state < unit_states; ++state) place->shares[state] += static_cast<double>(cycles[state]);
  }
  for (UnitShares& unit : all) {
    double sum = 0;
    for (const double share : unit.shares) sum += share;
    for (double& share : unit.shares) share = sum > 0 ? share / sum : 0;
  }
  return all;
}

}  // namespace

std::vector<UnitShares> unit_shares(const RunResult& run) {
  return summed(run.units, [](const UnitReport& unit) { return unit.cycles; });
}

std::vector<UnitShares> unit_shares(const IntervalReport& intervals, std::size_t begin, std::size_t end) {
  return summed(intervals.units, [&](const UnitIntervals& unit) {
    StateCycles cycles{};
    for (unsigned state = 0; state < unit_states; ++state) {
      for (std::size_t i = begin; i < end; ++i) cycles[state] += unit.cycles[state][i];
    }
    return cycles;
  });
}

double engaged(const UnitShares& unit) {
  const auto share = [&](UnitState state) { return unit.shares[static_cast<unsigned>(state)]; };
  return share(UnitState::busy) + share(UnitState::memory) + share(UnitState::latency);
}

}  // namespace vrpipe::tools
