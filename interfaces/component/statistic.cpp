#include <vrpipe/component/statistic.h>

#include <numeric>
#include <stdexcept>

namespace vrpipe {

Statistic::Statistic(const StatisticSet& owner, const char* name, const char* unit, const char* meaning)
    : name_(name), unit_(unit), meaning_(meaning) {
  if (owner.has(name)) throw std::logic_error("statistic '" + std::string(name) + "' is declared twice");
}

Counter::Counter(StatisticSet& owner, const char* name, const char* unit, const char* meaning)
    : Statistic(owner, name, unit, meaning) {
  owner.counters_.push_back(this);
}

DrawCounter::DrawCounter(StatisticSet& owner, const char* name, const char* unit, const char* meaning)
    : Counter(owner, name, unit, meaning) {
  owner.draw_counters_.push_back(this);
}

void StatisticSet::set_draws(std::size_t draws) {
  for (DrawCounter* counter : draw_counters_) {
    counter->of_draw_.assign(draws > 1 ? draws : 0, 0);
    counter->counts_ = draws > 1 ? counter->of_draw_.data() : nullptr;
  }
}

MinMax::MinMax(StatisticSet& owner, Of of, const char* name, const char* unit, const char* meaning)
    : Statistic(owner, name, unit, meaning), of_(of) {
  owner.min_max_.push_back(this);
}

Histogram::Histogram(StatisticSet& owner, Buckets buckets, const char* name, const char* unit, const char* meaning)
    : Statistic(owner, name, unit, meaning), buckets_(buckets), counts_(buckets.count()) {
  owner.histograms_.push_back(this);
}

std::uint64_t Histogram::sum() const {
  std::uint64_t sum = sum_;
  for (std::uint32_t bucket = 0; bucket < counts_.size(); ++bucket) {
    if (buckets_.is_one_value(bucket)) sum += counts_[bucket] * bucket;
  }
  return sum;
}

std::uint64_t Histogram::smallest() const {
  for (std::uint32_t bucket = 0; bucket < counts_.size(); ++bucket) {
    if (buckets_.is_one_value(bucket) && counts_[bucket] > 0) return bucket;
  }
  return smallest_;
}

std::uint64_t Histogram::largest() const {
  std::uint64_t largest = largest_;
  for (std::uint32_t bucket = 0; bucket < counts_.size(); ++bucket) {
    if (buckets_.is_one_value(bucket) && counts_[bucket] > 0) largest = std::max<std::uint64_t>(largest, bucket);
  }
  return largest;
}

std::uint64_t Histogram::count() const { return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0}); }

std::uint64_t CounterSum::value() const {
  return std::accumulate(counters_.begin(), counters_.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const Counter* counter) { return sum + counter->value(); });
}

std::string CounterSum::text() const {
  std::string text;
  for (const Counter* counter : counters_) text += (text.empty() ? "" : " + ") + std::string(counter->name());
  return text;
}

Ratio::Ratio(StatisticSet& owner, CounterSum numerator, CounterSum denominator, const char* name, const char* unit,
             const char* meaning)
    : Statistic(owner, name, unit, meaning), numerator_(std::move(numerator)), denominator_(std::move(denominator)) {
  const std::vector<Counter*>& counters = owner.counters_;
  for (const CounterSum* sum : {&numerator_, &denominator_}) {
    for (const Counter* counter : sum->counters()) {
      if (std::find(counters.begin(), counters.end(), counter) != counters.end()) continue;
      throw std::logic_error("statistic '" + std::string(name) + "' is of '" + counter->name() +
                             "', a counter of another set");
    }
  }
  owner.ratios_.push_back(this);
}

std::string Ratio::formula() const {
  const auto term = [](const CounterSum& sum) {
    return sum.counters().size() > 1 ? "(" + sum.text() + ")" : sum.text();
  };
  return term(numerator_) + " / " + term(denominator_);
}

StatisticSet::StatisticSet(StatisticSet& owner, const char* name) : name_(name) {
  if (owner.has(name)) throw std::logic_error("statistics '" + std::string(name) + "' are declared twice");
  owner.parts_.push_back(this);
}

bool StatisticSet::counted() const {
  return std::any_of(counters_.begin(), counters_.end(), [](const Counter* counter) { return counter->value() != 0; });
}

bool StatisticSet::has(const std::string& name) const {
  const auto is_named = [&](const auto& list) {
    return std::any_of(list.begin(), list.end(), [&](const auto* each) { return name == each->name(); });
  };
  return is_named(counters_) || is_named(min_max_) || is_named(histograms_) || is_named(ratios_) ||
         std::any_of(parts_.begin(), parts_.end(), [&](const auto* part) { return name == part->name_; });
}

}  // namespace vrpipe
