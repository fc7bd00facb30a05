// The SM array with its memory port connected: what it asks for and waits for, at every fidelity.
#include <map>

#include <gtest/gtest.h>

#include "sm/sm.h"

#include <vrpipe/component/error.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/memory.h>

#include "support/fidelities.h"
#include "support/foreign_memory.h"

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

/// A frame of 512 splats that all can be seen.
class VisibleSplats : public ::testing::Test {
 protected:
  VisibleSplats()
      : draw(testing::draw_of(64, 64, std::vector<Splat>(512, testing::flat_box(0, 0, 64, 64, 0.5F)))),
        context(testing::context_of(draw)) {}

  /// Of quads of these splats in turn, first triangles.
  static Warp warp(std::uint32_t sequence, std::uint32_t first_splat, unsigned splats = 1, TileId tile = {0, 0}) {
    Warp result;
    result.tile = tile;
    result.sequence = result.tile_sequence = sequence;
    for (unsigned i = 0; i < 8; ++i) {
      result.quads[result.count++] = {first_splat + i % splats, static_cast<std::uint8_t>(i), all_lanes, 0, 0};
    }
    return result;
  }

  Draw draw;
  RenderContext context;
};

class SmMemoryTest : public VisibleSplats, public ::testing::WithParamInterface<Fidelity> {};

class SmMemoryWithoutTimeTest : public VisibleSplats {
 protected:
  std::unique_ptr<UntimedUnit> make(const char* l1_bytes = "49152") {
    SplatShader::Parameters parameters;
    parameters.set("sm", "l1_bytes", l1_bytes);
    auto behaviour = std::make_unique<SplatShader>(parameters, context);
    std::unique_ptr<UntimedUnit> sm = untimed_unit_maker("sm")("sm", std::move(behaviour), context, 1);
    for (OutPort* port : sm->out_ports) port->stub();
    return sm;
  }
};

INSTANTIATE_TEST_SUITE_P(Fidelities, SmMemoryTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

constexpr unsigned memory_latency = 100;
constexpr unsigned memory_line_bytes = 128;

/// The unit with everything around it, and a memory of 100 cycles that moves a line a cycle.
struct SmMemoryBench {
  SmMemoryBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {})
      : bench(fidelity, "sm", "splat-shader", context, settings),
        warps(bench.source<Warp>("in_warps", 64)),
        release(bench.source<WarpRelease>("in_release", 4096)),
        vertices(bench.source<VertexWarp>("in_vertices", 64)),
        shaded(bench.sink<ShadedWarpItem>("out_shaded", 64)),
        shaded_vertices(bench.sink<VertexWarp>("out_vertices", 64)) {
    bench.set_memory(memory_latency, memory_line_bytes);
    shaded.on_take([this](const ShadedWarpItem& item, Cycle now) {
      if (item.warp->mark == Mark::none) cycles[item.warp->sequence] = now;
      item.warp->release();
      release.add({item.warp->slot}, now + 1);
    });
  }
  /// With the end of the frame behind the warps: at lt an array hands on what is done, and writes, when something comes.
  void run() {
    Warp end;
    end.mark = Mark::end_of_frame;
    end.sequence = 1000;
    warps.add(end);
    vertices.add({0, 0, 0, Mark::end_of_frame});
    bench.run();
  }
  std::uint64_t l1(const std::string& name) const {
    for (const StatisticSet* part : bench_unit().parts()) {
      for (const Counter* counter : part->counters()) {
        if (name == counter->name()) return counter->value();
      }
    }
    ADD_FAILURE() << "no counter " << name;
    return 0;
  }
  const Unit& bench_unit() const { return const_cast<Bench&>(bench).unit(); }

  Bench bench;
  Source<Warp>& warps;
  Source<WarpRelease>& release;
  Source<VertexWarp>& vertices;
  Sink<ShadedWarpItem>& shaded;
  Sink<VertexWarp>& shaded_vertices;
  std::map<std::uint32_t, Cycle> cycles;  ///< in which a warp was taken, by its number
};

