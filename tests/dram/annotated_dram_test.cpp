// The DRAM with annotated time, of `lt`: where nothing is guessed it is that of `cycle`.

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

#include "dram_bench.h"

namespace vrpipe {
namespace {

using namespace testing;

class AnnotatedDramTest : public ::testing::TestWithParam<const char*> {
 protected:
  void expect_as_at_cycle(const std::vector<Access>& accesses) {
    const std::vector<Cycle> cycle = bench.answered(accesses);
    EXPECT_EQ(bench.annotated_answers(accesses), cycle);
  }
  DramBench bench{GetParam(), {{"hash", "off"}, {"mapping", "row-bank-column-channel"}, {"channels", "1"}}};
};

INSTANTIATE_TEST_SUITE_P(Of, AnnotatedDramTest, ::testing::Values("lpddr3-1600", "lpddr5-6400"),
                         [](const auto& name) { return std::string(name.param).substr(0, 6); });

constexpr std::uint64_t far_row = 1U << 20U;  ///< of the same bank

TEST_P(AnnotatedDramTest, ARowIsOpenedHitAndClosed) {
  expect_as_at_cycle({read(10, 0)});
  expect_as_at_cycle({read(10, 0), read(300, 64)});
  expect_as_at_cycle({read(10, 0), read(300, far_row)});
  expect_as_at_cycle({read(10, 0), read(300, far_row), read(600, far_row + 32), read(900, 0)});
}

TEST_P(AnnotatedDramTest, ALineIsReadBurstByBurst) { expect_as_at_cycle({read(10, 0, 128), read(300, 256, 128)}); }

TEST_P(AnnotatedDramTest, ARowIsNotClosedBeforeItMay) { expect_as_at_cycle({read(10, 0), read(11, far_row)}); }

TEST_P(AnnotatedDramTest, AWriteIsAnsweredOnceItIsQueued) { expect_as_at_cycle({write(10, 0), write(11, far_row)}); }

TEST_P(AnnotatedDramTest, AReadOfWhatIsQueuedToBeWrittenIsAnsweredFromThere) {
  expect_as_at_cycle({write(10, 0), read(40, 0), write(50, 0), read(60, far_row)});
  EXPECT_EQ(bench.annotated->statistics.channels.reads_forwarded.value(), 1U);
  EXPECT_EQ(bench.annotated->statistics.channels.writes_merged.value(), 1U);
  // Of more writes the first are no longer queued: 32 stay.
  std::vector<Access> accesses;
  for (std::uint64_t i = 0; i < 40; ++i) accesses.push_back(write(10, i * 32));
  accesses.push_back(read(1000, 0));
  accesses.push_back(read(1000, 39 * 32));
  bench.answered(accesses);
  EXPECT_EQ(bench.clocked->statistics.channels.reads_forwarded.value(), 1U);
  bench.annotated_answers(accesses);
  EXPECT_EQ(bench.annotated->statistics.channels.reads_forwarded.value(), 1U);
}

TEST_P(AnnotatedDramTest, ARefreshIsInTheWay) {
  // Refreshes fall due every 3.9 us; rows are closed, refreshed, and opened again.
  const std::vector<Access> accesses = {read(10, 0), read(3950, 0)};
  const std::vector<Cycle> cycle = bench.answered(accesses);
  const std::vector<Cycle> annotated = bench.annotated_answers(accesses);
  EXPECT_EQ(annotated, cycle);
  EXPECT_GT(annotated[1], 3950U + 100U);
  expect_as_at_cycle({read(10, 0), read(5000, 0)});
}

TEST_P(AnnotatedDramTest, AccessesThatRanAheadDoNotDelayEarlierOnes) {
  const std::vector<Access> late = {read(2000, far_row), read(2001, far_row + 32), read(2010, 2 * far_row)};
  std::vector<Access> accesses = late;
  const Cycle alone = bench.annotated_answers({read(100, 4096)})[0];
  accesses.push_back(read(100, 4096));
  EXPECT_EQ(bench.annotated_answers(accesses).back(), alone);
}

TEST_P(AnnotatedDramTest, ARowThatWasOpenedAheadOfTimeTakesAsLongFromAnEarlierAccess) {
  const Cycle alone = bench.annotated_answers({read(100, far_row + 32)})[0];
  EXPECT_EQ(bench.annotated_answers({read(2000, far_row), read(100, far_row + 32)})[1], alone);
}

TEST_P(AnnotatedDramTest, ReadsAndWritesByTurnsLoseTheTurnsOfTheBus) {
  const auto cycles = [&](bool writes) {
    std::vector<Access> accesses;
    for (std::uint64_t i = 0; i < 4000; ++i) {
      // Bursts of two banks by turns, row after row.
      const std::uint64_t address = i % 2 * 4096 + i / 2 % 64 * 32 + i / 128 * 32768;
      accesses.push_back(writes && i % 2 == 1 ? write(0, address) : read(0, address));
    }
    const std::vector<Cycle> answered = bench.annotated_answers(accesses, 64);
    return static_cast<double>(*std::max_element(answered.begin(), answered.end()));
  };
  EXPECT_GT(cycles(true), 1.04 * cycles(false));
}

TEST_P(AnnotatedDramTest, CountsWhatItDoes) {
  std::vector<Access> accesses;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const std::uint64_t address = mix(i) % 8192 * 32;
    accesses.push_back(i % 4 == 0 ? write(i, address) : read(i, address, address % 64 == 0 ? 64 : 32));
  }
  bench.annotated_answers(accesses);
  bench.annotated->close(7000);
  const DramStatistics& s = bench.annotated->statistics.channels;
  EXPECT_EQ(32 * (s.reads.value() + s.reads_forwarded.value()),
            bench.behaviour->traffic().bytes(MemoryTraffic::color, false));
  EXPECT_EQ(32 * (s.writes.value() + s.writes_merged.value() + 32),
            bench.behaviour->traffic().bytes(MemoryTraffic::color, true));
  EXPECT_EQ(s.row_hits.value() + s.row_misses.value() + s.row_conflicts.value(), s.reads.value() + s.writes.value());
  EXPECT_EQ(s.activates.value(), s.row_misses.value() + s.row_conflicts.value());
  EXPECT_EQ(bench.annotated->statistics.read_latency.count(), 1500U);
  EXPECT_EQ(s.channel_cycles.value(), 5600U);
  EXPECT_EQ(s.refreshes.value(), 1U);
}

}  // namespace
}  // namespace vrpipe
