// What CROP was measured to take on a real GPU beyond its rate: the port to L2, lines that come back, quads without a
// neighbour in their sector, columns of RGBA32F. The same closed forms at every fidelity with time.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/crop.h>

#include "crop/timed_crop_bench.h"

namespace vrpipe {
namespace {

using testing::TimedCropBench;
using testkit::Bench;

/// One quad of RGBA16F a cycle, lines of 256 bytes, a flit a cycle, 8 KB, as on a GH100's ROP partition.
Bench::Settings partition(const Bench::Settings& more = {}) {
  Bench::Settings settings{{"bytes_per_cycle", "32"},
                           {"cache_bytes", "8192"},
                           {"line_bytes", "256"},
                           {"port_flits_per_cycle", "1"},
                           {"mshrs", "2048"}};
  settings.insert(settings.end(), more.begin(), more.end());
  return settings;
}

class CropPrices : public ::testing::TestWithParam<Fidelity> {
 protected:
  CropPrices() : draw(testing::draw_of(2048, 32)), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

INSTANTIATE_TEST_SUITE_P(Fidelities, CropPrices, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

/// Position of the n-th quad of a screen tile in the order of memory: eight in a row are a line of 256 bytes.
unsigned in_memory_order(unsigned n) {
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    if (morton_order[position] == n) return position;
  }
  return 0;
}

/// Cycles of so many whole tiles more, each of its own place.
double cycles_of_a_tile(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings, float alpha) {
  const auto cycles = [&](std::uint16_t tiles) {
    TimedCropBench crop(fidelity, context, settings);
    crop.quads_of_a_primitive = positions_per_tile;
    for (std::uint16_t tile = 0; tile < tiles; ++tile) {
      for (unsigned n = 0; n < positions_per_tile; ++n)
        crop.quad({static_cast<std::uint16_t>(tile % 128), static_cast<std::uint16_t>(tile / 128)}, in_memory_order(n),
                  alpha);
    }
    return static_cast<double>(crop.run());
  };
  return (cycles(120) - cycles(60)) / 60;
}

TEST_P(CropPrices, AWholeTileTakesAFlitToReadALineAndNineToWriteIt) {
  // Measured on the GPU: 80.1 cycles.
  for (const char* ahead : {"512", "0"})
    EXPECT_NEAR(cycles_of_a_tile(GetParam(), context, partition({{"fetch_ahead_quads", ahead}}), 0.5F), 8 * (1 + 1 + 8),
                0.5)
        << ahead;
}

TEST_P(CropPrices, LinesOfUnchangedValuesAreFree) {
  for (const char* ahead : {"512", "0"})
    EXPECT_NEAR(cycles_of_a_tile(GetParam(), context, partition({{"fetch_ahead_quads", ahead}}), 0.0F), 64, 0.5)
        << ahead;
}

TEST_P(CropPrices, ALineOfWhichOneSectorMovesTakesThreeFlits) {
  const auto cycles = [&](std::uint16_t tiles) {
    TimedCropBench crop(GetParam(), context, partition({{"fetch_ahead_quads", "512"}}));
    for (std::uint16_t tile = 0; tile < tiles; ++tile) {
      // In the first quad of each of the tile's eight lines.
      for (unsigned n = 0; n < positions_per_tile; n += 8) crop.quad({tile, 0}, in_memory_order(n), 0.5F);
    }
    return static_cast<double>(crop.run());
  };
  EXPECT_NEAR((cycles(120) - cycles(60)) / 60, 8 * (1 + 1 + 1), 0.5);
}

constexpr unsigned trip = 400;  ///< of a fill, cycles

/// Cycles between the visits to `tiles` tiles, in turn, of a primitive for each of the positions, a quad of it. `by_round`: these, in
/// turn.
double cycles_of_a_round(Fidelity fidelity, const RenderContext& context, unsigned tiles,
                         const std::vector<std::vector<unsigned>>& by_round = {{0}}) {
  const auto cycles = [&](unsigned rounds) {
    TimedCropBench crop(fidelity, context, partition({{"fetch_ahead_quads", "512"}, {"port_backlog_flits", "512"}}),
                        trip);
    for (unsigned round = 0; round < rounds; ++round) {
      for (unsigned tile = 0; tile < tiles; ++tile) {
        for (const unsigned position : by_round[round % by_round.size()])
          crop.quad({static_cast<std::uint16_t>(tile), 0}, position, 0.001F);
        crop.flush();
      }
    }
    return static_cast<double>(crop.run());
  };
  return (cycles(24) - cycles(8)) / 16;
}

TEST_P(CropPrices, ALineThatLeftAndComesBackIsFetchedOnceItsLastUseIsOver) {
  // 32 lines are held. Of more, each leaves before its turn comes again.
  EXPECT_LT(cycles_of_a_round(GetParam(), context, 32), 64);
  for (const unsigned tiles : {33U, 48U, 96U})
    EXPECT_NEAR(cycles_of_a_round(GetParam(), context, tiles), trip, 12) << tiles;
  // What takes longer than the trip does not notice it: a flit to read or two, where it is read again, and two to write each.
  const double round = cycles_of_a_round(GetParam(), context, 256);
  EXPECT_GT(round, 3 * 256 - 8);
  EXPECT_LT(round, 4 * 256 + 8);
}

TEST_P(CropPrices, OfALineThatComesBackSectorsOfAHalfAreNotFetchedSideBySide) {
  const auto two_visits = [&](unsigned second) {
    return cycles_of_a_round(GetParam(), context, 40, {{0, in_memory_order(second)}}) / trip;
  };
  EXPECT_NEAR(two_visits(0), 1, 0.05) << "the same sector";
  EXPECT_GT(two_visits(1), 1.4) << "another of the same half";
  EXPECT_LT(two_visits(1), 2.1);
  EXPECT_NEAR(two_visits(4), 1, 0.05) << "one of the other half";
  EXPECT_NEAR(two_visits(8), 1, 0.05) << "one of another line";
}

TEST_P(CropPrices, ALineComesBackWhateverOfItIsStillToBeUsed) {
  for (const unsigned other : {1U, 4U, 7U}) {
    EXPECT_NEAR(cycles_of_a_round(GetParam(), context, 40, {{0}, {in_memory_order(other)}}), trip, 12) << other;
  }
  EXPECT_LT(cycles_of_a_round(GetParam(), context, 40, {{0}, {in_memory_order(8)}}), 0.7 * trip) << "another line";
}

TEST_P(CropPrices, QuadsOfAVisitAreFetchedSideBySide) {
  TimedCropBench crop(GetParam(), context, partition({{"fetch_ahead_quads", "512"}}), trip);
  crop.quads_of_a_primitive = 4;
  for (unsigned round = 0; round < 24; ++round) {
    for (std::uint16_t tile = 0; tile < 40; ++tile) {
      for (unsigned quad = 0; quad < 4; ++quad) crop.quad({tile, 0}, in_memory_order(quad), 0.001F);
      crop.flush();
    }
  }
  EXPECT_LT(static_cast<double>(crop.run()), 24 * 1.1 * trip);
}

TEST_P(CropPrices, AheadOfItsDataALineThatStopsIsFetchedTwiceAndNothingBehindItMeanwhile) {
  const auto sectors_read = [&](unsigned tiles) {
    TimedCropBench crop(GetParam(), context, partition({{"fetch_ahead_quads", "512"}}), 400);
    for (unsigned round = 0; round < 4; ++round) {
      for (unsigned tile = 0; tile < tiles; ++tile) {
        crop.quad({static_cast<std::uint16_t>(tile), 0}, 0, 0.5F);
        crop.flush();
      }
    }
    crop.run();
    return crop.bench.unit().memory_bytes().read / 32;
  };
  EXPECT_EQ(sectors_read(32), 32U);
  // Once for each visit; those at the front of each round but the first, which are looked at before the first one stops, again.
  EXPECT_GE(sectors_read(40), 4 * 40U + 3);
  EXPECT_LE(sectors_read(40), 4 * 40U + 3 * 4);
}

TEST_P(CropPrices, AheadOfItsDataMoreLinesAreUnderWayThanTheCacheHolds) {
  for (const bool ahead : {true, false}) {
    TimedCropBench crop(GetParam(), context, partition({{"fetch_ahead_quads", ahead ? "512" : "0"}}), 400);
    for (std::uint16_t tile = 0; tile < 120; ++tile) {
      crop.quad({tile, 0}, 0, 0.5F);
      crop.flush();
    }
    // 120 lines at once, or 32 at a time.
    const Cycle cycles = crop.run();
    if (ahead) {
      EXPECT_LT(cycles, 400U + 3 * 120 + 60);
    } else {
      EXPECT_GT(cycles, 3 * 400U);
    }
  }
}

TEST_P(CropPrices, WhatIsBlendedIsTheSameAheadOfItsDataAndNot) {
  const auto image = [&](const Bench::Settings& settings) {
    TimedCropBench crop(GetParam(), context, settings);
    for (std::uint64_t i = 0; i < 4000; ++i) {
      crop.quad({static_cast<std::uint16_t>(mix(i / 5) % 60), 0}, static_cast<unsigned>(mix(i + 999) % 64), 0.2F);
    }
    EXPECT_NE(crop.run(), never);
    std::vector<float> alphas;
    for (std::uint16_t tile = 0; tile < 60; ++tile) {
      for (unsigned position = 0; position < 64; ++position)
        alphas.push_back(crop.bench.surface().quad({tile, 0}, position).alpha[0]);
    }
    const SectoredCacheStatistics& cache = crop.bench.behaviour<CropBehaviour>().cache_statistics;
    EXPECT_EQ(cache.sector_hits.value() + cache.sector_misses.value(), 4000U);
    EXPECT_EQ(cache.bytes_written_back.value(), 32 * cache.sectors_written_back.value());
    return alphas;
  };
  EXPECT_EQ(image(partition({{"fetch_ahead_quads", "40"}, {"input_quads", "30"}, {"mshrs", "8"}})), image({}));
}

/// Cycles that so many quads more of RGBA8 take, of those in `positions` in turn.
double cycles_of_a_quad(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings,
                        const std::vector<unsigned>& positions, LaneMask live = all_lanes) {
  const auto cycles = [&](unsigned quads) {
    TimedCropBench crop(fidelity, context, settings);
    for (unsigned i = 0; i < quads; ++i) crop.quad({0, 0}, positions[i % positions.size()], 0.001F, live);
    return static_cast<double>(crop.run());
  };
  return (cycles(1600) - cycles(800)) / 800;
}

TEST_P(CropPrices, QuadsOfRgba8GoInPairsOnlyWithTheirNeighbourInTheSector) {
  context.format = ColorFormat::rgba8;
  const Bench::Settings pairs{{"bytes_per_cycle", "32"}, {"pairs_in_sector", "on"}};
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, pairs, {0, 1, 2, 3, 8, 9, 10, 11}), 0.5, 0.01);
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, pairs, {0, 2, 4, 6, 8, 10, 12, 14}), 1, 0.01) << "every second";
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, pairs, {0, 8, 1, 9, 2, 10, 3, 11}), 1, 0.01)
      << "one above the other";
  const Bench::Settings any{{"bytes_per_cycle", "32"}};
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, any, {0, 2, 4, 6, 8, 10, 12, 14}), 0.5, 0.01);
}