// Default programs: 4 instructions, what they fetch, then 20 (16 for vertices) and 75 cycles; an instruction issues in 2.
constexpr Cycle first_segment_cycles = 4 * 2;
constexpr Cycle second_segment_cycles = 20 * 2 + 75;
constexpr Cycle fetched_vertex_cycles = first_segment_cycles + 16 * 2 + 75;

TEST_P(SmMemoryTest, AVertexWarpBeginsWhenItsVerticesAreThere) {
  SmMemoryBench sm(GetParam(), context);
  sm.vertices.add({0, 8}, 10);
  sm.run();
  ASSERT_EQ(sm.shaded_vertices.records().size(), 2U);
  // In hand and asked for at 11; of three lines that move one a cycle the last is there at 11 + 100 + 3. Attributes are
  // sent as soon as it is shaded; the memory takes them all.
  EXPECT_EQ(sm.shaded_vertices.records()[0].cycle, 11 + memory_latency + 3 + fetched_vertex_cycles + 1);
  EXPECT_EQ(sm.bench_unit().memory_bytes().read, 8U * 48);
  EXPECT_EQ(sm.bench_unit().memory_bytes().written, 8U * 704);
}

TEST_P(SmMemoryTest, AVertexWarpLeavesWhenTheLastOfItsAttributesHasBeenSent) {
  SmMemoryBench sm(GetParam(), context, {{"attribute_writes", "4"}});
  sm.vertices.add({0, 8}, 10);
  sm.run();
  ASSERT_EQ(sm.shaded_vertices.records().size(), 2U);
  // 44 lines. The first four are sent at once and answered in four cycles, the first after 101; each answer lets one go.
  const Cycle shaded = 11 + memory_latency + 3 + fetched_vertex_cycles;
  EXPECT_EQ(sm.shaded_vertices.records()[0].cycle, shaded + 10 * (memory_latency + 1) + 3 + 1);
}

TEST_P(SmMemoryTest, WhatIsCulledIsNotWritten) {
  draw.splats[2] = draw.splats[5] = testing::flat_box(100, 100, 120, 120, 0.5F);
  SmMemoryBench sm(GetParam(), context);
  sm.vertices.add({0, 8}, 10);
  sm.run();
  EXPECT_EQ(sm.bench_unit().memory_bytes().written, 6U * 704);
}

TEST_P(SmMemoryTest, AFragmentWarpWaitsForAttributesBehindItsFirstSegment) {
  SmMemoryBench sm(GetParam(), context);
  sm.warps.add(warp(0, 0), 10);
  sm.run();
  // Two sectors, in one access, asked for as it is launched at 11.
  EXPECT_EQ(sm.cycles[0], 11 + memory_latency + 1 + second_segment_cycles + 1);
  EXPECT_EQ(sm.bench_unit().memory_bytes().read, 64U);
}

TEST_P(SmMemoryTest, WhatIsOnItsWayIsNotAskedForAgainAndWhatIsThereTakesTheTimeOfL1) {
  SmMemoryBench sm(GetParam(), context);
  sm.warps.add(warp(0, 0), 10);
  sm.warps.add(warp(1, 0), 10);
  sm.warps.add(warp(2, 0), 299);
  sm.run();
  EXPECT_EQ(sm.cycles[0], 11 + memory_latency + 1 + second_segment_cycles + 1);
  EXPECT_EQ(sm.cycles[1], sm.cycles[0]) << "launched a cycle later, with the same fill";
  EXPECT_EQ(sm.cycles[2], 300 + 38 + second_segment_cycles + 1);
  EXPECT_EQ(sm.bench_unit().memory_bytes().read, 64U);
  EXPECT_EQ(sm.l1("line_accesses"), 3U);
  EXPECT_EQ(sm.l1("sector_misses"), 2U);
  EXPECT_EQ(sm.l1("sector_hits"), 4U);
}

TEST_P(SmMemoryTest, EachCoreHasAnL1OfItsOwn) {
  SmMemoryBench sm(GetParam(), context);
  sm.warps.add(warp(0, 0), 10);
  sm.warps.add(warp(1, 0, 1, {1, 0}), 300);  // another tile goes to another core
  sm.run();
  EXPECT_EQ(sm.cycles[1], 301 + memory_latency + 1 + second_segment_cycles + 1);
  EXPECT_EQ(sm.bench_unit().memory_bytes().read, 2 * 64U);
}

