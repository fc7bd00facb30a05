// QRU in a frame of several draws: marks stand between warps, and have the number of the warp that follows.
#include <gtest/gtest.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::Bins;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

class QruMarksTest : public ::testing::TestWithParam<std::tuple<Fidelity, std::string>> {
 protected:
  QruMarksTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {}

  /// Adds a bin of so many quads, or a mark.
  struct Input {
    Input(Bench& bench, Bins& storage) : bins(storage) {
      if (bench.fidelity() == Fidelity::cycle) {
        beats = &bench.source<QuadBeat>("in_quads");
      } else {
        items = &bench.source<BinItem>("in_quads");
      }
    }
    void bin(TileId tile, unsigned quads) {
      const std::vector<unsigned> positions = testing::numbers(quads);
      if (beats != nullptr) beats->add(testing::beat_of(tile, positions, 0, true));
      if (items != nullptr) items->add(bins.at(tile, positions));
    }
    void mark(Mark mark) {
      QuadBeat beat;
      beat.mark = mark;
      BinItem item;
      item.mark = mark;
      if (beats != nullptr) beats->add(beat);
      if (items != nullptr) items->add(item);
    }
    Bins& bins;
    Source<QuadBeat>* beats = nullptr;
    Source<BinItem>* items = nullptr;
  };

  Draw draw;
  RenderContext context;
  Bins bins;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, QruMarksTest,
                         ::testing::Combine(::testing::ValuesIn(testing::fidelities_with_time()),
                                            ::testing::Values("pairing", "pass-through")),
                         [](const auto& each) {
                           return name_of(std::get<0>(each.param)) +
                                  (std::get<1>(each.param) == "pairing" ? std::string("_pairing") : "_pass_through");
                         });

TEST_P(QruMarksTest, AMarkHasTheNumberOfTheWarpBehindItAndTakesNone) {
  const auto& [fidelity, implementation] = GetParam();
  for (const unsigned stalls : {0U, 96U}) {
    Bench bench(fidelity, "qru", implementation, context);
    Input in(bench, bins);
    Sink<Warp>& out = bench.sink<Warp>("out_warps", 2);
    in.mark(Frame::mark_of(0));
    in.bin({0, 0}, 12);  // warps 0 and 1
    in.mark(Frame::mark_of(1));
    in.mark(Frame::mark_of(2));
    in.bin({0, 0}, 3);   // 2
    in.bin({1, 0}, 16);  // 3 and 4
    in.mark(Frame::mark_of(3));
    in.bin({0, 0}, 1);  // 5
    in.mark(Mark::end_of_frame);
    bench.stall_randomly(3, stalls);
    bench.run();

    struct Expected {
      Mark mark;
      std::uint32_t sequence;
      std::uint32_t tile_sequence;
    };
    const Expected expected[] = {{Frame::mark_of(0), 0, 0}, {Mark::none, 0, 0},        {Mark::none, 1, 1},
                                 {Frame::mark_of(1), 2, 0}, {Frame::mark_of(2), 2, 0}, {Mark::none, 2, 2},
                                 {Mark::none, 3, 0},        {Mark::none, 4, 1},        {Frame::mark_of(3), 5, 0},
                                 {Mark::none, 5, 3},        {Mark::end_of_frame, 6, 0}};
    ASSERT_EQ(out.records().size(), std::size(expected));
    for (std::size_t i = 0; i < std::size(expected); ++i) {
      const Warp& warp = out.records()[i].item;
      EXPECT_EQ(warp.mark, expected[i].mark) << i;
      EXPECT_EQ(warp.sequence, expected[i].sequence) << i;
      if (warp.mark == Mark::none) {
        EXPECT_EQ(warp.tile_sequence, expected[i].tile_sequence) << i;
      } else {
        EXPECT_EQ(warp.count, 0) << i;
      }
    }
    EXPECT_TRUE(bench.unit().idle());
  }
}

}  // namespace
}  // namespace vrpipe
