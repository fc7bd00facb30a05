#include <map>
#include <set>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/quad_sectors.h>

namespace vrpipe {
namespace {

CacheOrganization lines_of_256() {
  CacheOrganization cache;
  cache.bytes = 8192;
  cache.line_bytes = 256;
  return cache;
}

/// Columns and rows of quads that are in a line, if each line has as many.
std::pair<std::size_t, std::size_t> shape_of_lines(std::uint32_t bytes_per_quad, TileOrder order) {
  std::map<std::uint32_t, std::pair<std::set<unsigned>, std::set<unsigned>>> lines;
  const auto places = sectors_of_quads(lines_of_256(), bytes_per_quad, order);
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    lines[places[position].line].first.insert(position % quads_per_tile_row);
    lines[places[position].line].second.insert(position / quads_per_tile_row);
  }
  EXPECT_EQ(lines.size(), positions_per_tile * bytes_per_quad / 256);
  std::set<std::pair<std::size_t, std::size_t>> shapes;
  for (const auto& [line, quads] : lines) shapes.emplace(quads.first.size(), quads.second.size());
  EXPECT_EQ(shapes.size(), 1U);
  return *shapes.begin();
}

TEST(SectorsOfQuads, OfGobsAre32BytesBy8Rows) {
  using Shape = std::pair<std::size_t, std::size_t>;
  EXPECT_EQ(shape_of_lines(16, TileOrder::gobs), Shape(4, 4)) << "RGBA8: 8x8 pixels";
  EXPECT_EQ(shape_of_lines(32, TileOrder::gobs), Shape(2, 4)) << "RGBA16F";
  EXPECT_EQ(shape_of_lines(64, TileOrder::gobs), Shape(1, 4)) << "RGBA32F";
  EXPECT_EQ(shape_of_lines(32, TileOrder::morton), Shape(4, 2));
}

TEST(SectorsOfQuads, AreEachOfItsOwnWhereItFillsThem) {
  for (const TileOrder order : {TileOrder::morton, TileOrder::gobs}) {
    std::map<std::uint32_t, std::uint32_t> taken;
    for (const QuadSectors& quad : sectors_of_quads(lines_of_256(), 32, order)) {
      EXPECT_EQ(taken[quad.line] & quad.sectors, 0U);
      taken[quad.line] |= quad.sectors;
    }
    for (const auto& [line, sectors] : taken) EXPECT_EQ(sectors, 0xffU) << line;
  }
}

}  // namespace
}  // namespace vrpipe
