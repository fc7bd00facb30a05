#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace vrpipe {

class StatisticSet;

/// What every statistic says about itself. Declared as a member of its set; the texts outlive it.
class Statistic {
 public:
  Statistic(const Statistic&) = delete;
  Statistic& operator=(const Statistic&) = delete;

  const char* name() const { return name_; }
  const char* unit() const { return unit_; }
  const char* meaning() const { return meaning_; }
  /// It is not followed, and so in no report. Before anything is counted.
  void leave_out() { is_left_out_ = true; }
  bool is_left_out() const { return is_left_out_; }

 protected:
  /// Throws std::logic_error if the set has one of this name: reports could not tell them apart.
  Statistic(const StatisticSet& owner, const char* name, const char* unit, const char* meaning);
  ~Statistic() = default;

 private:
  const char* name_;
  const char* unit_;
  const char* meaning_;
  bool is_left_out_ = false;
};

/// One declared counter; the hot path is an integer increment.
class Counter : public Statistic {
 public:
  Counter(StatisticSet& owner, const char* name, const char* unit, const char* meaning);

  void operator++() { ++value_; }
  void operator+=(std::uint64_t amount) { value_ += amount; }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0;
};

/// A counter of what belongs to a draw: counted for all, and draw by draw in a frame of several.
class DrawCounter : public Counter {
 public:
  DrawCounter(StatisticSet& owner, const char* name, const char* unit, const char* meaning);

  /// @param draw  its number in the frame
  void add(unsigned draw, std::uint64_t amount) {
    Counter::operator+=(amount);
    if (counts_ != nullptr) counts_[draw] += amount;
  }
  void operator++() = delete;
  void operator+=(std::uint64_t) = delete;
  /// By draw; empty in a frame of one.
  const std::vector<std::uint64_t>& of_draw() const { return of_draw_; }

 private:
  friend class StatisticSet;
  std::vector<std::uint64_t> of_draw_;
  std::uint64_t* counts_ = nullptr;  ///< those of draws, or null
};

/// The largest or the smallest of what a unit saw. Over several units: the largest or smallest of theirs.
class MinMax : public Statistic {
 public:
  enum class Of : std::uint8_t { largest, smallest };
  MinMax(StatisticSet& owner, Of of, const char* name, const char* unit, const char* meaning);

  void see(std::uint64_t value) {
    if (!seen_ || (of_ == Of::largest ? value > value_ : value < value_)) value_ = value;
    seen_ = true;
  }
  bool seen() const { return seen_; }  ///< anything at all; without, there is no value
  std::uint64_t value() const { return value_; }
  Of of() const { return of_; }

 private:
  std::uint64_t value_ = 0;
  bool seen_ = false;
  Of of_;
};

/// How often a component saw which values. Over several: as one that saw all of theirs.
class Histogram : public Statistic {
 public:
  /// Buckets begin at 0 and leave no gap; the last takes whatever is larger.
  class Buckets {
   public:
    /// So many, of `width` values each; both at least 1.
    static constexpr Buckets linear(std::uint32_t width, std::uint32_t count) { return {width, count}; }
    /// 0, 1, 2 and 3, 4 to 7, and so on: for values of any size.
    static constexpr Buckets log2() { return {0, 65}; }

    bool operator==(const Buckets& other) const { return width_ == other.width_ && count_ == other.count_; }
    std::uint32_t count() const { return count_; }
    std::uint32_t of(std::uint64_t value) const {
      if (width_ == 0) return value == 0 ? 0U : 64U - static_cast<std::uint32_t>(__builtin_clzll(value));
      // Most are of one value; dividing would be the most of the work.
      return static_cast<std::uint32_t>(std::min<std::uint64_t>(width_ == 1 ? value : value / width_, count_ - 1));
    }
    /// The smallest value of a bucket.
    std::uint64_t first(std::uint32_t bucket) const {
      if (width_ == 0) return bucket == 0 ? 0U : std::uint64_t{1} << (bucket - 1);
      return std::uint64_t{bucket} * width_;
    }
    bool is_one_value(std::uint32_t bucket) const { return width_ == 1 && bucket + 1 < count_; }
    /// And the largest.
    std::uint64_t last(std::uint32_t bucket) const {
      return bucket + 1 == count_ ? ~std::uint64_t{0} : first(bucket + 1) - 1;
    }

