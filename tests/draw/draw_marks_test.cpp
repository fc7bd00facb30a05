// DRAW in a frame of several draws: what it issues, in which order, and to whom.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "draw/draw.h"
#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::context_of;
using testing::geometry_of;
using testing::pruned_at;
using testkit::Bench;
using testkit::Sink;

using Words = std::vector<std::string>;

/// "draw 2: 5 to 12", "mark 3", "end".
std::string words_of(const VertexWarp& warp) {
  if (warp.mark == Mark::end_of_frame) return "end";
  if (warp.mark != Mark::none) return fmt::format("mark {}", static_cast<unsigned>(warp.mark) - 1);
  return fmt::format("draw {}: {} to {}", warp.draw, warp.first_splat, warp.first_splat + warp.splats - 1);
}

/// Without time.
Words issued(const Frame& frame) {
  const RenderContext context = context_of(frame);
  VertexIssue draw({}, context);
  Words words;
  for (VertexWarp warp; draw.next(warp);) words.push_back(words_of(warp));
  return words;
}

std::shared_ptr<const Draw> splats(std::uint32_t count) { return geometry_of(16, 16, std::vector<Splat>(count)); }

class DrawMarksTest : public ::testing::TestWithParam<Fidelity> {};
INSTANTIATE_TEST_SUITE_P(Fidelities, DrawMarksTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST(VertexIssueOfAFrame, AWarpIsOfOneDrawEvenIfTheNextHasTheSameState) {
  Frame frame(16, 16);
  frame.draw(splats(5), {});
  frame.draw(splats(12), {});
  frame.draw(splats(1), {});
  EXPECT_EQ(issued(frame), (Words{"draw 0: 0 to 4", "draw 1: 5 to 12", "draw 1: 13 to 16", "draw 2: 17 to 17"}));
}

TEST(VertexIssueOfAFrame, AMarkComesBeforeAClearAndBeforeADrawOfAnotherState) {
  Frame frame(16, 16);
  frame.clear({true, false});              // 0
  frame.draw(splats(8), pruned_at(0.1F));  // 1
  frame.draw(splats(8), pruned_at(0.2F));  // 2
  frame.clear({false, true});              // 3
  frame.clear({});                         // 4
  frame.draw(splats(8), pruned_at(0.2F));  // 5
  frame.clear({true, true});               // 6
  frame.draw(splats(8), pruned_at(0.1F));  // 7
  frame.clear({true, true});               // 8
  EXPECT_EQ(issued(frame), (Words{"mark 0", "draw 0: 0 to 7", "mark 2", "draw 1: 8 to 15", "mark 3", "mark 4",
                                  "draw 2: 16 to 23", "mark 6", "mark 7", "draw 3: 24 to 31", "mark 8"}));
}

TEST(VertexIssueOfAFrame, AnEmptyDrawIsNothingButItsChangeOfState) {
  Frame frame(16, 16);
  frame.draw(splats(0), {});
  frame.draw(splats(3), {});
  frame.draw(splats(0), pruned_at(0.2F));
  frame.draw(splats(3), {});
  frame.draw(splats(0), {});
  EXPECT_EQ(issued(frame), (Words{"draw 1: 0 to 2", "mark 2", "mark 3", "draw 3: 3 to 5"}));
}

TEST(VertexIssueOfAFrame, AFrameOfNothingIssuesNothing) { EXPECT_EQ(issued(Frame(16, 16)), Words{}); }

TEST_P(DrawMarksTest, AMarkWaitsForNoIntervalAndPutsOffNoWarp) {
  Frame frame(16, 16);
  frame.draw(splats(16), {});
  frame.clear({true, true});
  frame.clear({true, true});
  frame.draw(splats(8), {});
  Bench bench(GetParam(), "draw", "vertex-issue", context_of(frame), {{"warps_per_1024_cycles", "8"}});
  Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0");
  bench.run();
  // A warp in 128 cycles, seen a cycle later; the marks and the end follow at once.
  EXPECT_EQ(testing::cycles_of(warps), (std::vector<Cycle>{1, 129, 130, 131, 257, 258}));
  EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), DrawWork::warps, 10'000), 3 * 128) << "marks occupy nothing";
}

