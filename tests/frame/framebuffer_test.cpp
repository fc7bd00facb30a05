// What a frame is drawn into, and where it is in memory.
#include <vrpipe/pipeline/framebuffer.h>

#include <gtest/gtest.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

Clear of_termination() {
  Clear clear;
  clear.termination = true;
  return clear;
}

std::shared_ptr<const Draw> empty_geometry(std::uint32_t splats, bool triangles = false) {
  auto draw = std::make_shared<Draw>(testing::draw_of(100, 40, std::vector<Splat>(splats)));
  if (triangles) draw->triangles.resize(splats);
  return draw;
}

TEST(ScreenTiling, ATileAndItsIndexGiveEachOther) {
  for (const auto& [width, height] : {std::pair{1U, 1U}, {100U, 40U}, {16U, 64U}, {16384U, 16384U}}) {
    const ScreenTiling grid(width, height);
    EXPECT_EQ(grid.tiles(), std::size_t{(width + 15) / 16} * ((height + 15) / 16));
    for (std::size_t index = 0; index < grid.tiles(); ++index) {
      const TileId tile = grid.tile(index);
      ASSERT_EQ(grid.index(tile), index);
      ASSERT_TRUE(16 * tile.x < width && 16 * tile.y < height) << index;
    }
  }
}

TEST(AddressMap, RegionsFollowOneAnotherInPagesOf64KiB) {
  Frame frame(100, 40);
  frame.draw(empty_geometry(3000), {});
  frame.draw(empty_geometry(2000, true), {});
  for (const ColorFormat format : color_formats) {
    const AddressMap map = address_map(frame, format);
    std::uint64_t free_from = 0;
    for (const MemoryRegion& region : {map.color, map.depth_stencil, map.vertices, map.primitives, map.attributes}) {
      EXPECT_EQ(region.address % 65536, 0U);
      EXPECT_GE(region.address, free_from);
      EXPECT_LT(region.address, free_from + 65536) << "no page is left out";
      EXPECT_GT(region.bytes, 0U);
      free_from = region.end();
    }
    EXPECT_EQ(map.color.address, 0U) << "where ColorSurface has it";
  }
}

TEST(AddressMap, SizesAreThoseOfWhatIsInThem) {
  Frame frame(100, 40);
  frame.draw(empty_geometry(3000), {});
  frame.draw(empty_geometry(2000, true), {});
  const AddressMap map = address_map(frame, ColorFormat::rgba16f);
  constexpr std::uint64_t tiles = 7 * 3;
  EXPECT_EQ(map.color.bytes, tiles * 256 * 8);
  EXPECT_EQ(map.depth_stencil.bytes, tiles * 256 * 4) << "24 and 8 bits";
  EXPECT_EQ(map.vertices.bytes, 5000U * 48);
  EXPECT_EQ(map.primitives.bytes, 2000U * 24);
  EXPECT_EQ(map.attributes.bytes, 5000U * 704);
  EXPECT_EQ(address_map(frame, ColorFormat::rgba8).color.bytes, tiles * 256 * 4);
  EXPECT_EQ(address_map(frame, ColorFormat::rgba32f).color.bytes, tiles * 256 * 16);
}

TEST(AddressMap, AGeometryIsThereOnceHoweverOftenItIsDrawn) {
  const auto twice = empty_geometry(1000, true);
  Frame frame(100, 40);
  frame.draw(twice, {}, "", 0, 600);
  frame.draw(empty_geometry(10), {});
  frame.clear({true, true});
  frame.draw(twice, {}, "", 100, 900);
  const AddressMap map = address_map(frame, ColorFormat::rgba16f);
  EXPECT_EQ(map.vertices.bytes, 1010U * 48);
  EXPECT_EQ(map.primitives.bytes, 1000U * 24);
  EXPECT_EQ(map.attributes.bytes, (600U + 10 + 900) * 704) << "each draw writes its own";
}

TEST(Framebuffer, HasTheFramesSizeAndIsCleared) {
  Frame frame(100, 40);
  frame.draw(empty_geometry(5), {});
  const Framebuffer framebuffer(frame, ColorFormat::rgba8);
  EXPECT_EQ(framebuffer.color.width(), 100U);
  EXPECT_EQ(framebuffer.color.height(), 40U);
  EXPECT_EQ(framebuffer.color.format(), ColorFormat::rgba8);
  EXPECT_EQ(framebuffer.addresses.color.bytes, framebuffer.color.size_bytes());
  ASSERT_EQ(framebuffer.depth_stencil.grid().tiles(), 21U);
  for (std::size_t place = 0; place < framebuffer.depth_stencil.grid().quads(); ++place) {
    ASSERT_EQ(framebuffer.depth_stencil.terminated(place), 0);
    ASSERT_EQ(framebuffer.color.quad(place).alpha[3], 0.0F);
  }
}

