// A channel's controller: timelines worked out by hand, from LPDDR3-1600 with cycles of 1.25 ns: tRCD 15, RL 12, WL 6,
// tRP 15, tRPab 17, tRAS 34, tRC 48, tWR 12, tDQSS 1, tWTR 6, tRTP 6, tRRD 8, tCCD 4, tRTW 2, tRFC 104, tREFI 3120, and
// bursts of 4.

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "traffic.h"

namespace vrpipe {
namespace {

using namespace testing;
using Kind = DramCommand::Kind;
using Completions = std::map<std::uint32_t, Cycle>;

class DramChannelTest : public ::testing::Test {
 protected:
  void set(const std::string& name, const std::string& value) { parameters.set("dram", name, value); }
  void start() {
    bench = std::make_unique<ChannelBench>(parameters);
    log.commands.clear();
    bench->channel.observe(log);
  }
  static DramAddress at(unsigned bank, std::uint64_t row, std::uint32_t column = 0) {
    DramAddress place;
    place.bank = bank;
    place.row = row;
    place.column = column;
    return place;
  }
  void read(Cycle now, const DramAddress& place, std::uint32_t tag) {
    bench->channel.advance(now);
    ASSERT_TRUE(bench->channel.can_read());
    bench->channel.read(place, tag, now);
  }
  void write(Cycle now, const DramAddress& place) {
    bench->channel.advance(now);
    ASSERT_TRUE(bench->channel.can_write());
    bench->channel.write(place, now);
  }
  /// Kinds and cycles of all commands.
  std::vector<std::pair<Kind, Cycle>> commands() const {
    std::vector<std::pair<Kind, Cycle>> found;
    for (const DramCommand& command : log.commands) found.emplace_back(command.kind, command.at);
    return found;
  }
  using Commands = std::vector<std::pair<Kind, Cycle>>;

