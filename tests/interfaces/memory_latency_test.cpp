#include <gtest/gtest.h>

#include <vrpipe/memory/memory_port.h>

namespace vrpipe {
namespace {

TEST(MemoryLatency, IsThatOfNearSlicesForHalfOfTheTiles) {
  const MemoryLatency latency(433, 242, 0);
  unsigned near = 0;
  for (std::uint64_t tile = 0; tile < 1024; ++tile) {
    MemoryRequest request;
    request.address = tile * 1024;
    near += latency.of(request) == 242 ? 1U : 0U;
    EXPECT_EQ(latency.of(request), ((tile >> 1U ^ tile >> 4U ^ tile >> 8U) & 1U) != 0 ? 242U : 433U) << tile;
    request.address += 1023;
    EXPECT_EQ(MemoryLatency::is_near(request.address), MemoryLatency::is_near(tile * 1024)) << "all of a tile";
  }
  EXPECT_EQ(near, 512U);
}

TEST(MemoryLatency, IsMoreForColors) {
  MemoryRequest request;
  request.origin.traffic = MemoryTraffic::color;
  EXPECT_EQ(MemoryLatency(433, 433, 43).of(request), 476U);
  request.origin.traffic = MemoryTraffic::depth_stencil;
  EXPECT_EQ(MemoryLatency(433, 433, 43).of(request), 433U);
  EXPECT_EQ(MemoryLatency(100).of(request), 100U);
}

}  // namespace
}  // namespace vrpipe
