#include "crop/crop_time.h"

#include <random>

#include <gtest/gtest.h>

namespace vrpipe {
namespace {

CropTime time_of(const std::vector<std::pair<std::string, std::string>>& settings, ColorFormat format) {
  CropParameters parameters;
  for (const auto& [name, value] : settings) parameters.set("crop", name, value);
  return {parameters, format};
}
constexpr std::uint32_t one_sector = 1;
CropTime::Quad quad_of(std::uint64_t line, std::uint32_t place = 0) {
  return {line, one_sector, place, all_lanes, true};
}

/// Blends a quad that is ready in a cycle; returns when.
Cycle blended(CropTime& time, const CropTime::Quad& quad, Cycle ready) {
  const CropTime::Price price = time.price_of(quad, ready);
  const Cycle at = time.free_from(price, ready);
  time.blend(quad, price, at);
  return at;
}

TEST(CropTime, QuadsGoAtTheRateOfTheirFormat) {
  const std::pair<ColorFormat, Cycle> eight_quads[] = {{ColorFormat::rgba8, 2},
                                                       {ColorFormat::srgb8, 2},
                                                       {ColorFormat::rgba16f, 4},
                                                       {ColorFormat::rgba16, 4},
                                                       {ColorFormat::rgba32f, 8}};
  for (const auto& [format, cycles] : eight_quads) {
    CropTime time = time_of({}, format);
    for (unsigned quad = 0; quad < 8; ++quad) EXPECT_EQ(blended(time, quad_of(quad), 10), 10 + quad * cycles / 8);
    EXPECT_EQ(blended(time, quad_of(8), 10), 10 + cycles);
  }
}

TEST(CropTime, FractionsOfAQuadAreKeptAndUnusedCyclesLost) {
  CropTime time = time_of({{"bytes_per_cycle", "48"}}, ColorFormat::rgba16f);  // three quads in two cycles
  std::vector<Cycle> at;
  for (unsigned quad = 0; quad < 6; ++quad) at.push_back(blended(time, quad_of(quad), 10));
  EXPECT_EQ(at, (std::vector<Cycle>{10, 10, 11, 12, 12, 13}));
  EXPECT_EQ(blended(time, quad_of(6), 100), 100U);
  EXPECT_EQ(blended(time, quad_of(7), 100), 100U);
  EXPECT_EQ(blended(time, quad_of(8), 100), 101U);
}

TEST(CropTime, TheUnitOfACycleAndThatOfAWarpGetTheSameAnswer) {
  std::mt19937 draws(7);
  const auto below = [&draws](unsigned limit) { return static_cast<unsigned>(draws() % limit); };
  for (const char* bytes : {"16", "24", "64", "80", "256"}) {
    for (const char* pairs : {"off", "on"}) {
      CropTime of_warp = time_of({{"bytes_per_cycle", bytes}, {"pairs_in_sector", pairs}}, ColorFormat::rgba8);
      CropTime of_cycle = of_warp;
      Cycle now = 0;
      Cycle ready = 0;
      for (unsigned i = 0; i < 2000; ++i) {
        const CropTime::Quad quad = quad_of(below(2));
        ready += below(8) == 0 ? below(5) : 0;
        for (now = std::max(now, ready);; ++now) {
          of_cycle.open(now);
          const CropTime::Price price = of_cycle.price_of(quad, ready);
          if (!of_cycle.is_free(price, now)) continue;
          of_cycle.blend(quad, price, now);
          break;
        }
        ASSERT_EQ(blended(of_warp, quad, ready), now) << bytes << ' ' << pairs << ' ' << i;
        if (below(4) != 0) continue;
        const unsigned moved = below(5);
        EXPECT_EQ(of_warp.move(moved, now), of_cycle.move(moved, now));
      }
    }
  }
}

TEST(CropTime, AWarpOfQuadsThatAreAlikeTakesWhatTheyTakeOneByOne) {
  for (const char* bytes : {"16", "48", "64", "112"}) {
    CropTime together = time_of({{"bytes_per_cycle", bytes}}, ColorFormat::rgba16f);
    CropTime apart = together;
    for (Cycle ready = 5; ready < 400; ready += ready % 11) {
      const auto [first, last] = together.blend_all(8, ready);
      for (unsigned quad = 0; quad < 8; ++quad) {
        const Cycle at = blended(apart, quad_of(quad), ready);
        EXPECT_TRUE(quad != 0 || first == at) << bytes << ' ' << ready;
        EXPECT_TRUE(quad != 7 || last == at) << bytes << ' ' << ready;
      }
    }
  }
}

TEST(CropTime, WithoutAPortSectorsTakeTimeFromBlending) {
  CropTime time = time_of({{"sectors_per_cycle", "4"}}, ColorFormat::rgba16f);
  time.move(8, 10);
  EXPECT_EQ(blended(time, quad_of(0), 10), 12U);
}

TEST(CropTime, ATriangleAsksOnceForALineOfATile) {
  CropTime time = time_of({{"port_flits_per_cycle", "1"}}, ColorFormat::rgba16f);
  EXPECT_EQ(time.flits_of_read(64, 7, 2), 1U);
  EXPECT_EQ(time.flits_of_read(64, 7, 3), 1U);
  EXPECT_EQ(time.flits_of_read(64, 7, 2), 0U) << "4x8 halves of a block come back to its lines";
  EXPECT_EQ(time.flits_of_read(64, 8, 2), 1U) << "another triangle";
  EXPECT_EQ(time.flits_of_read(128, 8, 2), 1U) << "another tile";
  CropTime::Moves moves;
  moves.write(8);
  EXPECT_EQ(moves.flits, 9U);
}

TEST(CropTime, ThePortTakesAFlitACycleAndABacklog) {
  CropTime time = time_of({{"port_flits_per_cycle", "1"}, {"port_backlog_flits", "16"}}, ColorFormat::rgba16f);
  EXPECT_EQ(time.port.open_from(100), 100U);
  EXPECT_EQ(time.port.take(20, 100), (std::pair<Cycle, Cycle>{100, 120}));
  EXPECT_EQ(time.port.open_from(100), 104U);
  EXPECT_EQ(time.port.open_from(110), 110U);
  EXPECT_EQ(time.port.take(1, 104), (std::pair<Cycle, Cycle>{120, 121}));
  const CropTime none = time_of({}, ColorFormat::rgba16f);
  EXPECT_FALSE(none.port.is_on());
  EXPECT_EQ(none.port.open_from(5), 5U);
}

TEST(CropTime, QuadsOfOneCycleShareASector) {
  CropTime time = time_of({{"pairs_in_sector", "on"}}, ColorFormat::rgba16f);
  EXPECT_EQ(blended(time, quad_of(0), 10), 10U);
  EXPECT_EQ(blended(time, quad_of(0), 10), 10U);
  EXPECT_EQ(blended(time, quad_of(0), 10), 11U) << "two go in a cycle";
  EXPECT_EQ(blended(time, quad_of(1), 10), 12U) << "another line";
  EXPECT_EQ(time.take_unpaired(), time.parts_of_a_cycle / 2) << "of the third, which went alone";
  EXPECT_EQ(blended(time, quad_of(1), 13), 13U) << "too late for the last";
}

TEST(CropTime, ColumnsOfRgba32fLastAndTheCacheIsIdleBesideThem) {
  CropTime time = time_of({{"rgba32f_column_cycles", "4"}}, ColorFormat::rgba32f);
  CropTime::Quad column = quad_of(0);
  column.live = 5;
  EXPECT_EQ(blended(time, quad_of(0), 10), 10U);
  EXPECT_EQ(blended(time, column, 10), 18U) << "two columns";
  EXPECT_FALSE(time.move(1, 18));
  EXPECT_EQ(blended(time, column, 10), 22U) << "one column";
}

TEST(CropTime, AMoveOfWhichItIsToldLateIsBesideTheBlendOfItsTime) {
  CropTime time = time_of({{"rgba32f_column_cycles", "4"}, {"sectors_per_cycle", "1"}}, ColorFormat::rgba32f);
  const Cycle first = blended(time, quad_of(0), 10);
  const Cycle second = blended(time, quad_of(0), 10);
  ASSERT_EQ(second - first, 8U);
  EXPECT_TRUE(time.move(1, first - 1)) << "before there was one";
  EXPECT_FALSE(time.move(7, first + 1)) << "its rate is one of the eight cycles";
  EXPECT_TRUE(time.move(1, second - 1)) << "nothing is left of them";
  EXPECT_FALSE(time.move(1, second));
}

TEST(CropTime, AReadOfWhichItIsToldLateTakesNothingWhereTheBlenderWasIdle) {
  const auto next_after = [](unsigned flits, Cycle at) {
    CropTime time = time_of({{"bytes_per_cycle", "32"}, {"port_flits_per_cycle", "1"}}, ColorFormat::rgba16f);
    blended(time, quad_of(0), 10);
    blended(time, quad_of(1), 100);
    time.rest(flits, at);
    return blended(time, quad_of(2), 0);
  };
  EXPECT_EQ(next_after(0, 0), 101U);
  EXPECT_EQ(next_after(3, 50), 101U);
  EXPECT_EQ(next_after(1, 10), 102U) << "beside a blend";
  EXPECT_EQ(next_after(3, 98), 102U) << "of which one is";
  CropTime time = time_of({{"bytes_per_cycle", "32"}, {"port_flits_per_cycle", "1"}}, ColorFormat::rgba16f);
  blended(time, quad_of(0), 100);
  for (unsigned read = 0; read < 4; ++read) time.rest(50, 20);
  EXPECT_EQ(blended(time, quad_of(1), 0), 221U) << "time is idle once: 80 of 200 cycles";
}

TEST(CropTime, WithoutForwardingAQuadWaitsForOneOfTheSamePixels) {
  CropTime time = time_of({{"forwarding", "off"}, {"latency_cycles", "9"}}, ColorFormat::rgba16f);
  CropTime::Quad left = quad_of(0, 3);
  left.live = 5;
  EXPECT_EQ(blended(time, left, 10), 10U);
  EXPECT_EQ(time.hazard_until(3, all_lanes, 11), 19U);
  EXPECT_EQ(time.hazard_until(3, 10, 11), 0U) << "the other half of its pixels";
  EXPECT_EQ(time.hazard_until(4, all_lanes, 11), 0U);
  EXPECT_EQ(time.hazard_until(3, all_lanes, 19), 0U);
}

TEST(CropTime, QuadsWaitForThoseInTheirRowOfTheSamePlaceIn64Bytes) {
  const std::pair<ColorFormat, unsigned> columns[] = {{ColorFormat::rgba8, 8},
                                                      {ColorFormat::rgba16f, 4},
                                                      {ColorFormat::rgba32f, 2}};
  for (const auto& [format, width] : columns) {
    for (unsigned position = 0; position < positions_per_tile; ++position) {
      const auto waits = [&, format = format](const char* by_gob, std::size_t place) {
        CropTime time = time_of({{"forwarding", "off"}, {"latency_cycles", "9"}, {"gob_hazards", by_gob}}, format);
        CropTime::Quad first = quad_of(0);
        first.place = 5 * positions_per_tile;
        return time.hazard_until(place, all_lanes, blended(time, first, 10) + 1) != 0;
      };
      const bool same = position % quads_per_tile_row % width == 0 && position / quads_per_tile_row == 0;
      EXPECT_EQ(waits("on", 5 * positions_per_tile + position), same) << name_of(format) << ' ' << position;
      EXPECT_EQ(waits("off", 5 * positions_per_tile + position), position == 0) << name_of(format) << ' ' << position;
      EXPECT_FALSE(waits("on", 6 * positions_per_tile + position)) << "another tile";
    }
  }
}

TEST(CropTime, ThePairOfASectorSharesAPlaceWhereTagsRunAhead) {
  CropTime time = time_of({{"bytes_per_cycle", "32"}, {"pairs_in_sector", "on"}}, ColorFormat::rgba8);
  EXPECT_TRUE(time.takes_place(256, 1));
  EXPECT_FALSE(time.takes_place(256, 1));
  EXPECT_TRUE(time.takes_place(256, 1)) << "a third";
  EXPECT_TRUE(time.takes_place(256, 2)) << "another sector";
  EXPECT_TRUE(time.takes_place(512, 2)) << "another line";
  CropTime one = time_of({{"bytes_per_cycle", "32"}, {"pairs_in_sector", "on"}}, ColorFormat::rgba16f);
  EXPECT_TRUE(one.takes_place(256, 1));
  EXPECT_TRUE(one.takes_place(256, 1)) << "a quad a cycle";
}

TEST(CropTime, ABlendOfRgba32fMayTakeLonger) {
  const std::vector<std::pair<std::string, std::string>> settings = {{"rgba32f_latency_cycles", "12"},
                                                                     {"latency_cycles", "9"}};
  EXPECT_EQ(time_of(settings, ColorFormat::rgba32f).latency_cycles, 12U);
  EXPECT_EQ(time_of(settings, ColorFormat::rgba16f).latency_cycles, 9U);
}

TEST(CropTime, ASumTakesAsLongAsItsBusiestResource) {
  const CropTime time = time_of({{"mshrs", "100"}, {"cache_bytes", "12800"}}, ColorFormat::rgba16f);
  EXPECT_DOUBLE_EQ(time.least_cycles({1000, 160, 0, 0, 0, 50}), 1000 / 2.0 + 160 / 16.0);
  EXPECT_DOUBLE_EQ(time.least_cycles({10, 0, 0, 1100, 0, 50}), (1100 - 100) / 100.0 * 50) << "miss registers";
  EXPECT_DOUBLE_EQ(time.least_cycles({10, 0, 0, 90, 350, 50}), (350 - 100) / 100.0 * 50) << "lines";
  const CropTime port = time_of({{"port_flits_per_cycle", "2"}, {"port_backlog_flits", "100"}}, ColorFormat::rgba16f);
  EXPECT_DOUBLE_EQ(port.least_cycles({10, 0, 1000, 0, 0, 50}), 1000 / 2.0);
  EXPECT_EQ(port.port.most_waiting(port.cache), 100U + 4 + 3) << "at the end of a frame";
}

}  // namespace
}  // namespace vrpipe
