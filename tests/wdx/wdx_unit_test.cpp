// WDX between GPCs that assemble and GPCs that own, at every fidelity with time.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/wdx.h>

#include "support/fidelities.h"

namespace vrpipe {
namespace {

using testing::cycles_of;
using testing::marked;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

constexpr unsigned side = 128;  // pixels
constexpr unsigned primitives_of_batch = 16;

RenderContext context_of_gpcs(unsigned gpcs) {
  RenderContext context = testing::context_of(testing::draw_of(side, side));
  context.placement = testing::placement_of(gpcs, 0, side, side);
  return context;
}

PrimitiveItem primitive(std::uint32_t splat, PixelRect bounds = {0, 0, 1, 1}) {
  PrimitiveItem item;
  item.primitive.splat = splat;
  item.primitive.bounds = bounds;
  return item;
}
PrimitiveItem batch_end() {
  PrimitiveItem item;
  item.ends_batch = true;
  return item;
}

/// A crossbar whose GPCs assemble batches in turn, as VPO would.
struct WdxBench {
  WdxBench(Fidelity fidelity, unsigned gpcs, unsigned depth = 64, const Bench::Settings& settings = {})
      : bench(fidelity, "wdx", "interleave", context_of_gpcs(gpcs), settings, gpcs) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      ins.push_back(&bench.source<PrimitiveItem>("in_primitives_" + std::to_string(gpc), 8));
      outs.push_back(&bench.sink<PrimitiveItem>("out_primitives_" + std::to_string(gpc), depth));
    }
  }
  /// At lt calls come in draw order, so a batch comes when those before it have come.
  Cycle when(Cycle cycle) const { return bench.fidelity() == Fidelity::lt ? 1000 * added : cycle; }
  void next_turn() {
    turn = (turn + 1) % static_cast<unsigned>(ins.size());
    ++added;
  }
  void add_batch(const std::vector<PrimitiveItem>& primitives, Cycle cycle = 0) {
    for (const PrimitiveItem& item : primitives) ins[turn]->add(item, when(cycle));
    ins[turn]->add(batch_end(), when(cycle));
    next_turn();
  }
  void add_mark(Mark mark) {
    ins[turn]->add(marked<PrimitiveItem>(mark), when(0));
    next_turn();
  }
  void add_ends() {
    for (std::size_t gpc = 0; gpc < ins.size(); ++gpc) add_mark(Mark::end_of_frame);
  }

  Bench bench;
  std::vector<Source<PrimitiveItem>*> ins;
  std::vector<Sink<PrimitiveItem>*> outs;
  unsigned turn = 0;
  Cycle added = 0;
};

/// Batches over the whole screen, each primitive of up to 40 pixels a side.
std::vector<std::vector<PrimitiveItem>> batches_of(unsigned count, std::uint64_t seed) {
  std::vector<std::vector<PrimitiveItem>> batches(count);
  std::uint32_t splat = 0;
  for (auto& batch : batches) {
    const std::uint64_t primitives = mix(seed + splat) % (primitives_of_batch + 1);
    for (std::uint64_t i = 0; i < primitives; ++i, ++splat) {
      const auto random = [&](unsigned what, unsigned most) {
        return static_cast<std::int32_t>(mix(seed ^ mix(4 * splat + what)) % most);
      };
      const std::int32_t x = random(0, side - 40);
      const std::int32_t y = random(1, side - 40);
      batch.push_back(primitive(splat, {x, y, x + 1 + random(2, 40), y + 1 + random(3, 40)}));
    }
  }
  return batches;
}

