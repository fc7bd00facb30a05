// CROP in a frame of several draws: each is blended with its state, and a clear waits for what is before it.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/crop.h>

#include "crop/marked_crop_bench.h"

namespace vrpipe {
namespace {

using testing::color_of;
using testing::context_of;
using testing::geometry_of;
using testing::MarkedCropBench;
using testkit::Bench;

DrawState terminated_at(float threshold, bool on = true) {
  DrawState state;
  state.early_termination = on;
  state.termination_threshold = threshold;
  return state;
}

/// The behaviour and a target of 64x64 pixels that does not round.
struct Rop {
  explicit Rop(const Frame& frame, Termination termination = Termination::paper,
               ColorFormat format = ColorFormat::rgba32f, Placement placement = {})
      : context(context_of(frame)), surface(frame.width(), frame.height(), format) {
    context.termination = termination;
    context.format = format;
    context.placement = placement;
    const Implementation& implementation = Registry::instance().find("crop", "color-rop");
    behaviour = implementation.make_behaviour(*implementation.make_parameters(), context);
    behaviour->set_draws(frame.draws().size());
    crop = dynamic_cast<CropBehaviour*>(behaviour.get());
    crop->attach(surface);
  }
  /// Into the first quad; returns the pixels signalled.
  unsigned blend(DrawIndex draw, float alpha, LaneMask live = all_lanes) {
    return crop->blend(draw, 0, live, color_of(alpha, alpha, alpha, alpha)).terminated;
  }
  float alpha(unsigned lane = 0) const { return surface.quad(std::size_t{0}).alpha[lane]; }
  std::uint64_t count(const std::string& name) const {
    for (const Counter* counter : behaviour->counters()) {
      if (name == counter->name()) return counter->value();
    }
    ADD_FAILURE() << "no counter " << name;
    return 0;
  }