/// Quads that each have to wait for the one before them in their place.
Bench::Settings pairs_without_forwarding(const Bench::Settings& more = {}) {
  Bench::Settings settings{{"bytes_per_cycle", "32"},
                           {"pairs_in_sector", "on"},
                           {"forwarding", "off"},
                           {"latency_cycles", "9"}};
  settings.insert(settings.end(), more.begin(), more.end());
  return settings;
}

TEST_P(CropPrices, QuadsOfRgba8GoInPairsWithoutForwardingToo) {
  context.format = ColorFormat::rgba8;
  std::vector<unsigned> whole_tile;
  std::vector<unsigned> every_second;
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    whole_tile.push_back(position);
    if (position % 2 == 0) every_second.push_back(position);
  }
  const Bench::Settings settings = pairs_without_forwarding();
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, settings, whole_tile), 0.5, 0.01);
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, settings, every_second), 1, 0.01);
}

TEST_P(CropPrices, QuadsInPairsWaitForTheHazardsOfEach) {
  context.format = ColorFormat::rgba8;
  const Bench::Settings settings = pairs_without_forwarding();
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, settings, {0, 1}), 9.0 / 2, 0.01) << "together, in turn";
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, settings, {0}), 9, 0.01) << "never with itself";
  // The second in place 1 waits nine cycles for the first, and that in place 0 goes with it.
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, settings, {0, 1, 1}), 9.0 * 2 / 3, 0.01);
}

