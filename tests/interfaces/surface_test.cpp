#include <vrpipe/pipeline/surface.h>

#include <set>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/pipeline/order_monitor.h>

namespace vrpipe {
namespace {

TEST(ColorSurface, EveryQuadHasAnAddressOfItsOwnAlignedToItsSize) {
  for (const ColorFormat format : color_formats) {
    const ColorSurface surface(33, 17, format);
    const unsigned bytes = 4 * bytes_per_pixel(format);
    std::set<std::uint64_t> addresses;
    for (std::uint16_t y = 0; y < 2; ++y) {
      for (std::uint16_t x = 0; x < 3; ++x) {
        for (unsigned position = 0; position < positions_per_tile; ++position) {
          const std::uint64_t address = surface.address({x, y}, position);
          EXPECT_EQ(address % bytes, 0u);
          EXPECT_LT(address, surface.size_bytes());
          addresses.insert(address);
        }
      }
    }
    EXPECT_EQ(addresses.size(), 6u * positions_per_tile);
    EXPECT_EQ(surface.size_bytes(), std::uint64_t{6} * 256 * bytes_per_pixel(format));
  }
}

TEST(ColorSurface, FourNeighbouringQuadsOfRgba16fAreOneLine) {
  const ColorSurface surface(64, 64, ColorFormat::rgba16f);
  for (unsigned row = 0; row < 8; row += 2) {
    for (unsigned column = 0; column < 8; column += 2) {
      const std::uint64_t line = surface.address({1, 2}, 8 * row + column) / 128;
      EXPECT_EQ(surface.address({1, 2}, 8 * row + column + 1) / 128, line);
      EXPECT_EQ(surface.address({1, 2}, 8 * (row + 1) + column) / 128, line);
      EXPECT_EQ(surface.address({1, 2}, 8 * (row + 1) + column + 1) / 128, line);
    }
  }
}

TEST(ColorSurface, APixelIsTheLaneOfItsQuad) {
  ColorSurface surface(40, 40, ColorFormat::rgba32f);
  EXPECT_EQ(surface.pixel(39, 39), (std::array<float, 4>{0, 0, 0, 0}));
  surface.quad({2, 1}, 8 * 3 + 2).green[2] = 0.75F;  // tile (2,1), quad column 2, row 3, lane (0,1)
  EXPECT_EQ(surface.pixel(32 + 4, 16 + 7)[1], 0.75F);
}

ShadedWarp one_quad(TileId tile, std::uint8_t position, std::uint32_t first, std::uint32_t last) {
  ShadedWarp warp;
  warp.tile = tile;
  warp.count = 1;
  warp.position[0] = position;
  warp.first_primitive[0] = first;
  warp.last_primitive[0] = last;
  return warp;
}

TEST(BlendOrderMonitor, TakesRisingPrimitivesPerPositionInAnyOrderAcrossPositions) {
  BlendOrderMonitor monitor(64, 64);
  EXPECT_NO_THROW(monitor.blended(one_quad({1, 1}, 5, 10, 10), 0, 1, 1));
  EXPECT_NO_THROW(monitor.blended(one_quad({1, 1}, 6, 3, 3), 0, 1, 2));
  EXPECT_NO_THROW(monitor.blended(one_quad({2, 1}, 5, 3, 3), 0, 1, 3));
  EXPECT_NO_THROW(monitor.blended(one_quad({1, 1}, 5, 11, 14), 0, 1, 4));
}

TEST(BlendOrderMonitor, CatchesAPrimitiveThatComesAfterALaterOne) {
  BlendOrderMonitor monitor(64, 64);
  monitor.blended(one_quad({1, 1}, 5, 11, 14), 0, 1, 1);
  EXPECT_THROW(monitor.blended(one_quad({1, 1}, 5, 13, 16), 0, 1, 2), SimulationFault);
  EXPECT_THROW(monitor.blended(one_quad({1, 1}, 5, 17, 16), 0, 1, 3), SimulationFault);
}

TEST(RandomStalls, HoldInTheirShareOfCyclesAndDependOnTheSeed) {
  unsigned stalled = 0;
  unsigned different = 0;
  for (std::uint64_t cycle = 0; cycle < 100'000; ++cycle) {
    stalled += stall_at(1, cycle, 64);
    different += stall_at(1, cycle, 64) != stall_at(2, cycle, 64);
  }
  EXPECT_NEAR(stalled, 25'000, 500);
  EXPECT_GT(different, 20'000u);
}

}  // namespace
}  // namespace vrpipe
