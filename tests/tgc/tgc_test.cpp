#include "tgc/tgc.h"

#include <map>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/geometry.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

Primitive primitive_in(std::uint32_t splat, PixelRect bounds) {
  Primitive primitive;
  primitive.splat = splat;
  primitive.bounds = bounds;
  return primitive;
}

/// One pixel in the grid of index `grid`, counted row by row.
PixelRect in_grid(std::int32_t grid, std::int32_t grids_x) {
  const std::int32_t x = grid % grids_x * 64 + 5;
  const std::int32_t y = grid / grids_x * 64 + 7;
  return {x, y, x + 1, y + 1};
}

class TileGridCoalescingTest : public ::testing::Test {
 protected:
  TileGridCoalescingTest() : draw(testing::draw_of(1024, 1024)), context(testing::context_of(draw)) {}

  /// Enters primitives; the flushes come in order.
  std::vector<TgcBehaviour::Flush> enter(TgcBehaviour& tgc, const std::vector<Primitive>& primitives) {
    std::vector<TgcBehaviour::Flush> flushes;
    TgcBehaviour::Flush flush;
    for (const Primitive& primitive : primitives) {
      tgc.begin(primitive);
      while (tgc.entering()) {
        if (tgc.step(flush)) flushes.push_back(flush);
      }
    }
    return flushes;
  }
  std::vector<TgcBehaviour::Flush> drain(TgcBehaviour& tgc) {
    std::vector<TgcBehaviour::Flush> flushes;
    for (TgcBehaviour::Flush flush; tgc.drain(flush);) flushes.push_back(flush);
    return flushes;
  }

  Draw draw;
  RenderContext context;
  TileGridCoalescing::Parameters parameters;
};

// case T02
TEST_F(TileGridCoalescingTest, ABinFlushesWithItsSixteenthPrimitiveAndNotBefore) {
  TileGridCoalescing tgc(parameters, context);
  std::vector<Primitive> primitives;
  for (std::uint32_t i = 0; i < 15; ++i) primitives.push_back(primitive_in(i, in_grid(3, 16)));
  EXPECT_TRUE(enter(tgc, primitives).empty());
  const auto flushes = enter(tgc, {primitive_in(15, in_grid(3, 16))});
  ASSERT_EQ(flushes.size(), 1U);
  ASSERT_EQ(flushes[0].primitives.size(), 16U);
  for (std::uint32_t i = 0; i < 16; ++i) EXPECT_EQ(flushes[0].primitives[i].splat, i);
  EXPECT_EQ(flushes[0].clip.x0, 192);
  EXPECT_EQ(flushes[0].clip.x1, 256);
  EXPECT_EQ(flushes[0].clip.y0, 0);
  EXPECT_EQ(flushes[0].clip.y1, 64);
  EXPECT_TRUE(drain(tgc).empty());
}

// case T02
TEST_F(TileGridCoalescingTest, SeventeenPrimitivesOfAGridAreTwoFlushes) {
  TileGridCoalescing tgc(parameters, context);
  std::vector<Primitive> primitives;
  for (std::uint32_t i = 0; i < 17; ++i) primitives.push_back(primitive_in(i, in_grid(3, 16)));
  EXPECT_EQ(enter(tgc, primitives).size(), 1U);
  const auto rest = drain(tgc);
  ASSERT_EQ(rest.size(), 1U);
  EXPECT_EQ(rest[0].primitives[0].splat, 16U);
}

// case T02
TEST_F(TileGridCoalescingTest, All128BinsCanBeTakenAndThe129thGridEvictsTheFirstAllocated) {
  TileGridCoalescing tgc(parameters, context);
  std::vector<Primitive> primitives;
  for (std::int32_t i = 0; i < 128; ++i)
    primitives.push_back(primitive_in(static_cast<std::uint32_t>(i), in_grid(i, 16)));
  primitives.push_back(primitive_in(200, in_grid(0, 16)));  // touching it again does not save it
  EXPECT_TRUE(enter(tgc, primitives).empty());
  EXPECT_EQ(tgc.evictions.value(), 0U);
  const auto flushes = enter(tgc, {primitive_in(128, in_grid(128, 16))});
  ASSERT_EQ(flushes.size(), 1U);
  EXPECT_EQ(tgc.evictions.value(), 1U);
  ASSERT_EQ(flushes[0].primitives.size(), 2U);
  EXPECT_EQ(flushes[0].primitives[0].splat, 0U);
  EXPECT_EQ(flushes[0].primitives[1].splat, 200U);
}

