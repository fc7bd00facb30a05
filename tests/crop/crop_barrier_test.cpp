// CROP at a barrier: it says when all before it has been blended.
#include <gtest/gtest.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::geometry_of;
using testkit::Bench;
using testkit::Sink;

constexpr std::uint32_t side = 256;

/// Splats, a draw that reads what they leave, splats: marks 2 and 3, of which the first is a barrier.
RenderContext two_passes() {
  Frame frame(side, side);
  frame.draw(geometry_of(side, side), {});
  frame.draw(geometry_of(side, side), testing::alpha_threshold_state());
  frame.draw(geometry_of(side, side), {});
  return testing::context_of(frame);
}
constexpr Mark barrier = static_cast<Mark>(2);
constexpr Mark change = static_cast<Mark>(3);

class CropBarrierTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  CropBarrierTest() : bench(GetParam(), "crop", "color-rop", two_passes()), done(bench.sink<BlendsDone>("out_done")) {
    bench.set_memory(300, 4);
    if (GetParam() == Fidelity::cycle) {
      beats = &bench.source<ColorBeat>("in_color", 7);
    } else {
      items = &bench.source<ShadedWarpItem>("in_color", 7);
    }
  }
  void quad(std::uint16_t tile) {
    ShadedWarp& warp = pool.take();
    warp.tile = {tile, 0};
    warp.count = 1;
    warp.mark = Mark::none;
    warp.position[0] = 0;
    warp.live[0] = all_lanes;
    warp.first_primitive[0] = warp.last_primitive[0] = next_primitive++;
    warp.draw[0] = 0;
    warp.color[0] = testing::color_of(0.5F, 0.5F, 0.5F, 0.5F);
    ColorBeat beat;
    beat.count = 1;
    beat.quads[0] = {&warp, 0};
    send(warp, beat);
  }
  void mark(Mark mark) {
    ShadedWarp& warp = pool.take();
    warp.count = 0;
    warp.mark = mark;
    ColorBeat beat;
    beat.mark = mark;
    send(warp, beat);
  }
  void send(const ShadedWarp& warp, const ColorBeat& beat) {
    if (items != nullptr) items->add({&warp});
    if (beats != nullptr) beats->add(beat);
  }

  Bench bench;
  Sink<BlendsDone>& done;
  testkit::Source<ShadedWarpItem>* items = nullptr;
  testkit::Source<ColorBeat>* beats = nullptr;
  ShadedWarpPool pool;
  std::uint32_t next_primitive = 0;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, CropBarrierTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(CropBarrierTest, ItIsToldWhenTheLastBlendBeforeItHasLeftThePipeline) {
  for (std::uint16_t tile = 0; tile < 6; ++tile) quad(tile);  // a line each, which takes 300 cycles to come
  mark(barrier);
  mark(change);
  mark(Mark::end_of_frame);
  bench.run();
  ASSERT_EQ(done.records().size(), 1U) << "another mark is none";
  EXPECT_TRUE(done.records()[0].item.mark == barrier);
  EXPECT_GT(done.records()[0].cycle, 300U);
  EXPECT_EQ(done.records()[0].cycle, bench.unit().end_of_frame()) << "nothing is blended behind it";
}

TEST_P(CropBarrierTest, WhereNothingIsBlendedItTakesTheLatencyOfABlend) {
  mark(barrier);
  mark(Mark::end_of_frame);
  bench.run();
  // Sent in cycle 0, seen by CROP in 1; 8 cycles of latency.
  EXPECT_EQ(testing::cycles_of(done), std::vector<Cycle>{9});
}

TEST_P(CropBarrierTest, AReceiverThatTakesItLateHoldsUpNothing) {
  done.close(0, 5000);
  for (std::uint16_t tile = 0; tile < 6; ++tile) quad(tile);
  mark(barrier);
  mark(Mark::end_of_frame);
  bench.run();
  EXPECT_LT(bench.unit().end_of_frame(), 2000U);
  EXPECT_EQ(done.records().size(), 1U);
  EXPECT_TRUE(bench.unit().idle());
}

}  // namespace
}  // namespace vrpipe
