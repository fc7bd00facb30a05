#include "jobs/distribution.h"

#include <algorithm>
#include <utility>

#include <vrpipe/workloads/portable_math.h>

namespace vrpipe::tools {
namespace {

double quantile(const std::vector<std::pair<double, std::size_t>>& sorted, double p) {
  const double place = p * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double part = place - static_cast<double>(below);
  return sorted[below].first + part * (sorted[above].first - sorted[below].first);
}

}  // namespace

std::optional<Distribution> distribution_of(const std::vector<std::optional<double>>& values) {
  std::vector<std::pair<double, std::size_t>> sorted;
  double logarithms = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!values[i]) continue;
    sorted.emplace_back(*values[i], i);
    logarithms += portable_log(*values[i]);
  }
  if (sorted.empty()) return std::nullopt;
  std::sort(sorted.begin(), sorted.end());
  Distribution found;
  found.count = sorted.size();
  found.minimum = sorted.front().first;
  found.lower_quartile = quantile(sorted, 0.25);
  found.median = quantile(sorted, 0.5);
  found.upper_quartile = quantile(sorted, 0.75);
  found.maximum = sorted.back().first;
  found.geometric_mean = portable_exp(logarithms / static_cast<double>(sorted.size()));
  found.least = sorted.front().second;
  const auto is_below = [](const auto& entry, double value) { return entry.first < value; };
  found.most = std::lower_bound(sorted.begin(), sorted.end(), found.maximum, is_below)->second;
  return found;
}

}  // namespace vrpipe::tools
