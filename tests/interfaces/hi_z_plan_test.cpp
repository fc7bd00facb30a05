#include <vrpipe/pipeline/hi_z_plan.h>

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "support/builders.h"
#include "support/mixed_reference.h"

namespace vrpipe {
namespace {

constexpr Compare lowering[] = {Compare::less, Compare::less_equal};

class HiZPlanTest : public ::testing::Test {
 protected:
  void draw(Compare compare, bool write) {
    DrawState state;
    state.depth = {true, compare, write};
    state.pruning_threshold = 0.001F * static_cast<float>(++draws);  // each of another state
    frame.draw(splats, state);
  }
  void draw_without_test() { frame.draw(splats, {}); }
  void clear_depth(float depth) {
    Clear clear;
    clear.depth = true;
    clear.depth_value = depth;
    frame.clear(clear);
  }
  HiZPlan plan(Termination termination = Termination::paper) const {
    RenderContext context = testing::context_of(frame);
    context.termination = termination;
    return HiZPlan(context);
  }
  std::shared_ptr<const Draw> splats = testing::geometry_of(16, 16, {Splat{}});
  Frame frame{16, 16};
  unsigned draws = 0;
};

TEST_F(HiZPlanTest, IsOfNoUseWhereNothingIsStoredOrNothingIsTested) {
  EXPECT_FALSE(plan().is_used());
  draw_without_test();
  EXPECT_FALSE(plan().is_used());
  draw(Compare::less, false);
  EXPECT_FALSE(plan().is_used()) << "all is in front of what depth is cleared to";
  draw(Compare::greater, false);
  EXPECT_FALSE(plan().is_used());
  clear_depth(0.5F);
  EXPECT_FALSE(plan().is_used());
  draw(Compare::less, false);
  EXPECT_TRUE(plan().is_used()) << "but now all beyond 0.5 fails";
}

TEST_F(HiZPlanTest, WhatIsStoredCullsWhatComesBehind) {
  for (const Compare compare : lowering) {
    frame = Frame(16, 16);
    draw_without_test();
    draw(Compare::equal, false);
    draw(compare, true);
    draw(Compare::equal, false);
    draw(Compare::greater, false);
    draw(compare, true);
    const HiZPlan made = plan();
    EXPECT_FALSE(made.culls(0));
    EXPECT_FALSE(made.culls(1)) << "before anything is stored";
    EXPECT_TRUE(made.culls(2)) << "by itself";
    EXPECT_TRUE(made.culls(3));
    EXPECT_FALSE(made.culls(4));
    EXPECT_TRUE(made.reports(2));
    EXPECT_FALSE(made.reports(3));
    EXPECT_TRUE(made.reports(5));
  }
}

TEST_F(HiZPlanTest, WhatMayRaiseDepthEndsItUntilDepthIsCleared) {
  for (unsigned compare = 0; compare < compares; ++compare) {
    for (const bool write : {false, true}) {
      frame = Frame(16, 16);
      draw(Compare::less, true);
      draw(static_cast<Compare>(compare), write);
      draw(Compare::less, true);
      clear_depth(1);
      draw(Compare::less, true);
      // By the table: whether anything passes that is greater than what is stored.
      const bool raises = write && testing::passes_by_table(static_cast<Compare>(compare), 2, 1);
      const HiZPlan made = plan();
      SCOPED_TRACE("compare " + std::to_string(compare) + (write ? ", written" : ""));
      EXPECT_EQ(made.culls(2), !raises);
      EXPECT_EQ(made.reports(2), !raises);
      EXPECT_TRUE(made.culls(3));
      EXPECT_EQ(made.epoch(2), 0);
      EXPECT_EQ(made.epoch(3), 1);
    }
  }
}

TEST_F(HiZPlanTest, WhatNobodyCanUseIsNotReported) {
  draw(Compare::less, true);
  clear_depth(0.25F);
  draw(Compare::less, false);
  draw(Compare::always, true);
  draw(Compare::less, false);
  const HiZPlan made = plan();
  EXPECT_TRUE(made.reports(0)) << "it may cull itself";
  EXPECT_FALSE(made.reports(2));
  EXPECT_FLOAT_EQ(made.cleared_to(1), 0.25F);
}

TEST_F(HiZPlanTest, StrictTerminationWaitsWhereWhatIsStoredIsFirstUsed) {
  draw(Compare::less, true);    // 0
  draw(Compare::less, false);   // 1: waits
  draw(Compare::equal, false);  // 2: all is known
  draw(Compare::greater, false);
  draw(Compare::less, true);  // 4: all is known, of what was stored before
  draw_without_test();
  draw(Compare::less, false);  // 6: waits
  clear_depth(1);
  draw(Compare::less, true);
  for (std::size_t command = 0; command < frame.commands().size(); ++command) {
    const bool waits = command == 1 || command == 6;
    EXPECT_EQ(plan(Termination::strict).waits_at(Frame::mark_of(command)), waits) << command;
    EXPECT_FALSE(plan().waits_at(Frame::mark_of(command)));
  }
  EXPECT_FALSE(plan(Termination::strict).waits_at(Mark::end_of_frame));
}

// Every function, operation and some masks: what fails the depth test must not change any stencil value.
TEST(HiZStencil, WhatWouldLeaveATraceIsNotCulled) {
  unsigned may = 0;
  for (unsigned compare = 0; compare < compares; ++compare) {
    for (unsigned stencil_fail = 0; stencil_fail < stencil_operations; ++stencil_fail) {
      for (unsigned depth_fail = 0; depth_fail < stencil_operations; ++depth_fail) {
        for (const unsigned write_mask : {0U, 0x80U, 0x10U, 0x7fU}) {
          for (const bool is_back : {false, true}) {
            DrawState state;
            state.depth = {true, Compare::less, true};
            state.stencil.test = true;
            StencilFace& face = is_back ? state.stencil.back : state.stencil.front;
            face.compare = static_cast<Compare>(compare);
            face.stencil_fail = static_cast<StencilOperation>(stencil_fail);
            face.depth_fail = static_cast<StencilOperation>(depth_fail);
            face.pass = StencilOperation::invert;
            face.reference = 0x35;
            face.write_mask = static_cast<std::uint8_t>(write_mask);
            if (!hi_z_may_cull(state)) continue;
            ++may;
            for (unsigned stored = 0; stored < 128; ++stored) {
              const bool passes = testing::passes_by_table(face.compare, face.reference, stored);
              const unsigned made =
                  testing::stencil_by_table(passes ? face.depth_fail : face.stencil_fail, stored, face.reference);
              const unsigned bits = write_mask & 0x7fU;
              ASSERT_EQ((made & bits) | (stored & ~bits), stored);
            }
          }
        }
      }
    }
  }
  // All where nothing can be written; else where what can come to pass keeps the value.
  EXPECT_EQ(may, 2U * (2 * 512 + 2 * (6 + 8 + 8)));
}

}  // namespace
}  // namespace vrpipe