  RenderContext context;
  ColorSurface surface;
  std::unique_ptr<Behaviour> behaviour;
  CropBehaviour* crop = nullptr;
};

Frame frame_of(const std::vector<DrawState>& states, unsigned side = 64) {
  Frame frame(side, side);
  for (const DrawState& state : states) frame.draw(geometry_of(side, side), state);
  return frame;
}

using ByDraw = std::vector<std::uint64_t>;

TEST(ColorRopOfAFrame, SignalsAtTheThresholdOfTheDraw) {
  Rop rop(frame_of({terminated_at(0.9F), terminated_at(0.5F), terminated_at(0.5F, false)}));
  EXPECT_EQ(rop.blend(0, 0.4F), 0U);
  EXPECT_EQ(rop.blend(1, 0.4F), all_lanes) << "0.64";
  EXPECT_EQ(rop.blend(0, 0.5F), 0U) << "0.82";
  EXPECT_EQ(rop.blend(2, 0.5F), 0U) << "0.91, of a draw that does not terminate";
  EXPECT_EQ(rop.crop->termination_signals.of_draw(), (ByDraw{0, 1, 0}));
}

TEST(ColorRopOfAFrame, AnExclusiveThresholdIsOfTheDrawToo) {
  DrawState exclusive = terminated_at(0.5F);
  exclusive.termination_inclusive = false;
  Rop rop(frame_of({exclusive, terminated_at(0.5F)}));
  EXPECT_EQ(rop.blend(0, 0.5F, 0b0001), 0U);
  EXPECT_EQ(rop.blend(1, 0.5F, 0b0010), 0b0010U);
}

// Alpha alone does not close a pixel: the draw before had a higher threshold, or did not terminate.
TEST(ColorRopOfAFrame, InStrictOrderAPixelPastTheThresholdThatWasNotSignalledIsBlended) {
  for (const DrawState& before : {terminated_at(0.99F), terminated_at(0.5F, false)}) {
    Rop rop(frame_of({before, terminated_at(0.5F)}), Termination::strict);
    EXPECT_EQ(rop.blend(0, 0.8F), 0U);
    rop.blend(1, 0.5F);
    EXPECT_NEAR(rop.alpha(), 0.9F, 1e-6F);
    EXPECT_EQ(rop.crop->fragments_dropped_late.value(), 0U);
  }
}

TEST(ColorRopOfAFrame, InStrictOrderASignalledPixelDropsWhatEveryTerminatingDrawBringsAndNoOther) {
  Rop rop(frame_of({terminated_at(0.5F), terminated_at(0.99F), terminated_at(0.5F, false)}), Termination::strict);
  EXPECT_EQ(rop.blend(0, 0.6F, 0b0011), 0b0011U);
  rop.blend(1, 0.5F);
  EXPECT_FLOAT_EQ(rop.alpha(0), 0.6F) << "closed, though below the threshold of this draw";
  EXPECT_FLOAT_EQ(rop.alpha(2), 0.5F);
  rop.blend(2, 0.5F);
  EXPECT_FLOAT_EQ(rop.alpha(0), 0.8F) << "this one does not ask";
  rop.blend(0, 0.5F, 0b0001);
  EXPECT_EQ(rop.crop->fragments_dropped_late.of_draw(), (ByDraw{1, 2, 0}));
  EXPECT_EQ(rop.crop->quads_dropped_late.of_draw(), (ByDraw{1, 0, 0}));
  EXPECT_EQ(rop.crop->fragments_blended.of_draw(), (ByDraw{2, 2, 4}));
}

TEST(ColorRopOfAFrame, AClearOfColorLeavesPixelsClosedAndOneOfTerminationLeavesTheColor) {
  Frame frame(64, 64);
  frame.draw(geometry_of(64, 64), terminated_at(0.5F));
  frame.clear({true, false});
  frame.draw(geometry_of(64, 64), terminated_at(0.5F));
  frame.clear({false, true});
  frame.draw(geometry_of(64, 64), terminated_at(0.5F));
  Rop rop(frame, Termination::strict);
  rop.blend(0, 0.6F, 0b0001);
  rop.crop->pass(Frame::mark_of(1));
  EXPECT_EQ(rop.alpha(), 0.0F);
  rop.blend(1, 0.25F);
  EXPECT_EQ(rop.alpha(0), 0.0F);
  EXPECT_EQ(rop.alpha(1), 0.25F);
  rop.crop->pass(Frame::mark_of(3));
  EXPECT_EQ(rop.alpha(1), 0.25F);
  rop.blend(2, 0.25F);
  EXPECT_EQ(rop.alpha(0), 0.25F) << "open again";
}

TEST(ColorRopOfAFrame, MarksOfDrawsAndTheEndClearNothing) {
  Frame frame = frame_of({terminated_at(0.5F), terminated_at(0.9F)});
  Rop rop(frame, Termination::strict);
  rop.blend(0, 0.6F);
  rop.crop->pass(Frame::mark_of(1));
  rop.crop->pass(Mark::end_of_frame);
  rop.blend(1, 0.5F);
  EXPECT_FLOAT_EQ(rop.alpha(), 0.6F);
}

TEST(ColorRopOfAFrame, AGpcClearsItsOwnTilesAlone) {
  Frame frame(128, 128);
  frame.clear({true, true});
  const Placement placement = testing::placement_of(3, 1, 128, 128);
  Rop rop(frame, Termination::paper, ColorFormat::rgba16f, placement);
  const ScreenTiling& grid = rop.surface.grid();
  for (std::size_t place = 0; place < grid.quads(); ++place) rop.surface.quad(place) = color_of(1, 1, 1, 1);
  rop.crop->pass(Frame::mark_of(0));
  for (std::size_t place = 0; place < grid.quads(); ++place) {
    const bool own = placement.owns(grid.tile(place / positions_per_tile));
    ASSERT_EQ(rop.surface.quad(place).alpha[3], own ? 0.0F : 1.0F) << place;
  }
}

TEST(ColorRopOfAFrame, WhatRoundingHasLostIsForgottenWithTheColor) {
  Frame frame(64, 64);
  frame.draw(geometry_of(64, 64), {});
  frame.clear({true, false});
  frame.draw(geometry_of(64, 64), {});
  Rop rop(frame, Termination::paper, ColorFormat::rgba8);
  const auto fill = [&](DrawIndex draw) {
    for (unsigned i = 0; i < 3000; ++i) rop.blend(draw, 0.005F);
  };
  fill(0);
  const std::uint64_t lost = rop.count("fragments_lost_to_rounding");
  ASSERT_GT(lost, 0U);
  ASSERT_EQ(rop.count("pixels_stuck"), 4U) << "the four of the quad, each once";
  rop.crop->pass(Frame::mark_of(1));
  fill(1);
  EXPECT_EQ(rop.count("fragments_lost_to_rounding"), 2 * lost);
  EXPECT_EQ(rop.count("pixels_stuck"), 8U) << "once more after the clear";
}

TEST(ColorRopOfAFrame, QuadsOfAWarpAreBlendedAndCountedEachForItsDraw) {
  Rop rop(frame_of({terminated_at(0.5F), terminated_at(0.5F), terminated_at(0.5F)}));
  ShadedWarp warp;
  warp.count = 5;
  const DrawIndex draws[] = {0, 2, 2, 0, 1};
  for (unsigned i = 0; i < 5; ++i) {
    warp.position[i] = static_cast<std::uint8_t>(i);
    warp.live[i] = i == 2 ? 0b0001 : 0b0111;
    warp.color[i] = color_of(0.6F, 0.6F, 0.6F, 0.6F);
    warp.draw[i] = draws[i];
  }
  CropBehaviour::Outcomes outcomes;
  rop.crop->blend_quads(warp, 0, 5, outcomes);
  EXPECT_EQ(rop.crop->quads_blended.of_draw(), (ByDraw{2, 1, 2}));
  EXPECT_EQ(rop.crop->fragments_blended.of_draw(), (ByDraw{6, 3, 4}));
  EXPECT_EQ(rop.crop->termination_signals.of_draw(), (ByDraw{2, 1, 2}));
}

class CropMarksTest : public ::testing::TestWithParam<Fidelity> {};
INSTANTIATE_TEST_SUITE_P(Fidelities, CropMarksTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

/// Draws with a clear of colour between each two: draw n is command 2 n.
RenderContext cleared_between(unsigned draws, const DrawState& state = {}) {
  Frame frame(256, 256);
  for (unsigned draw = 0; draw < draws; ++draw) {
    if (draw > 0) frame.clear({true, true});
    frame.draw(geometry_of(256, 256), state);
  }
  RenderContext context = context_of(frame);
  context.format = ColorFormat::rgba32f;
  return context;
}

TEST_P(CropMarksTest, AClearWaitsForAllBlendsBeforeItAndNothingBehindItIsBlendedBefore) {
  constexpr DrawIndex draws = 6;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    Bench::Settings settings;
    if (seed % 2 == 0) settings = {{"cache_bytes", "1024"}, {"input_quads", "4"}, {"mshrs", "2"}};
    MarkedCropBench crop(GetParam(), cleared_between(draws), settings);
    // What the last draw leaves: its own blends alone.
    std::vector<float> last(256);
    for (DrawIndex draw = 0; draw < draws; ++draw) {
      if (draw > 0) crop.mark(Frame::mark_of(2 * std::size_t{draw} - 1));
      for (unsigned i = 0; i < 40; ++i) {
        const auto at = static_cast<unsigned>(mix(seed * 1000 + draw * 50U + i) % 256);
        crop.quad(draw, {static_cast<std::uint16_t>(at % 16), 3}, at / 16, 0.5F);
        if (draw + 1 == draws) last[at] += (1.0F - last[at]) * 0.5F;
      }
    }
    crop.mark(Mark::end_of_frame);
    crop.bench.stall_randomly(seed, 64);
    crop.bench.run();
    for (unsigned at = 0; at < 256; ++at) {
      const QuadColor& quad = crop.bench.surface().quad({static_cast<std::uint16_t>(at % 16), 3}, at / 16);
      ASSERT_EQ(quad.alpha[0], last[at]) << at << ", seed " << seed;
      ASSERT_EQ(quad.red[3], last[at]) << at << ", seed " << seed;
    }
    EXPECT_TRUE(crop.bench.unit().idle());
    EXPECT_NE(crop.bench.unit().end_of_frame(), never);
  }
}

TEST_P(CropMarksTest, ASignalHasTheEpochOfItsDraw) {
  MarkedCropBench crop(GetParam(), cleared_between(3, terminated_at(0.5F)));
  const testkit::Sink<TerminationBeat>& signals = crop.bench.sink<TerminationBeat>("out_terminations", 64);
  crop.quad(0, {0, 0}, 1, 0.6F);
  crop.mark(Frame::mark_of(1));
  crop.quad(1, {0, 0}, 2, 0.6F);
  crop.mark(Frame::mark_of(3));
  crop.quad(2, {0, 0}, 3, 0.6F);
  crop.mark(Mark::end_of_frame);
  crop.bench.run();
  std::vector<std::pair<unsigned, unsigned>> seen;  // position and epoch
  for (const auto& record : signals.records()) {
    for (unsigned i = 0; i < record.item.count; ++i) {
      seen.emplace_back(record.item.signals[i].position, record.item.signals[i].epoch);
    }
  }
  EXPECT_EQ(seen, (std::vector<std::pair<unsigned, unsigned>>{{1, 0}, {2, 1}, {3, 2}}));
}

TEST_P(CropMarksTest, QuadsBehindAClearFillTheirSectorsWhileThoseBeforeItWaitForTheirs) {
  MarkedCropBench crop(GetParam(), cleared_between(6));
  for (DrawIndex draw = 0; draw < 6; ++draw) {
    if (draw > 0) crop.mark(Frame::mark_of(2 * std::size_t{draw} - 1));
    crop.quad(draw, {draw, 0}, 0, 0.5F);
  }
  crop.mark(Mark::end_of_frame);
  crop.bench.run();
  EXPECT_GT(crop.bench.unit().end_of_frame(), 300U) << "a fill";
  EXPECT_LT(crop.bench.unit().end_of_frame(), 450U) << "and not two one after the other";
}

// A mark ends no cycle of the blender: what is counted as unpaired is what does not go together.
TEST_P(CropMarksTest, QuadsOfASectorGoTogetherAcrossAMark) {
  Frame frame(256, 256);
  for (unsigned draw = 0; draw < 5; ++draw) frame.draw(geometry_of(256, 256), {});
  RenderContext context = context_of(frame);
  context.format = ColorFormat::rgba8;
  for (const char* forwarding : {"on", "off"}) {
    MarkedCropBench crop(
        GetParam(), context,
        {{"bytes_per_cycle", "32"}, {"cache_bytes", "8192"}, {"pairs_in_sector", "on"}, {"forwarding", forwarding}});
    for (DrawIndex draw = 0; draw < 5; ++draw) {
      if (draw > 0) crop.mark(Frame::mark_of(draw));
      crop.quad(draw, {0, 0}, draw, 0.5F);
    }
    crop.mark(Mark::end_of_frame);
    crop.bench.run();
    EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::blend), 2.5) << forwarding;
    EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::unpaired), 0.5) << forwarding;
  }
}

TEST_P(CropMarksTest, ClearsAloneEndTheFrame) {
  MarkedCropBench crop(GetParam(), cleared_between(3));
  crop.mark(Frame::mark_of(1));
  crop.mark(Frame::mark_of(3));
  crop.mark(Mark::end_of_frame);
  crop.bench.run();
  EXPECT_NE(crop.bench.unit().end_of_frame(), never);
  EXPECT_TRUE(crop.bench.unit().idle());
}

}  // namespace
}  // namespace vrpipe
