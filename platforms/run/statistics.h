#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <vrpipe/component/statistic.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// Gathers the statistics of components, those of a kind together.
class StatisticCollector {
 public:
  /// Whether to take what has nothing to say in a run: extremes of nothing, parts in which nothing was counted.
  enum class Take : std::uint8_t { what_counted, all };
  explicit StatisticCollector(Take take = Take::what_counted) : take_(take) {}

  /// A set of the component of a kind at a path; a component may have several. Throws SimulationFault where two of them
  /// have a statistic of the same name.
  void add(const std::string& kind, const std::string& path, const StatisticSet& set);
  /// In the order in which they came.
  std::vector<StatisticReport> reports() const;

 private:
  struct Gathered {
    StatisticReport report;
    std::string kind;                           ///< of the component, which may have it in a part
    std::optional<Histogram::Buckets> buckets;  ///< of a histogram
    std::vector<std::uint64_t> counts;          ///< by bucket
  };
  void add_set(const std::string& kind, const std::string& name, const std::string& path, const StatisticSet& set);
  Gathered& gathered(const StatisticReport& declared, const std::string& kind,
                     const std::optional<Histogram::Buckets>& buckets = {});

  const Take take_;
  std::map<std::string, std::set<std::string>> paths_;  ///< of a kind
  std::vector<Gathered> gathered_;
  std::multimap<std::string, std::size_t> index_;  ///< of `gathered_`, by name
};

}  // namespace vrpipe
