#include "tc/tc.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "support/builders.h"
#include "tc/tc_tiles.h"

namespace vrpipe {
namespace {

using testing::beat_of;
using testing::tile;
using Flush = TcBehaviour::Flush;
using Reason = TcBehaviour::FlushReason;

class TileCoalescingTest : public ::testing::Test {
 protected:
  TileCoalescingTest() : draw(testing::draw_of(640, 640)), context(testing::context_of(draw)) {}

  std::vector<Flush> insert(TcBehaviour& tc, const QuadBeat& beat) {
    std::vector<Flush> flushes;
    for (unsigned from = 0; from < beat.count;) {
      Flush flush;
      bool flushed = false;
      from += tc.insert(beat, from, flush, flushed);
      if (flushed) flushes.push_back(std::move(flush));
    }
    return flushes;
  }
  std::vector<Flush> drain(TcBehaviour& tc) {
    std::vector<Flush> flushes;
    for (Flush flush; tc.flush_oldest(Reason::end_of_draw, flush);) flushes.push_back(flush);
    return flushes;
  }

  Draw draw;
  RenderContext context;
  TileCoalescing::Parameters parameters;
};

TEST_F(TileCoalescingTest, ABinFlushesWithItsLastQuadAndNotBefore) {
  TileCoalescing tc(parameters, context);
  for (std::uint32_t i = 0; i < 127; ++i) ASSERT_TRUE(insert(tc, beat_of(tile(3), {i % 64}, i)).empty()) << i;
  const auto flushes = insert(tc, beat_of(tile(3), {9}, 127));
  ASSERT_EQ(flushes.size(), 1U);
  EXPECT_EQ(flushes[0].tile, tile(3));
  EXPECT_EQ(flushes[0].reason, Reason::full);
  ASSERT_EQ(flushes[0].quads.size(), 128U);
  for (std::uint32_t i = 0; i < 128; ++i) EXPECT_EQ(flushes[0].quads[i].splat, i);
  EXPECT_TRUE(drain(tc).empty());
}

TEST_F(TileCoalescingTest, ABeatThatOverflowsABinFlushesItInTheMiddle) {
  parameters.set("tc", "bin_quads", "5");
  TileCoalescing tc(parameters, context);
  const QuadBeat beat = beat_of(tile(0), {0, 1, 2, 3, 4, 5, 6, 7}, 0);
  Flush flush;
  bool flushed = false;
  EXPECT_EQ(tc.insert(beat, 0, flush, flushed), 5U);
  EXPECT_TRUE(flushed);
  EXPECT_EQ(tc.insert(beat, 5, flush, flushed), 3U);
  EXPECT_FALSE(flushed);
  EXPECT_EQ(tc.quads.value(), 8U);
}

// case T01
TEST_F(TileCoalescingTest, The33rdTileEvictsTheBinAllocatedFirstHoweverRecentlyUsed) {
  TileCoalescing tc(parameters, context);
  for (unsigned i = 0; i < 32; ++i) ASSERT_TRUE(insert(tc, beat_of(tile(i), {0}, i)).empty());
  ASSERT_TRUE(insert(tc, beat_of(tile(0), {1, 2, 3}, 100)).empty());
  const auto flushes = insert(tc, beat_of(tile(32), {0}, 32));
  ASSERT_EQ(flushes.size(), 1U);
  EXPECT_EQ(flushes[0].tile, tile(0));
  EXPECT_EQ(flushes[0].reason, Reason::evicted);
  EXPECT_EQ(flushes[0].quads.size(), 4U);
  EXPECT_EQ(tc.flushes_evicted.value(), 1U);
  const auto next = insert(tc, beat_of(tile(33), {0}, 33));
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0].tile, tile(1));
}