/// Rates of which two quads of RGBA8 take more than a cycle, and one of which three would fit into one.
constexpr unsigned rates_between_whole_quads[] = {17, 18, 24, 31, 33, 40};

TEST_P(CropPrices, QuadsInPairsTakeNoLessThanTheirBytes) {
  context.format = ColorFormat::rgba8;
  std::vector<unsigned> whole_tile;  // so that no quad waits for the one before it in its place
  std::vector<unsigned> every_second;
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    whole_tile.push_back(position);
    if (position % 2 == 0) every_second.push_back(position);
  }
  for (const unsigned bytes : rates_between_whole_quads) {
    for (const char* forwarding : {"on", "off"}) {
      SCOPED_TRACE(std::to_string(bytes) + " bytes a cycle, forwarding " + forwarding);
      const Bench::Settings settings{{"bytes_per_cycle", std::to_string(bytes)},
                                     {"pairs_in_sector", "on"},
                                     {"forwarding", forwarding}};
      EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, settings, whole_tile), std::max(0.5, 16.0 / bytes), 0.01);
      EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, settings, every_second), 1, 0.01);
    }
  }
}

TEST_P(CropPrices, PartsOfTheOccupancyAreItsTimeAtRatesBetweenWholeQuads) {
  context.format = ColorFormat::rgba8;
  for (const unsigned bytes : rates_between_whole_quads) {
    for (const char* forwarding : {"on", "off"}) {
      SCOPED_TRACE(std::to_string(bytes) + " bytes a cycle, forwarding " + forwarding);
      TimedCropBench crop(GetParam(), context,
                          {{"bytes_per_cycle", std::to_string(bytes)},
                           {"pairs_in_sector", "on"},
                           {"forwarding", forwarding}});
      for (unsigned round = 0; round < 10; ++round) {
        for (unsigned position = 0; position < positions_per_tile; ++position) crop.quad({0, 0}, position, 0.01F);
        crop.flush();
      }
      crop.run();
      const double by_bytes = 640 * 16.0 / bytes;
      EXPECT_NEAR(testing::occupied(crop.bench.unit(), CropWork::blend), by_bytes, 1e-6);
      EXPECT_NEAR(testing::occupied(crop.bench.unit(), CropWork::unpaired), std::max(0.0, 320 - by_bytes), 1e-6);
    }
  }
}

