#include <deque>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/half.h>
#include <vrpipe/pipeline/slots/crop.h>
#include <vrpipe/testkit/bench.h>

#include "support/builders.h"
#include "support/foreign_memory.h"

namespace vrpipe {
namespace {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

/// Answers after a fixed time and counts what was asked.
class CountingMemory : public sc_core::sc_module, private tlm::tlm_fw_transport_if<> {
 public:
  CountingMemory(const sc_core::sc_module_name& name, const ClockDomain& clock, unsigned latency_cycles)
      : sc_module(name), socket("socket"), clock_(clock), latency_(latency_cycles) {
    socket.bind(*this);
  }
  tlm::tlm_target_socket<32> socket;
  std::uint64_t bytes_read = 0, bytes_written = 0;
  std::map<std::uint64_t, unsigned> reads_of;  ///< by address

 private:
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase&,
                                     sc_core::sc_time& delay) override {
    if (payload.is_read()) {
      bytes_read += payload.get_data_length();
      ++reads_of[payload.get_address()];
    } else {
      bytes_written += payload.get_data_length();
    }
    delay += latency_ * clock_.period();
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
    return tlm::TLM_COMPLETED;
  }
  void b_transport(tlm::tlm_generic_payload&, sc_core::sc_time&) override {}
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  const ClockDomain& clock_;
  double latency_;
};

/// CROP with a source of quads and a memory around it.
struct CropBench {
  explicit CropBench(const RenderContext& context, const Bench::Settings& settings = {}, unsigned latency = 146)
      : bench("crop", "color-rop", context, settings),
        memory("counting_memory", bench.clock(), latency),
        color(bench.source<ColorBeat>("in_color", 8)),
        signals(bench.sink<TerminationBeat>("out_terminations", 64)),
        width(static_cast<unsigned>(64 / (4 * bytes_per_pixel(context.format)))) {
    bench.bind_memory(memory.socket);
  }

  /// Adds a quad of the next primitive to the stream; beats are as wide as the format lets PROP be.
  void quad(TileId tile, unsigned position, float alpha = 0.01F, LaneMask live = all_lanes, Cycle earliest = 0) {
    ShadedWarp& warp = pool.take();
    warps.insert(&warp);
    warp.tile = tile;
    warp.count = 1;
    warp.position[0] = static_cast<std::uint8_t>(position);
    warp.live[0] = live;
    warp.first_primitive[0] = warp.last_primitive[0] = static_cast<std::uint32_t>(warps.size());
    warp.color[0] = testing::color_of(alpha, alpha, alpha, alpha);
    beat.quads[beat.count++] = {&warp, 0};
    if (beat.count == width) flush(earliest);
  }
  void flush(Cycle earliest = 0) {
    if (beat.count > 0) color.add(beat, earliest);
    beat = ColorBeat{};
  }
  void end() {
    flush();
    ColorBeat last;
    last.mark = Mark::end_of_frame;
    color.add(last);
  }
  /// The cycles of the draw, `never` if it did not end.
  Cycle run() {
    end();
    bench.run();
    return bench.unit().end_of_frame();
  }

