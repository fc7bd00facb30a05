// Warps that are tested late: PROP sends them to ZROP in their turn, and to CROP when they are back.
#include <map>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/prop.h>

#include "prop/mark_numbers.h"
#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::mark_number;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

/// Draw 0 is tested late, draw 1 not at all, draw 2 before it is shaded; a clear of colour lies between 0 and 1.
constexpr std::size_t color_clear_command = 1;
constexpr std::size_t early_draw_command = 3;
RenderContext three_draws() {
  DrawState late;
  late.depth = {true, Compare::less, true};
  DrawState early;
  early.depth = {true, Compare::less, false};
  Frame frame(256, 256);
  frame.draw(testing::geometry_of(256, 256), late);
  frame.clear({true, false});
  frame.draw(testing::geometry_of(256, 256), {});
  frame.draw(testing::geometry_of(256, 256), early);
  return testing::context_of(frame);
}

using Numbers = std::vector<std::uint32_t>;

/// PROP and what stands for ZROP: it gives a warp back so many cycles later, without the quads at `dead` positions.
class LateProp : public ::testing::TestWithParam<Fidelity> {
 protected:
  LateProp() : context(three_draws()) {}

  void make(const Bench::Settings& settings = {}, unsigned depth = 64) {
    bench = std::make_unique<Bench>(GetParam(), "prop", "pre-rop", context, settings);
    shaded = &bench->source<ShadedWarpItem>("in_shaded", 64);
    back = &bench->source<ShadedWarpItem>("in_late", depth);
    bench->sink<ShadedWarpItem>("out_late", depth).on_take([this](const ShadedWarpItem& item, Cycle at) {
      sent.push_back(number_of(*item.warp));
      sent_at.push_back(at);
      ShadedWarp& warp = item.warp->editable();
      std::array<LaneMask, quads_per_warp> passed{};
      for (unsigned i = 0; i < quads_per_warp; ++i) passed[i] = warp.position[i] == dead ? LaneMask{0} : all_lanes;
      if (warp.mark == Mark::none) warp.keep(passed);
      back->add(item, at + delay);
    });
    release = &bench->sink<WarpRelease>("out_release", depth);
    const auto note = [this](std::uint32_t number, Cycle at) {
      if (!left.empty() && left.back() == number) return;
      left.push_back(number);
      left_at.push_back(at);
    };
    if (GetParam() == Fidelity::cycle) {
      bench->sink<ColorBeat>("out_color", depth).on_take([note](const ColorBeat& beat, Cycle at) {
        if (beat.mark != Mark::none) note(mark_number(beat.mark), at);
        for (unsigned i = 0; i < beat.count; ++i) note(number_of(*beat.quads[i].warp), at);
      });
    } else {
      bench->sink<ShadedWarpItem>("out_color", depth).on_take([note](const ShadedWarpItem& item, Cycle at) {
        note(number_of(*item.warp), at);
      });
    }
  }
  static std::uint32_t number_of(const ShadedWarp& warp) {
    return warp.mark != Mark::none ? mark_number(warp.mark) : warp.sequence;
  }
  ShadedWarpItem warp(std::uint32_t sequence, unsigned column, std::uint32_t tile_sequence, DrawIndex draw,
                      std::uint8_t count = 8) {
    ShadedWarp& made = pool.take();
    made.tile = {static_cast<std::uint16_t>(column), 0};
    made.sequence = sequence;
    made.tile_sequence = tile_sequence;
    made.count = count;
    made.slot = static_cast<std::uint16_t>(sequence);
    made.mark = Mark::none;
    for (unsigned i = 0; i < count; ++i) {
      made.position[i] = static_cast<std::uint8_t>(i);
      made.live[i] = all_lanes;
      made.draw[i] = draw;
      made.first_primitive[i] = made.last_primitive[i] = sequence * 8 + i;
      made.color[i] = testing::color_of(1, 1, 1, 1);
    }
    return {&made};
  }
  ShadedWarpItem mark(std::uint32_t sequence, std::size_t command) {
    ShadedWarp& made = warp(sequence, 0, 0, 0, 0).warp->editable();
    made.mark = Frame::mark_of(command);
    made.slot = no_slot;
    return {&made};
  }

