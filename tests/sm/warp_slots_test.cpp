// Which slot of which core a fragment warp takes, and on which scheduler it issues.
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "sm/sm_parameters.h"
#include "sm/warp_slots.h"

namespace vrpipe {
namespace {

class WarpSlotsTest : public ::testing::Test {
 protected:
  /// Two cores of two schedulers and four slots, by default.
  static WarpSlots slots_of(std::uint32_t to_one_core, std::uint32_t cores = 2, std::uint32_t warps_per_core = 4) {
    SmTime time(SmParameters{}, DevicePrecision{});
    time.cores = cores;
    time.schedulers_per_core = 2;
    time.warps_per_core = warps_per_core;
    time.warps_to_one_core = to_one_core;
    return WarpSlots(time);
  }
  static constexpr TileId tile{1, 0};
};

TEST_F(WarpSlotsTest, ConsecutiveWarpsOfATileGoToOneCore) {
  WarpSlots slots = slots_of(3);
  std::vector<std::uint32_t> cores;
  for (int i = 0; i < 6; ++i) cores.push_back(slots.core_of(slots.take(tile)));
  EXPECT_EQ(cores, (std::vector<std::uint32_t>{1, 1, 1, 0, 0, 0}));
}

TEST_F(WarpSlotsTest, AnotherTileGoesToTheNextCore) {
  WarpSlots slots = slots_of(3);
  EXPECT_NE(slots.core_of(slots.take({1, 0})), slots.core_of(slots.take({2, 0})));
}

TEST_F(WarpSlotsTest, ACoreWithoutSlotsIsPassedOver) {
  WarpSlots slots = slots_of(100);
  for (int i = 0; i < 8; ++i) slots.take(tile);
  EXPECT_FALSE(slots.any());
  slots.release(5);
  EXPECT_TRUE(slots.any());
  EXPECT_EQ(slots.take(tile), 5U);
  EXPECT_FALSE(slots.any());
}

TEST_F(WarpSlotsTest, TheLowestFreeSlotIsTakenWhicheverWasReleasedFirst) {
  WarpSlots slots = slots_of(256, 1, 130);
  for (std::uint32_t i = 0; i < 130; ++i) EXPECT_EQ(slots.take(tile), i);
  for (const std::uint32_t slot : {100U, 129U, 63U, 64U}) slots.release(slot);
  for (const std::uint32_t slot : {63U, 64U, 100U, 129U}) EXPECT_EQ(slots.take(tile), slot);
}

TEST_F(WarpSlotsTest, SlotsOfACoreHaveItsSchedulersInTurn) {
  const WarpSlots slots = slots_of(3);
  std::vector<std::uint32_t> schedulers;
  for (std::uint32_t slot = 0; slot < 8; ++slot) schedulers.push_back(slots.scheduler_of(slot));
  EXPECT_EQ(schedulers, (std::vector<std::uint32_t>{0, 1, 0, 1, 2, 3, 2, 3}));
}

// With a turn of the array's schedulers warps that alternate between four cores of four schedulers found one of each.
TEST_F(WarpSlotsTest, WarpsThatAlternateBetweenCoresFindAllSchedulersOfEach) {
  for (const std::uint32_t cores : {2U, 3U, 4U}) {
    WarpSlots slots = slots_of(1, cores);
    std::set<std::uint32_t> schedulers;
    for (std::uint32_t i = 0; i < 2 * cores; ++i) schedulers.insert(slots.scheduler_of(slots.take(tile)));
    EXPECT_EQ(schedulers.size(), 2 * cores);
  }
}

}  // namespace
}  // namespace vrpipe