TEST_F(TileCoalescingTest, ATileThatComesBackAfterItsFlushIsTheYoungest) {
  parameters.set("tc", "bins", "2");
  TileCoalescing tc(parameters, context);
  insert(tc, beat_of(tile(0), {0}));
  insert(tc, beat_of(tile(1), {0}));
  ASSERT_EQ(insert(tc, beat_of(tile(2), {0}))[0].tile, tile(0));
  ASSERT_EQ(insert(tc, beat_of(tile(0), {0}))[0].tile, tile(1));
  const auto rest = drain(tc);
  ASSERT_EQ(rest.size(), 2U);
  EXPECT_EQ(rest[0].tile, tile(2));
  EXPECT_EQ(rest[1].tile, tile(0));
}

// case T03
TEST_F(TileCoalescingTest, MoreAllocationsThan16BitsCountKeepTheOrder) {
  TileCoalescing tc(parameters, context);
  std::uint32_t expected = 0;
  for (std::uint32_t i = 0; i < 70'000; ++i) {
    for (const Flush& flush : insert(tc, beat_of(tile(i % 65), {0}, i))) {
      ASSERT_EQ(flush.quads.size(), 1U);
      ASSERT_EQ(flush.quads[0].splat, expected++);
    }
  }
  EXPECT_EQ(tc.flushes.value(), 70'000U - 32);
}

// case T05
TEST_F(TileCoalescingTest, TheDrainFlushesNoneOneOrAllBins) {
  for (const unsigned bins : {0U, 1U, 32U}) {
    TileCoalescing tc(parameters, context);
    for (unsigned i = 0; i < bins; ++i) insert(tc, beat_of(tile(i), {0}, i));
    const auto flushes = drain(tc);
    ASSERT_EQ(flushes.size(), bins);
    for (unsigned i = 0; i < bins; ++i) {
      EXPECT_EQ(flushes[i].tile, tile(i));
      EXPECT_EQ(flushes[i].reason, Reason::end_of_draw);
    }
    Flush flush;
    EXPECT_FALSE(tc.flush_oldest(Reason::timed_out, flush));
  }
}

// case T06
TEST_F(TileCoalescingTest, NoQuadIsLostDoubledOrReorderedWithinItsTile) {
  parameters.set("tc", "bins", "4");
  parameters.set("tc", "bin_quads", "11");
  TileCoalescing tc(parameters, context);
  std::vector<Flush> flushes;
  std::uint32_t next = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    std::vector<unsigned> positions;
    for (std::uint64_t q = 0; q <= mix(i) % 16; ++q) positions.push_back(static_cast<unsigned>(mix(i + q) % 64));
    for (Flush& flush : insert(tc, beat_of(tile(static_cast<unsigned>(mix(i + 77) % 9)), positions, next)))
      flushes.push_back(flush);
    next += static_cast<std::uint32_t>(positions.size());
  }
  for (Flush& flush : drain(tc)) flushes.push_back(flush);
  std::vector<bool> seen(next);
  std::map<unsigned, std::uint32_t> last;
  for (const Flush& flush : flushes) {
    ASSERT_LE(flush.quads.size(), 11U);
    ASSERT_GE(flush.quads.size(), 1U);
    for (const Quad& quad : flush.quads) {
      ASSERT_FALSE(seen[quad.splat]);
      seen[quad.splat] = true;
      std::uint32_t& previous = last[flush.tile.y * 40U + flush.tile.x];
      ASSERT_GE(quad.splat, previous);
      previous = quad.splat;
    }
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), static_cast<std::ptrdiff_t>(next));
  EXPECT_EQ(tc.flushes.value(), flushes.size());
  EXPECT_EQ(tc.flushes.value(), tc.flushes_full.value() + tc.flushes_evicted.value() + tc.flushes_end_of_draw.value());
}

TEST_F(TileCoalescingTest, StrictTerminationHasNoTimeOut) {
  const TcTime timing(parameters);
  EXPECT_EQ(timing.timeout_in(Termination::paper), 150U);
  EXPECT_EQ(timing.timeout_in(Termination::strict), 0U);
}

}  // namespace
}  // namespace vrpipe
