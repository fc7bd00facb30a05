// Which draws are tested after shading, and what waits for them, command by command.
#include <vrpipe/pipeline/late_plan.h>

#include <memory>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/hi_z_plan.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

class LatePlanTest : public ::testing::Test {
 protected:
  /// Each of another state than the one before.
  void draw(const DrawState& state) {
    DrawState own = state;
    own.pruning_threshold = 0.001F * static_cast<float>(++draws);
    frame.draw(splats, own);
  }
  void clear(bool color, bool termination, bool depth, bool stencil) {
    Clear clear;
    clear.color = color;
    clear.termination = termination;
    clear.depth = depth;
    clear.stencil = stencil;
    frame.clear(clear);
  }
  static DrawState tested(bool write, bool late = false) {
    DrawState state;
    state.depth = {true, Compare::less, write};
    state.late_tests = late;
    return state;
  }
  LatePlan plan(Termination termination = Termination::paper) const {
    RenderContext context = testing::context_of(frame);
    context.termination = termination;
    return LatePlan(context);
  }
  /// The commands whose marks are waited for.
  std::vector<std::size_t> waits(Termination termination = Termination::paper) const {
    const LatePlan made = plan(termination);
    std::vector<std::size_t> commands;
    for (std::size_t i = 0; i < frame.commands().size(); ++i) {
      if (made.waits_at(Frame::mark_of(i))) commands.push_back(i);
    }
    return commands;
  }
  using Commands = std::vector<std::size_t>;

  std::shared_ptr<const Draw> splats = testing::geometry_of(16, 16, {Splat{}});
  Frame frame{16, 16};
  unsigned draws = 0;
};

TEST(LateTests, AreThoseOfADrawThatDiscardsAndWritesOrThatWantsThem) {
  DrawState state;
  EXPECT_FALSE(state.tests_late()) << "it tests nothing";
  state.late_tests = true;
  EXPECT_FALSE(state.tests_late());
  state.late_tests = false;
  state.depth = {true, Compare::less, false};
  EXPECT_FALSE(state.tests_late()) << "it writes nothing";
  EXPECT_TRUE(state.tests_early());
  state.depth.write = true;
  EXPECT_TRUE(state.tests_late());
  EXPECT_FALSE(state.tests_early());
  state.pruning_threshold = 0;
  EXPECT_FALSE(state.tests_late()) << "it discards nothing";
  state.pruning_threshold = 0.1F;
  state.depth.compare = Compare::none;
  EXPECT_FALSE(state.tests_late()) << "nothing passes that could be written";
  state.stencil.test = true;
  state.stencil.front.depth_fail = StencilOperation::increment;
  EXPECT_TRUE(state.tests_late());
  for (const FragmentShader shader : {FragmentShader::vertex, FragmentShader::lit}) {
    state.shader = shader;
    state.late_tests = false;
    EXPECT_FALSE(state.tests_late()) << "a mesh is opaque";
    state.late_tests = true;
    EXPECT_TRUE(state.tests_late());
  }
}

TEST(LateTests, OfADrawThatShadesNothingAreRefused) {
  Frame frame(16, 16);
  DrawState state;
  state.shader = FragmentShader::none;
  state.depth.test = true;
  state.late_tests = true;
  EXPECT_THROW(frame.draw(testing::geometry_of(16, 16), state), UserError);
  EXPECT_TRUE(frame.draws().empty());
}

TEST(LateTests, AreAStateOfTheirOwn) {
  DrawState early;
  early.depth = {true, Compare::less, false};
  DrawState late = early;
  late.late_tests = true;
  EXPECT_NE(early, late);
}

TEST_F(LatePlanTest, WithoutLateTestsNothingWaits) {
  draw(tested(false));
  clear(true, true, true, true);
  draw(tested(false));
  EXPECT_FALSE(plan().is_used());
  EXPECT_EQ(waits(), Commands{});
}

TEST_F(LatePlanTest, LateDrawsDoNotWaitForOneAnother) {
  for (unsigned i = 0; i < 3; ++i) draw(tested(true));
  const LatePlan made = plan();
  EXPECT_TRUE(made.is_used());
  for (DrawIndex i = 0; i < 3; ++i) EXPECT_TRUE(made.is_late(i));
  EXPECT_EQ(waits(), Commands{});
}

TEST_F(LatePlanTest, ATestBeforeShadingWaitsForWhatIsWrittenAfterIt) {
  draw(tested(true));   // 0
  draw({});             // 1: tests nothing
  draw(tested(false));  // 2
  draw(tested(false));  // 3: nothing new
  draw(tested(true));   // 4
  draw(tested(false));  // 5
  EXPECT_FALSE(plan().is_late(1));
  EXPECT_FALSE(plan().is_late(2));
  EXPECT_EQ(waits(), (Commands{2, 5}));
}

TEST_F(LatePlanTest, WhatIsWrittenBeforeShadingWaitsForTestsAfterIt) {
  draw(tested(false, true));  // 0: late, and writes nothing
  draw(tested(false));        // 1: reads as well
  DrawState depth_alone = tested(true);
  depth_alone.shader = FragmentShader::none;
  draw(depth_alone);  // 2
  EXPECT_TRUE(plan().is_late(0));
  EXPECT_EQ(waits(), Commands{2});
}

TEST_F(LatePlanTest, AClearWaitsIfItClearsWhatWasTested) {
  draw(tested(true));                // 0
  clear(true, true, false, false);   // 1
  clear(false, false, false, true);  // 2
  clear(false, false, true, true);   // 3: nothing new
  draw(tested(false, true));         // 4
  clear(false, false, true, false);  // 5
  EXPECT_EQ(waits(), (Commands{2, 5}));
}

// Hi-Z's wait is over when the mark comes: by then all that was stored before it must have been told.
TEST_F(LatePlanTest, AMarkThatHiZWaitsForWaitsForWhatIsWrittenLate) {
  draw(tested(true));         // 0
  draw(tested(false, true));  // 1: late itself, and may be culled by what 0 stores
  RenderContext context = testing::context_of(frame);
  context.termination = Termination::strict;
  ASSERT_TRUE(HiZPlan(context).waits_at(Frame::mark_of(1)));
  EXPECT_EQ(waits(Termination::strict), Commands{1});
  EXPECT_EQ(waits(Termination::paper), Commands{});
}

}  // namespace
}  // namespace vrpipe
