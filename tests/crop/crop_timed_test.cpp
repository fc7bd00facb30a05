// CROP at lt, where a warp goes in one piece; what has one closed form at every fidelity is compared with cycle by
// it.
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/crop.h>

#include "crop/timed_crop_bench.h"

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

using testing::TimedCropBench;

class CropTimedTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  CropTimedTest() : draw(testing::draw_of(1024, 32)), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

INSTANTIATE_TEST_SUITE_P(Fidelities, CropTimedTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(CropTimedTest, ResidentQuadsBlendAtTheRateOfTheFormat) {
  const std::pair<ColorFormat, unsigned> formats[] = {{ColorFormat::rgba8, 4},
                                                      {ColorFormat::rgba16f, 2},
                                                      {ColorFormat::rgba32f, 1}};
  for (const auto& [format, rate] : formats) {
    context.format = format;
    TimedCropBench crop(GetParam(), context, {{"latency_cycles", "8"}});
    for (unsigned i = 0; i < 8; ++i) crop.quad({0, 0}, i % 2 + 8 * (i / 2 % 2));
    for (unsigned i = 0; i < 400; ++i) crop.quad({0, 0}, i % 2 + 8 * (i / 2 % 2), 0.01F, 0b0110, 1000);
    // In hand and in the queue from 1001 on, blended from 1002 on; 8 cycles of latency behind the last.
    EXPECT_EQ(crop.run(), 1001 + 400 / rate + 8) << name_of(format);
    EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::blend), 408.0 / rate);
    EXPECT_EQ(testing::charged(crop.bench.unit(), UnitState::busy, crop.bench.unit().end_of_frame()), 408 / rate);
  }
}

TEST_P(CropTimedTest, AMissWaitsForTheMemoryAndAHitDoesNot) {
  TimedCropBench crop(GetParam(), context, {{"latency_cycles", "8"}, {"sectors_per_cycle", "8"}}, 100);
  crop.quad({0, 0}, 0);
  crop.flush();
  // In hand at 1, its sector asked for at 1, there at 101, blended then.
  EXPECT_EQ(crop.run(), 101U + 8);
  EXPECT_EQ(crop.memory.bytes(), 32U);
  EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::sectors), 1.0 / 8) << "one of eight in a cycle";
  EXPECT_EQ(testing::charged(crop.bench.unit(), UnitState::memory, 109), 99U) << "cycles 2 to 100";
}

TEST_P(CropTimedTest, FillsOfAWarpAndOfThoseBehindItOverlap) {
  TimedCropBench crop(GetParam(), context, {{"latency_cycles", "8"}, {"sectors_per_cycle", "8"}}, 100);
  for (unsigned i = 0; i < 64; ++i) crop.quad({0, 0}, i);
  // One latency, 32 cycles of blending and 8 of moving sectors. A warp is blended once the sectors of all its quads are
  // there, which it asks for in its last cycle.
  const Cycle least = 101 + 32 - 1 + 8;
  const Cycle end = crop.run();
  EXPECT_GE(end, least);
  EXPECT_LE(end, least + 8 + (GetParam() == Fidelity::cycle ? 0 : 3));
  EXPECT_EQ(crop.memory.bytes(), 64U * 32);
}

TEST_P(CropTimedTest, QuadsInTheSameSectorAskForItOnce) {
  TimedCropBench crop(GetParam(), context);
  for (unsigned i = 0; i < 20; ++i) crop.quad({0, 0}, 5);
  crop.run();
  EXPECT_EQ(crop.memory.bytes(), 32U);
}

TEST_P(CropTimedTest, MovingSectorsTakesCyclesFromBlending) {
  TimedCropBench crop(GetParam(), context, {{"sectors_per_cycle", "8"}, {"cache_bytes", "1048576"}}, 20);
  for (std::uint16_t tile = 0; tile < 64; ++tile) {
    for (unsigned i = 0; i < 64; ++i) crop.quad({tile, 0}, i);
  }
  const auto cycles = static_cast<double>(crop.run());
  EXPECT_NEAR(cycles, 4096 / 2.0 + 4096 / 8.0, 40) << "each quad has a sector of its own";
  EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::blend), 2048);
  EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::sectors), 512);
}