  Bench bench;
  CountingMemory memory;
  Source<ColorBeat>& color;
  Sink<TerminationBeat>& signals;
  unsigned width;
  ColorBeat beat;
  ShadedWarpPool pool;
  std::set<const ShadedWarp*> warps;  ///< all that were taken from it
};

class CropUnitTest : public ::testing::Test {
 protected:
  CropUnitTest() : draw(testing::draw_of(1024, 128)), context(testing::context_of(draw)) {}
  Draw draw;
  RenderContext context;
};

// The format decides how many quads of a resident line blend in a cycle.
class CropRate : public CropUnitTest, public ::testing::WithParamInterface<std::pair<ColorFormat, unsigned>> {};

TEST_P(CropRate, ResidentQuadsBlendAtExactlyTheRateOfTheFormat) {
  context.format = GetParam().first;
  const unsigned rate = GetParam().second;
  for (const LaneMask live :
       {LaneMask{0b1111}, LaneMask{0b0001}, LaneMask{0b0110}}) {  // case Q07: partial quads cost as much
    CropBench crop(context);
    for (unsigned i = 0; i < 4; ++i) crop.quad({0, 0}, i % 2 + 8 * (i / 2));
    crop.flush();
    for (unsigned i = 0; i < 400; ++i) crop.quad({0, 0}, i % 2 + 8 * (i / 2 % 2), 0.01F, live, 1000);
    // In hand from 1001 on and in the queue in that cycle; blended from 1002 on; 8 cycles of latency behind the last.
    EXPECT_EQ(crop.run(), 1001 + 400 / rate + 8);
    EXPECT_EQ(crop.bench.unit().occupancy().items(CropWork::blend), 404U);
  }
}

TEST_F(CropUnitTest, BytesThatAreNoWholeQuadsBlendAtTheirRateExactly) {
  for (const unsigned bytes : {16U, 17U, 24U, 48U, 64U, 96U, 128U, 200U, 256U}) {
    for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
      context.format = format;
      const Rate rate = Rate::of_bytes(bytes, 4 * bytes_per_pixel(format));
      // All wait in the queue for the line of the first.
      const auto cycles = [&](unsigned quads) {
        CropBench crop(context, {{"bytes_per_cycle", std::to_string(bytes)}, {"input_quads", "65536"}}, 40000);
        for (unsigned i = 0; i < quads; ++i) crop.quad({0, 0}, 0);
        return crop.run();
      };
      constexpr unsigned turns = 20;
      EXPECT_EQ(cycles(100 + turns * rate.items) - cycles(100), turns * rate.cycles) << bytes << " " << name_of(format);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, CropRate,
                         ::testing::Values(std::pair{ColorFormat::rgba8, 4U}, std::pair{ColorFormat::rgba16f, 2U},
                                           std::pair{ColorFormat::rgba32f, 1U}),
                         [](const auto& format) { return std::string(name_of(format.param.first)); });

TEST_F(CropUnitTest, AMissWaitsForTheMemoryAndAHitDoesNot) {
  CropBench crop(context, {}, 100);
  crop.quad({0, 0}, 0);
  crop.flush();
  // In hand at 1, its sector asked for at 1, there at 101, blended then; the end is 8 cycles of latency later.
  EXPECT_EQ(crop.run(), 101U + 8);
  EXPECT_EQ(crop.memory.bytes_read, 32U);
}

TEST_F(CropUnitTest, MissesOverlap) {
  CropBench crop(context, {}, 100);
  for (unsigned i = 0; i < 64; ++i) crop.quad({0, 0}, i);
  EXPECT_LT(crop.run(), 101U + 64 + 8) << "one latency, not 64";
  EXPECT_EQ(crop.memory.bytes_read, 64U * 32);
}

TEST_F(CropUnitTest, QuadsInTheSameSectorAskForItOnce) {
  CropBench crop(context, {}, 100);
  for (unsigned i = 0; i < 20; ++i) crop.quad({0, 0}, 5);
  crop.run();
  EXPECT_EQ(crop.memory.bytes_read, 32U);
}

std::uint64_t hits_on_their_way(CropBench& crop) { return crop.bench.unit().parts().at(0)->counters().at(0)->value(); }

TEST_F(CropUnitTest, HitsOnASectorThatIsStillBeingFilledAreCountedApart) {
  CropBench crop(context, {}, 100);
  for (unsigned i = 0; i < 20; ++i) crop.quad({0, 0}, 5);
  crop.flush();
  for (unsigned i = 0; i < 7; ++i) crop.quad({0, 0}, 5, 0.01F, all_lanes, 1000);
  crop.run();
  const SectoredCacheStatistics& cache = crop.bench.behaviour<CropBehaviour>().cache_statistics;
  EXPECT_EQ(cache.line_accesses.value(), 27U);
  EXPECT_EQ(cache.line_misses.value(), 1U);
  EXPECT_EQ(cache.sector_misses.value(), 1U);
  EXPECT_EQ(cache.sector_hits.value(), 26U);
  EXPECT_EQ(hits_on_their_way(crop), 19U);
}

TEST_F(CropUnitTest, TheCacheCountsWhatTheMemorySeesUnderAnyStalls) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    context.format = seed % 3 == 0 ? ColorFormat::rgba8 : seed % 3 == 1 ? ColorFormat::rgba16f : ColorFormat::rgba32f;
    CropBench crop(context,
                   {{"cache_bytes", seed % 2 == 0 ? "512" : "4096"},
                    {"mshrs", seed % 4 == 0 ? "1" : "16"},
                    {"input_quads", seed % 5 == 0 ? "1" : "64"}},
                   static_cast<unsigned>(1 + seed * 7 % 300));
    constexpr unsigned quads = 600;
    for (std::uint64_t i = 0; i < quads; ++i) {
      crop.quad({static_cast<std::uint16_t>(mix(i) % 3), 0}, static_cast<unsigned>(mix(i + 999) % 64), 0.3F);
    }
    crop.bench.stall_randomly(seed, 90);
    ASSERT_NE(crop.run(), never) << seed;
    const SectoredCacheStatistics& cache = crop.bench.behaviour<CropBehaviour>().cache_statistics;
    const unsigned sectors_of_a_quad = context.format == ColorFormat::rgba32f ? 2 : 1;
    EXPECT_EQ(cache.line_accesses.value(), quads);
    EXPECT_EQ(cache.line_hits.value() + cache.line_misses.value(), quads);
    EXPECT_EQ(cache.sector_accesses.value(), quads * sectors_of_a_quad);
    EXPECT_EQ(cache.sector_hits.value() + cache.sector_misses.value(), quads * sectors_of_a_quad);
    EXPECT_LE(hits_on_their_way(crop), cache.sector_hits.value());
    EXPECT_EQ(cache.bytes_filled.value(), 32 * cache.sector_misses.value());
    EXPECT_EQ(cache.bytes_written_back.value(), 32 * cache.sectors_written_back.value());
    EXPECT_EQ(cache.bytes_filled.value(), crop.memory.bytes_read) << seed;
    // The line evicted last waits for the next quad.
    EXPECT_GE(cache.bytes_written_back.value(), crop.memory.bytes_written) << seed;
    EXPECT_LE(cache.bytes_written_back.value(), crop.memory.bytes_written + 128) << seed;
  }
}

