#include "zrop/zrop.h"

#include <gtest/gtest.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::beat_of;

/// With a surface of its own.
struct Rop : DepthStencilRop {
  Rop(const Parameters& parameters, const RenderContext& context)
      : DepthStencilRop(parameters, context), stencil(context.frame->width(), context.frame->height()) {
    attach(stencil);
  }
  DepthStencilSurface stencil;
};

class DepthStencilRopTest : public ::testing::Test {
 protected:
  DepthStencilRopTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {
    testing::terminate_early(context);
  }
  Draw draw;
  RenderContext context;
  DepthStencilRop::Parameters parameters;
};

// case H03
TEST_F(DepthStencilRopTest, WithoutAnUpdateEveryQuadPasses) {
  Rop zrop(parameters, context);
  QuadBeat beat = beat_of({1, 1}, {0, 5, 63});
  zrop.test(beat);
  EXPECT_EQ(beat.count, 3);
  for (unsigned i = 0; i < 3; ++i) EXPECT_EQ(beat.quads[i].coverage, all_lanes);
  EXPECT_EQ(zrop.quads_terminated.value(), 0U);
  EXPECT_EQ(zrop.quads_tested.value(), 3U);
}

// case H10
TEST_F(DepthStencilRopTest, AQuadLivesUntilItsFourthPixelIsTerminated) {
  Rop zrop(parameters, context);
  for (unsigned lane = 0; lane < 4; ++lane) {
    QuadBeat beat = beat_of({1, 1}, {7});
    zrop.test(beat);
    ASSERT_EQ(beat.count, 1);
    EXPECT_EQ(popcount(beat.quads[0].coverage), 4 - lane);
    zrop.update({{1, 1}, 7, static_cast<LaneMask>(1U << lane)});
  }
  QuadBeat beat = beat_of({1, 1}, {7});
  zrop.test(beat);
  EXPECT_EQ(beat.count, 0);
  EXPECT_EQ(zrop.quads_terminated.value(), 1U);
  EXPECT_EQ(zrop.fragments_terminated.value(), 0U + 1 + 2 + 3 + 4);
}

// case H06
TEST_F(DepthStencilRopTest, OneSignalCanTerminateSeveralPixelsOfAQuad) {
  Rop zrop(parameters, context);
  zrop.update({{0, 0}, 3, 0b1010});
  QuadBeat beat = beat_of({0, 0}, {3});
  zrop.test(beat);
  EXPECT_EQ(beat.quads[0].coverage, 0b0101);
}

// case H05
TEST_F(DepthStencilRopTest, SignalsForOneLineAreOredInAnyOrder) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Rop zrop(parameters, context);
    unsigned expected[64] = {};
    for (std::uint64_t i = 0; i < 300; ++i) {
      const auto position = static_cast<std::uint8_t>(mix(seed + i) % 64);
      const auto pixels = static_cast<LaneMask>(1 + mix(seed * 999 + i) % 15);
      zrop.update({{2, 3}, position, pixels});
      expected[position] |= pixels;
      if (i % 3 == 0) zrop.update({{2, 3}, position, pixels});
    }
    for (unsigned position = 0; position < 64; ++position) {
      QuadBeat beat = beat_of({2, 3}, {position});
      zrop.test(beat);
      ASSERT_EQ(beat.count == 0 ? 0U : unsigned{beat.quads[0].coverage}, ~expected[position] & 0xFU);
    }
  }
}

TEST_F(DepthStencilRopTest, AnUpdateIsForItsTileAndPositionAlone) {
  Rop zrop(parameters, context);
  zrop.update({{1, 2}, 9, all_lanes});
  for (std::uint16_t y = 0; y < 4; ++y) {
    for (std::uint16_t x = 0; x < 4; ++x) {
      for (unsigned position = 0; position < 64; ++position) {
        QuadBeat beat = beat_of({x, y}, {position});
        zrop.test(beat);
        ASSERT_EQ(beat.count, x == 1 && y == 2 && position == 9 ? 0 : 1);
      }
    }
  }
}

TEST_F(DepthStencilRopTest, SurvivorsKeepTheirOrder) {
  Rop zrop(parameters, context);
  zrop.update({{0, 0}, 1, all_lanes});
  zrop.update({{0, 0}, 4, all_lanes});
  QuadBeat beat = beat_of({0, 0}, {0, 1, 2, 3, 4, 5}, 10);
  zrop.test(beat);
  ASSERT_EQ(beat.count, 4);
  const std::uint32_t expected[] = {10, 12, 13, 15};
  for (unsigned i = 0; i < 4; ++i) EXPECT_EQ(beat.quads[i].splat, expected[i]);
}

/// Terminates what it is told to, bin by bin.
struct Ahead : FunctionalRunAhead {
  void pass(Mark mark) override { marks.push_back(mark); }
  void tested(const QuadBeat& survivors, std::vector<TerminationSignal>& terminated) override {
    beats.push_back(survivors);
    if (beats.size() == 1) terminated.push_back({{0, 0}, 5, all_lanes});
  }
  std::vector<QuadBeat> beats;
  std::vector<Mark> marks;
};

TEST_F(DepthStencilRopTest, StrictlyABinsTestSeesWhatEarlierBinsTerminateAndNoUpdate) {
  context.termination = Termination::strict;
  Rop zrop(parameters, context);
  Ahead ahead;
  zrop.follow(ahead);
  zrop.update({{0, 0}, 6, all_lanes});  // costs time, decides nothing
  QuadBeat first = beat_of({0, 0}, {5, 6});
  zrop.test(first);
  QuadBeat rest = beat_of({0, 0}, {5}, 2, true);
  zrop.test(rest);
  EXPECT_EQ(first.count + rest.count, 3) << "within a bin nothing is terminated";
  ASSERT_EQ(ahead.beats.size(), 2U) << "as soon as they are tested";
  EXPECT_EQ(ahead.beats[0].count, 2U);
  EXPECT_TRUE(ahead.beats[1].last_of_bin);
  QuadBeat next = beat_of({0, 0}, {5, 6}, 3, true);
  zrop.test(next);
  ASSERT_EQ(next.count, 1);
  EXPECT_EQ(next.quads[0].position, 6);
}

}  // namespace
}  // namespace vrpipe