  const RenderContext context;
  std::unique_ptr<Bench> bench;
  Source<ShadedWarpItem>* shaded = nullptr;
  Source<ShadedWarpItem>* back = nullptr;
  Sink<WarpRelease>* release = nullptr;
  Cycle delay = 100;
  unsigned dead = 64;
  Numbers sent, left;
  std::vector<Cycle> sent_at, left_at;
  ShadedWarpPool pool;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, LateProp, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(LateProp, AWarpGoesToZropInItsTurnAndToCropWhenItIsBack) {
  make({{"latency_cycles", "4"}});
  shaded->add(warp(0, 0, 0, 0), 10);
  shaded->add(warp(1, 0, 1, 1), 40);
  bench->run();
  EXPECT_EQ(sent, Numbers{0});
  // Visible in 11, in its turn in 12, through the unit in 4.
  EXPECT_EQ(sent_at[0], 16U);
  ASSERT_EQ(left, (Numbers{0, 1}));
  // Back in 116 and visible in 117. At `lt` it goes in one piece, whose last quads leave 3 cycles later.
  EXPECT_EQ(left_at[0], 117U + 4 + (GetParam() == Fidelity::cycle ? 0 : 3));
  EXPECT_GE(left_at[1], left_at[0] + 4) << "8 quads go in 4 cycles";
  EXPECT_EQ(release->records().size(), 2U);
  EXPECT_TRUE(bench->unit().idle());
}

TEST_P(LateProp, WarpsOfATileAreSentOneBehindTheOther) {
  make({{"quads_per_cycle", "8"}});
  shaded->add(warp(0, 0, 0, 0), 10);
  shaded->add(warp(1, 0, 1, 0), 10);
  shaded->add(warp(2, 0, 2, 0), 10);
  bench->run();
  EXPECT_EQ(sent, (Numbers{0, 1, 2}));
  EXPECT_EQ(sent_at[1], sent_at[0] + 1) << "not when the one before is back";
  EXPECT_EQ(sent_at[2], sent_at[1] + 1);
  EXPECT_EQ(left, (Numbers{0, 1, 2}));
  EXPECT_DOUBLE_EQ(testing::occupied(bench->unit(), PropWork::late, 10'000), 3);
}

TEST_P(LateProp, AWarpThatTheTestLeavesNothingOfIsPassedOverAndReleased) {
  make();
  dead = 0;
  shaded->add(warp(0, 0, 0, 0, 1), 10);
  shaded->add(warp(1, 1, 0, 0, 2), 10);
  shaded->add(warp(2, 2, 0, 0, 0), 10);
  bench->run();
  EXPECT_EQ(sent, (Numbers{0, 1})) << "one without quads is not tested";
  EXPECT_EQ(left, Numbers{1});
  EXPECT_EQ(release->records().size(), 3U);
  EXPECT_TRUE(bench->unit().idle());
}

// Where a shader discards, warps with nothing left are as frequent as others.
TEST_P(LateProp, AWarpWithoutQuadsDoesNotWaitForLateTestsOfThoseBeforeIt) {
  make();
  shaded->add(warp(0, 0, 0, 0), 10);
  shaded->add(warp(1, 0, 1, 0, 0), 10);
  shaded->add(warp(2, 0, 2, 0), 10);
  bench->run();
  EXPECT_EQ(sent, (Numbers{0, 2}));
  EXPECT_LE(sent_at[1], sent_at[0] + 2) << "not when the first is back";
  ASSERT_EQ(release->records().size(), 3U);
  // At `lt` a sink takes in the order of the calls.
  if (GetParam() == Fidelity::cycle) {
    EXPECT_EQ(release->records()[0].item.slot, 1U);
  }
  EXPECT_EQ(left, (Numbers{0, 2}));
  EXPECT_TRUE(bench->unit().idle());
}

TEST_P(LateProp, AWarpWithoutQuadsTakesNoTimeInWhichOthersAreHandedOn) {
  make();
  // 64 cycles of colours; in 20 of these a warp without quads comes.
  for (unsigned i = 0; i < 16; ++i) shaded->add(warp(i, i, 0, 0), 10);
  for (unsigned i = 0; i < 20; ++i) shaded->add(warp(16 + i, 16 + i, 0, 0, 0), 125 + i);
  bench->run();
  ASSERT_EQ(left.size(), 16U);
  const double occupied =
      testing::occupied(bench->unit(), PropWork::color) + testing::occupied(bench->unit(), PropWork::empty_warps);
  EXPECT_LE(occupied, static_cast<double>(left_at.back() + 4 - left_at.front())) << "the last takes 4 cycles, too";
}

// A mark that nobody waits for, and what is not tested late, keep their place behind what is.
TEST_P(LateProp, WhatIsNotTestedLateWaitsForWhatIs) {
  make();
  shaded->add(warp(0, 0, 0, 0), 10);
  shaded->add(warp(1, 1, 0, 0), 11);
  shaded->add(mark(2, color_clear_command), 12);
  shaded->add(warp(2, 0, 1, 1), 13);
  shaded->add(warp(3, 2, 0, 1), 14);
  bench->run();
  EXPECT_EQ(sent, (Numbers{0, 1}));
  EXPECT_EQ(left, (Numbers{0, 1, mark_number(color_clear_command), 2, 3}));
  EXPECT_GT(left_at[2], 100U);
}

// As in a frame without late tests: it is not chosen before it can go.
TEST_P(LateProp, TheOldestThatIsThereGoesWhenTheWayIsFree) {
  make({{"color_bytes_per_cycle", "16"}}, 2);  // a quad in two cycles
  shaded->add(warp(0, 0, 0, 1), 10);
  shaded->add(warp(2, 1, 0, 1), 14);
  shaded->add(warp(1, 2, 0, 1), 20);
  bench->run();
  if (GetParam() == Fidelity::lt) GTEST_SKIP() << "chooses among those that have come when it is called";
  EXPECT_EQ(left, (Numbers{0, 1, 2}));
}

TEST_P(LateProp, AMarkThatWaitsForLateTestsGoesTheirWay) {
  make();
  shaded->add(warp(0, 0, 0, 0), 10);
  shaded->add(mark(1, early_draw_command), 11);
  bench->run();
  EXPECT_EQ(sent, (Numbers{0, mark_number(early_draw_command)}));
  EXPECT_EQ(left, (Numbers{0, mark_number(early_draw_command)}));
  EXPECT_GT(left_at[1], 110U);
  EXPECT_EQ(release->records().size(), 2U);
  EXPECT_TRUE(bench->unit().idle());
}

TEST_P(LateProp, AMarkStaysBehindAllQuadsOfTheWarpBeforeIt) {
  for (const std::size_t command : {color_clear_command, early_draw_command}) {
    sent.clear();
    left.clear();
    make({{"color_bytes_per_cycle", "16"}}, 2);  // a quad in two cycles
    shaded->add(warp(0, 0, 0, 0), 10);
    shaded->add(mark(1, command), 11);
    shaded->add(warp(1, 0, 1, 1), 12);
    bench->run();
    EXPECT_EQ(left, (Numbers{0, mark_number(command), 1}));
    EXPECT_EQ(release->records().size(), 3U);
  }
}

TEST_P(LateProp, NoOrderAndNoStallMovesAWarpPastAnotherOfItsTile) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    sent.clear();
    left.clear();
    delay = 1 + seed * 13;
    dead = seed % 8;
    make({{"quads_per_cycle", seed % 2 == 0 ? "16" : "5"}, {"order", seed % 3 == 0 ? "draw" : "tile"}},
         seed % 4 == 0 ? 2 : 64);
    std::map<unsigned, std::uint32_t> launched;
    std::map<std::uint32_t, unsigned> column_of;
    std::multimap<Cycle, ShadedWarpItem> arrivals;
    constexpr std::uint32_t count = 200;
    std::uint32_t survivors = 0;
    for (std::uint32_t sequence = 0; sequence < count; ++sequence) {
      const std::uint64_t random = mix(seed * 1000 + sequence);
      const auto column = static_cast<unsigned>(random % 5);
      // States change with the launches, as marks would have it.
      const DrawIndex draw = sequence / 50 % 2 == 0 ? 0 : 1;
      const auto quads = static_cast<std::uint8_t>(random / 5 % 9);
      column_of[sequence] = column;
      survivors += quads > (draw == 0 && dead < quads ? 1U : 0U) ? 1U : 0U;
      arrivals.emplace(4 * sequence + random / 1024 % 200, warp(sequence, column, launched[column]++, draw, quads));
    }
    for (const auto& [at, item] : arrivals) shaded->add(item, at);
    if (GetParam() != Fidelity::lt) bench->stall_randomly(seed, 64);
    bench->run();
    std::map<unsigned, std::uint32_t> last;
    for (const std::uint32_t number : left) {
      const unsigned column = column_of.at(number);
      ASSERT_TRUE(last.count(column) == 0 || last[column] < number) << "seed " << seed;
      last[column] = number;
    }
    EXPECT_EQ(left.size(), survivors) << "seed " << seed;
    EXPECT_EQ(release->records().size(), count);
    EXPECT_TRUE(bench->unit().idle());
  }
}

}  // namespace
}  // namespace vrpipe
