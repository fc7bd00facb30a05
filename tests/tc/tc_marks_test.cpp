// TC in a frame of several draws: at a mark it hands on what it holds; a mere change of state goes no further.
#include <set>

#include <gtest/gtest.h>

#include <fmt/format.h>

#include "support/fidelities.h"
#include "tc/tc.h"
#include "tc/tc_tiles.h"

namespace vrpipe {
namespace {

using testing::beat_of;
using testing::pruned_at;
using testing::tile;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

using Words = std::vector<std::string>;

constexpr unsigned change_command = 1;  ///< command of a draw of another state
constexpr unsigned clear_command = 2;   ///< command of a clear

/// TC with its ports, of whatever fidelity.
struct TcBench {
  TcBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {}, unsigned depth = 4)
      : bench(fidelity, "tc", "tile-coalescing", context, settings),
        in(bench.source<QuadBeat>("in_quads", depth)),
        beats(fidelity == Fidelity::cycle ? &bench.sink<QuadBeat>("out_bins", depth) : nullptr),
        bins(fidelity == Fidelity::cycle ? nullptr : &bench.sink<BinItem>("out_bins", depth)) {}
  void mark(unsigned command, Cycle at = 0) { in.add(testing::marked<QuadBeat>(Frame::mark_of(command)), at); }
  void end(Cycle at = 0) { in.add(testing::end_beat(), at); }
  void close(Cycle from, Cycle until) { beats != nullptr ? beats->close(from, until) : bins->close(from, until); }

  /// What came out: the splats of each bin, and marks.
  struct Item {
    std::vector<std::uint32_t> splats;
    Mark mark = Mark::none;
    Cycle cycle = 0;
  };
  std::vector<Item> items() const {
    std::vector<Item> all;
    std::vector<std::uint32_t> bin;
    for (std::size_t n = 0; beats != nullptr && n < beats->records().size(); ++n) {
      const QuadBeat& beat = beats->records()[n].item;
      for (unsigned i = 0; i < beat.count; ++i) bin.push_back(beat.quads[i].splat);
      if (!beat.last_of_bin && beat.mark == Mark::none) continue;
      all.push_back({bin, beat.mark, beats->records()[n].cycle});
      bin.clear();
    }
    for (std::size_t n = 0; bins != nullptr && n < bins->records().size(); ++n) {
      const auto& record = bins->records()[n];
      all.push_back({testing::splats_of(record.item), record.item.mark, record.cycle});
    }
    return all;
  }
  Words words() const {
    Words all;
    for (const Item& item : items()) {
      all.push_back(item.mark == Mark::none           ? fmt::format("{}", fmt::join(item.splats, " "))
                    : item.mark == Mark::end_of_frame ? "end"
                                                      : fmt::format("mark {}", static_cast<unsigned>(item.mark) - 1));
    }
    return all;
  }

