// TGC in a frame of several draws: at a mark it hands on what it holds.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "support/fidelities.h"
#include "tgc/tgc.h"
#include "tgc/tgc_items.h"

namespace vrpipe {
namespace {

using testing::item_in;
using testing::marked;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

using Words = std::vector<std::string>;

constexpr PixelRect one_grid{0, 0, 4, 4};
constexpr PixelRect another_grid{300, 300, 304, 304};

/// TGC with its ports.
struct TgcBench {
  TgcBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {},
           const std::string& implementation = "tile-grid-coalescing", unsigned depth = 4)
      : bench(fidelity, "tgc", implementation, context, settings),
        in(bench.source<PrimitiveItem>("in_primitives", depth)),
        out(bench.sink<RasterJob>("out_jobs", depth)) {}
  /// Splats, and "mark N" and "end".
  Words words() const {
    Words all;
    for (const auto& record : out.records()) {
      const RasterJob& job = record.item;
      all.push_back(job.mark == Mark::none           ? std::to_string(job.primitive.splat)
                    : job.mark == Mark::end_of_frame ? "end"
                                                     : fmt::format("mark {}", static_cast<unsigned>(job.mark) - 1));
    }
    return all;
  }
  Bench bench;
  Source<PrimitiveItem>& in;
  Sink<RasterJob>& out;
};

class TgcMarksTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  TgcMarksTest() : draw(testing::draw_of(1024, 1024)), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, TgcMarksTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(TgcMarksTest, AMarkFlushesAllBinsAndComesBehindThem) {
  TgcBench tgc(GetParam(), context);
  tgc.in.add(item_in(0, one_grid));
  tgc.in.add(item_in(1, another_grid));
  tgc.in.add(item_in(2, one_grid));
  tgc.in.add(marked<PrimitiveItem>(Frame::mark_of(1)));
  tgc.bench.run();
  EXPECT_EQ(tgc.words(), (Words{"0", "2", "1", "mark 1"})) << "bin by bin, the oldest first";
  EXPECT_TRUE(tgc.bench.unit().idle());
}

TEST_P(TgcMarksTest, PrimitivesAfterAMarkShareNoBinWithThoseBefore) {
  TgcBench tgc(GetParam(), context);
  for (const unsigned splat : {0U, 1U}) tgc.in.add(item_in(splat, one_grid));
  tgc.in.add(marked<PrimitiveItem>(Frame::mark_of(1)));
  for (const unsigned splat : {2U, 3U}) tgc.in.add(item_in(splat, one_grid));
  tgc.in.add(marked<PrimitiveItem>());
  tgc.bench.run();
  EXPECT_EQ(tgc.words(), (Words{"0", "1", "mark 1", "2", "3", "end"}));
  EXPECT_EQ(tgc.bench.behaviour<TileGridCoalescing>().flushes.value(), 2U);
  EXPECT_EQ(tgc.bench.behaviour<TileGridCoalescing>().evictions.value(), 0U);
}

TEST_P(TgcMarksTest, MarksWithNothingBetweenThemFollowOneAnother) {
  TgcBench tgc(GetParam(), context);
  for (const unsigned command : {0U, 1U, 2U}) tgc.in.add(marked<PrimitiveItem>(Frame::mark_of(command)));
  tgc.in.add(item_in(0, one_grid));
  for (const unsigned command : {4U, 5U}) tgc.in.add(marked<PrimitiveItem>(Frame::mark_of(command)));
  tgc.in.add(marked<PrimitiveItem>());
  tgc.bench.run();
  EXPECT_EQ(tgc.words(), (Words{"mark 0", "mark 1", "mark 2", "0", "mark 4", "mark 5", "end"}));
}

TEST_P(TgcMarksTest, WithoutBinsAMarkGoesThroughInItsPlace) {
  TgcBench tgc(GetParam(), context, {}, "pass-through");
  tgc.in.add(item_in(0, one_grid));
  tgc.in.add(marked<PrimitiveItem>(Frame::mark_of(1)));
  tgc.in.add(item_in(1, one_grid));
  tgc.in.add(marked<PrimitiveItem>());
  tgc.bench.run();
  EXPECT_EQ(tgc.words(), (Words{"0", "mark 1", "1", "end"}));
}

TEST_P(TgcMarksTest, StallsMovePrimitivesPastNoMark) {
  constexpr unsigned primitives = 200;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    TgcBench tgc(GetParam(), context, {{"bins", "3"}, {"bin_primitives", "4"}}, "tile-grid-coalescing", 2);
    std::vector<unsigned> marks_before;  // of each splat
    unsigned marks = 0;
    for (std::uint32_t splat = 0; splat < primitives; ++splat) {
      for (; mix(seed + 7 * splat + marks) % 6 == 0; ++marks) tgc.in.add(marked<PrimitiveItem>(Frame::mark_of(marks)));
      marks_before.push_back(marks);
      const auto x = static_cast<std::int32_t>(mix(seed ^ splat) % 5 * 100);
      tgc.in.add(item_in(splat, {x, 0, x + 90, 90}));
    }
    tgc.in.add(marked<PrimitiveItem>());
    tgc.out.close(50, 400);
    tgc.bench.stall_randomly(seed, 96);
    tgc.bench.run();
    unsigned seen = 0;
    std::set<std::uint32_t> splats;
    for (const auto& record : tgc.out.records()) {
      const RasterJob& job = record.item;
      if (job.mark == Mark::none) {
        ASSERT_EQ(marks_before[job.primitive.splat], seen);
        splats.insert(job.primitive.splat);
      } else if (job.mark != Mark::end_of_frame) {
        ASSERT_EQ(job.mark, Frame::mark_of(seen++));
      }
    }
    EXPECT_EQ(seen, marks);
    EXPECT_EQ(splats.size(), primitives);
    EXPECT_EQ(tgc.out.records().back().item.mark, Mark::end_of_frame);
    EXPECT_TRUE(tgc.bench.unit().idle());
  }
}

}  // namespace
}  // namespace vrpipe
