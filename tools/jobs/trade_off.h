#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace vrpipe::tools {

/// What something costs, and how wrong it is; the less of each, the better.
struct TradeOff {
  double timing;
  double error;
};

/// Differences up to these say nothing.
struct Tolerance {
  double cost_share = 0;  ///< of the cost
  double error = 0;

  bool cheaper(const TradeOff& a, const TradeOff& b) const { return a.timing * (1 + cost_share) < b.timing; }
  bool closer(const TradeOff& a, const TradeOff& b) const { return a.error + error < b.error; }
  /// Better in one, and no worse in the other.
  bool dominates(const TradeOff& a, const TradeOff& b) const {
    return (cheaper(a, b) && !closer(b, a)) || (closer(a, b) && !cheaper(b, a));
  }
  bool differ(const TradeOff& a, const TradeOff& b) const {
    return cheaper(a, b) || cheaper(b, a) || closer(a, b) || closer(b, a);
  }
};

/// For each whether another dominates it.
inline std::vector<bool> dominated(const std::vector<TradeOff>& all, const Tolerance& tolerance) {
  std::vector<bool> result;
  for (const TradeOff& mine : all) {
    const auto beats = [&](const TradeOff& other) { return tolerance.dominates(other, mine); };
    result.push_back(std::any_of(all.begin(), all.end(), beats));
  }
  return result;
}

/// For each whether it is on the Pareto front: nothing dominates it, and it differs from all before it on the front.
inline std::vector<bool> pareto_front(const std::vector<TradeOff>& all, const Tolerance& tolerance) {
  std::vector<bool> front = dominated(all, tolerance);
  front.flip();
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i && front[i]; ++k) front[i] = !front[k] || tolerance.differ(all[k], all[i]);
  }
  return front;
}

}  // namespace vrpipe::tools
