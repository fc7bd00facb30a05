// Frames by themselves: what clears and draws are numbered, and what a frame refuses.
#include <vrpipe/pipeline/frame.h>
#include <cmath>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>

#include "support/builders.h"
#include "support/refusals.h"

namespace vrpipe {
namespace {

using testing::refusal_of;

std::shared_ptr<const Draw> numbered_splats(std::uint32_t splats, std::uint32_t width = 64, std::uint32_t height = 48) {
  auto draw = std::make_shared<Draw>(testing::draw_of(width, height, std::vector<Splat>(splats)));
  for (std::uint32_t i = 0; i < splats; ++i) draw->splats[i].cx = static_cast<float>(i);
  return draw;
}

DrawState pruned_at(float threshold) {
  DrawState state;
  state.pruning_threshold = threshold;
  return state;
}

std::vector<bool> changes_in(const Frame& frame) {
  std::vector<bool> changes;
  for (const Frame::Command& command : frame.commands()) changes.push_back(command.changes_state);
  return changes;
}

TEST(Frame, NumbersSplatsThroughAllDraws) {
  const auto geometry = numbered_splats(20);
  Frame frame(64, 48);
  frame.draw(geometry, {}, "whole");
  frame.draw(geometry, {}, "none of it", 7, 0);
  frame.draw(geometry, {}, "middle", 5, 10);
  frame.draw(geometry, {}, "rest", 18);
  ASSERT_EQ(frame.draws().size(), 4U);
  const std::uint32_t bases[] = {0, 20, 20, 30};
  const std::uint32_t counts[] = {20, 0, 10, 2};
  for (DrawIndex draw = 0; draw < 4; ++draw) {
    EXPECT_EQ(frame.draw_call(draw).base, bases[draw]);
    EXPECT_EQ(frame.draw_call(draw).splats, counts[draw]);
  }
  EXPECT_EQ(frame.splats(), 32U);
  EXPECT_EQ(frame.draw_call(2).splat(20).cx, 5.0F);
  EXPECT_EQ(frame.draw_call(2).splat(29).cx, 14.0F);
  EXPECT_EQ(frame.draw_call(3).splat(31).cx, 19.0F);
}

TEST(Frame, ASplatHasTheTriangleOfItsPlaceInTheGeometry) {
  auto geometry = std::make_shared<Draw>(testing::draw_of(64, 48, std::vector<Splat>(4)));
  for (unsigned i = 0; i < 4; ++i) {
    geometry->triangles.push_back(testing::one_quad_triangle(2.0F * static_cast<float>(i), 0));
  }
  Frame frame(64, 48);
  frame.draw(numbered_splats(3), {});
  frame.draw(geometry, {}, "", 2, 2);
  EXPECT_EQ(frame.draw_call(0).triangle(1), nullptr);
  EXPECT_EQ(frame.draw_call(1).triangle(4), &geometry->triangles[3]);
}

TEST(Frame, OnlyClearsOfTerminationBeginAnEpoch) {
  const auto geometry = numbered_splats(1);
  Frame frame(64, 48);
  frame.clear({false, true});
  frame.draw(geometry, {});
  frame.clear({true, false});
  frame.draw(geometry, {});
  frame.clear({true, true});
  frame.clear({false, true});
  frame.draw(geometry, {});
  EXPECT_EQ(frame.draw_call(0).epoch, 1);
  EXPECT_EQ(frame.draw_call(1).epoch, 1);
  EXPECT_EQ(frame.draw_call(2).epoch, 3);
}

TEST(Frame, EpochsOfOneThatIsGoneOnWithAreCountedFromThere) {
  const auto geometry = numbered_splats(4);
  Frame frame(64, 48);
  frame.clear({false, true});
  frame.draw(geometry, {});
  frame.clear({false, true});
  frame.draw(geometry, {});
  const auto epoch_of_last = [&](std::uint32_t drawn) { return frame.gone_on_with(drawn).draw_call(1).epoch; };
  EXPECT_EQ(epoch_of_last(0), 2);
  EXPECT_EQ(epoch_of_last(1), 1);
  EXPECT_EQ(epoch_of_last(4), 1) << "the clear is still to come";
  EXPECT_EQ(epoch_of_last(5), 0);
  EXPECT_EQ(frame.gone_on_with(5).drawn(), 5);
  EXPECT_EQ(frame.gone_on_with(5).draw_call(1).splat(6).cx, frame.draw_call(1).splat(6).cx);
}

TEST(Frame, ADrawChangesStateIfTheDrawBeforeItHadAnother) {
  const auto geometry = numbered_splats(1);
  Frame frame(64, 48);
  frame.draw(geometry, pruned_at(0.1F));
  frame.draw(geometry, pruned_at(0.1F));
  frame.draw(geometry, pruned_at(0.2F));
  frame.clear({true, true});
  frame.draw(geometry, pruned_at(0.2F));
  frame.draw(geometry, pruned_at(0.1F));
  EXPECT_EQ(changes_in(frame), (std::vector<bool>{false, false, true, false, false, true}));
}

TEST(Frame, EveryFieldOfAStateTellsItFromAnother) {
  const std::vector<std::function<void(DrawState&)>> changes{
      [](DrawState& state) { state.early_termination = true; },
      [](DrawState& state) { state.termination_threshold = 0.5F; },
      [](DrawState& state) { state.termination_inclusive = false; },
      [](DrawState& state) { state.pruning_threshold = 0; },
      [](DrawState& state) { state.splat_extent = SplatExtent::three_sigma; },
      [](DrawState& state) { state.obb_padding = 0; },
      [](DrawState& state) { state.depth.test = true; },
      [](DrawState& state) { state.depth.compare = Compare::greater; },
      [](DrawState& state) { state.depth.write = false; },
      [](DrawState& state) { state.stencil.test = true; },
      [](DrawState& state) { state.stencil.front.compare = Compare::equal; },
      [](DrawState& state) { state.stencil.front.stencil_fail = StencilOperation::zero; },
      [](DrawState& state) { state.stencil.front.depth_fail = StencilOperation::zero; },
      [](DrawState& state) { state.stencil.back.pass = StencilOperation::zero; },
      [](DrawState& state) { state.stencil.back.reference = 1; },
      [](DrawState& state) { state.stencil.back.read_mask = 1; },
      [](DrawState& state) { state.stencil.back.write_mask = 1; },
      [](DrawState& state) { state.stencil.back.bits = all_stencil_bits; },
      [](DrawState& state) { state.early_tests = true; },
      [](DrawState& state) { state.cull = CullMode::front; },
      [](DrawState& state) { state.shader = FragmentShader::lit; },
      [](DrawState& state) { state.light.x = 1; },
      [](DrawState& state) { state.light.y = 1; },
      [](DrawState& state) { state.light.z = 1; },
      [](DrawState& state) { state.light.ambient = 0.5F; },
      [](DrawState& state) { state.blend = false; },
  };
  for (const auto& change : changes) {
    DrawState changed;
    change(changed);
    EXPECT_TRUE(changed != DrawState{});
    EXPECT_TRUE(changed == changed);
  }
}

TEST(Frame, StatesThatBecomeEqualChangeNoMore) {
  const auto geometry = numbered_splats(1);
  Frame frame(64, 48);
  frame.draw(geometry, pruned_at(0.1F));
  frame.clear({true, true});
  frame.draw(geometry, pruned_at(0.2F));
  frame.change_states([](DrawState& state) { state.pruning_threshold = 0.3F; });
  EXPECT_EQ(changes_in(frame), (std::vector<bool>{false, false, false}));
  EXPECT_EQ(frame.draw_call(1).state.pruning_threshold, 0.3F);
}

TEST(Frame, TerminatesEarlyIfAnyDrawDoes) {
  const auto geometry = numbered_splats(1);
  DrawState terminates;
  terminates.early_termination = true;
  Frame frame(64, 48);
  EXPECT_FALSE(frame.terminates_early());
  frame.draw(geometry, {});
  EXPECT_FALSE(frame.terminates_early());
  frame.draw(geometry, terminates);
  frame.draw(geometry, {});
  EXPECT_TRUE(frame.terminates_early());
}

TEST(Frame, NeedsZropIfAnyDrawTestsAnythingOrShadesNothing) {
  const auto geometry = numbered_splats(1);
  const std::vector<std::function<void(DrawState&)>> changes{[](DrawState& state) { state.early_termination = true; },
                                                             [](DrawState& state) { state.depth.test = true; },
                                                             [](DrawState& state) { state.stencil.test = true; },
                                                             [](DrawState& state) {
                                                               state.shader = FragmentShader::none;
                                                             }};
  for (const auto& change : changes) {
    Frame frame(64, 48);
    frame.draw(geometry, {});
    EXPECT_FALSE(frame.needs_zrop());
    DrawState state;
    change(state);
    frame.draw(geometry, state);
    EXPECT_TRUE(frame.needs_zrop());
    EXPECT_EQ(frame.tests_depth_stencil(), state.depth.test || state.stencil.test);
  }
}

TEST(Frame, AMeshAndItsStateBelongTogether) {
  const auto splats = numbered_splats(1);
  const auto mesh = std::make_shared<Draw>(testing::draw_of(64, 48));
  mesh->mesh.resize(3);
  const auto both = std::make_shared<Draw>(*mesh);
  both->splats.resize(3);
  DrawState lit;
  lit.shader = FragmentShader::lit;
  Frame frame(64, 48);
  frame.draw(mesh, lit);
  frame.draw(mesh, lit, "a part", 1, 2);
  EXPECT_EQ(frame.splats(), 5U);
  EXPECT_EQ(&frame.draw_call(1).mesh_triangle(3), &mesh->mesh[1]);
  EXPECT_THROW(frame.draw(mesh, {}), UserError) << "the shader of splats";
  EXPECT_THROW(frame.draw(splats, lit), UserError) << "the shader of meshes";
  EXPECT_THROW(frame.draw(both, lit), UserError) << "splats as well";
  EXPECT_THROW(frame.draw(mesh, lit, "", 2, 2), UserError) << "triangles that are not there";
  DrawState marked = lit;
  marked.stencil.back.reference = 128;
  EXPECT_THROW(frame.draw(mesh, marked), UserError) << "the bit of termination";
}

TEST(Frame, AllBitsOfTheStencilAreThereWhereNothingTerminates) {
  const auto splats = numbered_splats(1);
  DrawState whole;
  whole.stencil.test = true;
  whole.stencil.front.bits = whole.stencil.back.bits = all_stencil_bits;
  whole.stencil.front.reference = 255;
  DrawState terminates;
  terminates.early_termination = true;
  Frame frame(64, 48);
  frame.draw(splats, whole);
  EXPECT_THROW(frame.draw(splats, terminates), UserError);
  Frame other(64, 48);
  other.draw(splats, terminates);
  EXPECT_THROW(other.draw(splats, whole), UserError);
  whole.stencil.back.bits = 0x3f;
  EXPECT_THROW(Frame(64, 48).draw(splats, whole), UserError) << "neither 7 nor 8";
}

TEST(Frame, TestsAreBeforeShadingOrBehindIt) {
  DrawState state;
  state.stencil.test = true;
  state.stencil.front.pass = StencilOperation::decrement;
  EXPECT_TRUE(state.tests_late()) << "the shader may discard";
  state.early_tests = true;
  EXPECT_TRUE(state.tests_early());
  EXPECT_TRUE(state.merges());
  state.late_tests = true;
  EXPECT_THROW(Frame(64, 48).draw(numbered_splats(1), state), UserError);
}

TEST(Frame, APresetStencilHasAValueForEachPixel) {
  Frame frame(64, 48);
  EXPECT_EQ(frame.stencil_preset(), nullptr);
  EXPECT_THROW(frame.preset_stencil(std::vector<std::uint8_t>(64 * 47)), UserError);
  frame.preset_stencil(std::vector<std::uint8_t>(64 * 48, 200));
  EXPECT_EQ(frame.stencil_preset()->at(5), 200);
}

TEST(Frame, ClearsAreOfWhatATargetHolds) {
  Frame frame(64, 48);
  Clear clear;
  clear.depth_value = 1.5F;
  EXPECT_THROW(frame.clear(clear), UserError);
  clear.depth_value = std::nanf("");
  EXPECT_THROW(frame.clear(clear), UserError);
  clear.depth_value = 0;
  clear.stencil_value = 128;
  EXPECT_THROW(frame.clear(clear), UserError);
  clear.stencil_value = 127;
  EXPECT_NO_THROW(frame.clear(clear));
}

TEST(Frame, AMarkOfAClearGivesItAndNoOtherDoes) {
  const auto geometry = numbered_splats(1);
  Frame frame(64, 48);
  frame.draw(geometry, {});
  frame.clear({true, false});
  frame.draw(geometry, pruned_at(0.5F));
  frame.clear({false, true});
  EXPECT_EQ(frame.clear_of(Mark::none), nullptr);
  EXPECT_EQ(frame.clear_of(Mark::end_of_frame), nullptr);
  EXPECT_EQ(frame.clear_of(Frame::mark_of(0)), nullptr);
  EXPECT_EQ(frame.clear_of(Frame::mark_of(2)), nullptr);
  ASSERT_NE(frame.clear_of(Frame::mark_of(1)), nullptr);
  EXPECT_TRUE(frame.clear_of(Frame::mark_of(1))->color);
  EXPECT_FALSE(frame.clear_of(Frame::mark_of(1))->termination);
  ASSERT_NE(frame.clear_of(Frame::mark_of(3)), nullptr);
  EXPECT_TRUE(frame.clear_of(Frame::mark_of(3))->termination);
}

TEST(Frame, ASideIs1To16384) {
  for (const std::uint32_t side : {0U, 16385U, ~0U}) {
    EXPECT_NE(refusal_of([&] { Frame(side, 1); }).find("unusable size"), std::string::npos) << side;
    EXPECT_NE(refusal_of([&] { Frame(1, side); }).find("unusable size"), std::string::npos) << side;
  }
  EXPECT_EQ(Frame(16384, 1).width(), 16384U);
}

TEST(Frame, ADrawOfAnotherSizeIsRefusedByName) {
  Frame frame(64, 48);
  for (const auto& other : {numbered_splats(1, 63, 48), numbered_splats(1, 64, 49)}) {
    const std::string refusal = refusal_of([&] { frame.draw(other, {}, "roof"); });
    EXPECT_NE(refusal.find("cannot draw 'roof'"), std::string::npos) << refusal;
    EXPECT_NE(refusal.find("the frame has 64x48"), std::string::npos) << refusal;
  }
}

TEST(Frame, TrianglesThatAreNotAsManyAsSplatsAreRefused) {
  auto geometry = std::make_shared<Draw>(testing::draw_of(64, 48, std::vector<Splat>(4)));
  geometry->triangles.resize(3);
  Frame frame(64, 48);
  EXPECT_NE(refusal_of([&] { frame.draw(geometry, {}); }).find("3 triangles for 4 splats"), std::string::npos);
}

TEST(Frame, SplatsThatAreNotThereAreRefused) {
  const auto geometry = numbered_splats(20);
  struct Range {
    std::uint32_t first, splats;
  };
  for (const Range wrong : {Range{0, 21}, {20, 1}, {21, 0}, {21, ~0U}, {5, ~0U - 1}, {~0U, 1}}) {
    Frame frame(64, 48);
    EXPECT_NE(refusal_of([&] { frame.draw(geometry, {}, "", wrong.first, wrong.splats); }).find("draw what is there"),
              std::string::npos)
        << wrong.first << " " << wrong.splats;
    EXPECT_TRUE(frame.commands().empty() && frame.draws().empty() && frame.splats() == 0) << "it is left as it was";
  }
  Frame frame(64, 48);
  frame.draw(geometry, {}, "", 20);
  EXPECT_EQ(frame.draw_call(0).splats, 0U) << "behind the last is nothing, and that is there";
}

TEST(Frame, Has32767DrawsAtMost) {
  const auto geometry = numbered_splats(1);
  Frame frame(64, 48);
  for (unsigned i = 0; i < 32767; ++i) frame.draw(geometry, {});
  EXPECT_NE(refusal_of([&] { frame.draw(geometry, {}); }).find("32767 draws at most"), std::string::npos);
  EXPECT_EQ(frame.draws().size(), 32767U);
  Quad quad{};
  quad.draw = static_cast<std::uint16_t>(frame.draws().size() - 1) & 0x7fffU;
  EXPECT_EQ(quad.draw, 32766) << "a quad can say it";
}

TEST(Frame, Has65534CommandsAtMostAndEachAMarkOfItsOwn) {
  Frame frame(64, 48);
  for (unsigned i = 0; i < 65534; ++i) frame.clear({false, true});
  EXPECT_NE(refusal_of([&] { frame.clear({true, true}); }).find("65534 commands"), std::string::npos);
  EXPECT_NE(refusal_of([&] { frame.draw(numbered_splats(1), {}); }).find("65534 commands"), std::string::npos);
  EXPECT_EQ(frame.commands().size(), 65534U);
  EXPECT_TRUE(frame.draws().empty());
  EXPECT_EQ(frame.splats(), 0U);
  EXPECT_NE(Frame::mark_of(0), Mark::none);
  EXPECT_NE(Frame::mark_of(65533), Mark::end_of_frame);
}

TEST(Frame, HasTwoToThe31SplatsAtMost) {
  const auto geometry = numbered_splats(1U << 17U);
  Frame frame(64, 48);
  for (unsigned i = 0; i < 1U << 14U; ++i) frame.draw(geometry, {});
  EXPECT_EQ(frame.splats(), 1U << 31U);
  EXPECT_NE(refusal_of([&] { frame.draw(geometry, {}, "", 0, 1); }).find("2^31 splats"), std::string::npos);
  frame.draw(geometry, {}, "", 0, 0);
}

TEST(Frame, OfADrawIsThatDrawAlone) {
  const Draw draw = testing::draw_of(64, 48, std::vector<Splat>(3));
  const auto frame = Frame::of(draw, pruned_at(0.5F));
  EXPECT_EQ(frame->width(), 64U);
  EXPECT_EQ(frame->height(), 48U);
  ASSERT_EQ(frame->commands().size(), 1U);
  EXPECT_EQ(frame->draw_call(0).splats, 3U);
  EXPECT_EQ(frame->draw_call(0).state.pruning_threshold, 0.5F);
  EXPECT_EQ(&frame->draw_call(0).splat(1), &draw.splats[1]);
}

TEST(Frame, RefusesEarlyTerminationWithoutBlending) {
  DrawState state;
  state.blend = false;
  state.early_termination = true;
  Frame frame(64, 48);
  const std::string refusal = refusal_of([&] { frame.draw(numbered_splats(1), state, "flat"); });
  EXPECT_NE(refusal.find("cannot draw 'flat' (draw 0 of the frame): it terminates early, and does not blend"),
            std::string::npos)
      << refusal;
}

}  // namespace
}  // namespace vrpipe