TEST_P(CropTimedTest, NoMoreFillsAreInFlightThanItHasMissRegisters) {
  for (const unsigned mshrs : {1U, 2U, 4U, 8U}) {
    TimedCropBench crop(GetParam(), context, {{"mshrs", std::to_string(mshrs)}, {"latency_cycles", "8"}}, 100);
    for (unsigned i = 0; i < 8; ++i) crop.quad({0, 0}, i);
    // A round of the memory for each so many sectors, each from the cycle in which the one before is complete; the first
    // begins in cycles 1 to 4 as the quads come, two a cycle.
    const Cycle end = crop.run();
    EXPECT_GE(end, 1 + 8 / mshrs * 100 + 8) << mshrs;
    EXPECT_LE(end, 4 + 8 / mshrs * 100 + 1 + 8) << mshrs;
  }
}

// case B10
/// Sectors missed when so many lines, one quad each, are drawn in turn, so many rounds.
std::uint64_t misses_of_rounds(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings,
                               unsigned lines, unsigned rounds, std::vector<unsigned> order = {}) {
  TimedCropBench crop(fidelity, context, settings);
  if (order.empty()) {
    for (unsigned line = 0; line < lines; ++line) order.push_back(line);
  }
  for (unsigned round = 0; round < rounds; ++round) {
    // A line of RGBA16F is 4x4 pixels, 16 lines a tile, in Morton order.
    for (const unsigned line : order) {
      const unsigned x = (line & 1U) | (line >> 1U & 2U);
      const unsigned y = (line >> 1U & 1U) | (line >> 2U & 2U);
      crop.quad({static_cast<std::uint16_t>(line / 16), 0}, 16 * y + 2 * x);
    }
  }
  EXPECT_NE(crop.run(), never);
  const SectoredCacheStatistics& counts = crop.bench.behaviour<CropBehaviour>().cache_statistics;
  EXPECT_EQ(counts.sector_accesses.value(), rounds * order.size());
  EXPECT_EQ(counts.fill_cycles.count(), counts.sector_misses.value());
  EXPECT_EQ(counts.sector_misses.value(), counts.sector_misses_compulsory.value() +
                                              counts.sector_misses_capacity.value() +
                                              counts.sector_misses_conflict.value());
  EXPECT_EQ(counts.sector_misses_compulsory.value(), lines);
  return counts.sector_misses.value();
}

// Published: the table's 16 KB; and a real GPU's colour cache has its knee there whatever the shape.
TEST_P(CropTimedTest, TheKneeOfTheDefaultCacheIsAt16Kilobytes) {
  constexpr unsigned rounds = 4;
  for (const unsigned kilobytes : {4U, 8U, 12U, 15U, 16U, 17U, 20U, 32U}) {
    const unsigned lines = kilobytes * 1024 / 128;
    EXPECT_EQ(misses_of_rounds(GetParam(), context, {}, lines, rounds), kilobytes <= 16 ? lines : rounds * lines)
        << kilobytes << " KB";
  }
}

TEST_P(CropTimedTest, LinesOfOneSetMissInACacheOfFewWays) {
  const std::vector<unsigned> of_one_set = {0, 16, 32, 48, 64};  // of 16 sets of 4 ways
  const auto misses = [&](const Bench::Settings& more) {
    Bench::Settings settings = {{"cache_bytes", "8192"}, {"tell_conflicts", "on"}};
    settings.insert(settings.end(), more.begin(), more.end());
    return misses_of_rounds(GetParam(), context, settings, 5, 10, of_one_set);
  };
  EXPECT_EQ(misses({}), 5U);
  EXPECT_EQ(misses({{"ways", "8"}}), 5U);
  EXPECT_EQ(misses({{"ways", "4"}}), 50U);
  EXPECT_EQ(misses({{"ways", "4"}, {"hash_sets", "on"}}), 5U);
}

TEST_P(CropTimedTest, AFillIsSeenToTakeAsLongAsTheMemory) {
  TimedCropBench crop(GetParam(), context, {}, 77);
  for (unsigned i = 0; i < 10; ++i) crop.quad({static_cast<std::uint16_t>(i), 0}, 0);
  crop.run();
  const Histogram& fills = crop.bench.behaviour<CropBehaviour>().cache_statistics.fill_cycles;
  EXPECT_EQ(fills.count(), 10U);
  EXPECT_EQ(fills.smallest(), 77U);
  EXPECT_EQ(fills.largest(), 77U);
  // All ten are on their way together; each finds those before it.
  const Histogram& filling = crop.bench.behaviour<CropBehaviour>().cache_statistics.sectors_filling;
  EXPECT_EQ(filling.count(), 10U);
  EXPECT_EQ(filling.largest(), 9U);
  EXPECT_EQ(filling.sum(), 45U);
}

