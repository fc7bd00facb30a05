#pragma once

#include <cstddef>
#include <vector>

namespace vrpipe::tools {

/// What something costs, and how wrong it is; the less of each, the better.
struct TradeOff {
  double cost;
  double error;
};

/// For each whether another is no worse in both and better in one. What remains is the Pareto front.
inline std::vector<bool> dominated(const std::vector<TradeOff>& all) {
  std::vector<bool> result;
  for (const TradeOff& mine : all) {
    bool beaten = false;
    for (const TradeOff& other : all) {
      const bool no_worse = other.cost <= mine.cost && other.error <= mine.error;
      beaten |= no_worse && (other.cost < mine.cost || other.error < mine.error);
    }
    result.push_back(beaten);
  }
  return result;
}

}  // namespace vrpipe::tools