  DramParameters parameters{lpddr3_1600};
  CommandLog log;
  std::unique_ptr<ChannelBench> bench;
};

TEST_F(DramChannelTest, OpensARowReadsItAndReadsItAgain) {
  start();
  read(0, at(0, 7), 1);
  read(100, at(0, 7, 3), 2);
  EXPECT_EQ(bench->completed(200), (Completions{{1, 15 + 12 + 4}, {2, 100 + 12 + 4}}));
  EXPECT_EQ(commands(), (Commands{{Kind::activate, 0}, {Kind::read, 15}, {Kind::read, 100}}));
  EXPECT_EQ(bench->statistics.row_misses.value(), 1U);
  EXPECT_EQ(bench->statistics.row_hits.value(), 1U);
}

TEST_F(DramChannelTest, ClosesARowForAnother) {
  start();
  read(0, at(0, 7), 1);
  read(200, at(0, 8), 2);
  EXPECT_EQ(bench->completed(300)[2], 200 + 15 + 15 + 12 + 4);
  EXPECT_EQ(log.commands[2].kind, Kind::precharge);
  EXPECT_EQ(bench->statistics.row_conflicts.value(), 1U);
}

TEST_F(DramChannelTest, ClosesARowNoEarlierThanItMay) {
  start();
  read(0, at(0, 7), 1);
  read(1, at(0, 8), 2);
  // tRAS from the activate; tRP; and tRC is less than both.
  EXPECT_EQ(bench->completed(300)[2], 34 + 15 + 15 + 12 + 4);
}

TEST_F(DramChannelTest, BanksWorkSideBySide) {
  start();
  read(0, at(0, 7), 1);
  read(0, at(1, 7), 2);
  bench->completed(300);
  EXPECT_EQ(commands(), (Commands{{Kind::activate, 0}, {Kind::activate, 8}, {Kind::read, 15}, {Kind::read, 8 + 15}}));
}

TEST_F(DramChannelTest, ARowHitOvertakesAConflict) {
  start();
  read(0, at(0, 7), 1);
  read(1, at(0, 8), 2);
  read(2, at(0, 7, 5), 3);
  const Completions done = bench->completed(300);
  EXPECT_EQ(done.at(3), 15 + 4 + 12 + 4);
  EXPECT_EQ(done.at(2), 34 + 15 + 15 + 12 + 4);
}

TEST_F(DramChannelTest, RowHitsDoNotKeepAConflictWaitingForEver) {
  for (const unsigned cap : {100U, 400U}) {
    set("age_cap_cycles", std::to_string(cap));
    start();
    read(0, at(0, 7), 1);
    read(1, at(0, 8), 2);
    for (Cycle now = 2; now < 1000; now += 4) {
      bench->channel.advance(now);
      if (bench->channel.can_read()) bench->channel.read(at(0, 7, 3), 3, now);
    }
    const Cycle served = bench->completed(2000)[2];
    // Once it is too old: a precharge after the read before, an activate, a read.
    EXPECT_GT(served, cap);
    EXPECT_LE(served, 1 + cap + 4 + 6 + 15 + 15 + 12 + 4);
  }
}

TEST_F(DramChannelTest, ARefreshIsInTheWayFromTheCycleInWhichItIsDue) {
  constexpr Cycle due = 3120;
  start();
  read(0, at(0, 7), 1);
  read(due - 1, at(0, 7), 2);
  EXPECT_EQ(bench->completed(due + 200)[2], due - 1 + 12 + 4);
  EXPECT_EQ(commands(), (Commands{{Kind::activate, 0},
                                  {Kind::read, 15},
                                  {Kind::read, due - 1},
                                  {Kind::precharge_all, due - 1 + 6},
                                  {Kind::refresh, due - 1 + 6 + 17}}));
  start();
  read(0, at(0, 7), 1);
  read(due, at(0, 7), 2);
  EXPECT_EQ(bench->completed(due + 200)[2], due + 17 + 104 + 15 + 12 + 4);
  EXPECT_EQ(commands(), (Commands{{Kind::activate, 0},
                                  {Kind::read, 15},
                                  {Kind::precharge_all, due},
                                  {Kind::refresh, due + 17},
                                  {Kind::activate, due + 17 + 104},
                                  {Kind::read, due + 17 + 104 + 15}}));
}

TEST_F(DramChannelTest, RefreshesWhileNothingIsAskedFor) {
  start();
  read(0, at(0, 7), 1);
  bench->completed(40);
  EXPECT_EQ(bench->channel.next_command(), never) << "nobody needs to come for it";
  bench->channel.advance(10 * 3120 + 18);
  EXPECT_EQ(bench->statistics.refreshes.value(), 10U);
  set("refresh", "off");
  start();
  read(0, at(0, 7), 1);
  bench->channel.advance(10 * 3120 + 18);
  EXPECT_EQ(bench->statistics.refreshes.value(), 0U);
}

TEST_F(DramChannelTest, AFullQueueIsBlockedAtTheReadAndReadyAfterIt) {
  set("read_queue", "2");
  start();
  read(0, at(0, 7), 1);
  read(0, at(0, 7, 1), 2);
  bench->channel.advance(15);
  EXPECT_FALSE(bench->channel.can_read());
  EXPECT_EQ(bench->channel.next_command(), 15U);
  bench->channel.advance(16);
  EXPECT_TRUE(bench->channel.can_read());
  EXPECT_TRUE(bench->channel.can_write()) << "that has a queue of its own";
}

class DramWritesTest : public DramChannelTest {
 protected:
  /// Writes drain at once.
  DramWritesTest() {
    set("write_high", "1");
    set("write_low", "0");
  }
};

TEST_F(DramWritesTest, AReadAfterAWriteWaitsForTheBusToTurn) {
  start();
  write(0, at(0, 7));
  read(1, at(0, 7, 1), 1);
  EXPECT_EQ(bench->completed(200)[1], 15 + (6 + 1 + 4) + 6 + 12 + 4);
  EXPECT_EQ(commands(), (Commands{{Kind::activate, 0}, {Kind::write, 15}, {Kind::read, 15 + 6 + 1 + 4 + 6}}));
}

TEST_F(DramWritesTest, AWriteAfterAReadWaitsForTheBusToTurn) {
  start();
  read(0, at(0, 7), 1);
  write(16, at(0, 7, 1));
  bench->completed(200);
  // Its data follows that of the read after tRTW.
  EXPECT_EQ(commands(), (Commands{{Kind::activate, 0}, {Kind::read, 15}, {Kind::write, 15 + 12 + 4 + 2 - 6}}));
}

TEST_F(DramWritesTest, AWrittenRowIsClosedAfterTheWriteRecovers) {
  start();
  write(0, at(0, 7));
  read(100, at(0, 7), 1);
  write(101, at(0, 7, 2));
  read(200, at(0, 8), 2);
  bench->completed(400);
  const Cycle written = 100 + 12 + 4 + 2 - 6;
  EXPECT_EQ(log.cycles(Kind::write), (std::vector<Cycle>{15, written}));
  EXPECT_EQ(log.cycles(Kind::precharge), (std::vector<Cycle>{200}));
  start();
  write(0, at(0, 7));
  read(30, at(0, 8), 2);
  bench->completed(400);
  EXPECT_EQ(log.cycles(Kind::precharge), (std::vector<Cycle>{15 + 6 + 1 + 4 + 12}));
}

TEST_F(DramWritesTest, AWriteWaitsForOlderReadsOfItsBurst) {
  start();
  read(0, at(0, 7), 1);
  read(0, at(0, 7), 2);
  write(1, at(0, 7));
  bench->completed(300);
  EXPECT_EQ(log.cycles(Kind::read), (std::vector<Cycle>{15, 19}));
  EXPECT_EQ(log.cycles(Kind::write), (std::vector<Cycle>{19 + 12 + 4 + 2 - 6}));
}

TEST_F(DramChannelTest, AReadOfWhatIsQueuedToBeWrittenIsAnsweredFromThere) {
  start();
  write(0, at(0, 7));
  read(5, at(0, 7), 1);
  write(6, at(0, 7));
  read(8, at(0, 7, 1), 2);
  EXPECT_EQ(bench->completed(100), (Completions{{1, 6}, {2, 8 + 15 + 12 + 4}}));
  EXPECT_EQ(bench->statistics.reads_forwarded.value(), 1U);
  EXPECT_EQ(bench->statistics.writes_merged.value(), 1U);
  EXPECT_EQ(bench->statistics.writes.value(), 0U);
}

TEST_F(DramChannelTest, WritesDrainFromTheHighMarkToTheLow) {
  set("write_high", "6");
  set("write_low", "2");
  start();
  for (unsigned i = 0; i < 20; ++i) read(0, at(0, 7, i), i);
  for (unsigned i = 0; i < 5; ++i) write(0, at(1, 7, i));
  bench->channel.advance(40);
  EXPECT_TRUE(log.cycles(Kind::write).empty()) << "reads go first";
  write(40, at(1, 7, 5));
  bench->completed(300);
  const std::vector<Cycle> writes = log.cycles(Kind::write);
  ASSERT_EQ(writes.size(), 4U);
  EXPECT_GT(writes.front(), 40U);
  for (const Cycle read : log.cycles(Kind::read))
    EXPECT_TRUE(read < 40 || read > writes.back()) << "a drain is not interrupted: " << read;
  // From when it was due until the last of it.
  EXPECT_EQ(bench->statistics.drain_cycles.value(), writes.back() - 40);
}

TEST_F(DramChannelTest, WithoutReadsWritesAboveTheLowMarkAreWritten) {
  set("write_high", "6");
  set("write_low", "2");
  start();
  for (unsigned i = 0; i < 5; ++i) write(0, at(1, 7, i));
  bench->channel.advance(1000);
  EXPECT_EQ(log.cycles(Kind::write).size(), 3U);
  EXPECT_EQ(bench->channel.next_command(), never);
}

TEST_F(DramChannelTest, ADenseStreamOfWritesDoesNotStarveReads) {
  start();
  std::uint32_t written = 0;
  for (; bench->channel.can_write(); ++written) bench->channel.write(at(0, 7, written % 64), 0);
  read(1, at(1, 9), 1);
  Cycle now = 1;
  for (; now < 20000 && bench->completed(now).count(1) == 0; ++now) {
    if (bench->channel.can_write()) bench->channel.write(at(0, written / 64, written % 64), now);
    if (bench->channel.can_write()) ++written;
  }
  // A drain takes at most a queue of writes.
  EXPECT_LT(now, 2 * 64 * 4 + 200U);
}

TEST_F(DramChannelTest, ThePagePolicyClosesWhatNobodyNeeds) {
  set("page_policy", "closed");
  start();
  read(0, at(0, 7), 1);
  read(20, at(0, 7, 1), 2);
  read(200, at(0, 7), 3);
  EXPECT_EQ(bench->completed(300).at(3), 200 + 15 + 12 + 4);
  EXPECT_EQ(log.cycles(Kind::precharge), (std::vector<Cycle>{34, 200 + 34}));
  EXPECT_EQ(bench->statistics.row_misses.value(), 2U);
  EXPECT_EQ(bench->statistics.row_hits.value(), 1U);
}

TEST_F(DramWritesTest, ThePagePolicyClosesNoRowThatAReadWaitsFor) {
  set("page_policy", "closed");
  start();
  read(0, at(0, 7), 1);
  write(1, at(1, 7));
  write(1, at(1, 8));
  // The drain goes from row 7 to row 8 of bank 1.
  const Cycle written = 8 + 15 + (6 + 1 + 4) + 12 + 15 + 15;
  EXPECT_EQ(bench->completed(300).at(1), written + (6 + 1 + 4) + 6 + 12 + 4);
  EXPECT_EQ(log.cycles(Kind::write).back(), written);
  EXPECT_EQ(log.cycles(Kind::activate).size(), 3U);
}

TEST_F(DramChannelTest, CountsHowFullItIsAndHowLongReadsTake) {
  start();
  read(0, at(0, 7), 1);
  read(0, at(0, 7, 1), 2);
  write(0, at(0, 7, 2));
  bench->completed(100);
  EXPECT_EQ(bench->statistics.reads_queued.largest(), 1U);
  EXPECT_EQ(bench->statistics.writes_queued.largest(), 0U);
  EXPECT_EQ(bench->statistics.read_cycles.sum(), 31U + 35U);
  bench->channel.close(100);
  EXPECT_EQ(bench->statistics.channel_cycles.value(), 100U);
  EXPECT_EQ(bench->statistics.drain_cycles.value(), 0U);
}

}  // namespace
}  // namespace vrpipe