TEST_F(CropUnitTest, MovingSectorsTakesCyclesFromBlending) {
  // 4096 quads, each of its own sector: CROP cycles = quads / 2 + sectors / 8.
  CropBench crop(context, {{"sectors_per_cycle", "8"}, {"cache_bytes", "1048576"}}, 20);
  for (std::uint16_t tile = 0; tile < 64; ++tile) {
    for (unsigned i = 0; i < 64; ++i) crop.quad({tile, 0}, i);
  }
  const auto cycles = static_cast<double>(crop.run());
  EXPECT_NEAR(cycles, 4096 / 2.0 + 4096 / 8.0, 40);
}

// case B10
TEST_F(CropUnitTest, WithoutForwardingAQuadWaitsForTheOneBeforeAtItsPosition) {
  for (const bool forwarding : {true, false}) {
    CropBench crop(context, {{"forwarding", forwarding ? "on" : "off"}, {"latency_cycles", "8"}});
    crop.quad({0, 0}, 0);
    crop.flush();
    for (unsigned i = 0; i < 100; ++i) crop.quad({0, 0}, 0, 0.01F, all_lanes, 1000);
    EXPECT_EQ(crop.run(), forwarding ? 1001U + 50 + 8 : 1002U + 99 * 8 + 8);
    crop.bench.unit().close_account(crop.bench.unit().end_of_frame());
    const std::uint64_t stalled = crop.bench.unit().account().cycles(UnitState::latency);
    EXPECT_EQ(stalled > 0, !forwarding);
  }
}

// case B10
TEST_F(CropUnitTest, WithoutForwardingOtherPositionsDoNotWait) {
  CropBench crop(context, {{"forwarding", "off"}, {"latency_cycles", "8"}});
  for (unsigned i = 0; i < 64; ++i) crop.quad({0, 0}, i);
  for (unsigned i = 0; i < 256; ++i) crop.quad({0, 0}, i % 64, 0.01F, all_lanes, 1000);
  EXPECT_EQ(crop.run(), 1001U + 128 + 8);
}