TEST_P(CropTimedTest, WithoutForwardingAQuadWaitsForTheOneBeforeAtItsPosition) {
  for (const bool forwarding : {true, false}) {
    TimedCropBench crop(GetParam(), context, {{"forwarding", forwarding ? "on" : "off"}, {"latency_cycles", "8"}});
    crop.quad({0, 0}, 0);
    crop.flush();
    for (unsigned i = 0; i < 96; ++i) crop.quad({0, 0}, 0, 0.01F, all_lanes, 1000);
    EXPECT_EQ(crop.run(), forwarding ? 1001U + 48 + 8 : 1002U + 95 * 8 + 8);
    // Of the 8 cycles from a quad to the next, 7 and the half that the quad leaves.
    const double wasted = testing::occupied(crop.bench.unit(), CropWork::forwarding);
    EXPECT_DOUBLE_EQ(wasted, forwarding ? 0 : 95 * 7.5);
  }
}

// case B10
TEST_P(CropTimedTest, WithoutForwardingOtherPositionsDoNotWait) {
  TimedCropBench crop(GetParam(), context, {{"forwarding", "off"}, {"latency_cycles", "8"}});
  for (unsigned i = 0; i < 64; ++i) crop.quad({0, 0}, i);
  for (unsigned i = 0; i < 256; ++i) crop.quad({0, 0}, i % 64, 0.01F, all_lanes, 1000);
  EXPECT_EQ(crop.run(), 1001U + 128 + 8);
}

TEST_P(CropTimedTest, ATerminationIsSeenTheLatencyAfterItsBlend) {
  testing::terminate_early(context);
  for (const unsigned latency : {1U, 8U}) {
    TimedCropBench crop(GetParam(), context, {{"latency_cycles", std::to_string(latency)}});
    crop.quad({2, 1}, 9, 0.5F);
    crop.flush();
    crop.quad({2, 1}, 9, 0.999F, 0b0101, 1000);
    crop.flush(1000);
    crop.run();
    ASSERT_EQ(crop.signals.records().size(), 1U);
    EXPECT_EQ(crop.signals.records()[0].cycle, 1002U + latency);
    const TerminationBeat& beat = crop.signals.records()[0].item;
    ASSERT_EQ(beat.count, 1);
    EXPECT_EQ(beat.signals[0].tile, (TileId{2, 1}));
    EXPECT_EQ(beat.signals[0].position, 9);
    EXPECT_EQ(beat.signals[0].pixels, 0b0101);
  }
}

TEST_P(CropTimedTest, TheSignalsOfAWarpComeNoLaterThanTheLatencyAfterItsLastBlend) {
  testing::terminate_early(context);
  TimedCropBench crop(GetParam(), context, {{"latency_cycles", "8"}});
  for (unsigned i = 0; i < 8; ++i) crop.quad({0, 0}, i, 0.5F);
  for (unsigned i = 0; i < 8; ++i) crop.quad({0, 0}, i, 0.999F, all_lanes, 1000);
  crop.run();
  // Blended in cycles 1002 to 1005, two a cycle; at lt the signals of four quads go together.
  std::vector<unsigned> positions;
  for (const auto& record : crop.signals.records()) {
    EXPECT_GE(record.cycle, 1002U + 8);
    EXPECT_LE(record.cycle, 1005U + 8);
    for (unsigned i = 0; i < record.item.count; ++i) positions.push_back(record.item.signals[i].position);
  }
  EXPECT_EQ(crop.signals.records().back().cycle, 1005U + 8);
  EXPECT_EQ(positions, testing::numbers(8));
}

