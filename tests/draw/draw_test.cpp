#include "draw/draw.h"

#include <gtest/gtest.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

std::vector<VertexWarp> warps_of(std::uint32_t splats) {
  const Draw draw = testing::draw_of(16, 16, std::vector<Splat>(splats));
  const RenderContext context = testing::context_of(draw);
  const VertexIssue::Parameters parameters;
  VertexIssue issue(parameters, context);
  std::vector<VertexWarp> warps;
  for (VertexWarp warp; issue.next(warp);) warps.push_back(warp);
  EXPECT_EQ(issue.splats.value(), splats);
  return warps;
}

TEST(VertexIssue, EverySplatIsInOneWarpInOrder) {
  for (const std::uint32_t splats : {1U, 7U, 8U, 9U, 16U, 1000U}) {
    std::uint32_t next = 0;
    for (const VertexWarp& warp : warps_of(splats)) {
      EXPECT_EQ(warp.first_splat, next);
      EXPECT_GE(warp.splats, 1U);
      EXPECT_FALSE(warp.mark == Mark::end_of_frame);
      next += warp.splats;
    }
    EXPECT_EQ(next, splats);
  }
}

TEST(VertexIssue, WarpsHoldEightSplatsButTheLast) {
  const std::vector<VertexWarp> warps = warps_of(19);
  ASSERT_EQ(warps.size(), 3U);
  EXPECT_EQ(warps[0].splats, 8U);
  EXPECT_EQ(warps[1].splats, 8U);
  EXPECT_EQ(warps[2].splats, 3U);
}

// case Z01
TEST(VertexIssue, AnEmptyDrawHasNoWarp) { EXPECT_TRUE(warps_of(0).empty()); }

}  // namespace
}  // namespace vrpipe
