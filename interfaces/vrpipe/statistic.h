#pragma once

#include <cstdint>
#include <vector>

namespace vrpipe {

class StatisticSet;

/// One declared counter; the hot path is an integer increment.
class Counter {
 public:
  Counter(StatisticSet& owner, const char* name, const char* unit, const char* meaning);
  Counter(const Counter&) = delete;
  Counter& operator=(const Counter&) = delete;

  void operator++() { ++value_; }
  void operator+=(std::uint64_t amount) { value_ += amount; }
  std::uint64_t value() const { return value_; }
  const char* name() const { return name_; }
  const char* unit() const { return unit_; }
  const char* meaning() const { return meaning_; }

 private:
  std::uint64_t value_ = 0;
  const char* name_;
  const char* unit_;
  const char* meaning_;
};

/// The largest or the smallest of what a unit saw. Over several units: the largest or smallest of theirs.
class Extreme {
 public:
  enum class Of : std::uint8_t { largest, smallest };
  Extreme(StatisticSet& owner, Of of, const char* name, const char* unit, const char* meaning);
  Extreme(const Extreme&) = delete;
  Extreme& operator=(const Extreme&) = delete;

  void see(std::uint64_t value) {
    if (!seen_ || (of_ == Of::largest ? value > value_ : value < value_)) value_ = value;
    seen_ = true;
  }
  bool seen() const { return seen_; }  ///< anything at all; without, there is no value
  std::uint64_t value() const { return value_; }
  Of of() const { return of_; }
  const char* name() const { return name_; }
  const char* unit() const { return unit_; }
  const char* meaning() const { return meaning_; }

 private:
  std::uint64_t value_ = 0;
  bool seen_ = false;
  Of of_;
  const char* name_;
  const char* unit_;
  const char* meaning_;
};

/// The counters of one unit; a unit derives from it and declares each counter as a member.
class StatisticSet {
 public:
  StatisticSet() = default;
  StatisticSet(const StatisticSet&) = delete;
  StatisticSet& operator=(const StatisticSet&) = delete;

  const std::vector<Counter*>& counters() const { return counters_; }
  const std::vector<Extreme*>& extremes() const { return extremes_; }

 private:
  friend class Counter;
  friend class Extreme;
  std::vector<Counter*> counters_;
  std::vector<Extreme*> extremes_;
};

inline Counter::Counter(StatisticSet& owner, const char* name, const char* unit, const char* meaning)
    : name_(name), unit_(unit), meaning_(meaning) {
  owner.counters_.push_back(this);
}

inline Extreme::Extreme(StatisticSet& owner, Of of, const char* name, const char* unit, const char* meaning)
    : of_(of), name_(name), unit_(unit), meaning_(meaning) {
  owner.extremes_.push_back(this);
}

}  // namespace vrpipe