TEST_P(CropPrices, TheBlenderRestsACycleForAFlitThatZropReads) {
  const auto cycles = [this](unsigned reads, unsigned flits) {
    TimedCropBench crop(GetParam(), context, partition());
    auto& in = crop.bench.source<PortReads>("in_reads", 64);
    for (unsigned i = 0; i < reads; ++i) in.add({flits}, Cycle{150 + 4 * i});
    for (unsigned i = 0; i < 1000; ++i) crop.quad({0, 0}, in_memory_order(i % 64), 0.0F);
    const Cycle end = crop.run();
    EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::reads), reads * flits);
    return end;
  };
  const Cycle alone = cycles(0, 0);
  EXPECT_EQ(cycles(50, 1), alone + 50) << "of opacity 0 nothing is written, so that the port has time";
  EXPECT_EQ(cycles(50, 2), alone + 100);
}

TEST_P(CropPrices, QuadsInPairsTakeLessThanTheirLines) {
  context.format = ColorFormat::rgba8;
  for (const char* forwarding : {"on", "off"}) {
    EXPECT_NEAR(cycles_of_a_tile(
                    GetParam(), context,
                    partition({{"fetch_ahead_quads", "512"}, {"pairs_in_sector", "on"}, {"forwarding", forwarding}}),
                    0.5F),
                4 * (1 + 1 + 8), 0.5)
        << forwarding;
  }
}

TEST_P(CropPrices, PartsOfTheOccupancySayWhatWasNotPaired) {
  context.format = ColorFormat::rgba8;
  for (const char* forwarding : {"on", "off"}) {
    for (const unsigned step : {1U, 2U}) {
      TimedCropBench crop(GetParam(), context,
                          {{"bytes_per_cycle", "32"}, {"pairs_in_sector", "on"}, {"forwarding", forwarding}});
      for (unsigned round = 0; round < 10; ++round) {
        for (unsigned position = 0; position < positions_per_tile; position += step) crop.quad({0, 0}, position, 0.01F);
        crop.flush();
      }
      crop.run();
      const double quads = 640.0 / step;
      EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::blend), quads / 2) << forwarding << step;
      EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::unpaired), step == 1 ? 0 : quads / 2)
          << forwarding << step;
    }
  }
}

TEST_P(CropPrices, QuadsOfRgba32fTakeTheirColumns) {
  context.format = ColorFormat::rgba32f;
  const Bench::Settings columns{{"bytes_per_cycle", "32"}, {"rgba32f_column_cycles", "4"}};
  const std::vector<unsigned> positions{0, 1, 2, 3, 8, 9, 10, 11};
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, columns, positions), 8, 0.02) << "measured: 4 px in 8 cycles";
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, columns, positions, 0b0101), 4, 0.02);
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, columns, positions, 0b0011), 8, 0.02);
  EXPECT_NEAR(cycles_of_a_quad(GetParam(), context, {{"bytes_per_cycle", "32"}}, positions), 2, 0.02);
}

TEST_P(CropPrices, PartsOfTheOccupancySayWhatTookTheTime) {
  TimedCropBench crop(GetParam(), context, partition({{"fetch_ahead_quads", "512"}}));
  crop.quads_of_a_primitive = positions_per_tile;
  for (std::uint16_t tile = 0; tile < 100; ++tile) {
    for (unsigned n = 0; n < positions_per_tile; ++n) crop.quad({tile, 0}, in_memory_order(n), 0.5F);
  }
  crop.run();
  EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::blend), 6400);
  // All were fetched; the last 32 are held still.
  EXPECT_DOUBLE_EQ(testing::occupied(crop.bench.unit(), CropWork::sectors), 0);
  EXPECT_NEAR(testing::occupied(crop.bench.unit(), CropWork::flits), 800 + 9 * (800 - 32), 9 * 32) << "some go later";
}

}  // namespace
}  // namespace vrpipe