TEST_P(DrawMarksTest, AFrameThatIsGoneOnWithIsIssuedBehindWhatWasDrawn) {
  Frame frame(16, 16);
  frame.clear({true, false});  // 0
  frame.draw(splats(12), pruned_at(0.1F));
  frame.draw(splats(8), pruned_at(0.2F));  // 2
  frame.clear({false, true});              // 3
  frame.draw(splats(8), pruned_at(0.2F));
  const auto goes_on = [&](std::uint32_t drawn) {
    const Frame rest = frame.gone_on_with(drawn);
    Bench bench(GetParam(), "draw", "vertex-issue", context_of(rest));
    Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0");
    bench.run();
    Words words;
    for (const auto& record : warps.records()) words.push_back(words_of(record.item));
    return words;
  };
  const Words all{"mark 0",           "draw 0: 0 to 7", "draw 0: 8 to 11",  "mark 2",
                  "draw 1: 12 to 19", "mark 3",         "draw 2: 20 to 27", "end"};
  EXPECT_EQ(goes_on(0), all);
  EXPECT_EQ(goes_on(8), Words(all.begin() + 2, all.end()));
  EXPECT_EQ(goes_on(12), Words(all.begin() + 3, all.end())) << "the next draw's mark is still to come";
  EXPECT_EQ(goes_on(20), Words(all.begin() + 5, all.end()));
  EXPECT_EQ(goes_on(28), Words{"end"});
}

TEST_P(DrawMarksTest, WarpsOfFilledRectanglesGoAtARateOfTheirOwn) {
  DrawState rectangles;
  rectangles.splat_extent = SplatExtent::fill_rectangle;
  Frame frame(16, 16);
  frame.draw(splats(16), {});
  frame.draw(splats(20), rectangles);  // ten of three vertices a warp
  frame.draw(splats(8), {});
  Bench bench(GetParam(), "draw", "vertex-issue", context_of(frame),
              {{"warps_per_1024_cycles", "8"}, {"rectangle_warps_per_1024_cycles", "16"}});
  Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0");
  bench.run();
  Words words;
  for (const auto& record : warps.records()) words.push_back(words_of(record.item));
  EXPECT_EQ(words, (Words{"draw 0: 0 to 7", "draw 0: 8 to 15", "mark 1", "draw 1: 16 to 25", "draw 1: 26 to 35",
                          "mark 2", "draw 2: 36 to 43", "end"}));
  EXPECT_EQ(testing::cycles_of(warps), (std::vector<Cycle>{1, 129, 130, 257, 321, 322, 385, 386}));
  EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), DrawWork::warps, 10'000), 3 * 128 + 2 * 64);
}

TEST_P(DrawMarksTest, AMarkTakesItsTurnAmongTheGpcsAndEachGetsAnEnd) {
  Frame frame(16, 16);
  frame.draw(splats(16), {});
  frame.clear({true, true});
  frame.draw(splats(8), pruned_at(0.5F));
  Bench bench(GetParam(), "draw", "vertex-issue", context_of(frame), {}, 3);
  Words seen[3];
  for (unsigned gpc = 0; gpc < 3; ++gpc) {
    bench.sink<VertexWarp>("out_vertices_" + std::to_string(gpc)).on_take([&, gpc](const VertexWarp& warp, Cycle) {
      seen[gpc].push_back(words_of(warp));
    });
  }
  bench.run();
  EXPECT_EQ(seen[0], (Words{"draw 0: 0 to 7", "mark 2", "end"}));
  EXPECT_EQ(seen[1], (Words{"draw 0: 8 to 15", "draw 1: 16 to 23", "end"}));
  EXPECT_EQ(seen[2], (Words{"mark 1", "end"}));
}

TEST_P(DrawMarksTest, StallsChangeNothingInTheOrder) {
  Frame frame(16, 16);
  for (unsigned i = 0; i < 12; ++i) {
    if (i % 3 == 1) frame.clear({true, true});
    frame.draw(splats(5 * i), pruned_at(i % 4 < 2 ? 0.1F : 0.2F));
  }
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Bench bench(GetParam(), "draw", "vertex-issue", context_of(frame), {{"warps_per_1024_cycles", "1024"}});
    Sink<VertexWarp>& warps = bench.sink<VertexWarp>("out_vertices_0", 2);
    bench.stall_randomly(seed, 96);
    bench.run();
    Words seen;
    for (const auto& record : warps.records()) seen.push_back(words_of(record.item));
    Words expected = issued(frame);
    expected.push_back("end");
    EXPECT_EQ(seen, expected);
    EXPECT_TRUE(bench.unit().idle());
  }
}

}  // namespace
}  // namespace vrpipe
