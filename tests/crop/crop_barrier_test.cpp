// CROP at a barrier: it says when all before it has been blended.
#include <gtest/gtest.h>

#include "crop/marked_crop_bench.h"

namespace vrpipe {
namespace {

using testing::geometry_of;
using testkit::Sink;

constexpr std::uint32_t screen_side = 256;

/// Splats, a draw that reads what they leave, splats: marks 2 and 3, of which the first is a barrier.
RenderContext two_passes() {
  Frame frame(screen_side, screen_side);
  frame.draw(geometry_of(screen_side, screen_side), {});
  frame.draw(geometry_of(screen_side, screen_side), testing::alpha_threshold_state());
  frame.draw(geometry_of(screen_side, screen_side), {});
  return testing::context_of(frame);
}
constexpr Mark barrier = static_cast<Mark>(2);
constexpr Mark change = static_cast<Mark>(3);

class CropBarrierTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  CropBarrierTest() : crop(GetParam(), two_passes()), done(crop.bench.sink<BlendsDone>("out_done")) {}
  void quad(std::uint16_t tile) { crop.quad(0, {tile, 0}, 0, 0.5F); }

  testing::MarkedCropBench crop;
  Sink<BlendsDone>& done;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, CropBarrierTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(CropBarrierTest, ItIsToldWhenTheLastBlendBeforeItHasLeftThePipeline) {
  for (std::uint16_t tile = 0; tile < 6; ++tile) quad(tile);  // a line each, which takes 300 cycles to come
  crop.mark(barrier);
  crop.mark(change);
  crop.mark(Mark::end_of_frame);
  crop.bench.run();
  ASSERT_EQ(done.records().size(), 1U) << "another mark is none";
  EXPECT_TRUE(done.records()[0].item.mark == barrier);
  EXPECT_GT(done.records()[0].cycle, 300U);
  EXPECT_EQ(done.records()[0].cycle, crop.bench.unit().end_of_frame()) << "nothing is blended behind it";
}

TEST_P(CropBarrierTest, WhereNothingIsBlendedItTakesTheLatencyOfABlend) {
  crop.mark(barrier);
  crop.mark(Mark::end_of_frame);
  crop.bench.run();
  // Sent in cycle 0, seen by CROP in 1; 8 cycles of latency.
  EXPECT_EQ(testing::cycles_of(done), std::vector<Cycle>{9});
}

TEST_P(CropBarrierTest, AReceiverThatTakesItLateHoldsUpNothing) {
  done.close(0, 5000);
  for (std::uint16_t tile = 0; tile < 6; ++tile) quad(tile);
  crop.mark(barrier);
  crop.mark(Mark::end_of_frame);
  crop.bench.run();
  EXPECT_LT(crop.bench.unit().end_of_frame(), 2000U);
  EXPECT_EQ(done.records().size(), 1U);
  EXPECT_TRUE(crop.bench.unit().idle());
}

}  // namespace
}  // namespace vrpipe
