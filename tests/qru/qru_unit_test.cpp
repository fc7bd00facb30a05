#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::beat_of;
using testing::end_beat;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

const std::vector<unsigned> eight{0, 1, 2, 3, 4, 5, 6, 7};

class QruUnitTest : public ::testing::Test {
 protected:
  QruUnitTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

TEST_F(QruUnitTest, AWarpIsSeenTheLatencyAfterItsLastQuad) {
  Bench bench("qru", "pairing", context, {{"latency_cycles", "6"}});
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
  Sink<Warp>& out = bench.sink<Warp>("out_warps");
  in.add(beat_of({0, 0}, {1, 1, 2, 2, 3, 3, 4, 4}), 10);
  bench.run();
  ASSERT_EQ(out.records().size(), 1U);
  EXPECT_EQ(out.records()[0].cycle, 11U + 6);
}

TEST_F(QruUnitTest, ExaminesItsQuadsPerCycle) {
  for (const unsigned rate : {1U, 2U, 4U, 8U}) {
    Bench bench("qru", "pairing", context, {{"quads_per_cycle", std::to_string(rate)}});
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 64);
    Sink<Warp>& out = bench.sink<Warp>("out_warps", 64);
    // Pairs as they come: a warp every 8 quads.
    for (unsigned i = 0; i < 16; ++i) in.add(beat_of({0, 0}, {1, 1, 2, 2, 3, 3, 4, 4}, 8 * i, i == 15));
    bench.run();
    ASSERT_EQ(out.records().size(), 16U);
    EXPECT_EQ(out.records().back().cycle - out.records().front().cycle, 15 * 8 / rate);
  }
}

TEST_F(QruUnitTest, LaunchesOneWarpACycleAndTheLeftOversOfABinBeforeTheNext) {
  Bench bench("qru", "pairing", context, {{"latency_cycles", "1"}});
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 64);
  Sink<Warp>& out = bench.sink<Warp>("out_warps", 64);
  for (unsigned i = 0; i < 4; ++i) {
    std::vector<unsigned> positions = eight;
    for (unsigned& position : positions) position += 8 * i;
    in.add(beat_of({0, 0}, positions, 8 * i, i == 3));
  }
  in.add(beat_of({1, 0}, eight, 100, true));
  bench.run();
  ASSERT_EQ(out.records().size(), 5U);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(out.records()[i].cycle, out.records()[i - 1].cycle + 1);
  EXPECT_EQ(out.records()[4].item.tile, (TileId{1, 0}));
}

TEST_F(QruUnitTest, TheEndCarriesTheNumberOfWarps) {
  for (const char* implementation : {"pairing", "pass-through"}) {
    Bench bench("qru", implementation, context);
    Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
    Sink<Warp>& out = bench.sink<Warp>("out_warps");
    for (unsigned i = 0; i < 7; ++i) in.add(beat_of({0, 0}, eight, 8 * i, true));
    in.add(end_beat());
    bench.run();
    ASSERT_EQ(out.records().size(), 8U);
    EXPECT_TRUE(out.records()[7].item.mark == Mark::end_of_frame);
    EXPECT_EQ(out.records()[7].item.sequence, 7U);
    EXPECT_TRUE(bench.unit().idle());
  }
}

// case M13
TEST_F(QruUnitTest, ABinThatDiedInTheTestsLaunchesNothing) {
  Bench bench("qru", "pairing", context);
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads");
  Sink<Warp>& out = bench.sink<Warp>("out_warps");
  in.add(beat_of({0, 0}, {}, 0, true));
  in.add(end_beat());
  bench.run();
  ASSERT_EQ(out.records().size(), 1U);
  EXPECT_EQ(out.records()[0].item.sequence, 0U);
}

TEST_F(QruUnitTest, ABlockedReceiverStopsItUntilACycleAfterItTakes) {
  Bench bench("qru", "pairing", context, {{"latency_cycles", "1"}});
  Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 16);
  Sink<Warp>& out = bench.sink<Warp>("out_warps", 1);
  for (unsigned i = 0; i < 3; ++i) in.add(beat_of({0, 0}, {1, 1, 2, 2, 3, 3, 4, 4}, 8 * i, i == 2));
  out.close(0, 40);
  bench.run();
  EXPECT_EQ(out.records()[0].cycle, 40U);
  EXPECT_EQ(out.records()[1].cycle, 42U);
}

TEST_F(QruUnitTest, WarpsAreTheSameUnderAnyStalls) {
  for (const char* implementation : {"pairing", "pass-through"}) {
    std::vector<std::uint32_t> expected;
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      Bench bench("qru", implementation, context);
      Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", static_cast<unsigned>(1 + seed % 4));
      Sink<Warp>& out = bench.sink<Warp>("out_warps", static_cast<unsigned>(1 + seed % 3));
      std::uint32_t next = 0;
      for (std::uint64_t i = 0; i < 100; ++i) {
        std::vector<unsigned> positions;
        for (std::uint64_t q = 0; q < mix(i) % 17; ++q)
          positions.push_back(static_cast<unsigned>(mix(200 * i + q) % 30));
        in.add(beat_of({static_cast<std::uint16_t>(i / 20), 0}, positions, next, i % 5 == 4));
        next += static_cast<std::uint32_t>(positions.size());
      }
      in.add(end_beat());
      if (seed > 0) bench.stall_randomly(seed, 100);
      if (seed > 0) bench.shuffle_ticks(seed);
      bench.run();
      std::vector<std::uint32_t> got;
      for (const auto& record : out.records()) {
        const Warp& warp = record.item;
        got.insert(got.end(),
                   {warp.sequence, warp.tile_sequence, warp.merge_pairs, warp.tile.x, warp.mark == Mark::end_of_frame});
        for (unsigned i = 0; i < warp.count; ++i) got.push_back(warp.quads[i].splat);
      }
      if (seed == 0) expected = got;
      ASSERT_EQ(got, expected) << seed;
    }
  }
}

}  // namespace
}  // namespace vrpipe
