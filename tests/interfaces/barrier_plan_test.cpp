#include <vrpipe/pipeline/barrier_plan.h>

#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

class BarrierPlanTest : public ::testing::Test {
 protected:
  void write(float pruning = 0.01F) { frame.draw(splats, testing::pruned_at(pruning)); }
  void write_depth_alone() {
    DrawState state;
    state.shader = FragmentShader::none;
    state.depth.test = true;
    frame.draw(splats, state);
  }
  void read() { frame.draw(splats, testing::alpha_threshold_state()); }
  void clear(bool color) {
    Clear clear;
    clear.color = color;
    clear.stencil = !color;
    frame.clear(clear);
  }
  /// The commands that have a barrier before them.
  std::vector<std::size_t> barriers() const {
    RenderContext context;
    context.frame = std::make_shared<Frame>(frame);
    const BarrierPlan plan(context);
    std::vector<std::size_t> found;
    for (std::size_t at = 0; at < frame.commands().size(); ++at) {
      if (plan.is_barrier(Frame::mark_of(at))) found.push_back(at);
    }
    EXPECT_EQ(plan.is_used(), !found.empty());
    EXPECT_FALSE(plan.is_barrier(Mark::none));
    EXPECT_FALSE(plan.is_barrier(Mark::end_of_frame));
    return found;
  }
  std::shared_ptr<const Draw> splats = testing::geometry_of(16, 16, {Splat{}});
  Frame frame{16, 16};
};

using Commands = std::vector<std::size_t>;

TEST_F(BarrierPlanTest, ThereIsNoneWhereNobodyReadsWhatIsDrawn) {
  EXPECT_EQ(barriers(), Commands{});
  write();
  clear(true);
  write(0.5F);
  write_depth_alone();
  EXPECT_EQ(barriers(), Commands{});
}

TEST_F(BarrierPlanTest, ADrawThatReadsWaitsForThoseThatWriteBeforeIt) {
  write();
  write(0.5F);
  read();
  write();
  read();
  EXPECT_EQ(barriers(), (Commands{2, 4}));
}

TEST_F(BarrierPlanTest, WhatIsReadTwiceIsWaitedForOnce) {
  write();
  read();
  read();
  write_depth_alone();
  read();
  EXPECT_EQ(barriers(), Commands{1});
}

TEST_F(BarrierPlanTest, BeforeAnythingIsDrawnThereIsNothingToWaitFor) {
  clear(false);
  write_depth_alone();
  read();
  EXPECT_EQ(barriers(), Commands{});
}

// The second draw has the state of the first, and so no mark of its own.
TEST_F(BarrierPlanTest, AClearOfColorIsWaitedForAtItsOwnMark) {
  read();
  clear(true);
  read();
  EXPECT_EQ(barriers(), Commands{1});
}

TEST_F(BarrierPlanTest, AClearOfTheStencilIsNot) {
  write();
  read();
  clear(false);
  read();
  EXPECT_EQ(barriers(), Commands{1});
}

}  // namespace
}  // namespace vrpipe
