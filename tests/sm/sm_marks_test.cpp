// The SM array in a frame of several draws: warps may be of several, which are told apart in what is counted, and marks
// are never behind a warp launched after them.
#include <algorithm>

#include <gtest/gtest.h>

#include "sm/sm.h"
#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

constexpr DrawIndex marked_draws = 3;
constexpr std::uint32_t splats_of_draw = 8;

/// Draws of equal state: splats 0, 1, ... of the frame, eight of each. Round ones, so that some lanes are pruned.
RenderContext three_draws() {
  std::vector<Splat> splats;
  for (std::uint32_t i = 0; i < splats_of_draw; ++i) {
    splats.push_back(testing::round_splat(1 + 2 * static_cast<float>(i), 3, 0.8F, 0.7F));
  }
  const auto geometry = testing::geometry_of(64, 64, splats);
  Frame frame(64, 64);
  for (DrawIndex draw = 0; draw < marked_draws; ++draw) frame.draw(geometry, {});
  return testing::context_of(frame);
}

/// A shader whose counters count by draw.
struct CountingShader : SplatShader {
  explicit CountingShader(const RenderContext& context) : SplatShader({}, context) { set_draws(marked_draws); }
};

Quad quad_of_splat(std::uint32_t splat, unsigned position, LaneMask coverage) {
  Quad quad{};
  quad.splat = splat;
  quad.position = static_cast<std::uint8_t>(position);
  quad.coverage = coverage;
  quad.draw = (splat / splats_of_draw) & 0x7fffU;
  return quad;
}

using ByDraw = std::vector<std::uint64_t>;

TEST(SplatShaderOfAFrame, AnAttributeIsThatOfTheDrawsOwnSplat) {
  std::vector<Splat> red{testing::flat_box(0, 0, 64, 64, 0.5F, 1, 0, 0)};
  std::vector<Splat> blue{testing::flat_box(0, 0, 64, 64, 0.5F, 1, 1, 1),
                          testing::flat_box(0, 0, 64, 64, 0.5F, 0, 0, 1)};
  Frame frame(64, 64);
  frame.draw(testing::geometry_of(64, 64, red), {});
  frame.draw(testing::geometry_of(64, 64, blue), {}, "", 1);
  const RenderContext context = testing::context_of(frame);
  SplatShader sm({}, context);
  Warp warp;
  for (DrawIndex draw = 0; draw < 2; ++draw) {
    Quad quad{};
    quad.splat = draw;
    quad.draw = draw & 1U;
    quad.coverage = all_lanes;
    quad.position = static_cast<std::uint8_t>(draw);
    warp.quads[warp.count++] = quad;
  }
  ShadedWarp out;
  sm.shade(warp, out);
  ASSERT_EQ(out.count, 2);
  EXPECT_GT(out.color[0].red[0], 0.4F);
  EXPECT_EQ(out.color[0].blue[0], 0.0F);
  EXPECT_EQ(out.color[1].red[0], 0.0F);
  EXPECT_GT(out.color[1].blue[0], 0.4F);
  EXPECT_EQ(out.draw[0], 0);
  EXPECT_EQ(out.draw[1], 1);
}

TEST(SplatShaderOfAFrame, PrunesAtTheThresholdOfTheWarpsDraw) {
  const auto geometry = testing::geometry_of(64, 64, {testing::flat_box(0, 0, 64, 64, 0.3F)});
  Frame frame(64, 64);
  for (const float threshold : {0.2F, 0.4F}) frame.draw(geometry, testing::pruned_at(threshold));
  const RenderContext context = testing::context_of(frame);
  SplatShader sm({}, context);
  for (const DrawIndex draw : std::vector<DrawIndex>{0, 1, 0}) {
    Warp warp;
    Quad quad{};
    quad.splat = draw;
    quad.draw = draw & 1U;
    quad.coverage = all_lanes;
    warp.quads[warp.count++] = quad;
    ShadedWarp out;
    sm.shade(warp, out);
    EXPECT_EQ(out.count, draw == 0 ? 1 : 0);
  }
}

