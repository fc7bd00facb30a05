// Handing fragment warps to cores, at the price measured on a real GPU.
#include <gtest/gtest.h>

#include "sm/hand_over.h"
#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class HandOverTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  HandOverTest()
      : draw(testing::draw_of(64, 64, std::vector<Splat>(64, testing::flat_box(0, 0, 64, 64, 0.5F)))),
        context(testing::context_of(draw)) {}
  /// A warp of quads of these splats.
  static Warp warp_of(const std::vector<std::uint32_t>& splats, TileId tile = {0, 0}) {
    Warp warp;
    warp.tile = tile;
    for (const std::uint32_t splat : splats) {
      warp.quads[warp.count] = {splat, warp.count, all_lanes, 0, 0};
      ++warp.count;
    }
    return warp;
  }
  /// Cycles of a warp, of those that `make` gives, where nothing else takes longer.
  double cycles_of_a_warp(const std::vector<Warp>& in_turn, const Bench::Settings& settings) {
    const auto cycles = [&](unsigned count) {
      Bench bench(GetParam(), "sm", "splat-shader", context, settings);
      Source<Warp>& warps = bench.source<Warp>("in_warps", 64);
      Source<WarpRelease>& release = bench.source<WarpRelease>("in_release", 4096);
      Sink<ShadedWarpItem>& shaded = bench.sink<ShadedWarpItem>("out_shaded", 64);
      Cycle last = 0;
      shaded.on_take([&](const ShadedWarpItem& item, Cycle now) {
        if (item.warp->mark == Mark::none) last = now;
        item.warp->release();
        release.add({item.warp->slot}, now + 1);
      });
      for (unsigned i = 0; i < count; ++i) {
        Warp warp = in_turn[i % in_turn.size()];
        warp.sequence = warp.tile_sequence = i;
        warps.add(warp);
      }
      Warp end;
      end.mark = Mark::end_of_frame;
      end.sequence = count;
      warps.add(end);
      bench.run();
      return static_cast<double>(last);
    };
    return (cycles(800) - cycles(400)) / 400;
  }
  Draw draw;
  RenderContext context;
};

INSTANTIATE_TEST_SUITE_P(Fidelities, HandOverTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

// Splats discard: a visit takes both.
const Bench::Settings measured{{"warp_launch_cycles", "2.5"},
                               {"visit_launch_cycles", "4"},
                               {"discard_launch_cycles", "1.7"},
                               {"discard_warp_cycles", "1.03"}};

TEST_P(HandOverTest, WarpsOfOnePrimitiveTakeTheirQuads) {
  // The same primitive on and on: its visit is paid once.
  EXPECT_NEAR(cycles_of_a_warp({warp_of({1, 1, 1, 1, 1, 1, 1, 1})}, measured), 3.53, 0.02);
  EXPECT_NEAR(cycles_of_a_warp({warp_of({1, 1, 1, 1, 1, 1, 1, 1})}, {}), 1, 0.02);
}

TEST_P(HandOverTest, EachPrimitiveInATileTakesItsVisitAtLeast) {
  EXPECT_NEAR(cycles_of_a_warp({warp_of({1, 1, 1}), warp_of({2, 2})}, measured), 5.7, 0.02);
  EXPECT_NEAR(cycles_of_a_warp({warp_of({1, 1, 2, 2, 3, 3, 4, 4}), warp_of({5, 5})}, measured), 5 * 5.7 / 2, 0.02);
}

TEST_P(HandOverTest, PairsOfTwoPrimitivesAreAVisitOfEach) {
  const auto pairs_of = [](std::uint32_t front, std::uint32_t back) {
    Warp warp = warp_of({front, back, front, back, front, back, front, back});
    for (unsigned i = 0; i < warp.count; ++i) warp.quads[i].position = static_cast<std::uint8_t>(i / 2);
    warp.merge_pairs = 0xf;
    return warp;
  };
  EXPECT_NEAR(cycles_of_a_warp({pairs_of(1, 2), pairs_of(3, 4)}, measured), 2 * 5.7, 0.02);
  EXPECT_NEAR(cycles_of_a_warp({pairs_of(1, 2), pairs_of(2, 3)}, measured), 3 * 5.7 / 2, 0.02)
      << "2 goes on from one warp to the next";
}

TEST_P(HandOverTest, WarpsGoOnBesideVisits) {
  // Two visits of 5.7 cycles in six warps of 3.53: the warps are longer, the visits hide beside them.
  const Warp full = warp_of({1, 1, 1, 1, 1, 1, 1, 1});
  const Warp other = warp_of({2, 2, 2, 2, 2, 2, 2, 2});
  EXPECT_NEAR(cycles_of_a_warp({full, full, full, other, other, other}, measured), 3.53, 0.02);
  // One warp of eight visits for nine of none: 8 + 1 visits.
  const Warp many = warp_of({3, 4, 5, 6, 7, 8, 9, 10});
  std::vector<Warp> warps(9, full);
  warps.push_back(many);
  EXPECT_NEAR(cycles_of_a_warp(warps, measured), 9 * 5.7 / 10, 0.02);
}

TEST_P(HandOverTest, ADrawThatDiscardsNothingPaysNoMoreThanItsVisits) {
  testing::change_state(context, [](DrawState& state) { state.pruning_threshold = 0; });
  EXPECT_NEAR(cycles_of_a_warp({warp_of({1, 1, 1}), warp_of({2, 2})}, measured), 4, 0.02);
  EXPECT_NEAR(cycles_of_a_warp({warp_of({1, 1, 1, 1, 1, 1, 1, 1})}, measured), 2.5, 0.02);
}

// As it was measured: full-screen draws of a shader that reads alpha and discards.
TEST_P(HandOverTest, AProgramWithoutAttributesPaysNothingForWhatItDiscards) {
  testing::change_state(context, [](DrawState& state) {
    state = DrawState();
    state.shader = FragmentShader::alpha_threshold;
  });
  EXPECT_NEAR(cycles_of_a_warp({warp_of({1, 1, 1, 1, 1, 1, 1, 1})}, measured), 2.5, 0.02);
}

}  // namespace
}  // namespace vrpipe
