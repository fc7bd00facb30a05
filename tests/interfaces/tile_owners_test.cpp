#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/pipeline/tile_owners.h>

namespace vrpipe {
namespace {

constexpr unsigned width = 150;  // 10 x 5 tiles, of which the last row and column are cut
constexpr unsigned height = 70;

unsigned owner(TileId tile) { return (3U * tile.x + 5U * tile.y * tile.y) % 7; }

TEST(TileOwners, AreWhatTheMapSays) {
  const TileOwners owners(width, height, owner);
  for (std::uint16_t y = 0; y < 5; ++y) {
    for (std::uint16_t x = 0; x < 10; ++x) EXPECT_EQ(owners.owner_of({x, y}), owner({x, y}));
  }
}

TEST(TileOwners, OfARectangleAreThoseOfItsPixels) {
  const TileOwners owners(width, height, owner);
  for (std::uint64_t draw = 0; draw < 500; ++draw) {
    const auto random = [&](std::uint64_t what, unsigned most) {
      return static_cast<std::int32_t>(mix(4 * draw + what) % most);
    };
    const std::int32_t x0 = random(0, width);
    const std::int32_t y0 = random(1, height);
    const PixelRect pixels{x0, y0, x0 + 1 + random(2, width - static_cast<unsigned>(x0)),
                           y0 + 1 + random(3, height - static_cast<unsigned>(y0))};
    GpcSet expected;
    for (std::int32_t y = pixels.y0; y < pixels.y1; ++y) {
      for (std::int32_t x = pixels.x0; x < pixels.x1; ++x) {
        expected.set(owner({static_cast<std::uint16_t>(x / 16), static_cast<std::uint16_t>(y / 16)}));
      }
    }
    EXPECT_EQ(owners.owners_in(pixels), expected);
    for (unsigned gpc = 0; gpc < 7; ++gpc) EXPECT_EQ(owners.has_any(gpc, pixels), expected[gpc]);
  }
}

TEST(TileOwners, OfARectangleBeyondTheFrameAreThoseInside) {
  const TileOwners owners(32, 32, [](TileId tile) { return tile.x + 2U * tile.y; });
  EXPECT_TRUE(owners.has_any(3, {20, 20, 1000, 1000}));
  EXPECT_FALSE(owners.has_any(2, {20, 20, 1000, 1000}));
}

}  // namespace
}  // namespace vrpipe
