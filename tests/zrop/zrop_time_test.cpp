// What ZROP's work takes in sum, in closed form: cycles of the one port into the z-cache.
#include "zrop/zrop_time.h"

#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace vrpipe {
namespace {

using Settings = std::vector<std::pair<std::string, std::string>>;

ZropTime time_of(const Settings& settings) {
  ZropParameters parameters;
  for (const auto& [name, value] : settings) parameters.set("zrop", name, value);
  return {parameters, DepthFormat::d24};
}
/// By ZropWork.
using Items = std::array<std::uint64_t, most_work_kinds>;
std::vector<double> least(const ZropTime& time, const Items& items, bool to_last = false) {
  std::vector<double> cycles;
  for (const OccupancyPart& part : time.least_parts(items, to_last)) cycles.push_back(part.cycles);
  return cycles;
}

TEST(ZropTime, TestsUpdatesAndSectorsTakeTurns) {
  const ZropTime time = time_of({{"updates_per_cycle", "2"}, {"sectors_per_cycle", "8"}});
  EXPECT_FALSE(time.updates_hide());
  EXPECT_EQ(least(time, {160, 30, 40, 32, 0}), (std::vector<double>{10, 15, 5, 2, 0}));
}

TEST(ZropTime, UpdatesHideBesideBeatsOfSeveralCycles) {
  const ZropTime time = time_of({{"quads_per_cycle", "8"}});
  EXPECT_TRUE(time.updates_hide());
  EXPECT_EQ(least(time, {160, 15, 0, 0, 0}), (std::vector<double>{20, 0, 0, 0, 0}));
  EXPECT_EQ(least(time, {160, 25, 0, 0, 0}), (std::vector<double>{20, 5, 0, 0, 0}));
}

TEST(ZropTime, SectorsMayMoveInTheLastCycleOfABlockAndNobodyWaitsForTheLastBeat) {
  const ZropTime time = time_of({{"half_block_cycles", "1"}, {"block_cycles", "1.5"}});
  EXPECT_TRUE(time.updates_hide());
  EXPECT_EQ(time.longest_beat(), 16U * 1500);
  EXPECT_EQ(least(time, {160, 50, 640, 0, 30'000}), (std::vector<double>{10, 10, 10, 0, 30}));
  EXPECT_EQ(least(time, {160, 50, 640, 0, 30'000}, true), (std::vector<double>{10, 10, 10, 0, 30 - 24}));
  EXPECT_EQ(least(time, {160, 0, 0, 0, 20'000}, true), (std::vector<double>{10, 0, 0, 0, 0}));
}

TEST(ZropTime, BehindASecondLookTheQueueMayHoldHalvesOfBlocks) {
  QuadBeat beat;
  // By columns and rows of 2 and 4 quads: two of the first half, one of that below, two in the right block's halves.
  for (const unsigned position : {0U, 9U, 32U, 4U, 7U})
    beat.quads[beat.count++].position = static_cast<std::uint8_t>(position);
  const ZropTime halves = time_of({{"fetch_ahead_lines", "256"}, {"input_quads", "100"}, {"input_halves", "30"}});
  EXPECT_EQ(halves.z_cache.places(), 30U);
  EXPECT_EQ(halves.z_cache.places_of(beat), 4U);
  for (const Settings& settings : {Settings{{"fetch_ahead_lines", "256"}, {"input_quads", "100"}},
                                   Settings{{"input_quads", "100"}, {"input_halves", "30"}}}) {
    const ZropTime quads = time_of(settings);
    EXPECT_EQ(quads.z_cache.places(), 100U);
    EXPECT_EQ(quads.z_cache.places_of(beat), 5U);
  }
}

TEST(ZropTime, SectorsOfLookUpsThatRanAheadAreLeftOut) {
  const ZropTime time = time_of({{"input_quads", "100"}, {"sectors_per_cycle", "16"}});
  EXPECT_EQ(time.sectors_not_ahead(99), 0U);
  EXPECT_EQ(time.sectors_not_ahead(100 + 35), 32U) << "whole cycles";
}

}  // namespace
}  // namespace vrpipe
