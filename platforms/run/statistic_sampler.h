#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/component/statistic.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/platforms/observers.h>

namespace vrpipe {

/// Takes statistics in the course of a run, for those who asked for them with Observers::on_statistics.
class StatisticSampler {
 public:
  /// A set of a component at a path, with its parts; a component may have several. `name` is the component's kind. Sets
  /// outlive the sampler.
  void add(const std::string& name, const std::string& path, const StatisticSet& set);
  /// What can be asked for: each statistic of a kind and, by path, of its components.
  std::vector<std::string> names() const;

  /// Once all is added. Throws UserError for a name that is not there.
  void find(const Observers& observers);
  /// Begins, before the first edge. Clock and observers outlive the run.
  void watch(ClockDomain& clock);
  /// The draw has ended: gives what is left, and the last sample.
  void finish(Cycle end);

 private:
  struct Value {
    std::optional<std::uint64_t> value;
    std::optional<std::uint64_t> denominator;
  };
  /// A statistic over components of a kind, or of one.
  struct Known {
    std::string name;
    std::string kind;       ///< of statistic: counter, ...
    std::string described;  ///< those of one name are one statistic if this is the same
    std::vector<std::function<Value()>> sources;
    Value value() const;
  };
  struct Sample {
    Cycle cycle;
    std::vector<Value> values;
  };
  /// What one call of on_statistics asked for.
  struct Series {
    const Observers::OnStatistics* asked;
    std::vector<std::size_t> known;  ///< in the order asked for
    Cycle next;
    std::vector<Observers::Sampled> given;  ///< as of the last call
    std::deque<Sample> held;                ///< until the draw is known to last as long
  };
  void add_statistic(const std::string& name, const std::string& path, const Statistic& statistic,
                     const std::string& kind, const std::string& formula, const std::function<Value()>& source);
  /// Takes the samples up to a cycle; returns the cycle of the next.
  Cycle sample_until(Cycle cycle);
  void take(Series& series, Cycle cycle) const;
  /// Gives the samples held that are before a cycle.
  void give_before(Series& series, Cycle cycle);

  std::vector<Known> known_;
  std::vector<Series> series_;
  ClockDomain* clock_ = nullptr;
};

}  // namespace vrpipe
