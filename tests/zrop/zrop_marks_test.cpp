// ZROP in a frame of several draws: each is tested as its state says, and a clear of termination ends an epoch.
#include <gtest/gtest.h>

#include "support/fidelities.h"
#include "zrop/zrop.h"

namespace vrpipe {
namespace {

using testing::Bins;
using testing::context_of;
using testing::geometry_of;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

DrawState terminating(bool on = true) {
  DrawState state;
  state.early_termination = on;
  return state;
}
Quad quad_of(DrawIndex draw, unsigned position, LaneMask coverage = all_lanes) {
  Quad quad{};
  quad.splat = draw;
  quad.position = static_cast<std::uint8_t>(position);
  quad.coverage = coverage;
  quad.draw = draw & 0x7fffU;
  return quad;
}
QuadBeat beat_of(std::initializer_list<Quad> quads) {
  QuadBeat beat;
  beat.last_of_bin = true;
  for (const Quad& quad : quads) beat.quads[beat.count++] = quad;
  return beat;
}

/// Draw 0, a clear of colour, draw 1, a clear of termination, draw 2: all terminate.
constexpr std::size_t color_clear = 1;
constexpr std::size_t termination_clear = 3;
RenderContext three_draws(unsigned side = 64) {
  Frame frame(side, side);
  frame.draw(geometry_of(side, side), terminating());
  frame.clear({true, false});
  frame.draw(geometry_of(side, side), terminating());
  frame.clear({false, true});
  frame.draw(geometry_of(side, side), terminating());
  return context_of(frame);
}

/// With a surface of its own.
struct RopOfAFrame : DepthStencilRop {
  explicit RopOfAFrame(const RenderContext& context)
      : DepthStencilRop({}, context), stencil(context.frame->width(), context.frame->height()) {
    attach(stencil);
    set_draws(context.frame->draws().size());
  }
  unsigned survivors(QuadBeat beat) {
    test(beat);
    return beat.count;
  }
  DepthStencilSurface stencil;
};

TEST(DepthStencilRopOfAFrame, OnlyAClearOfTerminationOpensPixels) {
  const RenderContext context = three_draws();
  RopOfAFrame zrop(context);
  zrop.update({{0, 0}, 3, all_lanes, 0});
  EXPECT_EQ(zrop.survivors(beat_of({quad_of(0, 3)})), 0U);
  zrop.pass(Frame::mark_of(color_clear));
  EXPECT_EQ(zrop.survivors(beat_of({quad_of(1, 3)})), 0U);
  zrop.pass(Frame::mark_of(2));  // of a draw
  EXPECT_EQ(zrop.survivors(beat_of({quad_of(1, 3)})), 0U);
  zrop.pass(Frame::mark_of(termination_clear));
  EXPECT_EQ(zrop.survivors(beat_of({quad_of(2, 3)})), 1U);
}

TEST(DepthStencilRopOfAFrame, ASignalOfAnEpochThatHasPassedIsCountedAndVoid) {
  const RenderContext context = three_draws();
  RopOfAFrame zrop(context);
  zrop.pass(Frame::mark_of(color_clear));
  zrop.update({{0, 0}, 1, all_lanes, 0});
  EXPECT_EQ(zrop.updates_void.value(), 0U) << "a clear of colour ends no epoch";
  zrop.pass(Frame::mark_of(termination_clear));
  zrop.update({{0, 0}, 3, all_lanes, 0});
  zrop.update({{0, 0}, 4, all_lanes, 1});
  EXPECT_EQ(zrop.survivors(beat_of({quad_of(2, 1), quad_of(2, 3)})), 2U);
  EXPECT_EQ(zrop.survivors(beat_of({quad_of(2, 4)})), 0U);
  EXPECT_EQ(zrop.termination_updates.value(), 3U);
  EXPECT_EQ(zrop.updates_void.value(), 1U);
}

TEST(DepthStencilRopOfAFrame, ADrawThatDoesNotTerminatePassesTerminatedPixelsAndIsNotCounted) {
  Frame frame(64, 64);
  frame.draw(geometry_of(64, 64), terminating());
  frame.draw(geometry_of(64, 64), terminating(false));
  frame.draw(geometry_of(64, 64), terminating());
  const RenderContext context = context_of(frame);
  RopOfAFrame zrop(context);
  zrop.update({{0, 0}, 3, all_lanes, 0});
  EXPECT_EQ(zrop.survivors(beat_of({quad_of(0, 3)})), 0U);
  EXPECT_EQ(zrop.survivors(beat_of({quad_of(1, 3)})), 1U);
  EXPECT_EQ(zrop.survivors(beat_of({quad_of(2, 3)})), 0U) << "the bits have stayed";
  EXPECT_EQ(zrop.quads_tested.of_draw(), (std::vector<std::uint64_t>{1, 0, 1}));
  EXPECT_EQ(zrop.quads_terminated.of_draw(), (std::vector<std::uint64_t>{1, 0, 1}));
}

TEST(DepthStencilRopOfAFrame, ABeatOfSeveralDrawsIsCountedQuadByQuad) {
  Frame frame(64, 64);
  for (unsigned i = 0; i < 4; ++i) frame.draw(geometry_of(64, 64), terminating());
  const RenderContext context = context_of(frame);
  RopOfAFrame zrop(context);
  zrop.update({{0, 0}, 1, all_lanes, 0});
  zrop.update({{0, 0}, 2, 0b0011, 0});
  QuadBeat beat = beat_of({quad_of(0, 1, 0b0111), quad_of(0, 2), quad_of(1, 1), quad_of(3, 2, 0b0001), quad_of(3, 5)});
  zrop.test(beat);
  EXPECT_EQ(zrop.quads_tested.of_draw(), (std::vector<std::uint64_t>{2, 1, 0, 2}));
  EXPECT_EQ(zrop.quads_terminated.of_draw(), (std::vector<std::uint64_t>{1, 1, 0, 1}));
  EXPECT_EQ(zrop.fragments_terminated.of_draw(), (std::vector<std::uint64_t>{5, 4, 0, 1}));
  ASSERT_EQ(beat.count, 2);
  EXPECT_EQ(beat.quads[0].draw, 0);
  EXPECT_EQ(beat.quads[0].coverage, 0b1100);
  EXPECT_EQ(beat.quads[1].draw, 3);
  EXPECT_EQ(beat.quads[1].position, 5);
}

TEST(DepthStencilRopOfAFrame, AGpcClearsItsOwnTilesAlone) {
  RenderContext context = three_draws(128);
  context.placement = testing::placement_of(2, 1, context.frame->width(), context.frame->height());
  RopOfAFrame zrop(context);
  const ScreenTiling& grid = zrop.stencil.grid();
  for (std::size_t place = 0; place < grid.quads(); ++place) zrop.stencil.terminated(place) = all_lanes;
  zrop.pass(Frame::mark_of(termination_clear));
  for (std::size_t tile = 0; tile < grid.tiles(); ++tile) {
    EXPECT_EQ(zrop.stencil.terminated(tile * positions_per_tile) == 0, context.placement.owns(grid.tile(tile)));
  }
}

class ZropMarksTest : public ::testing::TestWithParam<Fidelity> {};
INSTANTIATE_TEST_SUITE_P(Fidelities, ZropMarksTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

/// ZROP with its ports, of whatever fidelity. What leaves it is noted by splat, marks as 1000 and their number.
struct MarkedZropBench {
  explicit MarkedZropBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {})
      : bench(fidelity, "zrop", "depth-stencil-rop", context, settings),
        updates(bench.source<TerminationBeat>("in_terminations")) {
    if (fidelity == Fidelity::cycle) {
      beats = &bench.source<QuadBeat>("in_quads");
      bench.sink<QuadBeat>("out_quads").on_take([this](const QuadBeat& beat, Cycle) {
        for (unsigned i = 0; i < beat.count; ++i) left.push_back(beat.quads[i].splat);
        if (beat.mark != Mark::none) left.push_back(1000 + static_cast<std::uint32_t>(beat.mark));
      });
    } else {
      items = &bench.source<BinItem>("in_quads");
      bench.sink<BinItem>("out_quads").on_take([this](const BinItem& item, Cycle) {
        if (item.mark != Mark::none) return left.push_back(1000 + static_cast<std::uint32_t>(item.mark));
        for (const std::uint32_t splat : testing::splats_of(item)) left.push_back(splat);
      });
    }
  }
  void test(std::uint32_t splat, DrawIndex draw, unsigned position, Cycle at) {
    Quad quad = quad_of(draw, position);
    quad.splat = splat;
    if (beats != nullptr) beats->add(beat_of({quad}), at);
    if (items != nullptr) items->add(bins.of({0, 0}, {quad}), at);
  }
  void pass(Mark mark, Cycle at) {
    QuadBeat beat;
    beat.mark = mark;
    BinItem item;
    item.mark = mark;
    if (beats != nullptr) beats->add(beat, at);
    if (items != nullptr) items->add(item, at);
  }
  void signal(unsigned position, std::uint16_t epoch, Cycle at) {
    TerminationBeat beat;
    beat.count = 1;
    beat.signals[0] = {{0, 0}, static_cast<std::uint8_t>(position), all_lanes, epoch};
    updates.add(beat, at);
  }
  Bench bench;
  Source<TerminationBeat>& updates;
  Source<QuadBeat>* beats = nullptr;
  Source<BinItem>* items = nullptr;
  Bins bins;
  std::vector<std::uint32_t> left;
};
std::uint32_t number_of(std::size_t command) { return 1000 + static_cast<std::uint32_t>(Frame::mark_of(command)); }

TEST_P(ZropMarksTest, AQuadBehindAClearPassesWhereOneBeforeItWasTerminated) {
  const RenderContext context = three_draws();
  MarkedZropBench zrop(GetParam(), context);
  zrop.signal(3, 0, 10);
  zrop.test(0, 1, 3, 50);
  zrop.pass(Frame::mark_of(termination_clear), 60);
  zrop.test(1, 2, 3, 60);
  zrop.bench.run();
  EXPECT_EQ(zrop.left, (std::vector<std::uint32_t>{number_of(termination_clear), 1}));
  EXPECT_TRUE(zrop.bench.unit().idle());
}

TEST_P(ZropMarksTest, ALateSignalOfThePassedEpochTakesItsTimeAndTerminatesNothing) {
  const RenderContext context = three_draws();
  MarkedZropBench zrop(GetParam(), context);
  zrop.pass(Frame::mark_of(termination_clear), 50);
  zrop.signal(3, 0, 100);
  zrop.test(0, 2, 3, 200);
  zrop.signal(3, 1, 300);
  zrop.test(1, 2, 3, 400);
  zrop.bench.run();
  EXPECT_EQ(zrop.left, (std::vector<std::uint32_t>{number_of(termination_clear), 0}));
  EXPECT_EQ(zrop.bench.behaviour<DepthStencilRop>().updates_void.value(), 1U);
  EXPECT_DOUBLE_EQ(testing::occupied(zrop.bench.unit(), ZropWork::updates, 1000), 2) << "void or not, a cycle each";
}

TEST_P(ZropMarksTest, ASignalThatComesBeforeTheClearIsClearedWithTheRest) {
  const RenderContext context = three_draws();
  MarkedZropBench zrop(GetParam(), context);
  zrop.signal(3, 0, 10);
  zrop.pass(Frame::mark_of(termination_clear), 50);
  zrop.test(0, 2, 3, 60);
  zrop.bench.run();
  EXPECT_EQ(zrop.left, (std::vector<std::uint32_t>{number_of(termination_clear), 0}));
  EXPECT_EQ(zrop.bench.behaviour<DepthStencilRop>().updates_void.value(), 0U);
}

TEST_P(ZropMarksTest, MarksKeepTheirPlaceAmongQuadsUnderStalls) {
  const RenderContext context = three_draws();
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    MarkedZropBench zrop(GetParam(), context, {{"quads_per_cycle", seed == 2 ? "1" : "16"}});
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < 60; ++i) {
      zrop.test(i, 0, i, 0);
      expected.push_back(i);
      if (i % 7 != 0) continue;
      zrop.pass(Frame::mark_of(color_clear), 0);
      expected.push_back(number_of(color_clear));
    }
    zrop.pass(Mark::end_of_frame, 0);
    expected.push_back(1000 + 0xffff);
    zrop.bench.stall_randomly(seed, 96);
    zrop.bench.run();
    EXPECT_EQ(zrop.left, expected);
    EXPECT_TRUE(zrop.bench.unit().idle());
  }
}

}  // namespace
}  // namespace vrpipe
