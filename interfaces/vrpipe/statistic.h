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

/// The counters of one unit; a unit derives from it and declares each counter as a member.
class StatisticSet {
 public:
  StatisticSet() = default;
  StatisticSet(const StatisticSet&) = delete;
  StatisticSet& operator=(const StatisticSet&) = delete;

  const std::vector<Counter*>& counters() const { return counters_; }

 private:
  friend class Counter;
  std::vector<Counter*> counters_;
};

inline Counter::Counter(StatisticSet& owner, const char* name, const char* unit, const char* meaning)
    : name_(name), unit_(unit), meaning_(meaning) {
  owner.counters_.push_back(this);
}

}  // namespace vrpipe
