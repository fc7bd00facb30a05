#include <gtest/gtest.h>

#include <vrpipe/testkit/bench.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::marked;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class VpoUnitTest : public ::testing::Test {
 protected:
  VpoUnitTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {
    for (unsigned i = 0; i < 32; ++i) {
      const auto x = static_cast<float>(i % 8 * 8);
      const auto y = static_cast<float>(i / 8 * 16);
      draw.splats.push_back(testing::flat_box(x, y, x + 6, y + 6, 0.5F));
    }
  }
  Draw draw;
  RenderContext context;
};

TEST_F(VpoUnitTest, APrimitiveIsSeenItsLatencyAfterTheVertices) {
  Bench bench("vpo", "primitive-assembly", context);
  Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices");
  Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives", 64);
  vertices.add({0, 1}, 20);
  bench.run();
  ASSERT_EQ(primitives.records().size(), 2U);
  EXPECT_EQ(primitives.records()[0].cycle, 21U + 10) << "in hand at 21, latency 10";
}

TEST_F(VpoUnitTest, AssemblesItsTrianglesPerCycle) {
  for (const unsigned rate : {1U, 2U, 4U}) {
    Bench bench("vpo", "primitive-assembly", context, {{"triangles_per_cycle", std::to_string(rate)}});
    Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices", 8);
    Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives", 64);
    for (std::uint32_t i = 0; i < 4; ++i) vertices.add({8 * i, 8});
    bench.run();
    ASSERT_EQ(primitives.records().size(), 64U);
    EXPECT_EQ(primitives.records().back().cycle - primitives.records().front().cycle + 1, 64 / rate);
  }
}

TEST_F(VpoUnitTest, PrimitivesComeInDrawOrderAndTheEndLast) {
  Bench bench("vpo", "primitive-assembly", context);
  Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices");
  Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives");
  for (std::uint32_t i = 0; i < 4; ++i) vertices.add({8 * i, 8});
  vertices.add(marked<VertexWarp>());
  bench.run();
  ASSERT_EQ(primitives.records().size(), 65U);
  for (std::uint32_t i = 0; i < 64; ++i) {
    EXPECT_EQ(primitives.records()[i].item.primitive.splat, i / 2);
    EXPECT_EQ(primitives.records()[i].item.primitive.triangle, i % 2);
  }
  EXPECT_TRUE(primitives.records()[64].item.mark == Mark::end_of_frame);
  EXPECT_TRUE(bench.unit().idle());
}

TEST_F(VpoUnitTest, StallsChangeNeitherPrimitivesNorOrder) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Bench bench("vpo", "primitive-assembly", context);
    Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices", static_cast<unsigned>(1 + seed % 2));
    Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives", static_cast<unsigned>(1 + seed % 5));
    for (std::uint32_t i = 0; i < 4; ++i) vertices.add({8 * i, 8});
    vertices.add(marked<VertexWarp>());
    bench.stall_randomly(seed, 100);
    bench.shuffle_ticks(seed);
    bench.run();
    ASSERT_EQ(primitives.records().size(), 65U) << seed;
    for (std::uint32_t i = 0; i < 64; ++i) ASSERT_EQ(primitives.records()[i].item.primitive.splat, i / 2) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
