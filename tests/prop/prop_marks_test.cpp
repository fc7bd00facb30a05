// PROP in a frame of several draws: a mark leaves between the warps launched before it and those after, in whichever
// order they are shaded.
#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "prop/mark_numbers.h"
#include "prop/reorder_buffer.h"
#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::mark_number;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class PropMarksTest : public ::testing::TestWithParam<std::tuple<Fidelity, std::string>> {
 protected:
  PropMarksTest() : draw(testing::draw_of(256, 256)), context(testing::context_of(draw)) {}
  Fidelity fidelity() const { return std::get<0>(GetParam()); }
  Bench::Settings order() const { return {{"order", std::get<1>(GetParam())}}; }

  ShadedWarp* warp(std::uint32_t sequence, TileId tile, std::uint32_t tile_sequence, std::uint8_t count = 8) {
    ShadedWarp& made = pool.take();
    made.tile = tile;
    made.sequence = sequence;
    made.tile_sequence = tile_sequence;
    made.count = count;
    made.slot = static_cast<std::uint16_t>(sequence);
    made.mark = Mark::none;
    return &made;
  }
  ShadedWarp* mark(std::uint32_t sequence, Mark which) {
    ShadedWarp* const made = warp(sequence, {}, 0, 0);
    made->mark = which;
    made->slot = no_slot;
    return made;
  }

  Draw draw;
  RenderContext context;
  ShadedWarpPool pool;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, PropMarksTest,
                         ::testing::Combine(::testing::ValuesIn(testing::fidelities_with_time()),
                                            ::testing::Values("draw", "tile")),
                         [](const auto& each) {
                           return name_of(std::get<0>(each.param)) + ("_" + std::get<1>(each.param));
                         });

/// What left PROP for CROP, in its order: numbers of warps that have quads, and of marks from 1000 on.
struct PropBench {
  PropBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings, unsigned depth = 64)
      : bench(fidelity, "prop", "pre-rop", context, settings),
        shaded(bench.source<ShadedWarpItem>("in_shaded", 64)),
        release(bench.sink<WarpRelease>("out_release", depth)) {
    const auto note = [this](const ShadedWarp* warp, Mark mark) {
      const std::uint32_t number = mark != Mark::none ? mark_number(mark) : warp->sequence;
      if (left.empty() || left.back() != number) left.push_back(number);
    };
    if (fidelity == Fidelity::cycle) {
      beats = &bench.sink<ColorBeat>("out_color", depth);
      beats->on_take([note](const ColorBeat& beat, Cycle) {
        if (beat.mark != Mark::none) note(nullptr, beat.mark);
        for (unsigned i = 0; i < beat.count; ++i) note(beat.quads[i].warp, Mark::none);
      });
    } else {
      warps = &bench.sink<ShadedWarpItem>("out_color", depth);
      warps->on_take([note](const ShadedWarpItem& item, Cycle) { note(item.warp, item.warp->mark); });
    }
  }
  void close(Cycle from, Cycle until) { beats != nullptr ? beats->close(from, until) : warps->close(from, until); }
  Bench bench;
  Source<ShadedWarpItem>& shaded;
  Sink<WarpRelease>& release;
  Sink<ColorBeat>* beats = nullptr;
  Sink<ShadedWarpItem>* warps = nullptr;
  std::vector<std::uint32_t> left;
};
constexpr std::uint32_t end_number = mark_number(Mark::end_of_frame);

using Left = std::vector<std::uint32_t>;

TEST_P(PropMarksTest, AMarkWithNoWarpBeforeItLeavesAtOnce) {
  PropBench prop(fidelity(), context, order());
  prop.shaded.add({mark(0, Frame::mark_of(0))}, 10);
  prop.shaded.add({warp(0, {0, 0}, 0)}, 500);
  prop.bench.run();
  EXPECT_EQ(prop.left, (Left{mark_number(0), 0}));
  EXPECT_TRUE(prop.bench.unit().idle());
}

TEST_P(PropMarksTest, AWarpLaunchedAfterAMarkWaitsForItThoughItIsAloneInItsTile) {
  if (fidelity() == Fidelity::lt) GTEST_SKIP() << "there a mark comes behind all before it";
  PropBench prop(fidelity(), context, order());
  prop.shaded.add({mark(1, Frame::mark_of(0))}, 10);
  prop.shaded.add({warp(1, {5, 5}, 0)}, 20);
  prop.shaded.add({warp(0, {0, 0}, 0)}, 1000);
  prop.bench.run();
  EXPECT_EQ(prop.left, (Left{0, mark_number(0), 1}));
}

TEST_P(PropMarksTest, TwoMarksWaitAndLeaveInOrderEachInItsPlace) {
  if (fidelity() == Fidelity::lt) GTEST_SKIP() << "there a mark comes behind all before it";
  PropBench prop(fidelity(), context, order());
  prop.shaded.add({mark(2, Frame::mark_of(0))}, 10);
  prop.shaded.add({mark(2, Frame::mark_of(1))}, 20);
  prop.shaded.add({mark(3, Frame::mark_of(2))}, 30);
  prop.shaded.add({warp(3, {1, 0}, 2)}, 40);
  prop.shaded.add({warp(2, {1, 0}, 1)}, 50);
  prop.shaded.add({warp(1, {2, 0}, 0)}, 60);
  prop.shaded.add({warp(0, {1, 0}, 0)}, 1000);
  prop.bench.run();
  const bool by_draw = std::get<1>(GetParam()) == "draw";
  const Left first = by_draw ? Left{0, 1} : Left{1, 0};
  EXPECT_EQ(prop.left, (Left{first[0], first[1], mark_number(0), mark_number(1), 2, mark_number(2), 3}));
}