TEST_P(SmMemoryTest, AMemoryFasterThanL1DoesNotShortenItsTime) {
  SmMemoryBench sm(GetParam(), context);
  sm.bench.set_memory(1, memory_line_bytes);
  sm.warps.add(warp(0, 0), 10);
  sm.run();
  EXPECT_EQ(sm.cycles[0], 11 + 38 + second_segment_cycles + 1);
}

TEST_P(SmMemoryTest, AWarpIsLaunchedWhenAllItsSectorsHaveBeenAskedFor) {
  SmMemoryBench sm(GetParam(), context, {{"l1_mshrs", "1"}});
  sm.warps.add(warp(0, 0, 2), 10);
  sm.run();
  // Two primitives of two sectors, each asked for when the one before has come.
  const Cycle launched = 11 + 3 * (memory_latency + 1);
  EXPECT_EQ(sm.cycles[0], launched + memory_latency + 1 + second_segment_cycles + 1);
}

TEST_P(SmMemoryTest, EightPrimitivesMoveAsManyLinesAsTheyLieIn) {
  SmMemoryBench sm(GetParam(), context);
  sm.bench.set_memory(memory_latency, 32);
  sm.warps.add(warp(0, 0, 8), 10);
  sm.run();
  // Sixteen sectors, one a cycle.
  EXPECT_EQ(sm.cycles[0], 11 + memory_latency + 16 + second_segment_cycles + 1);
}

TEST_P(SmMemoryTest, AnL1OfOneLineWaitsForItBeforeItGoesForAnother) {
  SmMemoryBench sm(GetParam(), context, {{"l1_bytes", "128"}});
  sm.warps.add(warp(0, 0, 2), 10);
  sm.run();
  // The second primitive's line can only be asked for when the first one's has come; then the warp is launched.
  EXPECT_EQ(sm.cycles[0], 11 + 2 * (memory_latency + 1) + second_segment_cycles + 1);
  EXPECT_EQ(sm.l1("lines_evicted"), 1U);
}

TEST_P(SmMemoryTest, WithoutAnL1EachWarpAsksForAllThatItReads) {
  SmMemoryBench sm(GetParam(), context, {{"l1_bytes", "0"}});
  sm.warps.add(warp(0, 0), 10);
  sm.warps.add(warp(1, 0), 10);
  sm.warps.add(warp(2, 0), 299);
  sm.run();
  EXPECT_EQ(sm.cycles[0], 11 + memory_latency + 1 + second_segment_cycles + 1);
  EXPECT_EQ(sm.cycles[1], 12 + memory_latency + 1 + second_segment_cycles + 1);
  EXPECT_EQ(sm.cycles[2], 300 + memory_latency + 1 + second_segment_cycles + 1);
  EXPECT_EQ(sm.bench_unit().memory_bytes().read, 3 * 64U);
  EXPECT_EQ(sm.l1("line_accesses"), 0U);
  EXPECT_EQ(sm.l1("sector_misses"), 0U);
}

TEST_P(SmMemoryTest, WithoutAnL1MemorySaysHowLongItTakes) {
  SmMemoryBench sm(GetParam(), context, {{"l1_bytes", "0"}});
  sm.bench.set_memory(1, memory_line_bytes);
  sm.warps.add(warp(0, 0), 10);
  sm.run();
  EXPECT_EQ(sm.cycles[0], 11 + first_segment_cycles + second_segment_cycles + 1)
      << "before its first instructions have been issued";
}

TEST_P(SmMemoryTest, WithoutAnL1ACoreHasNoMoreSectorsInFlight) {
  SmMemoryBench sm(GetParam(), context, {{"l1_bytes", "0"}, {"l1_mshrs", "1"}});
  sm.warps.add(warp(0, 0, 2), 10);
  sm.run();
  const Cycle launched = 11 + 3 * (memory_latency + 1);
  EXPECT_EQ(sm.cycles[0], launched + memory_latency + 1 + second_segment_cycles + 1);
  EXPECT_EQ(sm.bench_unit().memory_bytes().read, 4 * 32U);
}

