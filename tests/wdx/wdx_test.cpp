// The maps of WDX: which GPC owns which screen tile.
#include "wdx/wdx.h"

#include <numeric>
#include <set>

#include <gtest/gtest.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

template <class Map>
Map map_of(unsigned gpcs, const std::vector<std::pair<const char*, unsigned>>& settings = {}) {
  RenderContext context;
  context.placement.gpcs = gpcs;
  typename Map::Parameters parameters;
  for (const auto& [name, value] : settings) parameters.set("wdx", name, std::to_string(value));
  return Map(parameters, context);
}
TileId tile(unsigned x, unsigned y) { return {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)}; }

TEST(TileInterleave, AnyRowOrColumnOfAsManyUnitsHasAllGpcs) {
  for (const unsigned gpcs : {2U, 3U, 4U, 5U, 6U, 7U, 8U, 10U, 12U, 256U}) {
    for (const unsigned unit : {1U, 2U, 4U}) {
      const auto map = map_of<TileInterleave>(gpcs, {{"unit_tiles", unit}});
      for (const unsigned from : {0U, 3U, 17U}) {
        std::set<unsigned> row, column;
        for (unsigned i = 0; i < gpcs; ++i) {
          row.insert(map.owner_of(tile(unit * (from + i), unit * from)));
          column.insert(map.owner_of(tile(unit * from, unit * (from + i))));
        }
        EXPECT_EQ(row.size(), gpcs) << "unit " << unit;
        EXPECT_EQ(column.size(), gpcs) << "unit " << unit;
        EXPECT_LT(*row.rbegin(), gpcs);
      }
    }
  }
}

TEST(TileInterleave, TwoGpcsHaveACheckerboard) {
  const auto map = map_of<TileInterleave>(2);
  for (unsigned y = 0; y < 6; ++y) {
    for (unsigned x = 0; x < 6; ++x) EXPECT_EQ(map.owner_of(tile(x, y)), (x + y) % 2);
  }
}

TEST(TileInterleave, UnitsOfTheSideOfATileGridAreOneGpcs) {
  const auto map = map_of<TileInterleave>(4, {{"unit_tiles", 4}});
  for (unsigned y = 0; y < 16; ++y) {
    for (unsigned x = 0; x < 16; ++x) {
      EXPECT_EQ(map.owner_of(tile(x, y)), map.owner_of(tile(x / 4 * 4, y / 4 * 4)));
    }
  }
}

// nvgpu's map over units, filled in entry by entry.
TEST(TpcTable, IsTheDriversTableAlongRowsWithItsOffset) {
  for (const auto& [gpcs, tpcs_per_gpc, offset] :
       {std::tuple{2U, 4U, 3U}, {2U, 8U, 3U}, {3U, 4U, 5U}, {4U, 8U, 3U}, {7U, 9U, 5U}, {8U, 9U, 5U}, {5U, 3U, 6U}}) {
    const auto map = map_of<TpcTable>(gpcs, {{"tpcs_per_gpc", tpcs_per_gpc}});
    std::vector<unsigned> gpc_of_tpc;
    for (unsigned tpc = 0; tpc < tpcs_per_gpc; ++tpc) {
      for (unsigned gpc = 0; gpc < gpcs; ++gpc) gpc_of_tpc.push_back(gpc);
    }
    for (unsigned y = 0; y < 40; ++y) {
      for (unsigned x = 0; x < 40; ++x) {
        EXPECT_EQ(map.owner_of(tile(x, y)), gpc_of_tpc[(x + y * offset) % gpc_of_tpc.size()]);
      }
    }
  }
}

TEST(TpcTable, TheRowOffsetIsTheSmallestOddPrimeThatDoesNotDivideTheTpcsButForThoseListed) {
  const std::vector<std::pair<unsigned, unsigned>> listed{{1, 1},  {2, 1},  {3, 2},  {5, 1},  {7, 1},
                                                          {10, 6}, {11, 7}, {13, 2}, {14, 5}, {15, 6}};
  for (const auto& [tpcs, offset] : listed) EXPECT_EQ(TpcTable::row_offset_of(tpcs), offset) << tpcs;
  EXPECT_EQ(TpcTable::row_offset_of(4), 3U);
  EXPECT_EQ(TpcTable::row_offset_of(6), 5U);
  EXPECT_EQ(TpcTable::row_offset_of(30), 7U);
  EXPECT_EQ(TpcTable::row_offset_of(72), 5U);
  EXPECT_EQ(TpcTable::row_offset_of(2 * 3 * 5 * 7), 11U);
}

TEST(TpcTable, ARowOffsetOfOnesOwnTakesThePlaceOfTheDrivers) {
  const auto map = map_of<TpcTable>(4, {{"tpcs_per_gpc", 1}, {"row_offset", 2}, {"unit_tiles", 2}});
  EXPECT_EQ(map.owner_of(tile(1, 1)), 0U);
  EXPECT_EQ(map.owner_of(tile(2, 0)), 1U);
  EXPECT_EQ(map.owner_of(tile(0, 2)), 2U);
}

}  // namespace
}  // namespace vrpipe