TEST(Framebuffer, HasTheStencilThatIsPreset) {
  Frame frame(35, 20);
  DrawState state;
  state.stencil.test = true;
  frame.draw(std::make_shared<const Draw>(testing::draw_of(35, 20)), state);
  EXPECT_FALSE(Framebuffer(frame, ColorFormat::rgba8).depth_stencil.is_preset());
  std::vector<std::uint8_t> values;
  for (unsigned i = 0; i < 35 * 20; ++i) values.push_back(static_cast<std::uint8_t>(i % 256));
  frame.preset_stencil(values);
  const DepthStencilSurface surface = Framebuffer(frame, ColorFormat::rgba8).depth_stencil;
  EXPECT_TRUE(surface.is_preset());
  const auto at = [&](std::uint16_t x, std::uint16_t y) {
    const TileId tile{static_cast<std::uint16_t>(x / 16), static_cast<std::uint16_t>(y / 16)};
    const unsigned position = (y % 16U) / 2 * 8 + (x % 16U) / 2;
    return surface.quad(surface.grid().place(tile, position)).stencil[(y % 2U) * 2 + x % 2U];
  };
  EXPECT_EQ(at(0, 0), 0);
  EXPECT_EQ(at(34, 19), (19 * 35 + 34) % 256);
  EXPECT_EQ(at(17, 5), (5 * 35 + 17) % 256);
  EXPECT_EQ(at(16, 18), (18 * 35 + 16) % 256);
}

TEST(DepthStencilSurface, AGpcClearsTheTerminationOfItsOwnTiles) {
  constexpr unsigned gpcs = 3;
  for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
    DepthStencilSurface surface(100, 40);
    for (std::size_t place = 0; place < surface.grid().quads(); ++place) surface.terminated(place) = 0xa;
    const Placement placement = testing::placement_of(gpcs, gpc, 100, 40);
    surface.clear(of_termination(), placement);
    std::size_t cleared = 0;
    for (std::size_t place = 0; place < surface.grid().quads(); ++place) {
      const TileId tile = surface.grid().tile(place / positions_per_tile);
      const bool own = (tile.x + tile.y) % gpcs == gpc;
      ASSERT_EQ(surface.terminated(place), own ? 0 : 0xa) << tile.x << "," << tile.y;
      cleared += own;
    }
    EXPECT_EQ(cleared, 7 * positions_per_tile) << "a third of the tiles";
  }
}

TEST(DepthStencilSurface, AGpcAloneClearsAll) {
  DepthStencilSurface surface(100, 40);
  surface.terminated(0) = surface.terminated(surface.grid().quads() - 1) = all_lanes;
  surface.clear(of_termination(), {1, 0});
  EXPECT_EQ(surface.terminated(0), 0);
  EXPECT_EQ(surface.terminated(surface.grid().quads() - 1), 0);
}

TEST(DepthStencilSurface, AClearChangesWhatItNamesAndNothingElse) {
  for (const DepthFormat format : {DepthFormat::d16, DepthFormat::d24, DepthFormat::d32f}) {
    for (unsigned which = 0; which < 8; ++which) {
      DepthStencilSurface surface(20, 20, 0, format);
      EXPECT_EQ(surface.quad(7).depth[3], store_depth(format, 1)) << "at first";
      EXPECT_EQ(surface.quad(7).stencil[3], 0) << "at first";
      surface.quad(7) = {{1, 2, 3, 4}, {5, 6, 7, 8}};
      surface.terminated(7) = 0b0101;
      Clear clear;
      clear.termination = (which & 1U) != 0;
      clear.depth = (which & 2U) != 0;
      clear.stencil = (which & 4U) != 0;
      clear.depth_value = 0.25F;
      clear.stencil_value = 77;
      surface.clear(clear, {});
      EXPECT_EQ(surface.terminated(7), clear.termination ? 0 : 0b0101);
      EXPECT_EQ(surface.quad(7).depth[1], clear.depth ? store_depth(format, 0.25) : 2);
      EXPECT_EQ(surface.quad(7).stencil[2], clear.stencil ? 77 : 7);
    }
  }
}

TEST(DepthStencilSurface, AQuadIsHalfASectorOrAWholeOne) {
  EXPECT_EQ(DepthStencilSurface::bytes_per_quad(DepthFormat::d16), 16U);
  EXPECT_EQ(DepthStencilSurface::bytes_per_quad(DepthFormat::d24), 16U);
  EXPECT_EQ(DepthStencilSurface::bytes_per_quad(DepthFormat::d32f), 32U);
  EXPECT_EQ(DepthStencilSurface::size_bytes(100, 40, DepthFormat::d24), 7U * 3 * 1024);
  EXPECT_EQ(DepthStencilSurface::size_bytes(100, 40, DepthFormat::d32f), 7U * 3 * 2048);
}

TEST(ColorSurface, ClearsOneScreenTile) {
  ColorSurface surface(48, 48, ColorFormat::rgba16f);
  const ScreenTiling& grid = surface.grid();
  for (std::size_t place = 0; place < grid.quads(); ++place)
    surface.quad(place) = testing::color_of(0.1F, 0.2F, 0.3F, 1);
  surface.clear({1, 2});
  for (std::uint32_t y = 0; y < 48; ++y) {
    for (std::uint32_t x = 0; x < 48; ++x) {
      const bool inside = x / 16 == 1 && y / 16 == 2;
      const std::array<float, 4> expected = inside ? std::array<float, 4>{} : std::array<float, 4>{0.1F, 0.2F, 0.3F, 1};
      ASSERT_EQ(surface.pixel(x, y), expected) << x << "," << y;
    }
  }
}

}  // namespace
}  // namespace vrpipe