// case T05
TEST_F(TileGridCoalescingTest, TheDrainFlushesInTheOrderOfAllocation) {
  TileGridCoalescing tgc(parameters, context);
  enter(tgc, {primitive_in(0, in_grid(9, 16)), primitive_in(1, in_grid(2, 16)), primitive_in(2, in_grid(5, 16)),
              primitive_in(3, in_grid(2, 16))});
  const auto flushes = drain(tgc);
  ASSERT_EQ(flushes.size(), 3U);
  EXPECT_EQ(flushes[0].primitives[0].splat, 0U);
  EXPECT_EQ(flushes[1].primitives.size(), 2U);
  EXPECT_EQ(flushes[2].primitives[0].splat, 2U);
  TgcBehaviour::Flush flush;
  EXPECT_FALSE(tgc.drain(flush));
}

TEST_F(TileGridCoalescingTest, APrimitiveEntersEveryGridOfItsBoundsOnce) {
  TileGridCoalescing tgc(parameters, context);
  enter(tgc, {primitive_in(0, {60, 100, 200, 129})});  // grids x 0..3, y 1..2
  const auto flushes = drain(tgc);
  ASSERT_EQ(flushes.size(), 8U);
  std::map<std::pair<int, int>, int> seen;
  for (const auto& flush : flushes) ++seen[{flush.clip.x0 / 64, flush.clip.y0 / 64}];
  for (int y = 1; y <= 2; ++y) {
    for (int x = 0; x <= 3; ++x) EXPECT_EQ((seen[{x, y}]), 1);
  }
  EXPECT_EQ(tgc.entries.value(), 8U);
}

// case R14
TEST_F(TileGridCoalescingTest, AThinDiagonalEntersTheGridsOfItsBounds) {
  draw.splats = {Splat{}};
  draw.triangles = {{{10, 500, 500.5F}, {10, 499.5F, 500}}};
  SnappedTriangle snapped;
  ASSERT_TRUE(snap_triangle(context, 0, 0, 0, snapped));
  Primitive sliver;
  sliver.bounds = covered_bounds(snapped, 8, draw.width, draw.height);
  TileGridCoalescing tgc(parameters, context);
  enter(tgc, {sliver});
  EXPECT_EQ(tgc.entries.value(), 64U);
}

// case T03
TEST_F(TileGridCoalescingTest, MoreAllocationsThan16BitsCountKeepTheOrder) {
  TileGridCoalescing tgc(parameters, context);
  std::uint32_t expected = 0;
  TgcBehaviour::Flush flush;
  for (std::uint32_t i = 0; i < 70'000; ++i) {
    tgc.begin(primitive_in(i, in_grid(static_cast<std::int32_t>(i % 255), 16)));
    while (tgc.entering()) {
      if (!tgc.step(flush)) continue;
      ASSERT_EQ(flush.primitives.size(), 1U);
      ASSERT_EQ(flush.primitives[0].splat, expected++);
    }
  }
  EXPECT_EQ(drain(tgc).size(), 128U);
}

// case R12
TEST_F(TileGridCoalescingTest, The65536thGridOfTheLargestImageIsAGridLikeAnyOther) {
  draw.width = draw.height = 16384;
  context = testing::context_of(draw);
  TileGridCoalescing tgc(parameters, context);
  enter(tgc, {primitive_in(1, {16383, 16383, 16384, 16384}), primitive_in(2, {0, 0, 1, 1})});
  const auto flushes = drain(tgc);
  ASSERT_EQ(flushes.size(), 2U);
  EXPECT_EQ(flushes[0].clip.x0, 16320);
  EXPECT_EQ(flushes[0].primitives.size(), 1U);
}

