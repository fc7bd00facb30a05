// VPO in a frame of several draws: a mark comes from one GPC and goes to all.
#include <gtest/gtest.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::marked;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

constexpr unsigned marked_draws = 6;
constexpr unsigned splats_of_draw = 16;

/// Draws with a clear before each but the first: draw n is command 2 n, the clear before it 2 n - 1.
RenderContext cleared_between_draws() {
  std::vector<Splat> splats;
  for (unsigned i = 0; i < splats_of_draw; ++i) {
    // Some lie in tiles of every GPC.
    const float side = i % 5 == 0 ? 100 : 6;
    splats.push_back(
        testing::flat_box(static_cast<float>(i * 6), 10, static_cast<float>(i * 6) + side, 10 + side, 0.5F));
  }
  const auto geometry = testing::geometry_of(128, 128, splats);
  Frame frame(128, 128);
  for (unsigned draw = 0; draw < marked_draws; ++draw) {
    if (draw > 0) frame.clear({true, true});
    frame.draw(geometry, {});
  }
  return testing::context_of(frame);
}
Mark before(unsigned draw) { return Frame::mark_of(2 * draw - 1); }

class VpoMarksTest : public ::testing::TestWithParam<Fidelity> {};
INSTANTIATE_TEST_SUITE_P(Fidelities, VpoMarksTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

/// VPO and its GPCs. What DRAW would hand on is added in its order.
struct VpoBench {
  VpoBench(Fidelity fidelity, const RenderContext& context, unsigned gpcs, unsigned depth = 4)
      : bench(fidelity, "vpo", "primitive-assembly", context, {}, gpcs) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      ins.push_back(&bench.source<VertexWarp>("in_vertices_" + std::to_string(gpc)));
      outs.push_back(&bench.sink<PrimitiveItem>("out_primitives_" + std::to_string(gpc), depth));
    }
  }
  void add(const VertexWarp& warp) {
    // At lt the order of calls is that of cycles.
    ins[turn]->add(warp, bench.fidelity() == Fidelity::lt ? 1000 * added : 0);
    turn = (turn + 1) % static_cast<unsigned>(ins.size());
    ++added;
  }
  void add_frame() {
    for (std::uint32_t draw = 0; draw < marked_draws; ++draw) {
      if (draw > 0) add(marked<VertexWarp>(before(draw)));
      for (std::uint32_t first = 0; first < splats_of_draw; first += 8) {
        add({splats_of_draw * draw + first, 8, static_cast<DrawIndex>(draw), Mark::none});
      }
    }
    for (std::size_t gpc = 0; gpc < ins.size(); ++gpc) add(marked<VertexWarp>());
  }

  Bench bench;
  std::vector<Source<VertexWarp>*> ins;
  std::vector<Sink<PrimitiveItem>*> outs;
  unsigned turn = 0;
  unsigned added = 0;
};

/// Each mark once, in order, between the primitives of the draws that it stands between.
void expect_marks_in_place(const Sink<PrimitiveItem>& sink) {
  unsigned draw = 0;
  bool ended = false;
  for (const auto& record : sink.records()) {
    const PrimitiveItem& item = record.item;
    ASSERT_FALSE(ended) << "nothing comes after the end";
    if (item.mark == Mark::end_of_frame) {
      ended = true;
    } else if (item.mark != Mark::none) {
      ++draw;
      ASSERT_EQ(item.mark, before(draw));
    } else {
      ASSERT_EQ(item.primitive.draw, draw);
      ASSERT_EQ(item.primitive.splat / splats_of_draw, draw);
    }
  }
  EXPECT_TRUE(ended);
  EXPECT_EQ(draw + 1, marked_draws);
}

TEST_P(VpoMarksTest, AMarkGoesToEveryGpcOnceInItsPlace) {
  const RenderContext context = cleared_between_draws();
  for (const unsigned gpcs : {1U, 2U, 3U, 4U}) {
    VpoBench vpo(GetParam(), context, gpcs);
    vpo.add_frame();
    vpo.bench.run();
    for (const Sink<PrimitiveItem>* out : vpo.outs) expect_marks_in_place(*out);
    EXPECT_TRUE(vpo.bench.unit().idle());
  }
}

TEST_P(VpoMarksTest, StallsAndGpcsThatTakeNothingForLongChangeNoOrder) {
  const RenderContext context = cleared_between_draws();
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    VpoBench vpo(GetParam(), context, 3, 2);
    vpo.add_frame();
    vpo.outs[1]->close(0, 700);
    vpo.outs[2]->close(800, 1500);
    vpo.bench.stall_randomly(seed, GetParam() == Fidelity::lt ? 32 : 128);
    vpo.bench.run();
    for (const Sink<PrimitiveItem>* out : vpo.outs) expect_marks_in_place(*out);
    EXPECT_TRUE(vpo.bench.unit().idle());
  }
}

TEST_P(VpoMarksTest, AMarkTakesTheCycleOfATriangle) {
  const RenderContext context = cleared_between_draws();
  VpoBench vpo(GetParam(), context, 1, 64);
  vpo.ins[0]->add(marked<VertexWarp>(before(1)), 20);
  vpo.bench.run();
  EXPECT_EQ(testing::cycles_of(*vpo.outs[0]), (std::vector<Cycle>{21 + 10})) << "in hand at 21, latency 10";
}

}  // namespace
}  // namespace vrpipe
