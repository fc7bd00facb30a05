#include <vrpipe/component/statistic.h>

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {
namespace {

constexpr std::uint64_t huge = std::numeric_limits<std::uint64_t>::max();

TEST(Histogram, LinearBucketsAreOfEqualWidthAndTheLastTakesTheRest) {
  const auto buckets = Histogram::Buckets::linear(10, 4);
  for (std::uint64_t value = 0; value < 100; ++value) {
    EXPECT_EQ(buckets.of(value), std::min<std::uint64_t>(value / 10, 3)) << value;
  }
  EXPECT_EQ(buckets.of(huge), 3U);
  EXPECT_EQ(buckets.first(2), 20U);
  EXPECT_EQ(buckets.last(2), 29U);
  EXPECT_EQ(buckets.last(3), huge);
}

TEST(Histogram, Log2BucketsHoldAnyValue) {
  const auto buckets = Histogram::Buckets::log2();
  EXPECT_EQ(buckets.of(0), 0U);
  EXPECT_EQ(buckets.of(huge), buckets.count() - 1);
  for (unsigned bit = 0; bit < 64; ++bit) {
    const std::uint64_t power = std::uint64_t{1} << bit;
    EXPECT_EQ(buckets.of(power), bit + 1);
    EXPECT_EQ(buckets.of(power - 1), bit);
  }
}

TEST(Histogram, BucketsLeaveNoGap) {
  for (const auto& buckets : {Histogram::Buckets::log2(), Histogram::Buckets::linear(7, 5)}) {
    EXPECT_EQ(buckets.first(0), 0U);
    for (std::uint32_t i = 0; i < buckets.count(); ++i) {
      EXPECT_EQ(buckets.of(buckets.first(i)), i);
      EXPECT_EQ(buckets.of(buckets.last(i)), i);
      if (i > 0) {
        EXPECT_EQ(buckets.first(i), buckets.last(i - 1) + 1);
      }
    }
    EXPECT_EQ(buckets.last(buckets.count() - 1), huge);
  }
}

TEST(Histogram, OfConsecutiveNumbersIsKnown) {
  StatisticSet set;
  Histogram histogram(set, Histogram::Buckets::log2(), "sizes", "quads", "seen");
  EXPECT_EQ(histogram.count(), 0U);
  EXPECT_GT(histogram.smallest(), histogram.largest());
  for (std::uint64_t value = 3; value <= 1023; ++value) histogram.see(value);
  EXPECT_EQ(histogram.count(), 1021U);
  EXPECT_EQ(histogram.sum(), std::uint64_t{1023 * 1024 / 2 - 1 - 2});
  EXPECT_EQ(histogram.smallest(), 3U);
  EXPECT_EQ(histogram.largest(), 1023U);
  EXPECT_EQ(histogram.counts()[2], 1U);
  for (unsigned bucket = 3; bucket <= 10; ++bucket) EXPECT_EQ(histogram.counts()[bucket], 1U << (bucket - 1));
  EXPECT_EQ(histogram.counts()[11], 0U);
}

TEST(Histogram, SeesEveryValueOnce) {
  StatisticSet set;
  Histogram histogram(set, Histogram::Buckets::linear(1, 9), "sizes", "quads", "seen");
  std::vector<std::uint64_t> expected(9);
  for (std::uint64_t i = 0; i < 10000; ++i) {
    histogram.see(mix(i) % 12);
    ++expected[std::min<std::uint64_t>(mix(i) % 12, 8)];
  }
  EXPECT_EQ(histogram.counts(), expected);
  EXPECT_EQ(histogram.count(), 10000U);
}

struct Cache : StatisticSet {
  Counter hits{*this, "hits", "accesses", "found"};
  Counter misses{*this, "misses", "accesses", "not found"};
  Counter bytes{*this, "bytes", "bytes", "moved"};
  Ratio hit_rate{*this, hits, hits + misses, "hit_rate", "", "of accesses"};
  Ratio everything{*this, hits + misses + bytes, bytes, "everything", "", "over bytes"};
};

TEST(Ratio, IsAFormulaOverCounters) {
  Cache cache;
  EXPECT_EQ(cache.hit_rate.denominator(), 0U);
  cache.hits += 3;
  ++cache.misses;
  cache.bytes += 32;
  EXPECT_EQ(cache.hit_rate.numerator(), 3U);
  EXPECT_EQ(cache.hit_rate.denominator(), 4U);
  EXPECT_EQ(cache.hit_rate.formula(), "hits / (hits + misses)");
  EXPECT_EQ(cache.everything.numerator(), 36U);
  EXPECT_EQ(cache.everything.formula(), "(hits + misses + bytes) / bytes");
  EXPECT_EQ(cache.ratios().size(), 2U);
}

TEST(Ratio, IsOfCountersOfItsOwnSet) {
  Cache cache;
  StatisticSet other;
  EXPECT_THROW(Ratio(other, cache.hits, cache.misses, "rate", "", ""), std::logic_error);
  EXPECT_TRUE(other.ratios().empty());
}

TEST(StatisticSet, ANameIsDeclaredOnce) {
  Cache cache;
  EXPECT_THROW(Counter(cache, "hits", "", ""), std::logic_error);
  EXPECT_THROW(Histogram(cache, Histogram::Buckets::log2(), "hit_rate", "", ""), std::logic_error);
  EXPECT_THROW(StatisticSet(cache, "bytes"), std::logic_error);
  const StatisticSet part(cache, "tags");
  EXPECT_THROW(Counter(cache, "tags", "", ""), std::logic_error);
  EXPECT_EQ(cache.counters().size(), 3U);
}

TEST(StatisticSet, PartsHaveNamesOfTheirOwn) {
  struct Unit : StatisticSet {
    Counter hits{*this, "hits", "accesses", "found"};
    StatisticSet cache{*this, "cache"};
    Counter cache_hits{cache, "hits", "accesses", "found"};
  } unit;
  ASSERT_EQ(unit.parts().size(), 1U);
  EXPECT_STREQ(unit.parts().front()->part_name(), "cache");
  EXPECT_FALSE(unit.cache.counted());
  ++unit.hits;
  EXPECT_FALSE(unit.cache.counted());
  ++unit.cache_hits;
  EXPECT_TRUE(unit.cache.counted());
}

}  // namespace
}  // namespace vrpipe
