// In which cycles cores have fragment warps.
#include <gtest/gtest.h>

#include "sm/active_cores.h"

namespace vrpipe {
namespace {

TEST(ActiveCores, ACoreIsActiveFromItsFirstWarpToTheReleaseOfItsLast) {
  StatisticSet owner;
  ActiveCores cores(owner, 3);
  cores.launched(0, 10);
  cores.launched(0, 12);
  cores.launched(1, 20);
  cores.released(0, 15);
  cores.released(0, 30);
  EXPECT_EQ(cores.core_cycles.value(), 20U);
  cores.launched(0, 40);
  cores.released(0, 41);
  EXPECT_EQ(cores.core_cycles.value(), 21U);
  cores.close(50);
  EXPECT_EQ(cores.core_cycles.value(), 21U + 30) << "the second has a warp yet, the third had none";
}

}  // namespace
}  // namespace vrpipe