   private:
    constexpr Buckets(std::uint32_t width, std::uint32_t count) : width_(width), count_(count) {}
    std::uint32_t width_;  ///< 0: log2
    std::uint32_t count_;
  };

  Histogram(StatisticSet& owner, Buckets buckets, const char* name, const char* unit, const char* meaning);

  /// times: at least 1
  void see(std::uint64_t value, std::uint64_t times = 1) {
    const std::uint32_t bucket = buckets_.of(value);
    counts_[bucket] += times;
    if (buckets_.is_one_value(bucket)) return;  // its count says it all
    sum_ += value * times;
    smallest_ = std::min(smallest_, value);
    largest_ = std::max(largest_, value);
  }
  /// Values seen.
  std::uint64_t count() const;
  std::uint64_t sum() const;
  /// Where nothing was seen, `smallest` is larger than `largest`.
  std::uint64_t smallest() const;
  std::uint64_t largest() const;
  const Buckets& buckets() const { return buckets_; }
  /// By bucket.
  const std::vector<std::uint64_t>& counts() const { return counts_; }

 private:
  Buckets buckets_;
  std::vector<std::uint64_t> counts_;
  // Of buckets of several values.
  std::uint64_t sum_ = 0;
  std::uint64_t smallest_ = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t largest_ = 0;
};

/// Counters added up, as `hits + misses`: for a Ratio.
class CounterSum {
 public:
  CounterSum(const Counter& counter) : counters_{&counter} {}
  CounterSum operator+(const Counter& counter) && {
    counters_.push_back(&counter);
    return std::move(*this);
  }
  const std::vector<const Counter*>& counters() const { return counters_; }
  std::uint64_t value() const;
  /// The names, with plus signs between them.
  std::string text() const;

 private:
  std::vector<const Counter*> counters_;
};
inline CounterSum operator+(const Counter& one, const Counter& other) { return CounterSum(one) + other; }

/// A quotient of counters of its set, taken when it is reported; none where the denominator is 0. Over several
/// components: the sum of the numerators over that of the denominators.
class Ratio : public Statistic {
 public:
  /// Throws std::logic_error for a counter of another set.
  Ratio(StatisticSet& owner, CounterSum numerator, CounterSum denominator, const char* name, const char* unit,
        const char* meaning);

  std::uint64_t numerator() const { return numerator_.value(); }
  std::uint64_t denominator() const { return denominator_.value(); }
  /// By the names of the counters: "hits / (hits + misses)".
  std::string formula() const;

 private:
  CounterSum numerator_;
  CounterSum denominator_;
};

/// The statistics of a component, which derives from it and declares each as a member. What is a part of the component
/// and could as well be one of another, as a cache, has a set of its own in it; reports leave a part out in which no
/// counter moved, since it took no part in the run.
class StatisticSet {
 public:
  StatisticSet() = default;
  /// Of a part of the component whose set `owner` is, and outlives this one: gpc0.crop.NAME.
  StatisticSet(StatisticSet& owner, const char* name);
  StatisticSet(const StatisticSet&) = delete;
  StatisticSet& operator=(const StatisticSet&) = delete;

  /// Before anything is counted: in a frame of so many draws.
  void set_draws(std::size_t draws);
  const std::vector<DrawCounter*>& draw_counters() const { return draw_counters_; }
  /// Of a part; empty otherwise.
  const char* part_name() const { return name_; }
  const std::vector<Counter*>& counters() const { return counters_; }
  const std::vector<MinMax*>& min_max() const { return min_max_; }
  const std::vector<Histogram*>& histograms() const { return histograms_; }
  const std::vector<Ratio*>& ratios() const { return ratios_; }
  const std::vector<StatisticSet*>& parts() const { return parts_; }
  /// Whether any counter is not 0.
  bool counted() const;

 private:
  friend class Statistic;
  friend class Counter;
  friend class DrawCounter;
  friend class MinMax;
  friend class Histogram;
  friend class Ratio;
  bool has(const std::string& name) const;

  const char* name_ = "";
  std::vector<Counter*> counters_;
  std::vector<DrawCounter*> draw_counters_;  ///< which are among the counters
  std::vector<MinMax*> min_max_;
  std::vector<Histogram*> histograms_;
  std::vector<Ratio*> ratios_;
  std::vector<StatisticSet*> parts_;
};

}  // namespace vrpipe