TEST_P(PropMarksTest, WarpsWithoutSurvivorsCountAsWarpsBeforeAMark) {
  PropBench prop(fidelity(), context, order());
  prop.shaded.add({warp(0, {0, 0}, 0, 0)}, 10);
  prop.shaded.add({warp(1, {1, 0}, 0, 0)}, 20);
  prop.shaded.add({mark(2, Frame::mark_of(0))}, 30);
  prop.shaded.add({warp(2, {0, 0}, 1, 0)}, 40);
  prop.shaded.add({warp(3, {0, 0}, 2)}, 50);
  prop.shaded.add({mark(4, Mark::end_of_frame)}, 60);
  prop.bench.run();
  EXPECT_EQ(prop.left, (Left{mark_number(0), 3, end_number}));
}

TEST_P(PropMarksTest, NoOrderOfCompletionAndNoStallMovesAWarpPastAMark) {
  constexpr std::uint32_t count = 300;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Bench::Settings settings = order();
    settings.emplace_back("color_bytes_per_cycle", seed % 2 == 0 ? "64" : "20");
    PropBench prop(fidelity(), context, settings, seed % 3 == 0 ? 2 : 64);
    // Shaded up to 400 cycles after the launch; a mark at once, at lt behind all before it.
    std::map<unsigned, std::uint32_t> launched_in_tile;
    std::map<std::uint32_t, std::uint32_t> marks_before;
    std::multimap<Cycle, ShadedWarp*> arrivals;
    Cycle behind_all = 0;
    std::uint32_t marks = 0;
    Cycle earliest = 0;
    for (std::uint32_t sequence = 0; sequence < count; ++sequence) {
      const std::uint64_t random = mix(seed * 10'000 + sequence);
      for (; mix(random + marks) % 16 == 0; ++marks) {
        const Cycle at = fidelity() == Fidelity::lt ? std::max(behind_all + 1, earliest) : Cycle{4} * sequence;
        arrivals.emplace(at, mark(sequence, Frame::mark_of(marks)));
        if (fidelity() == Fidelity::lt) earliest = at + 1;
      }
      marks_before[sequence] = marks;
      const auto column = static_cast<unsigned>(random / 64 % 5);
      const Cycle at = std::max(Cycle{4} * sequence + 1 + random / 1024 % 400, earliest);
      behind_all = std::max(behind_all, at);
      arrivals.emplace(at, warp(sequence, {static_cast<std::uint16_t>(column), 0}, launched_in_tile[column]++,
                                random % 7 == 0 ? 0 : 1 + static_cast<std::uint8_t>(random / 7 % 8)));
    }
    arrivals.emplace(10'000, mark(count, Mark::end_of_frame));
    std::map<std::uint32_t, const ShadedWarp*> with_quads;
    for (const auto& [at, item] : arrivals) {
      if (item->count > 0) with_quads[item->sequence] = item;
      prop.shaded.add({item}, at);
    }
    prop.close(300, 300 + 100 * (seed % 5));
    prop.bench.stall_randomly(seed, fidelity() == Fidelity::lt ? 0 : 64);
    prop.bench.run();

    std::uint32_t seen = 0;
    std::size_t warps = 0;
    std::map<unsigned, std::uint32_t> last_of_tile;
    for (const std::uint32_t number : prop.left) {
      if (number >= testing::marks_from) {
        ASSERT_EQ(number, seen < marks ? mark_number(seen) : end_number) << "seed " << seed;
        ++seen;
        continue;
      }
      ASSERT_EQ(marks_before[number], seen) << "warp " << number << ", seed " << seed;
      const unsigned column = with_quads.at(number)->tile.x;
      ASSERT_TRUE(last_of_tile.count(column) == 0 || last_of_tile[column] < number) << "seed " << seed;
      last_of_tile[column] = number;
      ++warps;
    }
    EXPECT_EQ(seen, marks + 1);
    EXPECT_EQ(warps, with_quads.size());
    EXPECT_EQ(prop.release.records().size(), arrivals.size());
    EXPECT_TRUE(prop.bench.unit().idle());
  }
}

TEST(WarpOrderOfAFrame, IsEmptyOnlyWhenTheMarkHasLeftToo) {
  const Draw draw = testing::draw_of(64, 64);
  const RenderContext context = testing::context_of(draw);
  ReorderBuffer order(PropTime::Order::tile, context);
  ShadedWarp mark;
  mark.sequence = 0;
  mark.mark = Frame::mark_of(0);
  ShadedWarp warp;
  order.arrive_mark(mark);
  order.arrive(warp);
  EXPECT_FALSE(order.has_next()) << "the mark comes first";
  ASSERT_NE(order.next_mark(), nullptr);
  order.leave_mark();
  EXPECT_EQ(order.next_mark(), nullptr);
  ASSERT_TRUE(order.has_next());
  EXPECT_FALSE(order.empty());
  order.leave(order.take().turn);
  EXPECT_TRUE(order.empty());
}

}  // namespace
}  // namespace vrpipe
