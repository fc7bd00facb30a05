// VPO in a frame of several draws.
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

/// VPO, given what DRAW would hand on.
struct VpoBench {
  VpoBench(Fidelity fidelity, const RenderContext& context, unsigned depth = 4)
      : bench(fidelity, "vpo", "primitive-assembly", context),
        in(bench.source<VertexWarp>("in_vertices")),
        out(bench.sink<PrimitiveItem>("out_primitives", depth)) {}
  void add_frame() {
    for (std::uint32_t draw = 0; draw < marked_draws; ++draw) {
      if (draw > 0) in.add(marked<VertexWarp>(before(draw)));
      for (std::uint32_t first = 0; first < splats_of_draw; first += 8) {
        in.add({splats_of_draw * draw + first, 8, static_cast<DrawIndex>(draw), Mark::none});
      }
    }
    in.add(marked<VertexWarp>());
  }

  Bench bench;
  Source<VertexWarp>& in;
  Sink<PrimitiveItem>& out;
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

TEST_P(VpoMarksTest, AMarkGoesOnInItsPlace) {
  const RenderContext context = cleared_between_draws();
  VpoBench vpo(GetParam(), context);
  vpo.add_frame();
  vpo.bench.run();
  expect_marks_in_place(vpo.out);
  EXPECT_TRUE(vpo.bench.unit().idle());
}

TEST_P(VpoMarksTest, StallsAndAReceiverThatTakesNothingForLongChangeNoOrder) {
  const RenderContext context = cleared_between_draws();
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    VpoBench vpo(GetParam(), context, 2);
    vpo.add_frame();
    vpo.out.close(0, 700);
    vpo.bench.stall_randomly(seed, GetParam() == Fidelity::lt ? 32 : 128);
    vpo.bench.run();
    expect_marks_in_place(vpo.out);
    EXPECT_TRUE(vpo.bench.unit().idle());
  }
}

TEST_P(VpoMarksTest, AMarkTakesTheCycleOfATriangle) {
  const RenderContext context = cleared_between_draws();
  VpoBench vpo(GetParam(), context, 64);
  vpo.in.add(marked<VertexWarp>(before(1)), 20);
  vpo.bench.run();
  EXPECT_EQ(testing::cycles_of(vpo.out), (std::vector<Cycle>{21 + 10})) << "in hand at 21, latency 10";
}

}  // namespace
}  // namespace vrpipe