// case T06
TEST_F(TileGridCoalescingTest, NoEntryIsLostOrDoubled) {
  parameters.set("tgc", "bins", "5");
  parameters.set("tgc", "bin_primitives", "3");
  TileGridCoalescing tgc(parameters, context);
  std::map<std::uint32_t, unsigned> entered;
  std::vector<Primitive> primitives;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const auto x = static_cast<std::int32_t>(mix(i) % 900);
    const auto y = static_cast<std::int32_t>(mix(i + 5000) % 900);
    const PixelRect bounds{x, y, x + 1 + static_cast<std::int32_t>(mix(i + 9000) % 120), y + 60};
    primitives.push_back(primitive_in(i, bounds));
    entered[i] = static_cast<unsigned>(((bounds.x1 - 1) / 64 - bounds.x0 / 64 + 1) *
                                       ((bounds.y1 - 1) / 64 - bounds.y0 / 64 + 1));
  }
  auto flushes = enter(tgc, primitives);
  for (auto& flush : drain(tgc)) flushes.push_back(flush);
  EXPECT_EQ(tgc.flushes.value(), flushes.size());
  for (const auto& flush : flushes) {
    EXPECT_LE(flush.primitives.size(), 3U);
    for (std::size_t i = 1; i < flush.primitives.size(); ++i) {
      EXPECT_LT(flush.primitives[i - 1].splat, flush.primitives[i].splat) << "draw order within a flush";
    }
    for (const Primitive& primitive : flush.primitives) --entered[primitive.splat];
  }
  for (const auto& [splat, left] : entered) EXPECT_EQ(left, 0U) << splat;
}

TEST_F(TileGridCoalescingTest, StorageIsThatOfThePapersTable) {
  const TileGridCoalescing tgc(parameters, context);
  EXPECT_EQ(tgc.storage_bytes(), 24'832U) << "24.25 KB";
}

TEST_F(TileGridCoalescingTest, AGpcSkipsGridsInWhichItOwnsNoTile) {
  parameters.set("tgc", "grid_tiles", "1");
  unsigned entries = 0;
  for (unsigned gpc = 0; gpc < 4; ++gpc) {
    context.placement = testing::placement_of(4, gpc, context.frame->width(), context.frame->height());
    TileGridCoalescing tgc(parameters, context);
    enter(tgc, {primitive_in(0, {0, 0, 256, 256})});
    for (const auto& flush : drain(tgc)) {
      EXPECT_EQ((flush.clip.x0 / 16 + flush.clip.y0 / 16) % 4, static_cast<int>(gpc));
      ++entries;
    }
  }
  EXPECT_EQ(entries, 256U);
}

TEST_F(TileGridCoalescingTest, AGpcSkipsGridsOfWhichItOwnsNoTileThatThePrimitiveMayCover) {
  unsigned entries = 0;
  for (unsigned gpc = 0; gpc < 4; ++gpc) {
    context.placement = testing::placement_of(4, gpc, context.frame->width(), context.frame->height());
    TileGridCoalescing tgc(parameters, context);
    // Two tiles on either side of the border between two grids of 4x4: GPC 3's and GPC 0's.
    enter(tgc, {primitive_in(0, {50, 2, 78, 9})});
    for (const auto& flush : drain(tgc)) {
      EXPECT_EQ(gpc, flush.clip.x0 == 0 ? 3U : 0U);
      ++entries;
    }
  }
  EXPECT_EQ(entries, 2U);
}

TEST_F(TileGridCoalescingTest, PassingThroughEveryPrimitiveIsAFlushOfItsBounds) {
  const TgcPassThrough::Parameters none;
  TgcPassThrough tgc(none, context);
  const auto flushes = enter(tgc, {primitive_in(4, {3, 4, 500, 600}), primitive_in(5, {7, 8, 9, 10})});
  ASSERT_EQ(flushes.size(), 2U);
  EXPECT_EQ(flushes[0].primitives.at(0).splat, 4U);
  EXPECT_EQ(flushes[0].clip.x1, 500);
  EXPECT_EQ(flushes[1].primitives.at(0).splat, 5U);
  EXPECT_TRUE(drain(tgc).empty());
}

}  // namespace
}  // namespace vrpipe