TEST_P(SmMemoryTest, CyclesOfWaitingForMemoryAreChargedToIt) {
  SmMemoryBench sm(GetParam(), context);
  sm.warps.add(warp(0, 0), 10);
  sm.warps.add(warp(1, 100), 500);  // at lt cycles are charged when the next warp comes
  sm.run();
  EXPECT_GE(testing::charged(sm.bench.unit(), UnitState::memory, 501), memory_latency - first_segment_cycles);
}

TEST_P(SmMemoryTest, WithoutAMemoryAttributesTakeAFixedTime) {
  Bench bench(GetParam(), "sm", "splat-shader", context, {{"attribute_latency_cycles", "500"}});
  Source<VertexWarp>& in = bench.source<VertexWarp>("in_vertices");
  Sink<VertexWarp>& out = bench.sink<VertexWarp>("out_vertices");
  in.add({0, 8}, 10);
  bench.run();
  EXPECT_EQ(out.records().at(0).cycle, 11 + 500 + fetched_vertex_cycles + 1);
  EXPECT_EQ(bench.unit().memory_bytes().read, 0U);
}

sc_core::sc_time nanoseconds(std::uint64_t number) { return {static_cast<double>(number), sc_core::SC_NS}; }

/// With a memory that answers in no order and holds requests up, or annotates; and with next to no room for anything.
TEST_P(SmMemoryTest, EveryWarpComesOutOnceWhateverTheMemoryDoes) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const auto of = [&](std::uint64_t salt, std::initializer_list<const char*> values) {
      return std::string(*(values.begin() + mix(seed * 7 + salt) % values.size()));
    };
    SmMemoryBench sm(GetParam(), context,
                     {{"cores", "2"},
                      {"warps_per_core", "6"},
                      {"vertex_warps", "3"},
                      {"l1_bytes", of(1, {"128", "256", "1024", "49152"})},
                      {"l1_mshrs", of(2, {"1", "3", "8", "384"})},
                      {"attribute_writes", of(3, {"1", "5", "640"})},
                      {"attribute_bytes", of(4, {"4", "40", "352"})},
                      {"l1_latency_cycles", of(5, {"0", "38", "300"})}});
    foreign::Dram dram("dram", nanoseconds(1 + seed % 3), nanoseconds(40), nanoseconds(70 + 100 * (seed % 5)));
    sm.bench.bind_memory(dram.socket);
    for (std::uint32_t i = 0; i < 60; ++i) {
      const TileId tile{static_cast<std::uint16_t>(i % 4), 0};
      sm.warps.add(warp(i, static_cast<std::uint32_t>(mix(seed + i) % 40), 1 + i % 8, tile));
      sm.vertices.add({8 * i, 8});
    }
    sm.bench.stall_randomly(seed, 60);
    sm.run();
    ASSERT_EQ(sm.cycles.size(), 60U) << seed;
    ASSERT_EQ(sm.shaded_vertices.records().size(), 61U) << seed;
    for (std::uint32_t i = 0; i < 60; ++i) {
      ASSERT_EQ(sm.shaded_vertices.records()[i].item.first_splat, 8 * i) << seed;
    }
    ASSERT_TRUE(sm.bench.unit().idle()) << seed;
    ASSERT_EQ(sm.bench_unit().memory_bytes().written, 480U * 704) << seed;
    ASSERT_EQ(sm.bench_unit().memory_bytes().read, 480 * 48 + 32 * sm.l1("sector_misses")) << seed;
    ASSERT_EQ(dram.responses, dram.requests) << seed;
  }
}

/// Keeps what it is asked for.
class RecordingMemory : public MemoryBehaviour {
 public:
  void access(const MemoryRequest& request) override { requests.push_back(request); }
  TimingParameters timing() const override { return {1, 1}; }
  std::vector<MemoryRequest> requests;
};