// case B10
TEST_F(CropUnitTest, AHazardMakesNoDifferenceToTheImage) {
  Lanes alpha[2];
  for (const bool forwarding : {true, false}) {
    CropBench crop(context, {{"forwarding", forwarding ? "on" : "off"}});
    for (unsigned i = 0; i < 1000; ++i) crop.quad({0, 0}, 9, 0.003F + 0.00001F * static_cast<float>(i));
    crop.run();
    alpha[forwarding] = crop.bench.surface().quad({0, 0}, 9).alpha;
  }
  EXPECT_EQ(alpha[0][0], alpha[1][0]);
  EXPECT_GT(alpha[0][0], 0.5F);
}

TEST_F(CropUnitTest, ATerminationIsSeenTheLatencyAfterItsBlend) {
  testing::terminate_early(context);
  CropBench crop(context, {{"latency_cycles", "8"}});
  crop.quad({2, 1}, 9, 0.5F);
  crop.flush();
  crop.quad({2, 1}, 9, 0.999F, 0b0101, 1000);
  crop.flush(1000);
  crop.run();
  ASSERT_EQ(crop.signals.records().size(), 1U);
  EXPECT_EQ(crop.signals.records()[0].cycle, 1002U + 8);
  const TerminationBeat& beat = crop.signals.records()[0].item;
  ASSERT_EQ(beat.count, 1);
  EXPECT_EQ(beat.signals[0].tile, (TileId{2, 1}));
  EXPECT_EQ(beat.signals[0].position, 9);
  EXPECT_EQ(beat.signals[0].pixels, 0b0101);
}

TEST_F(CropUnitTest, SignalsThatNobodyTakesStopTheBlending) {
  testing::terminate_early(context);
  Bench bench("crop", "color-rop", context, {{"latency_cycles", "1"}});
  bench.set_memory(1, 4096);
  Source<ColorBeat>& color = bench.source<ColorBeat>("in_color", 64);
  Sink<TerminationBeat>& signals = bench.sink<TerminationBeat>("out_terminations", 1);
  signals.close(0, 500);
  std::deque<ShadedWarp> warps;
  for (unsigned i = 0; i < 8; ++i) {
    warps.emplace_back();
    warps.back().count = 1;
    warps.back().position[0] = static_cast<std::uint8_t>(i);
    warps.back().live[0] = all_lanes;
    warps.back().first_primitive[0] = warps.back().last_primitive[0] = i;
    warps.back().color[0] = testing::color_of(1, 1, 1, 0.999F);
    ColorBeat beat;
    beat.count = 1;
    beat.quads[0] = {&warps.back(), 0};
    color.add(beat);
  }
  bench.run();
  std::size_t received = 0;
  for (const auto& record : signals.records()) received += record.item.count;
  EXPECT_EQ(received, 8U);
  bench.unit().close_account(500);
  EXPECT_GT(bench.unit().account().cycles(UnitState::blocked), 400U);
}

// case T05
TEST_F(CropUnitTest, AnEmptyDrawEndsWithItsMark) {
  CropBench crop(context);
  EXPECT_EQ(crop.run(), 1U);
}

TEST_F(CropUnitTest, DirtySectorsAreWrittenBackWhenTheirLineGoesAndCleanOnesAreNot) {
  for (const bool changes : {true, false}) {
    CropBench crop(context, {{"cache_bytes", "1024"}}, 10);  // 8 lines, 32 quads
    for (std::uint16_t tile = 0; tile < 4; ++tile) {
      for (unsigned i = 0; i < 64; ++i) crop.quad({tile, 0}, i, changes ? 0.5F : 0.0F);
    }
    crop.run();
    EXPECT_EQ(crop.memory.bytes_read, 256U * 32);
    EXPECT_EQ(crop.memory.bytes_written, changes ? (256U - 32) * 32 : 0U) << "the last 8 lines stay";
  }
}