  Bench bench;
  Source<QuadBeat>& in;
  Sink<QuadBeat>* beats;
  Sink<BinItem>* bins;
};

class TcMarksTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  TcMarksTest() {
    const auto geometry = testing::geometry_of(640, 640);
    Frame frame(640, 640);
    frame.draw(geometry, pruned_at(0.1F));
    frame.draw(geometry, pruned_at(0.2F));
    frame.clear({true, true});
    frame.draw(geometry, pruned_at(0.2F));
    context = testing::context_of(frame);
  }
  RenderContext context;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, TcMarksTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(TcMarksTest, AClearFlushesAllBinsAndFollowsThem) {
  TcBench tc(GetParam(), context);
  tc.in.add(beat_of(tile(0), {1}, 0));
  tc.in.add(beat_of(tile(1), {1}, 1));
  tc.in.add(beat_of(tile(0), {2}, 2));
  tc.mark(clear_command);
  tc.in.add(beat_of(tile(0), {3}, 3));
  tc.end();
  tc.bench.run();
  EXPECT_EQ(tc.words(), (Words{"0 2", "1", "mark 2", "3", "end"}));
  EXPECT_TRUE(tc.bench.unit().idle());
}

TEST_P(TcMarksTest, AChangeOfStateFlushesAllBinsAndEndsThere) {
  TcBench tc(GetParam(), context);
  tc.in.add(beat_of(tile(0), {1, 2}, 0));
  tc.mark(change_command);
  tc.in.add(beat_of(tile(0), {3, 4}, 2));
  tc.end();
  tc.bench.run();
  EXPECT_EQ(tc.words(), (Words{"0 1", "2 3", "end"}));
}

TEST_P(TcMarksTest, MarksThatFindNothingGoOnOrNotAllTheSame) {
  TcBench tc(GetParam(), context);
  for (const unsigned command :
       {clear_command, change_command, change_command, clear_command, clear_command, change_command})
    tc.mark(command);
  tc.end();
  tc.bench.run();
  EXPECT_EQ(tc.words(), (Words{"mark 2", "mark 2", "mark 2", "end"}));
  EXPECT_TRUE(tc.bench.unit().idle());
}

TEST_P(TcMarksTest, ALostMarkLeavesNothingForTheTimeOut) {
  TcBench tc(GetParam(), context, {{"idle_timeout_cycles", "50"}});
  tc.in.add(beat_of(tile(0), {1}, 0));
  tc.mark(change_command);
  tc.in.add(beat_of(tile(1), {1}, 1), 300);
  tc.end(1000);
  tc.bench.run();
  EXPECT_EQ(tc.words(), (Words{"0", "1", "end"}));
  EXPECT_EQ(tc.bench.behaviour<TileCoalescing>().flushes_end_of_draw.value(), 1U);
  EXPECT_EQ(tc.bench.behaviour<TileCoalescing>().flushes_timed_out.value(), 1U) << "of the second draw";
  EXPECT_EQ(tc.items()[1].cycle, 301U + 50 + 1 + 4) << "its time begins with its own quads";
}

TEST_P(TcMarksTest, DrainsIntoAFullQueueAndAClosedReceiverWithMoreBehind) {
  for (const unsigned command : {change_command, clear_command}) {
    for (const char* queue : {"1", "2", "5"}) {
      for (const Cycle closed_from : {Cycle{0}, Cycle{10}, Cycle{25}}) {
        TcBench tc(GetParam(), context, {{"flush_queue_bins", queue}, {"bin_quads", "4"}}, 2);
        // Full bins, then nine that only a mark flushes, three times.
        std::uint32_t splat = 0;
        for (unsigned round = 0; round < 3; ++round) {
          for (unsigned i = 0; i < 6; ++i, splat += 4) tc.in.add(beat_of(tile(0), {1, 2, 3, 4}, splat));
          for (unsigned i = 0; i < 9; ++i, ++splat) tc.in.add(beat_of(tile(1 + i), {1}, splat));
          tc.mark(command);
        }
        tc.end();
        tc.close(closed_from, 2000);
        tc.bench.run();
        std::uint32_t next = 0;
        unsigned marks = 0;
        for (const TcBench::Item& item : tc.items()) {
          for (const std::uint32_t each : item.splats) ASSERT_EQ(each, next++) << "bins go in the order of their first";
          marks += item.mark != Mark::none;
        }
        EXPECT_EQ(next, splat);
        EXPECT_EQ(marks, command == clear_command ? 4U : 1U);
        EXPECT_TRUE(tc.bench.unit().idle());
      }
    }
  }
}

TEST_P(TcMarksTest, ABinIsOfOneStateAndNoQuadPassesAMarkUnderAnyStalls) {
  constexpr unsigned beats = 400;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    TcBench tc(GetParam(), context,
               {{"bins", std::to_string(1 + mix(seed) % 6)},
                {"bin_quads", std::to_string(1 + mix(seed + 1) % 40)},
                {"flush_queue_bins", std::to_string(1 + mix(seed + 2) % 3)},
                {"idle_timeout_cycles", mix(seed + 3) % 2 == 0 ? "0" : "20"},
                {"quads_per_cycle", std::to_string(1 + mix(seed + 4) % 16)}},
               1 + mix(seed + 5) % 4);
    std::map<std::uint32_t, unsigned> clears_before;
    std::map<std::uint32_t, unsigned> marks_before;
    std::uint32_t splat = 0;
    unsigned clears = 0;
    unsigned marks = 0;
    Cycle at = 0;
    for (unsigned i = 0; i < beats; ++i) {
      const std::uint64_t random = mix(seed * 1000 + i);
      at += random % 16 == 0 ? random / 16 % 100 : 0;
      if (random % 9 == 1) {
        const bool clears_now = random / 9 % 2 == 0;
        clears += clears_now;
        ++marks;
        tc.mark(clears_now ? clear_command : change_command, at);
        continue;
      }
      std::vector<unsigned> positions(1 + random / 32 % 16, 5);
      tc.in.add(beat_of(tile(static_cast<unsigned>(random / 1024 % 8)), positions, splat), at);
      for (std::size_t n = 0; n < positions.size(); ++n, ++splat) {
        clears_before[splat] = clears;
        marks_before[splat] = marks;
      }
    }
    tc.end(at);
    tc.close(100, 100 + 60 * (seed % 10));
    tc.bench.stall_randomly(seed, seed % 3 == 0 ? 0 : 80);
    tc.bench.run();
    unsigned seen = 0;
    std::set<std::uint32_t> splats;
    for (const TcBench::Item& item : tc.items()) {
      for (const std::uint32_t each : item.splats) {
        ASSERT_EQ(clears_before[each], seen) << "seed " << seed;
        ASSERT_EQ(marks_before[each], marks_before[item.splats.front()]) << "seed " << seed;
        splats.insert(each);
      }
      seen += item.mark == Frame::mark_of(clear_command);
    }
    EXPECT_EQ(seen, clears);
    EXPECT_EQ(splats.size(), splat);
    EXPECT_TRUE(tc.bench.unit().idle());
  }
}

}  // namespace
}  // namespace vrpipe