TEST_F(SmMemoryWithoutTimeTest, AsksForWhatItAsksForAtCycle) {
  std::unique_ptr<UntimedUnit> sm = make();
  RecordingMemory memory;
  sm->memory_port()->connect(memory);
  auto& vertices = dynamic_cast<UntimedIn<VertexWarp>&>(sm->in("in_vertices"));
  auto& warps = dynamic_cast<UntimedIn<Warp>&>(sm->in("in_warps"));
  SmMemoryBench cycle(Fidelity::cycle, context);
  for (std::uint32_t i = 0; i < 4; ++i) {
    vertices.take({8 * i, 8});
    cycle.vertices.add({8 * i, 8});
  }
  ASSERT_EQ(memory.requests.size(), 4U * (3 + 44));
  EXPECT_EQ(memory.requests[0].origin.traffic, MemoryTraffic::vertex);
  EXPECT_EQ(memory.requests[3].origin.traffic, MemoryTraffic::attribute);
  EXPECT_EQ(memory.requests[3].command, tlm::TLM_WRITE_COMMAND);
  memory.requests.clear();
  for (std::uint32_t i = 0; i < 12; ++i) {
    // One of three primitives is that of the warp before; the ninth and later ones go to another core.
    warps.take(warp(i, 2 * i, 3));
    cycle.warps.add(warp(i, 2 * i, 3));
  }
  cycle.run();
  EXPECT_EQ(sm->memory_port()->moved().read, cycle.bench_unit().memory_bytes().read);
  EXPECT_EQ(sm->memory_port()->moved().written, cycle.bench_unit().memory_bytes().written);
  std::uint64_t sectors = 0;
  for (const MemoryRequest& request : memory.requests) sectors += request.bytes / 32;
  // Three primitives of the first warp of a core, two of each other one.
  EXPECT_EQ(sectors, 2U * (3 + 7 * 2 + 3 + 3 * 2));
}

TEST_F(SmMemoryWithoutTimeTest, WithoutAnL1AsksForAllThatWarpsRead) {
  std::unique_ptr<UntimedUnit> sm = make("0");
  RecordingMemory memory;
  sm->memory_port()->connect(memory);
  auto& warps = dynamic_cast<UntimedIn<Warp>&>(sm->in("in_warps"));
  for (std::uint32_t i = 0; i < 4; ++i) warps.take(warp(i, 0, 3));
  EXPECT_EQ(sm->memory_port()->moved().read, 4U * 3 * 64);
  for (const StatisticSet* part : sm->parts()) EXPECT_FALSE(part->counted());
}

TEST_F(SmMemoryWithoutTimeTest, LooksNothingUpForNobody) {
  std::unique_ptr<UntimedUnit> sm = make();
  dynamic_cast<UntimedIn<Warp>&>(sm->in("in_warps")).take(warp(0, 0));
  dynamic_cast<UntimedIn<VertexWarp>&>(sm->in("in_vertices")).take({0, 8});
  EXPECT_EQ(sm->memory_port()->moved().read, 0U);
  for (const StatisticSet* part : sm->parts()) EXPECT_FALSE(part->counted());
}

TEST(SmMemory, RefusesWhatCannotBe) {
  const Draw draw = testing::draw_of(64, 64, {});
  const RenderContext context = testing::context_of(draw);
  const auto make = [&](const char* parameter, const char* value) {
    Bench bench("sm", "splat-shader", context, {{parameter, value}});
  };
  EXPECT_THROW(make("attribute_bytes", "356"), UserError) << "more than a primitive has";
  EXPECT_THROW(make("l1_bytes", "200"), UserError) << "not whole lines";
  EXPECT_THROW(make("l1_bytes", "127"), UserError) << "less than one";
  EXPECT_THROW(make("l1_ways", "5"), UserError) << "no whole sets";
  EXPECT_THROW(make("l1_ways", "768"), UserError) << "more than there are lines";
  EXPECT_NO_THROW(make("l1_ways", "96"));
  EXPECT_NO_THROW(make("l1_ways", "128")) << "three sets";
  EXPECT_NO_THROW(make("l1_bytes", "0")) << "none";
}

}  // namespace
}  // namespace vrpipe