/// Rectangles of pixels drawn one after another, round after round; the bytes read beyond the first round's.
std::uint64_t reads_beyond_compulsory(const RenderContext& context, unsigned width, unsigned height,
                                      unsigned rectangles) {
  CropBench crop(context, {}, 20);
  // Rectangles follow one another in tile order: one to each 16x16 tile, the larger over several.
  const unsigned tiles_x = (width + 15) / 16;
  for (unsigned round = 0; round < 6; ++round) {
    for (unsigned r = 0; r < rectangles; ++r) {
      const unsigned per_row = 1024 / (16 * tiles_x);
      const unsigned x0 = r % per_row * 16 * tiles_x;
      const unsigned y0 = r / per_row * ((height + 15) / 16) * 16;
      for (unsigned y = y0; y < y0 + height; y += 2) {
        for (unsigned x = x0; x < x0 + width; x += 2) {
          crop.quad({static_cast<std::uint16_t>(x / 16), static_cast<std::uint16_t>(y / 16)},
                    y % 16 / 2 * 8 + x % 16 / 2, 0.001F);
        }
      }
    }
  }
  crop.run();
  const std::uint64_t compulsory = std::uint64_t{width} * height * rectangles * bytes_per_pixel(context.format);
  EXPECT_GE(crop.memory.bytes_read, compulsory);
  return crop.memory.bytes_read - compulsory;
}

struct KneeShape {
  ColorFormat format;
  unsigned width, height, rectangles;  ///< the most that 16 KB hold
};

class CropKnee : public CropUnitTest, public ::testing::WithParamInterface<KneeShape> {};

TEST_P(CropKnee, ReadsStartAbove16KiloBytesWhateverTheShape) {
  const KneeShape& shape = GetParam();
  context.format = shape.format;
  EXPECT_EQ(shape.width * shape.height * shape.rectangles * bytes_per_pixel(shape.format), 16384U);
  EXPECT_EQ(reads_beyond_compulsory(context, shape.width, shape.height, shape.rectangles), 0U);
  EXPECT_GT(reads_beyond_compulsory(context, shape.width, shape.height, shape.rectangles + 1), 0U);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, CropKnee,
    ::testing::Values(KneeShape{ColorFormat::rgba16f, 8, 8, 32}, KneeShape{ColorFormat::rgba16f, 8, 16, 16},
                      KneeShape{ColorFormat::rgba16f, 16, 16, 8}, KneeShape{ColorFormat::rgba16f, 32, 64, 1},
                      KneeShape{ColorFormat::rgba16f, 64, 4, 8}, KneeShape{ColorFormat::rgba8, 8, 16, 32},
                      KneeShape{ColorFormat::rgba8, 16, 16, 16}, KneeShape{ColorFormat::rgba32f, 16, 16, 4}),
    [](const auto& shape) {
      const KneeShape& s = shape.param;
      return std::string(name_of(s.format)) + "_" + std::to_string(s.width) + "x" + std::to_string(s.height) + "x" +
             std::to_string(s.rectangles);
    });

TEST_F(CropUnitTest, ImageAndSignalsAreTheSameUnderAnyStallsAndMemory) {
  testing::terminate_early(context);
  context.termination = Termination::strict;
  std::vector<float> expected;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    CropBench crop(context,
                   {{"cache_bytes", seed % 2 == 0 ? "1024" : "16384"},
                    {"mshrs", seed % 3 == 0 ? "2" : "16"},
                    {"input_quads", seed % 5 == 0 ? "1" : "64"}},
                   static_cast<unsigned>(1 + seed * 7 % 300));
    for (std::uint64_t i = 0; i < 600; ++i) {
      crop.quad({static_cast<std::uint16_t>(mix(i) % 3), 0}, static_cast<unsigned>(mix(i + 999) % 64),
                testing::uniform(4, i, 0.2F, 0.95F), static_cast<LaneMask>(1 + mix(i + 5) % 15));
    }
    if (seed > 0) crop.bench.stall_randomly(seed, 90);
    if (seed > 0) crop.bench.shuffle_ticks(seed);
    ASSERT_NE(crop.run(), never) << seed;
    std::vector<float> got;
    unsigned pixels = 0;
    for (const auto& record : crop.signals.records()) {
      for (unsigned i = 0; i < record.item.count; ++i) pixels += popcount(record.item.signals[i].pixels);
    }
    unsigned terminated = 0;
    for (std::uint32_t y = 0; y < 16; ++y) {
      for (std::uint32_t x = 0; x < 48; ++x) {
        const auto pixel = crop.bench.surface().pixel(x, y);
        got.insert(got.end(), pixel.begin(), pixel.end());
        terminated += pixel[3] >= 0.996F;
      }
    }
    ASSERT_EQ(pixels, terminated) << seed;
    if (seed == 0) expected = got;
    ASSERT_EQ(got, expected) << seed;
    for (std::size_t i = crop.warps.size(); i > 0; --i) {
      ASSERT_EQ(crop.warps.erase(&crop.pool.take()), 1U) << "a blended warp is back in its pool";
    }
    ASSERT_TRUE(crop.bench.unit().idle());
  }
}

