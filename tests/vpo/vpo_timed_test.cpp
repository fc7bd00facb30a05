// VPO at lt; what has one closed form at every fidelity is compared with cycle by it.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/vpo.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::cycles_of;
using testing::marked;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class VpoTimedTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  VpoTimedTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {
    for (unsigned i = 0; i < 32; ++i) {
      const auto x = static_cast<float>(i % 8 * 8);
      const auto y = static_cast<float>(i / 8 * 16);
      draw.splats.push_back(testing::flat_box(x, y, x + 6, y + 6, 0.5F));
    }
  }
  static void expect_in_draw_order(const Sink<PrimitiveItem>& sink) {
    ASSERT_EQ(sink.records().size(), 65U);
    for (std::uint32_t i = 0; i < 64; ++i) {
      ASSERT_EQ(2 * sink.records()[i].item.primitive.splat + sink.records()[i].item.primitive.triangle, i);
    }
    EXPECT_TRUE(sink.records()[64].item.mark == Mark::end_of_frame);
  }
  Draw draw;
  RenderContext context;
};

INSTANTIATE_TEST_SUITE_P(Fidelities, VpoTimedTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(VpoTimedTest, APrimitiveIsSeenTheLatencyAfterItsVertices) {
  for (const unsigned latency : {1U, 10U}) {
    Bench bench(GetParam(), "vpo", "primitive-assembly", context,
                {{"latency_cycles", std::to_string(latency)}, {"triangles_per_cycle", "1"}});
    Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices");
    Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives", 64);
    vertices.add({0, 1}, 20);
    bench.run();
    EXPECT_EQ(cycles_of(primitives), (std::vector<Cycle>{21 + latency, 22 + latency})) << "in hand at 21";
  }
}

TEST_P(VpoTimedTest, AssemblesItsTrianglesPerCycle) {
  for (const unsigned rate : {1U, 2U, 4U}) {
    Bench bench(GetParam(), "vpo", "primitive-assembly", context,
                {{"triangles_per_cycle", std::to_string(rate)}, {"latency_cycles", "10"}});
    Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices", 8);
    Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives", 64);
    for (std::uint32_t i = 0; i < 4; ++i) vertices.add({8 * i, 8});
    bench.run();
    ASSERT_EQ(primitives.records().size(), 64U);
    for (std::size_t i = 0; i < 64; ++i) EXPECT_EQ(primitives.records()[i].cycle, 1 + i / rate + 10);
    EXPECT_DOUBLE_EQ(testing::occupied(bench.unit(), VpoWork::triangles), 64.0 / rate);
  }
}

TEST_P(VpoTimedTest, CulledTrianglesTakeTheirTurn) {
  for (unsigned i = 0; i < 8; ++i) draw.splats[i] = testing::flat_box(-40, -40, -30, -30, 0.5F);
  Bench bench(GetParam(), "vpo", "primitive-assembly", context,
              {{"triangles_per_cycle", "1"}, {"latency_cycles", "1"}});
  Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices");
  Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives");
  vertices.add({0, 8});
  vertices.add({8, 1});
  bench.run();
  // Eight splats without a triangle, a cycle each from 1 on.
  EXPECT_EQ(cycles_of(primitives), (std::vector<Cycle>{10, 11}));
}

TEST_P(VpoTimedTest, PrimitivesComeInDrawOrderAndTheEndLast) {
  Bench bench(GetParam(), "vpo", "primitive-assembly", context);
  Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices");
  Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives");
  for (std::uint32_t i = 0; i < 4; ++i) vertices.add({8 * i, 8});
  vertices.add(marked<VertexWarp>());
  bench.run();
  expect_in_draw_order(primitives);
  EXPECT_TRUE(bench.unit().idle());
}

TEST_P(VpoTimedTest, TellsTheCrossbarWhereABatchEndsWhereThereAreSeveralGpcs) {
  for (unsigned i = 8; i < 16; ++i) draw.splats[i] = testing::flat_box(-40, -40, -30, -30, 0.5F);
  for (const unsigned gpcs : {1U, 2U}) {
    Bench bench(GetParam(), "vpo", "primitive-assembly", context, {}, gpcs);
    Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices");
    Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives");
    for (std::uint32_t first = 0; first < 24; first += 8) vertices.add({first, 8});
    vertices.add(marked<VertexWarp>());
    bench.run();
    std::vector<std::size_t> ends;  // behind so many primitives
    std::size_t behind = 0;
    for (const auto& record : primitives.records()) {
      if (record.item.ends_batch) ends.push_back(behind);
      behind += record.item.mark == Mark::none && !record.item.ends_batch ? 1U : 0U;
    }
    EXPECT_EQ(ends, gpcs == 1 ? std::vector<std::size_t>() : (std::vector<std::size_t>{16, 16, 32}))
        << "the second is culled";
    EXPECT_EQ(behind, 32U);
  }
}

TEST_P(VpoTimedTest, AFullReceiverStopsItUntilACycleAfterItTakes) {
  Bench bench(GetParam(), "vpo", "primitive-assembly", context,
              {{"triangles_per_cycle", "1"}, {"latency_cycles", "1"}});
  Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices");
  Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives", 2);
  primitives.close(0, 50);
  vertices.add({0, 2});
  vertices.add(marked<VertexWarp>());
  bench.run();
  // At lt the one that waited goes beside the next.
  const Cycle fourth = GetParam() == Fidelity::cycle ? 53 : 52;
  ASSERT_EQ(primitives.records().size(), 5U);
  EXPECT_EQ(primitives.records()[1].cycle, 50U);
  EXPECT_EQ(primitives.records()[2].cycle, 52U);
  EXPECT_EQ(primitives.records()[3].cycle, fourth);
  // Cycles 3 to 50. At cycle it takes the next splat in hand in the first of them, which is work.
  const std::uint64_t busy = GetParam() == Fidelity::lt ? 0 : 1;
  EXPECT_EQ(testing::charged(bench.unit(), UnitState::blocked, 55), 48 - busy);
}

TEST_P(VpoTimedTest, StallsChangeNeitherPrimitivesNorOrder) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Bench bench(GetParam(), "vpo", "primitive-assembly", context);
    Source<VertexWarp>& vertices = bench.source<VertexWarp>("in_vertices", static_cast<unsigned>(1 + seed % 2));
    Sink<PrimitiveItem>& primitives = bench.sink<PrimitiveItem>("out_primitives", static_cast<unsigned>(1 + seed % 10));
    for (std::uint32_t i = 0; i < 4; ++i) vertices.add({8 * i, 8});
    vertices.add(marked<VertexWarp>());
    bench.stall_randomly(seed, 100);
    bench.run();
    expect_in_draw_order(primitives);
    ASSERT_FALSE(HasFatalFailure()) << seed;
    ASSERT_TRUE(bench.unit().idle()) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