TEST_P(CropTimedTest, SignalsThatNobodyTakesStopTheBlending) {
  testing::terminate_early(context);
  TimedCropBench crop(GetParam(), context, {{"latency_cycles", "1"}}, 2, 8, 1);
  crop.signals.close(0, 500);
  for (unsigned i = 0; i < 8; ++i) {
    crop.quad({0, 0}, i, 0.999F);
    crop.flush();
  }
  crop.run();
  std::size_t received = 0;
  for (const auto& record : crop.signals.records()) received += record.item.count;
  EXPECT_EQ(received, 8U);
  EXPECT_GT(testing::charged(crop.bench.unit(), UnitState::blocked, crop.bench.unit().end_of_frame()), 400U);
}

// case T05
TEST_P(CropTimedTest, AnEmptyDrawEndsWithItsMark) {
  TimedCropBench crop(GetParam(), context);
  EXPECT_EQ(crop.run(), 1U);
}

TEST_P(CropTimedTest, DirtySectorsAreWrittenBackWhenTheirLineGoesAndCleanOnesAreNot) {
  for (const bool changes : {true, false}) {
    TimedCropBench crop(GetParam(), context, {{"cache_bytes", "1024"}}, 10);  // 8 lines, 32 quads
    for (std::uint16_t tile = 0; tile < 4; ++tile) {
      for (unsigned i = 0; i < 64; ++i) crop.quad({tile, 0}, i, changes ? 0.5F : 0.0F);
    }
    crop.run();
    const std::uint64_t written = changes ? (256U - 32) * 32 : 0;  // the last 8 lines stay
    EXPECT_EQ(crop.memory.bytes(), 256U * 32 + written);
  }
}

TEST_P(CropTimedTest, ALineIsNotReplacedBeforeItsQuadsAreBlended) {
  // One line, memory of 100 cycles: every second warp needs another, and a fill can only begin once the quads before are
  // blended.
  TimedCropBench crop(GetParam(), context, {{"cache_bytes", "128"}, {"latency_cycles", "8"}}, 100);
  for (std::uint16_t i = 0; i < 6; ++i) {
    crop.quad({static_cast<std::uint16_t>(i % 2), 0}, 0);
    crop.flush();
  }
  // Asked for at 1, blended at 101, the next asked for in that cycle or the next.
  const Cycle end = crop.run();
  EXPECT_GE(end, 1 + 6 * 100 + 8U);
  EXPECT_LE(end, 1 + 6 * 102 + 8U);
}

TEST_P(CropTimedTest, ImageAndSignalsAreThoseOfCycleUnderAnyStallsAndMemory) {
  testing::terminate_early(context);
  context.termination = Termination::strict;
  std::vector<float> expected;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    // What is to come out is what cycle makes of it undisturbed.
    TimedCropBench crop(seed == 0 ? Fidelity::cycle : GetParam(), context,
                        {{"cache_bytes", seed % 2 == 0 ? "1024" : "16384"},
                         {"mshrs", seed % 3 == 0 ? "2" : "16"},
                         {"input_quads", seed % 5 == 0 ? "1" : "64"}},
                        static_cast<unsigned>(2 + seed * 7 % 300), static_cast<unsigned>(1 + seed % 10),
                        static_cast<unsigned>(1 + seed % 9));
    for (std::uint64_t i = 0; i < 600; ++i) {
      crop.quad({static_cast<std::uint16_t>(mix(i / 5) % 3), 0}, static_cast<unsigned>(mix(i + 999) % 64),
                testing::uniform(4, i, 0.2F, 0.95F), static_cast<LaneMask>(1 + mix(i + 5) % 15));
    }
    if (seed > 0) crop.bench.stall_randomly(seed, 90);
    ASSERT_NE(crop.run(), never) << seed;
    std::vector<float> got;
    unsigned pixels = 0;
    for (const auto& record : crop.signals.records()) {
      for (unsigned i = 0; i < record.item.count; ++i) pixels += popcount(record.item.signals[i].pixels);
    }
    unsigned terminated = 0;
    for (std::uint32_t y = 0; y < 16; ++y) {
      for (std::uint32_t x = 0; x < 48; ++x) {
        const auto pixel = crop.bench.surface().pixel(x, y);
        got.insert(got.end(), pixel.begin(), pixel.end());
        terminated += pixel[3] >= 0.996F;
      }
    }
    ASSERT_EQ(pixels, terminated) << seed;
    if (seed == 0) expected = got;
    ASSERT_EQ(got, expected) << seed;
    ASSERT_TRUE(crop.bench.unit().idle()) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