TEST_F(CropUnitTest, AMemoryOfAnotherMakeIsServedToTheEndWhateverItsRefresh) {
  draw = testing::draw_of(1024, 1024);
  context = testing::context_of(draw);
  Bench bench("crop", "color-rop", context, {{"cache_bytes", "1024"}});
  foreign::Dram dram("dram", sc_core::sc_time(1.5, sc_core::SC_NS), sc_core::sc_time(30, sc_core::SC_NS),
                     sc_core::sc_time(75, sc_core::SC_NS));
  bench.bind_memory(dram.socket);
  Source<ColorBeat>& color = bench.source<ColorBeat>("in_color", 8);
  bench.sink<TerminationBeat>("out_terminations", 64);
  ShadedWarpPool pool;
  for (unsigned i = 0; i < 2000; ++i) {
    ShadedWarp& warp = pool.take();
    warp.tile = {static_cast<std::uint16_t>(i / 4 * 7 % 64), static_cast<std::uint16_t>(i / 4 * 5 % 64)};
    warp.count = 1;
    warp.position[0] = static_cast<std::uint8_t>(i % 64);
    warp.live[0] = all_lanes;
    warp.first_primitive[0] = warp.last_primitive[0] = i + 1;
    warp.color[0] = testing::color_of(0.01F, 0.01F, 0.01F, 0.01F);
    ColorBeat beat;
    beat.quads[beat.count++] = {&warp, 0};
    color.add(beat);
  }
  ColorBeat last;
  last.mark = Mark::end_of_frame;
  color.add(last);
  bench.run();
  EXPECT_NE(bench.unit().end_of_frame(), never);
  EXPECT_EQ(bench.unit().occupancy().items(CropWork::blend), 2000U);
  EXPECT_GE(dram.requests, 2000U);
  EXPECT_EQ(dram.responses, dram.requests);
  EXPECT_GT(dram.out_of_order, 0U);
  EXPECT_TRUE(sc_core::sc_pending_activity()) << "its timer goes on";
}

TEST_F(CropUnitTest, ABenchNamesAMemoryThatFallsSilent) {
  Bench bench("crop", "color-rop", context);
  foreign::Dram dram("dram", sc_core::sc_time(1.5, sc_core::SC_NS), sc_core::sc_time(30, sc_core::SC_NS),
                     sc_core::sc_time(75, sc_core::SC_NS));
  dram.fall_silent_after(0);
  bench.bind_memory(dram.socket);
  ShadedWarpPool pool;
  ShadedWarp& warp = pool.take();
  warp.tile = {1, 0};
  warp.count = 1;
  warp.live[0] = all_lanes;
  ColorBeat beat;
  beat.quads[beat.count++] = {&warp, 0};
  bench.source<ColorBeat>("in_color").add(beat);
  try {
    bench.run();
    FAIL() << "it came to an end";
  } catch (const SimulationFault& fault) {
    EXPECT_NE(std::string(fault.what()).find("crop.memory"), std::string::npos) << fault.what();
  }
}

}  // namespace
}  // namespace vrpipe