TEST(SplatShaderOfAFrame, AMergedQuadIsOfItsFrontsDrawAndIsCountedAsMergedForItsBacks) {
  const RenderContext context = three_draws();
  CountingShader sm(context);
  Warp warp;
  warp.merge_pairs = 1;
  warp.quads[0] = quad_of_splat(0, 8, 0b0111);                   // draw 0
  warp.quads[1] = quad_of_splat(2 * splats_of_draw, 8, 0b1110);  // draw 2
  warp.count = 2;
  ShadedWarp out;
  sm.shade(warp, out);
  ASSERT_EQ(out.count, 1);
  EXPECT_EQ(out.draw[0], 0);
  EXPECT_EQ(out.live[0], all_lanes);
  EXPECT_EQ(sm.quads_merged.of_draw(), (ByDraw{0, 0, 1}));
  EXPECT_EQ(sm.fragments_merged.of_draw(), (ByDraw{0, 0, 2}));
  EXPECT_EQ(sm.quads_shaded.of_draw(), (ByDraw{1, 0, 1}));
  EXPECT_EQ(sm.fragments_shaded.of_draw(), (ByDraw{3, 0, 3}));
}

TEST(SplatShaderOfAFrame, WarpsOfSeveralDrawsAreCountedQuadByQuad) {
  const RenderContext context = three_draws();
  CountingShader sm(context);
  CountingShader alone(context);  // a quad at a time: which of its lanes live
  ByDraw shaded(marked_draws), fragments(marked_draws), pruned(marked_draws), fragments_pruned(marked_draws),
      merged(marked_draws), fragments_merged(marked_draws);
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    Warp warp;
    warp.count = static_cast<std::uint8_t>(1 + mix(seed) % 8);
    LaneMask live[quads_per_warp] = {};
    for (unsigned i = 0; i < warp.count; ++i) {
      const std::uint64_t random = mix(seed * 8 + i);
      const auto splat = static_cast<std::uint32_t>(random % (marked_draws * splats_of_draw));
      // About the splat, or of the position of the quad before, to be merged.
      const bool pairs = i % 2 == 1 && random / 64 % 2 == 0;
      const auto position = static_cast<unsigned>(splat % splats_of_draw + 8 * (random / 128 % 3));
      warp.quads[i] = quad_of_splat(splat, pairs ? warp.quads[i - 1].position : position,
                                    static_cast<LaneMask>(1 + random / 1024 % 15));
      if (pairs) warp.merge_pairs |= static_cast<std::uint8_t>(1U << (i / 2));
      Warp single;
      single.count = 1;
      single.quads[0] = warp.quads[i];
      ShadedWarp out;
      alone.shade(single, out);
      live[i] = out.count == 0 ? LaneMask{0} : out.live[0];
    }
    ShadedWarp out;
    sm.shade(warp, out);
    for (unsigned i = 0; i < warp.count; ++i) {
      const Quad& quad = warp.quads[i];
      ++shaded[quad.draw];
      fragments[quad.draw] += popcount(quad.coverage);
      pruned[quad.draw] += live[i] == 0;
      fragments_pruned[quad.draw] += popcount(static_cast<LaneMask>(quad.coverage & ~live[i]));
      const bool merges = i % 2 == 1 && (warp.merge_pairs >> (i / 2) & 1U) != 0 && live[i] != 0 && live[i - 1] != 0;
      merged[quad.draw] += merges;
      if (merges) fragments_merged[quad.draw] += popcount(static_cast<LaneMask>(live[i] & live[i - 1]));
    }
  }
  EXPECT_EQ(sm.quads_shaded.of_draw(), shaded);
  EXPECT_EQ(sm.fragments_shaded.of_draw(), fragments);
  EXPECT_EQ(sm.quads_pruned.of_draw(), pruned);
  EXPECT_EQ(sm.fragments_pruned.of_draw(), fragments_pruned);
  EXPECT_EQ(sm.quads_merged.of_draw(), merged);
  EXPECT_EQ(sm.fragments_merged.of_draw(), fragments_merged);
  for (DrawIndex draw = 0; draw < marked_draws; ++draw) {
    EXPECT_GT(pruned[draw], 0U) << "the test is of something";
    EXPECT_GT(merged[draw], 0U);
  }
}

class SmMarksTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  SmMarksTest() : context(three_draws()) {}
  static Warp warp(std::uint32_t sequence) {
    Warp warp;
    warp.sequence = warp.tile_sequence = sequence;
    warp.count = 8;
    for (unsigned i = 0; i < 8; ++i) warp.quads[i] = quad_of_splat(sequence % splats_of_draw, i, all_lanes);
    return warp;
  }
  static Warp mark(std::uint32_t sequence, Mark which) {
    Warp warp;
    warp.sequence = sequence;
    warp.mark = which;
    return warp;
  }
  RenderContext context;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, SmMarksTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

/// The numbers of warps and, from 1000 on, of marks as they come to PROP, which releases slots a little later.
struct MarkedSmBench {
  MarkedSmBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {},
                unsigned depth = 64)
      : bench(fidelity, "sm", "splat-shader", context, settings),
        warps(bench.source<Warp>("in_warps", depth)),
        release(bench.source<WarpRelease>("in_release", 4096)),
        shaded(bench.sink<ShadedWarpItem>("out_shaded", depth)) {
    shaded.on_take([this](const ShadedWarpItem& item, Cycle now) {
      const Mark mark = item.warp->mark;
      left.push_back(mark == Mark::none ? item.warp->sequence : 1000 + static_cast<std::uint32_t>(mark));
      if (mark != Mark::none) {
        EXPECT_EQ(item.warp->slot, no_slot);
        EXPECT_EQ(item.warp->count, 0);
      }
      item.warp->release();
      release.add({item.warp->slot}, now + 3);
    });
  }
  Bench bench;
  Source<Warp>& warps;
  Source<WarpRelease>& release;
  Sink<ShadedWarpItem>& shaded;
  std::vector<std::uint32_t> left;
};

TEST_P(SmMarksTest, NoWarpLaunchedAfterAMarkIsHandedOnBeforeIt) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    // With room to spare, and with so few slots that warps wait for one.
    Bench::Settings settings;
    if (seed % 2 == 1) settings = {{"cores", "1"}, {"warps_per_core", "3"}};
    MarkedSmBench sm(GetParam(), context, settings, seed % 4 < 2 ? 64 : 2);
    constexpr std::uint32_t count = 60;
    std::uint32_t marks = 0;
    std::vector<std::uint32_t> marks_before;
    for (std::uint32_t sequence = 0; sequence < count; ++sequence) {
      for (; mix(seed * 100 + sequence + 1000 * marks) % 5 == 0; ++marks)
        sm.warps.add(mark(sequence, Frame::mark_of(marks)));
      marks_before.push_back(marks);
      sm.warps.add(warp(sequence));
    }
    sm.warps.add(mark(count, Mark::end_of_frame));
    sm.bench.stall_randomly(seed, seed % 3 == 0 || GetParam() == Fidelity::lt ? 0 : 64);
    sm.bench.run();
    ASSERT_EQ(sm.left.size(), count + marks + 1) << seed;
    std::uint32_t seen = 0;
    for (const std::uint32_t number : sm.left) {
      if (number < 1000) {
        ASSERT_LE(marks_before[number], seen) << "warp " << number << ", seed " << seed;
      } else if (number != 1000 + 0xffff) {
        ASSERT_EQ(number, 1000 + static_cast<std::uint32_t>(Frame::mark_of(seen))) << seed;
        ++seen;
      }
    }
    EXPECT_EQ(seen, marks);
    EXPECT_EQ(std::count(sm.left.begin(), sm.left.end(), 1000U + 0xffff), 1) << seed;
    EXPECT_TRUE(sm.bench.unit().idle());
  }
}

TEST_P(SmMarksTest, AMarkTakesNoSlotAndWaitsForNoWarpBeforeIt) {
  if (GetParam() == Fidelity::lt) GTEST_SKIP() << "there it comes behind all before it";
  MarkedSmBench sm(GetParam(), context);
  sm.warps.add(warp(0), 10);
  sm.warps.add(mark(1, Frame::mark_of(0)), 11);
  sm.warps.add(warp(1), 12);
  sm.bench.run();
  EXPECT_EQ(sm.left, (std::vector<std::uint32_t>{1000 + 1, 0, 1}));
}

}  // namespace
}  // namespace vrpipe
