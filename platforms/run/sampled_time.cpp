#include "run/sampled_time.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace vrpipe {

namespace {

/// Cycles of an item of each kind.
using Prices = SampledWork;

double cycles_of(const SampledWork& work, const Prices& prices) {
  return std::inner_product(work.begin(), work.end(), prices.begin(), 0.0);
}

/// Solves the normal equations of some kinds by elimination; false where they do not tell them apart.
bool solve(std::vector<std::vector<double>> rows, std::vector<double>& solution) {
  const std::size_t size = rows.size();
  for (std::size_t i = 0; i < size; ++i) {
    std::size_t pivot = i;
    for (std::size_t row = i; row < size; ++row) {
      if (std::fabs(rows[row][i]) > std::fabs(rows[pivot][i])) pivot = row;
    }
    if (std::fabs(rows[pivot][i]) < 1e-9) return false;
    std::swap(rows[i], rows[pivot]);
    for (std::size_t row = 0; row < size; ++row) {
      if (row == i) continue;
      const double factor = rows[row][i] / rows[i][i];
      for (std::size_t column = i; column <= size; ++column) rows[row][column] -= factor * rows[i][column];
    }
  }
  solution.resize(size);
  for (std::size_t i = 0; i < size; ++i) solution[i] = rows[i][size] / rows[i][i];
  return true;
}

/// Least squares over the windows; kinds whose price would be below 0 are left out, the lowest first. `fitted` gets how many are left.
Prices prices_of(const std::vector<SampledStratum>& strata, std::size_t& fitted) {
  Prices prices{};
  Prices scale{};  // so that all kinds are of one size
  for (std::size_t kind = 0; kind < prices.size(); ++kind) {
    for (const SampledStratum& stratum : strata) scale[kind] += stratum.window_work[kind] * stratum.window_work[kind];
    scale[kind] = std::sqrt(scale[kind]);
  }
  std::vector<std::size_t> used;
  for (std::size_t kind = 0; kind < prices.size(); ++kind) {
    if (scale[kind] > 0) used.push_back(kind);
  }
  while (!used.empty()) {
    std::vector<std::vector<double>> rows(used.size(), std::vector<double>(used.size() + 1));
    for (std::size_t row = 0; row < used.size(); ++row) {
      for (const SampledStratum& stratum : strata) {
        const double item = stratum.window_work[used[row]] / scale[used[row]];
        for (std::size_t column = 0; column < used.size(); ++column)
          rows[row][column] += item * stratum.window_work[used[column]] / scale[used[column]];
        rows[row].back() += item * stratum.window_cycles;
      }
      rows[row][row] += 1e-6;
    }
    std::vector<double> solution;
    if (!solve(std::move(rows), solution)) solution.assign(used.size(), -1);
    const auto lowest = std::min_element(solution.begin(), solution.end());
    if (*lowest >= 0) {
      for (std::size_t i = 0; i < used.size(); ++i) prices[used[i]] = solution[i] / scale[used[i]];
      break;
    }
    used.erase(used.begin() + (lowest - solution.begin()));
  }
  fitted = used.size();
  return prices;
}

/// Student's t of which 95 % lie within, by degrees of freedom; the Cornish-Fisher expansion, exact to 0.01 from 3 on.
double t95(double degrees) {
  constexpr double z = 1.959964;
  return z + (z * z * z + z) / (4 * degrees) +
         (5 * z * z * z * z * z + 16 * z * z * z + 3 * z) / (96 * degrees * degrees);
}

}  // namespace

EstimatedTime estimate_time(const std::vector<SampledStratum>& strata) {
  std::size_t fitted = 0;
  const Prices prices = prices_of(strata, fitted);
  EstimatedTime time;
  std::vector<double> beyond;  // by stratum: cycles that the prices do not know
  for (const SampledStratum& stratum : strata) {
    const double of_window = stratum.window_cycles - cycles_of(stratum.window_work, prices);
    beyond.push_back(of_window * stratum.quads / stratum.window_quads);
    time.cycles += cycles_of(stratum.work, prices) + beyond.back();
  }
  struct OfGroup {
    double count = 0, sum = 0, squares = 0;
  };
  std::map<std::size_t, OfGroup> groups;
  for (std::size_t i = 0; i < strata.size(); ++i) {
    OfGroup& group = groups[strata[i].group];
    ++group.count;
    group.sum += beyond[i];
    group.squares += beyond[i] * beyond[i];
  }
  double free = -static_cast<double>(fitted), variance = 0;
  for (const auto& [number, group] : groups) {
    if (group.count < 2) continue;
    free += group.count - 1;
    variance += group.count * std::max(0.0, group.squares - group.sum * group.sum / group.count) / (group.count - 1);
  }
  // As if prices had been taken from all alike.
  free = std::max(free, 1.0);
  time.half_width = t95(free) * std::sqrt(variance * (free + static_cast<double>(fitted)) / free);
  return time;
}

}  // namespace vrpipe