/// Each GPC has the primitives that concern it, and no other, in draw order, and one end at its end.
void expect_own_in_order(const WdxBench& wdx, const std::vector<std::vector<PrimitiveItem>>& batches) {
  const unsigned gpcs = static_cast<unsigned>(wdx.outs.size());
  for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
    const Placement placement = testing::placement_of(gpcs, gpc, side, side);
    std::vector<std::uint32_t> expected, came;
    for (const auto& batch : batches) {
      for (const PrimitiveItem& item : batch) {
        if (placement.owns_any_of(item.primitive.bounds)) expected.push_back(item.primitive.splat);
      }
    }
    const auto& records = wdx.outs[gpc]->records();
    ASSERT_FALSE(records.empty());
    EXPECT_EQ(records.back().item.mark, Mark::end_of_frame);
    for (std::size_t i = 0; i + 1 < records.size(); ++i) {
      ASSERT_EQ(records[i].item.mark, Mark::none);
      ASSERT_FALSE(records[i].item.ends_batch) << "the end of a batch is the crossbar's alone";
      came.push_back(records[i].item.primitive.splat);
    }
    EXPECT_EQ(came, expected) << "GPC " << gpc;
  }
}

class WdxUnitTest : public ::testing::TestWithParam<Fidelity> {};
INSTANTIATE_TEST_SUITE_P(Fidelities, WdxUnitTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(WdxUnitTest, APrimitiveGoesToEveryGpcThatOwnsATileOfItsBoundsAndToNoOther) {
  for (const unsigned gpcs : {2U, 3U, 4U, 7U}) {
    WdxBench wdx(GetParam(), gpcs);
    const auto batches = batches_of(30, gpcs);
    for (const auto& batch : batches) wdx.add_batch(batch);
    wdx.add_ends();
    wdx.bench.run();
    expect_own_in_order(wdx, batches);
    EXPECT_TRUE(wdx.bench.unit().idle());
  }
}

TEST_P(WdxUnitTest, CountsWhatItTakesAndWhatItHandsOn) {
  WdxBench wdx(GetParam(), 4);
  wdx.add_batch({primitive(0), primitive(1, {0, 0, 32, 16}), primitive(2, {0, 0, 64, 64})});
  wdx.add_ends();
  wdx.bench.run();
  const auto& behaviour = dynamic_cast<const WdxBehaviour&>(wdx.bench.unit().behaviour());
  EXPECT_EQ(behaviour.primitives.value(), 3U);
  EXPECT_EQ(behaviour.copies.value(), 1U + 2 + 4);
}

TEST_P(WdxUnitTest, APrimitiveIsSeenTheLatencyAfterItIsTaken) {
  for (const unsigned latency : {2U, 8U}) {
    WdxBench wdx(GetParam(), 2, 64, {{"latency_cycles", std::to_string(latency)}, {"primitives_per_cycle", "1"}});
    wdx.ins[0]->add(primitive(0), 20);
    wdx.ins[0]->add(primitive(1), 20);
    wdx.bench.run();
    EXPECT_EQ(cycles_of(*wdx.outs[0]), (std::vector<Cycle>{21 + latency, 22 + latency})) << "in hand at 21";
  }
}

TEST_P(WdxUnitTest, AGpcIsHandedSoManyPrimitivesACycle) {
  for (const unsigned rate : {1U, 2U, 4U}) {
    WdxBench wdx(GetParam(), 2, 64, {{"primitives_per_cycle", std::to_string(rate)}, {"credits", "64"}});
    std::vector<PrimitiveItem> batch;
    for (std::uint32_t i = 0; i < 32; ++i) batch.push_back(primitive(i));
    wdx.add_batch(batch);
    wdx.bench.run();
    const std::vector<Cycle> seen = cycles_of(*wdx.outs[0]);
    ASSERT_EQ(seen.size(), 32U);
    for (std::size_t i = 0; i < 32; ++i) EXPECT_EQ(seen[i], seen[0] + i / rate);
  }
}

TEST_P(WdxUnitTest, OneWithoutAPrimitiveForAGpcHoldsNobodyUp) {
  // All of the first GPC's batch is its own; the second has its turn at once.
  WdxBench wdx(GetParam(), 2, 64, {{"primitives_per_cycle", "1"}, {"latency_cycles", "2"}});
  wdx.outs[0]->close(0, 500);
  wdx.add_batch({primitive(0), primitive(1)});
  wdx.add_batch({primitive(2, {16, 0, 17, 1})});
  wdx.bench.run();
  EXPECT_EQ(wdx.outs[1]->records().size(), 1U);
  EXPECT_LT(wdx.outs[1]->records()[0].cycle, 20U + wdx.when(0));
}

TEST_P(WdxUnitTest, WaitingPrimitivesTakeTheCreditsAndStopTheirGpc) {
  // Of ten for a GPC that takes none, one is in its queue, and as many wait as there are credits; then nothing moves any
  // more, not even what goes to another.
  for (const unsigned credits : {2U, 64U}) {
    WdxBench wdx(GetParam(), 2, 1,
                 {{"primitives_per_cycle", "1"}, {"latency_cycles", "2"}, {"credits", std::to_string(credits)}});
    wdx.outs[0]->close(0, 500);
    std::vector<PrimitiveItem> batch;
    for (std::uint32_t i = 0; i < 10; ++i) batch.push_back(primitive(i));
    batch.push_back(primitive(10, {16, 0, 17, 1}));
    wdx.add_batch(batch);
    wdx.bench.run();
    ASSERT_EQ(wdx.outs[1]->records().size(), 1U);
    const Cycle seen = wdx.outs[1]->records()[0].cycle;
    EXPECT_EQ(seen > 500, credits == 2) << seen;
  }
}

TEST_P(WdxUnitTest, AMarkGoesToEveryGpcOnceInItsPlace) {
  for (const unsigned gpcs : {2U, 3U, 4U}) {
    WdxBench wdx(GetParam(), gpcs);
    wdx.add_batch({primitive(0, {0, 0, side, side})});
    wdx.add_mark(Frame::mark_of(1));
    wdx.add_batch({});
    wdx.add_batch({primitive(1, {0, 0, side, side})});
    wdx.add_ends();
    wdx.bench.run();
    for (const Sink<PrimitiveItem>* out : wdx.outs) {
      ASSERT_EQ(out->records().size(), 4U);
      EXPECT_EQ(out->records()[0].item.primitive.splat, 0U);
      EXPECT_EQ(out->records()[1].item.mark, Frame::mark_of(1));
      EXPECT_EQ(out->records()[2].item.primitive.splat, 1U);
      EXPECT_EQ(out->records()[3].item.mark, Mark::end_of_frame);
    }
    EXPECT_TRUE(wdx.bench.unit().idle());
  }
}

TEST_P(WdxUnitTest, StallsAndGpcsThatTakeNothingForLongChangeNoOrder) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    WdxBench wdx(GetParam(), 3, 2, {{"credits", seed % 2 == 0 ? "1" : "8"}});
    const auto batches = batches_of(20, 100 + seed);
    for (const auto& batch : batches) wdx.add_batch(batch);
    wdx.add_ends();
    wdx.outs[1]->close(0, 700);
    wdx.outs[2]->close(800, 1500);
    wdx.bench.stall_randomly(seed, GetParam() == Fidelity::lt ? 32 : 128);
    wdx.bench.shuffle_ticks(seed);
    wdx.bench.run();
    expect_own_in_order(wdx, batches);
    ASSERT_TRUE(wdx.bench.unit().idle()) << seed;
  }
}

TEST(WdxUnit, TakesTheGpcsBatchesInTurnHoweverLateOneIs) {
  WdxBench wdx(Fidelity::cycle, 2);
  const auto batches = batches_of(6, 7);
  for (std::size_t i = 0; i < batches.size(); ++i) wdx.add_batch(batches[i], i % 2 == 0 ? 500 : 0);
  wdx.add_ends();
  wdx.bench.run();
  expect_own_in_order(wdx, batches);
  EXPECT_GE(wdx.outs[1]->records().front().cycle, 500U);
}

}  // namespace
}  // namespace vrpipe
