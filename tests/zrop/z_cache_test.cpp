// ZROP in front of a memory: its z-cache at cycle, by hand-computed timelines and against a cache by its definition.
#include <deque>
#include <map>
#include <numeric>
#include <set>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/testkit/bench.h>

#include "support/builders.h"
#include "support/fidelities.h"
#include "support/reference_cache.h"
#include "zrop/signals.h"
#include "zrop/zrop.h"

namespace vrpipe {
namespace {

using testing::beat_of;
using testing::end_beat;
using testing::signals;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

/// Answers each access after a fixed time and notes it.
class NotingMemory : public sc_core::sc_module, private tlm::tlm_fw_transport_if<> {
 public:
  NotingMemory(const sc_core::sc_module_name& name, const ClockDomain& clock, unsigned latency_cycles)
      : sc_module(name), socket("socket"), clock_(clock), latency_(latency_cycles) {
    socket.bind(*this);
  }
  struct Access {
    Cycle cycle;
    std::uint64_t address;
    unsigned bytes;
    bool written;
  };
  tlm::tlm_target_socket<32> socket;
  std::vector<Access> accesses;
  unsigned first_takes_longer = 0;  ///< cycles

  std::uint64_t bytes(bool written) const {
    std::uint64_t sum = 0;
    for (const Access& access : accesses) sum += access.written == written ? access.bytes : 0;
    return sum;
  }

 private:
  void note(const tlm::tlm_generic_payload& payload) {
    accesses.push_back({clock_.now(), payload.get_address(), payload.get_data_length(), payload.is_write()});
  }
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase&,
                                     sc_core::sc_time& delay) override {
    note(payload);
    delay += (latency_ + (accesses.size() == 1 ? first_takes_longer : 0)) * clock_.period();
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
    return tlm::TLM_COMPLETED;
  }
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    note(payload);
    delay += latency_ * clock_.period();
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
  }
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  const ClockDomain& clock_;
  const double latency_;
};

/// ZROP at cycle, with a latency of a cycle and without fast clears unless told, in front of a memory of 100 cycles.
struct ZBench {
  explicit ZBench(const RenderContext& context, const Bench::Settings& settings = {}, unsigned latency = 100,
                  unsigned depth = 32)
      : bench("zrop", "depth-stencil-rop", context, with_defaults(settings)),
        memory("noting_memory", bench.clock(), latency),
        in(bench.source<QuadBeat>("in_quads", depth)),
        updates(bench.source<TerminationBeat>("in_terminations", 16)),
        out(bench.sink<QuadBeat>("out_quads", 32)) {
    bench.bind_memory(memory.socket);
  }
  static Bench::Settings with_defaults(Bench::Settings settings) {
    settings.insert(settings.begin(), {{"latency_cycles", "1"}, {"fast_clear", "off"}});
    return settings;
  }
  /// In which beats left.
  std::vector<Cycle> left() const {
    std::vector<Cycle> cycles;
    for (const auto& record : out.records()) cycles.push_back(record.cycle);
    return cycles;
  }
  std::uint64_t statistic(const char* name) {
    for (const StatisticSet* part : bench.unit().parts()) {
      for (const Counter* counter : part->counters()) {
        if (std::string(counter->name()) == name) return counter->value();
      }
    }
    ADD_FAILURE() << "no statistic " << name;
    return 0;
  }
  double occupied(unsigned kind) { return testing::occupied(bench.unit(), kind, 1'000'000); }

  Bench bench;
  NotingMemory memory;
  Source<QuadBeat>& in;
  Source<TerminationBeat>& updates;
  Sink<QuadBeat>& out;
};

class ZCacheTest : public ::testing::Test {
 protected:
  ZCacheTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {
    testing::terminate_early(context);
  }
  Draw draw;
  RenderContext context;
};

// Of a screen tile, quads 0 and 1 are a sector, 8 and 9 the next one of the same line; 4 is in another line.

TEST(DepthStencilLayout, ALineIs8By4PixelsAndASector4By2) {
  const DepthStencilSurface surface(64, 48, 65536);
  std::set<std::uint64_t> seen;
  for (std::uint32_t y = 0; y < 48; y += 2) {
    for (std::uint32_t x = 0; x < 64; x += 2) {
      const TileId tile{static_cast<std::uint16_t>(x / 16), static_cast<std::uint16_t>(y / 16)};
      const std::uint64_t address = surface.address(tile, y % 16 / 2 * 8 + x % 16 / 2);
      EXPECT_TRUE(seen.insert(address).second);
      EXPECT_EQ(address % 16, 0U);
      EXPECT_GE(address, 65536U);
      EXPECT_LT(address, 65536U + 64 * 48 * 4);
      // Those of the corner of its sector and its line.
      const auto corner = [&](std::uint32_t width, std::uint32_t height) {
        const std::uint32_t left = x / width * width;
        const std::uint32_t top = y / height * height;
        return surface.address(tile, top % 16 / 2 * 8 + left % 16 / 2);
      };
      EXPECT_EQ(address / 32 * 32, corner(4, 2));
      EXPECT_EQ(address / 128 * 128, corner(8, 4));
    }
  }
}

TEST(DepthStencilLayout, IsPaddedToWholeScreenTilesInItsRegion) {
  Frame frame(65, 17);
  frame.draw(std::make_shared<const Draw>(testing::draw_of(65, 17)), {});
  const Framebuffer framebuffer(frame, ColorFormat::rgba16f);
  EXPECT_EQ(framebuffer.addresses.depth_stencil.bytes, 5U * 2 * 1024);
  EXPECT_EQ(framebuffer.depth_stencil.address({0, 0}, 0), framebuffer.addresses.depth_stencil.address);
  EXPECT_EQ(framebuffer.depth_stencil.address({4, 1}, 63) + 16, framebuffer.addresses.depth_stencil.end());
}

TEST_F(ZCacheTest, AMissWaitsForItsFill) {
  ZBench zrop(context);
  zrop.in.add(beat_of({0, 0}, {0, 1}), 10);  // in hand in 11, where the fill is asked for: there in 111
  zrop.in.add(beat_of({0, 0}, {0}), 150);    // hits
  zrop.bench.run();
  EXPECT_EQ(zrop.left(), (std::vector<Cycle>{112, 152}));
  ASSERT_EQ(zrop.memory.accesses.size(), 1U) << "a sector for both quads";
  EXPECT_EQ(zrop.memory.accesses[0].cycle, 11U);
  EXPECT_EQ(zrop.memory.accesses[0].bytes, 32U);
  EXPECT_EQ(zrop.statistic("sector_misses"), 1U);
  EXPECT_EQ(zrop.statistic("sector_hits"), 2U);
  EXPECT_EQ(testing::charged(zrop.bench.unit(), UnitState::memory, 1000), 100U) << "11 to 110";
}

TEST_F(ZCacheTest, FillsOverlapAndTestsKeepTheirOrder) {
  ZBench zrop(context);
  zrop.in.add(beat_of({0, 0}, {0}), 9);   // asked for in 10
  zrop.in.add(beat_of({0, 0}, {4}), 10);  // in 11
  zrop.in.add(beat_of({0, 0}, {0}), 11);  // on its way
  zrop.in.add(beat_of({0, 0}, {8}), 12);  // in 13: another sector of the first line
  zrop.bench.run();
  EXPECT_EQ(zrop.left(), (std::vector<Cycle>{111, 112, 112, 114})) << "two beats fit into a cycle";
  EXPECT_EQ(zrop.statistic("line_misses"), 2U);
  EXPECT_EQ(zrop.statistic("sector_misses"), 3U);
}

TEST_F(ZCacheTest, AnUpdateThatMissesWaitsForItsFillAndTestsGoBy) {
  ZBench zrop(context);
  zrop.in.add(beat_of({0, 0}, {0}), 10);
  zrop.updates.add(signals({4}), 200);     // looked up in 201: there in 301
  zrop.in.add(beat_of({0, 0}, {0}), 250);  // hits, and does not wait
  zrop.in.add(beat_of({0, 0}, {4}), 298);  // looked up in 299, there in 301; the update has its cycle first
  zrop.in.add(beat_of({0, 0}, {5}), 299);
  zrop.bench.run();
  EXPECT_EQ(zrop.left(), (std::vector<Cycle>{112, 252, 303}));
  EXPECT_EQ(zrop.bench.behaviour<DepthStencilRop>().quads_terminated.value(), 1U) << "tested in 302, after 301";
  EXPECT_DOUBLE_EQ(zrop.occupied(ZropWork::updates), 1);
}

TEST_F(ZCacheTest, AnUpdateMakesItsSectorDirtyWhichIsWrittenBackForAnotherLine) {
  ZBench zrop(context, {{"cache_bytes", "128"}});
  zrop.updates.add(signals({0}), 10);      // looked up in 11, applied in 111
  zrop.in.add(beat_of({0, 0}, {4}), 200);  // looked up in 201
  zrop.in.add(beat_of({0, 0}, {0}), 400);  // in 401, again
  zrop.bench.run();
  ASSERT_EQ(zrop.memory.accesses.size(), 4U);
  const std::uint64_t base = 64 * 1024;  // of the region behind colour
  EXPECT_EQ(zrop.memory.accesses[0].address, base);
  EXPECT_FALSE(zrop.memory.accesses[0].written);
  EXPECT_EQ(zrop.memory.accesses[1].address, base + 256);
  EXPECT_EQ(zrop.memory.accesses[1].cycle, 201U);
  EXPECT_TRUE(zrop.memory.accesses[2].written);
  EXPECT_EQ(zrop.memory.accesses[2].address, base) << "with the bit";
  EXPECT_EQ(zrop.memory.accesses[2].bytes, 32U);
  EXPECT_FALSE(zrop.memory.accesses[3].written) << "what was only read is not written back";
  EXPECT_EQ(zrop.bench.behaviour<DepthStencilRop>().quads_terminated.value(), 1U);
  EXPECT_EQ(zrop.statistic("sectors_written_back"), 1U);
}

TEST_F(ZCacheTest, ACycleThatMovesSectorsTestsNothing) {
  // Four sectors are a cycle's worth: two of the beat, asked for in 11, and those of updates, in 200 and 201.
  for (const bool fourth : {false, true}) {
    ZBench zrop(context, {{"sectors_per_cycle", "4"}});
    zrop.in.add(beat_of({0, 0}, {0, 4}), 10);
    for (unsigned i = 0; i < 6; ++i) zrop.in.add(beat_of({0, 0}, {0}), 198 + i);
    zrop.updates.add(signals({40}, {1, 0}), 199);
    if (fourth) zrop.updates.add(signals({44}, {1, 0}), 200);
    zrop.bench.run();
    // One is tested in 199, one in 200; what 201 moves for keeps the third, which goes with the fourth.
    EXPECT_EQ(zrop.left(), fourth ? (std::vector<Cycle>{112, 200, 201, 203, 203, 204, 205})
                                  : (std::vector<Cycle>{112, 200, 201, 202, 203, 204, 205}));
    EXPECT_DOUBLE_EQ(zrop.occupied(ZropWork::sectors), fourth ? 1 : 0);
  }
}

TEST_F(ZCacheTest, MissRegistersThatAreAllTakenHoldTheNextLookUp) {
  ZBench zrop(context, {{"mshrs", "1"}});
  zrop.in.add(beat_of({0, 0}, {0, 4}), 10);  // asked for in 11 and 111
  zrop.in.add(beat_of({0, 0}, {8}), 11);     // 211
  zrop.bench.run();
  EXPECT_EQ(zrop.left(), (std::vector<Cycle>{212, 312}));
  ASSERT_EQ(zrop.memory.accesses.size(), 3U);
  EXPECT_EQ(zrop.memory.accesses[1].cycle, 111U) << "blocked in 110, free in 111";
  EXPECT_EQ(zrop.memory.accesses[2].cycle, 211U);
}

TEST_F(ZCacheTest, WhereTagsRunAheadAMissRegisterIsFreeWhenItsSectorComesBeforeOthers) {
  ZBench zrop(context, {{"mshrs", "2"}, {"fetch_ahead_lines", "256"}});
  zrop.memory.first_takes_longer = 200;
  zrop.in.add(beat_of({0, 0}, {0}), 10);   // there in 311
  zrop.in.add(beat_of({0, 0}, {16}), 11);  // in 112
  zrop.in.add(beat_of({0, 0}, {32}), 12);
  zrop.bench.run();
  ASSERT_EQ(zrop.memory.accesses.size(), 3U);
  EXPECT_EQ(zrop.memory.accesses[2].cycle, 113U);
}

TEST_F(ZCacheTest, NoMoreSectorsAreOnTheirWayThanThereAreMissRegistersAlsoWhereTagsRunAhead) {
  for (const char* ahead : {"0", "256"}) {
    for (const unsigned registers : {1U, 2U, 3U, 8U}) {
      SCOPED_TRACE(std::string(ahead) + " lines ahead, " + std::to_string(registers) + " registers");
      ZBench zrop(context, {{"mshrs", std::to_string(registers)},
                            {"fetch_ahead_lines", ahead},
                            {"line_bytes", "512"},
                            {"cache_bytes", "4096"}});
      for (std::uint16_t tile = 0; tile < 4; ++tile) {
        for (unsigned beat = 0; beat < 4; ++beat) {
          std::vector<unsigned> positions(16);
          std::iota(positions.begin(), positions.end(), 16 * beat);
          QuadBeat rows = beat_of({tile, 0}, positions);
          for (Quad& quad : rows.quads) quad.splat = 4U * tile + beat;  // a primitive's are looked up together
          zrop.in.add(rows);
        }
      }
      zrop.bench.run();
      unsigned most = 0;
      for (const NotingMemory::Access& access : zrop.memory.accesses) {
        unsigned on_their_way = 0;
        for (const NotingMemory::Access& other : zrop.memory.accesses) {
          if (!other.written && other.cycle <= access.cycle && access.cycle < other.cycle + 100)
            on_their_way += other.bytes / 32;
        }
        most = std::max(most, on_their_way);
      }
      EXPECT_EQ(most, registers);
    }
  }
}

TEST_F(ZCacheTest, AFullQueueHoldsTheNextLookUp) {
  for (const unsigned quads : {1U, 2U, 4U}) {
    ZBench zrop(context, {{"input_quads", std::to_string(quads)}});
    zrop.in.add(beat_of({0, 0}, {0, 1}), 10);
    zrop.in.add(beat_of({0, 0}, {4, 5}), 11);
    zrop.bench.run();
    ASSERT_EQ(zrop.memory.accesses.size(), 2U);
    // The first is tested in 111, which frees its places for 112.
    EXPECT_EQ(zrop.memory.accesses[1].cycle, quads == 4 ? 12U : 112U) << quads;
  }
}

TEST_F(ZCacheTest, AFullQueueOfUpdatesHoldsTheNextLookUp) {
  for (const unsigned places : {1U, 2U}) {
    ZBench zrop(context, {{"input_updates", std::to_string(places)}});
    zrop.updates.add(signals({0, 4}), 10);
    zrop.bench.run();
    ASSERT_EQ(zrop.memory.accesses.size(), 2U);
    EXPECT_EQ(zrop.memory.accesses[1].cycle, places == 2 ? 12U : 112U) << places;
  }
}

TEST_F(ZCacheTest, ALineGoesOnceWhatABeatNeedsOfItHasCome) {
  // A beat that needs eight lines passes through a cache of one, and no test need take place for that.
  ZBench zrop(context, {{"cache_bytes", "128"}});
  zrop.out.close(0, 5000);
  zrop.in.add(beat_of({0, 0}, {0, 4, 16, 20, 32, 36, 48, 52}), 10);
  zrop.updates.add(signals({0}), 2000);
  zrop.bench.run();
  ASSERT_EQ(zrop.memory.accesses.size(), 9U);
  for (unsigned i = 0; i < 8; ++i) EXPECT_EQ(zrop.memory.accesses[i].cycle, 11 + i * 101U) << i;
  EXPECT_EQ(zrop.memory.accesses[8].cycle, 2001U) << "the update comes by";
  ASSERT_EQ(zrop.out.records().size(), 1U);
  EXPECT_EQ(zrop.out.records()[0].item.count, 8U);
}

TEST_F(ZCacheTest, AClearOfTerminationMovesNothingAndWhatIsCachedStays) {
  Frame frame(64, 64);
  DrawState state;
  state.early_termination = true;
  frame.draw(std::make_shared<const Draw>(testing::draw_of(64, 64)), state);
  frame.clear({false, true});
  frame.draw(std::make_shared<const Draw>(testing::draw_of(64, 64)), state);
  const RenderContext cleared = testing::context_of(frame);
  ZBench zrop(cleared);
  zrop.updates.add(signals({0}), 10);
  QuadBeat mark;
  mark.mark = Frame::mark_of(1);
  zrop.in.add(mark, 300);
  zrop.in.add(beat_of({0, 0}, {0}), 400);
  zrop.bench.run();
  EXPECT_EQ(zrop.memory.accesses.size(), 1U) << "the fill for the update";
  EXPECT_EQ(zrop.left(), (std::vector<Cycle>{302, 402}));
  EXPECT_EQ(zrop.bench.behaviour<DepthStencilRop>().quads_terminated.value(), 0U);
}

TEST_F(ZCacheTest, AFastClearSparesReadingWhatNothingWasWrittenBackTo) {
  ZBench zrop(context, {{"cache_bytes", "128"}, {"fast_clear", "on"}});
  zrop.in.add(beat_of({0, 0}, {0, 8}), 10);
  zrop.updates.add(signals({0}), 20);
  zrop.in.add(beat_of({0, 0}, {4}), 30);   // the sector of the update goes
  zrop.in.add(beat_of({0, 0}, {8}), 40);   // another one of its line
  zrop.in.add(beat_of({0, 0}, {0}), 50);   // its own
  zrop.in.add(beat_of({0, 0}, {4}), 300);  // went as it was
  zrop.bench.run();
  EXPECT_EQ(zrop.left(), (std::vector<Cycle>{12, 32, 42, 302}));
  ASSERT_EQ(zrop.memory.accesses.size(), 2U);
  EXPECT_TRUE(zrop.memory.accesses[0].written);
  EXPECT_EQ(zrop.memory.accesses[0].cycle, 32U) << "after the look-up";
  EXPECT_EQ(zrop.memory.accesses[1].address, 64U * 1024);
  EXPECT_EQ(zrop.memory.accesses[1].cycle, 51U);
  EXPECT_EQ(zrop.bench.behaviour<DepthStencilRop>().quads_terminated.value(), 1U);
  EXPECT_EQ(zrop.statistic("sector_misses"), 6U);
  EXPECT_EQ(zrop.statistic("sectors_as_cleared"), 5U);
  EXPECT_EQ(zrop.statistic("bytes_filled"), 32U);
}

/// Of what a frame keeps there: termination bits alone, or depth, too.
TEST_F(ZCacheTest, AClearOfAllThatAFrameTestsIsFast) {
  for (const bool tests_depth : {false, true}) {
    for (const bool clears_depth : {false, true}) {
      Frame frame(64, 64);
      DrawState state;
      state.early_termination = true;
      state.depth.test = tests_depth;
      state.depth.write = false;
      frame.draw(std::make_shared<const Draw>(testing::draw_of(64, 64)), state);
      Clear clear;
      clear.termination = true;
      clear.depth = clears_depth;
      frame.clear(clear);
      frame.draw(std::make_shared<const Draw>(testing::draw_of(64, 64)), state);
      const RenderContext cleared = testing::context_of(frame);
      ZBench zrop(cleared, {{"cache_bytes", "128"}, {"fast_clear", "on"}});
      zrop.updates.add(signals({0}), 10);
      zrop.updates.add(signals({4}), 20);
      QuadBeat mark;
      mark.mark = Frame::mark_of(1);
      zrop.in.add(mark, 300);
      zrop.updates.add(signals({0}), 400);
      zrop.bench.run();
      const bool is_fast = clears_depth || !tests_depth;
      EXPECT_EQ(zrop.memory.bytes(false), is_fast ? 0U : 32U) << tests_depth << clears_depth;
    }
  }
}

TEST_F(ZCacheTest, ADrawThatDoesNotTerminateEarlyReadsNothing) {
  Frame frame(64, 64);
  frame.draw(std::make_shared<const Draw>(testing::draw_of(64, 64)), {});
  const RenderContext plain = testing::context_of(frame);
  ZBench zrop(plain);
  zrop.in.add(beat_of({0, 0}, {0, 4}), 10);
  zrop.bench.run();
  EXPECT_EQ(zrop.left(), (std::vector<Cycle>{12}));
  EXPECT_TRUE(zrop.memory.accesses.empty());
}

/// Beats of random quads of random tiles, and updates, one at a time so that their order is known.
TEST_F(ZCacheTest, CountsAreThoseOfACacheByItsDefinition) {
  for (const unsigned kind : {0U, 1U, 2U}) {
    const bool fifo = kind == 1;
    const bool fast_clear = kind == 2;
    ZBench zrop(context, {{"cache_bytes", "1024"},
                          {"replacement", fifo ? "fifo" : "lru"},
                          {"tell_conflicts", "on"},
                          {"fast_clear", fast_clear ? "on" : "off"}});
    CacheOrganization organization;
    organization.bytes = 1024;
    organization.replacement = fifo ? Replacement::fifo : Replacement::lru;
    testing::ReferenceCache reference(organization);
    const DepthStencilSurface surface(64, 64, 64 * 1024);
    std::set<std::uint64_t> written;  // sectors
    std::uint64_t read = 0;
    const auto access = [&](std::uint64_t address) {
      const testing::ReferenceCache::Outcome outcome = reference.access(address, 16, false);
      for (const unsigned sector : outcome.written_back) written.insert(outcome.old_address / 32 + sector);
      for (const unsigned sector : outcome.missed) {
        read += !fast_clear || written.count(address / 128 * 4 + sector) > 0 ? 1U : 0U;
      }
    };
    Cycle at = 10;
    std::uint64_t accesses = 0;
    for (std::uint64_t i = 0; i < 600; ++i, at += 1200) {
      const TileId tile{static_cast<std::uint16_t>(mix(3 * i) % 2), static_cast<std::uint16_t>(mix(3 * i + 1) % 2)};
      const auto first = static_cast<unsigned>(mix(3 * i + 2) % 64);
      if (i % 3 == 0) {
        zrop.updates.add(signals({first}, tile), at);
        const std::uint64_t address = surface.address(tile, first);
        access(address);
        reference.make_dirty(address, {static_cast<unsigned>(address % 128 / 32)});
        ++accesses;
        continue;
      }
      std::vector<unsigned> positions;
      for (unsigned n = 0; n < 1 + i % 5; ++n) positions.push_back((first + n * n) % 64);
      QuadBeat beat;
      beat.tile = tile;
      for (const unsigned position : positions) {
        Quad quad{};
        quad.position = static_cast<std::uint8_t>(position);
        quad.coverage = all_lanes;
        beat.quads[beat.count++] = quad;
      }
      zrop.in.add(beat, at);
      // Line by line, in the order in which they are needed first.
      std::vector<std::uint64_t> lines;
      for (const unsigned position : positions) {
        const std::uint64_t line = surface.address(tile, position) / 128;
        if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(line);
      }
      for (const std::uint64_t line : lines) {
        for (const unsigned position : positions) {
          const std::uint64_t address = surface.address(tile, position);
          if (address / 128 == line) access(address);
        }
      }
      accesses += positions.size();
    }
    zrop.bench.run();
    EXPECT_EQ(zrop.statistic("line_accesses"), accesses);
    EXPECT_EQ(zrop.statistic("line_misses"), reference.line_misses);
    EXPECT_EQ(zrop.statistic("sector_hits"), reference.hits);
    EXPECT_EQ(zrop.statistic("sector_misses_compulsory"), reference.compulsory);
    EXPECT_EQ(zrop.statistic("sector_misses_capacity"), reference.capacity);
    EXPECT_EQ(zrop.statistic("sectors_written_back"), reference.written_back);
    EXPECT_GT(reference.capacity, 100U);
    EXPECT_GT(reference.written_back, 50U);
    EXPECT_EQ(zrop.memory.bytes(false), 32 * read);
    EXPECT_EQ(read + zrop.statistic("sectors_as_cleared"), reference.compulsory + reference.capacity);
    EXPECT_GT(read, 100U);
    EXPECT_EQ(zrop.memory.bytes(true), 32 * reference.written_back);
  }
}

/// Whatever the sizes, all that comes in goes through, in order, and bytes are conserved.
TEST_F(ZCacheTest, NeverStopsHoweverSmallItIs) {
  for (std::uint64_t seed = 0; seed < 120; ++seed) {
    const auto pick = [&](std::uint64_t salt, std::initializer_list<const char*> values) {
      return std::string(*(values.begin() + mix(seed * 16 + salt) % values.size()));
    };
    ZBench zrop(context,
                {{"cache_bytes", pick(1, {"128", "256", "1024"})},
                 {"mshrs", pick(2, {"1", "2", "64"})},
                 {"input_quads", pick(3, {"1", "17", "512"})},
                 {"input_updates", pick(4, {"1", "3", "64"})},
                 {"sectors_per_cycle", pick(5, {"1", "3", "16"})},
                 {"quads_per_cycle", pick(6, {"1", "5", "16"})},
                 {"updates_per_cycle", pick(7, {"1", "4"})}},
                static_cast<unsigned>(1 + mix(seed) % 60), static_cast<unsigned>(1 + seed % 3));
    std::uint32_t quads = 0;
    for (std::uint64_t i = 0; i < 60; ++i) {
      const TileId tile{static_cast<std::uint16_t>(mix(i + seed) % 3), 0};
      QuadBeat beat;
      beat.tile = tile;
      for (unsigned n = 0; n < 1 + mix(seed + 2 * i) % 16; ++n) {
        Quad quad{};
        quad.splat = quads++;
        quad.position = static_cast<std::uint8_t>(mix(quads) % 64);
        quad.coverage = all_lanes;
        beat.quads[beat.count++] = quad;
      }
      zrop.in.add(beat);
      zrop.updates.add(signals({static_cast<unsigned>(mix(seed ^ i) % 64), static_cast<unsigned>(i % 64)}, tile));
    }
    zrop.in.add(end_beat());
    zrop.bench.stall_randomly(seed, 110);
    zrop.bench.shuffle_ticks(seed + 1);
    zrop.bench.run();
    const auto& rop = zrop.bench.behaviour<DepthStencilRop>();
    std::uint64_t survivors = 0;
    std::uint32_t last = 0;
    for (const auto& record : zrop.out.records()) {
      for (unsigned n = 0; n < record.item.count; ++n) {
        ASSERT_GE(record.item.quads[n].splat, last) << "in order";
        last = record.item.quads[n].splat;
        ++survivors;
      }
    }
    ASSERT_EQ(survivors + rop.quads_terminated.value(), quads) << seed;
    ASSERT_EQ(rop.termination_updates.value(), 120U) << seed;
    ASSERT_TRUE(zrop.out.records().back().item.mark == Mark::end_of_frame) << seed;
    ASSERT_TRUE(zrop.bench.unit().idle()) << seed;
    ASSERT_EQ(zrop.statistic("bytes_filled"), zrop.memory.bytes(false)) << seed;
    ASSERT_EQ(zrop.statistic("bytes_written_back"), zrop.memory.bytes(true)) << seed;
    ASSERT_EQ(zrop.statistic("line_accesses"), quads + 120) << seed;
    ASSERT_EQ(zrop.statistic("sector_hits") + zrop.statistic("sector_misses"), quads + 120) << seed;
  }
}

TEST_F(ZCacheTest, WhatMakesNoCacheIsRefusedWhenTheUnitIsMade) {
  const auto refused = [&](const Bench::Settings& settings, const std::string& names) {
    try {
      Bench bench("zrop", "depth-stencil-rop", context, settings);
      ADD_FAILURE() << "accepted, " << names;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("(" + names + ")"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("unusable z-cache"), std::string::npos) << error.what();
    }
  };
  refused({{"cache_bytes", "5000"}}, "zrop.cache_bytes");
  refused({{"line_bytes", "96"}}, "zrop.line_bytes");
  refused({{"ways", "256"}}, "zrop.ways, zrop.cache_bytes");
  refused({{"ways", "48"}}, "zrop.ways, zrop.cache_bytes");
  refused({{"line_bytes", "64"}, {"sector_bytes", "128"}}, "zrop.sector_bytes, zrop.line_bytes");
  ZropParameters parameters;
  parameters.set("zrop", "sector_bytes", "16");
  EXPECT_NO_THROW(ZCache(parameters, DepthFormat::d24));
  EXPECT_THROW(ZCache(parameters, DepthFormat::d32f), UserError) << "of half a quad";
}

/// As ZBench, at lt.
struct TimedZBench {
  explicit TimedZBench(const RenderContext& context, const Bench::Settings& settings = {}, unsigned update_depth = 4,
                       unsigned update_latency = 1)
      : bench(Fidelity::lt, "zrop", "depth-stencil-rop", context, ZBench::with_defaults(settings)),
        memory("noting_memory", bench.clock(), 100),
        in(bench.source<BinItem>("in_quads", 64)),
        updates(bench.source<TerminationBeat>("in_terminations", update_depth, update_latency)),
        out(bench.sink<BinItem>("out_quads", 64)) {
    bench.bind_memory(memory.socket);
  }
  Bench bench;
  NotingMemory memory;
  Source<BinItem>& in;
  Source<TerminationBeat>& updates;
  Sink<BinItem>& out;
};

/// At lt a bin waits for its fills as its beats do at cycle.
class TimedZCacheTest : public ::testing::Test {
 protected:
  TimedZCacheTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {
    testing::terminate_early(context);
  }
  Draw draw;
  RenderContext context;
  testing::Bins bins;
};

TEST_F(TimedZCacheTest, AMissWaitsForItsFillAndAHitDoesNot) {
  TimedZBench zrop(context);
  zrop.in.add(bins.at({0, 0}, {0, 1}), 10);
  zrop.in.add(bins.at({0, 0}, {4}, 2), 20);
  zrop.in.add(bins.at({0, 0}, {0}, 3), 150);
  zrop.bench.run();
  EXPECT_EQ(testing::cycles_of(zrop.out), (std::vector<Cycle>{112, 122, 152}));
  EXPECT_EQ(zrop.memory.accesses.size(), 2U);
}

TEST_F(TimedZCacheTest, AFastClearSparesReadingWhatNothingWasWrittenBackTo) {
  TimedZBench zrop(context, {{"fast_clear", "on"}, {"cache_bytes", "128"}});
  zrop.in.add(bins.at({0, 0}, {0, 8}), 10);
  zrop.updates.add(signals({0}), 20);
  zrop.in.add(bins.at({0, 0}, {4}, 1), 130);
  zrop.in.add(bins.at({0, 0}, {8}, 2), 240);
  zrop.in.add(bins.at({0, 0}, {1}, 3), 350);
  zrop.bench.run();
  EXPECT_EQ(testing::cycles_of(zrop.out), (std::vector<Cycle>{12, 132, 242, 452}))
      << "the last one's sector was written back";
  EXPECT_EQ(zrop.memory.bytes(false), 32U);
  EXPECT_EQ(zrop.memory.bytes(true), 32U);
}

TEST_F(TimedZCacheTest, AnUpdateWaitsForItsFillAndTestsGoBy) {
  TimedZBench zrop(context);
  zrop.in.add(bins.at({0, 0}, {0}), 10);
  zrop.updates.add(signals({4}), 200);
  zrop.in.add(bins.at({0, 0}, {0}, 1), 250);
  zrop.in.add(bins.at({0, 0}, {5}, 2), 400);
  zrop.in.add(bins.at({0, 0}, {4}, 3), 500);
  zrop.bench.run();
  const auto& rop = zrop.bench.behaviour<DepthStencilRop>();
  EXPECT_EQ(testing::cycles_of(zrop.out), (std::vector<Cycle>{112, 252, 402, 502}));
  EXPECT_EQ(rop.quads_terminated.value(), 1U);
  EXPECT_EQ(zrop.memory.accesses.size(), 2U) << "the sector of the update is that of the last tests";
}

TEST_F(TimedZCacheTest, ATestSeesAnUpdateThatCameBehindItsLookUp) {
  for (const bool in_time : {true, false}) {
    TimedZBench zrop(context, {}, 4, 60);
    zrop.updates.add(signals({0}), in_time ? 10 : 70);  // visible in 70 or 130
    zrop.in.add(bins.at({0, 0}, {0}), 20);              // looked up in 21, tested in 121
    zrop.bench.run();
    EXPECT_EQ(zrop.bench.behaviour<DepthStencilRop>().quads_terminated.value(), in_time ? 1U : 0U);
    EXPECT_EQ(zrop.memory.accesses.size(), 1U) << "the sector is fetched once";
  }
}

TEST_F(TimedZCacheTest, ATestThatHasComeWaitsForAllUpdatesThatFollowOneAnother) {
  for (const unsigned updates : {1U, 5U}) {
    TimedZBench zrop(context, {}, 8, 110);
    // Of the sector that the test waits for, one a cycle from 121 on.
    for (unsigned i = 0; i < updates; ++i) zrop.updates.add(signals({1}), 11 + i);
    zrop.in.add(bins.at({0, 0}, {0}), 20);  // looked up in 21, there in 121
    zrop.bench.run();
    EXPECT_EQ(testing::cycles_of(zrop.out), (std::vector<Cycle>{122 + updates}));
  }
}

TEST_F(TimedZCacheTest, UpdatesThatWaitForTheirFillsTakeOneCycleEach) {
  TimedZBench zrop(context, {}, 4, 90);
  zrop.updates.add(signals({0, 1, 0, 1}), 11);  // looked up from 101 on, by the fill of the test there in 121
  zrop.in.add(bins.at({0, 0}, {0}), 20);
  zrop.bench.run();
  EXPECT_EQ(testing::cycles_of(zrop.out), (std::vector<Cycle>{126}));
}

TEST_F(TimedZCacheTest, AFullQueueOfUpdatesHoldsTheLink) {
  for (const unsigned places : {1U, 2U}) {
    TimedZBench zrop(context, {{"input_updates", std::to_string(places)}}, 1);
    zrop.in.add(bins.at({0, 0}, {16}), 10);  // by which it is known how long a fill takes
    for (const unsigned position : {0U, 4U, 32U}) zrop.updates.add(signals({position}), 200);
    zrop.bench.run();
    // The first is in the queue from 201 to 301.
    EXPECT_EQ(zrop.updates.sent().at(2), places == 2 ? 204U : 303U) << places;
  }
}

/// A bin of primitives that each cover some of one or two raster tiles.
std::vector<Quad> random_bin(std::uint32_t number) {
  const auto below = [&](unsigned salt, std::uint64_t count) {
    return static_cast<unsigned>(mix(number * 1000U + salt) % count);
  };
  std::vector<Quad> quads;
  const unsigned primitives = 2 + below(0, 10);
  for (unsigned primitive = 0; primitive < primitives; ++primitive) {
    const unsigned tiles = 1 + below(10 * primitive + 1, 2);
    for (unsigned tile = 0; tile < tiles; ++tile) {
      const unsigned part = below(10 * primitive + 2 + tile, 4);
      const unsigned count = 3 + below(10 * primitive + 5 + tile, 13);
      for (unsigned i = 0; i < count; ++i) {
        const unsigned position = (i / 4 + 4 * (part / 2)) * quads_per_tile_row + i % 4 + 4 * (part % 2);
        quads.push_back({100 * number + primitive, static_cast<std::uint8_t>(position), all_lanes, 0, 0});
      }
    }
  }
  return quads;
}

// What is looked up and tested together is a primitive's in a beat, also where that is wider than the unit.
TEST_F(TimedZCacheTest, WhereTagsRunAheadBinsAreTestedAboutInTheCyclesOfCycle) {
  const Draw wide = testing::draw_of(512, 512);
  RenderContext of_wide = testing::context_of(wide);
  testing::terminate_early(of_wide);
  for (const unsigned rate : {8U, 16U}) {
    const Bench::Settings settings{
        {"latency_cycles", "1"},      {"fast_clear", "off"},   {"quads_per_cycle", std::to_string(rate)},
        {"line_bytes", "512"},        {"mshrs", "2048"},       {"sectors_per_cycle", "64"},
        {"fetch_ahead_lines", "256"}, {"cache_bytes", "16384"}};
    const auto last_at = [&](Fidelity fidelity) {
      Bench bench(fidelity, "zrop", "depth-stencil-rop", of_wide, settings);
      NotingMemory memory("noting_memory", bench.clock(), 100);
      bench.bind_memory(memory.socket);
      bench.source<TerminationBeat>("in_terminations");
      Source<BinItem>* const bins_in = fidelity == Fidelity::lt ? &bench.source<BinItem>("in_quads", 64) : nullptr;
      Source<QuadBeat>* const beats_in = fidelity == Fidelity::lt ? nullptr : &bench.source<QuadBeat>("in_quads", 64);
      if (beats_in != nullptr) beats_in->set_rate(1);
      if (bins_in != nullptr) bins_in->set_rate(1);
      for (std::uint32_t number = 0; number < 60; ++number) {
        const std::vector<Quad> quads = random_bin(number);
        const auto count = static_cast<unsigned>(quads.size());
        const unsigned beats = (count + QuadBeat::capacity - 1) / QuadBeat::capacity;
        const TileId tile{static_cast<std::uint16_t>(mix(number) % 32),
                          static_cast<std::uint16_t>(mix(number) / 32 % 8)};
        if (bins_in != nullptr) bins_in->add(bins.of(tile, quads), {0, beats - 1}, beats);
        for (unsigned from = 0; beats_in != nullptr && from < count; from += QuadBeat::capacity) {
          QuadBeat beat;
          beat.tile = tile;
          beat.last_of_bin = from + QuadBeat::capacity >= count;
          for (unsigned i = from; i < std::min(from + QuadBeat::capacity, count); ++i)
            beat.quads[beat.count++] = quads[i];
          beats_in->add(beat);
        }
      }
      if (bins_in != nullptr) {
        const Sink<BinItem>& out = bench.sink<BinItem>("out_quads", 256);
        bench.run();
        return out.records().back().last;
      }
      const Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 256);
      bench.run();
      return out.records().back().cycle;
    };
    const auto at_cycle = static_cast<double>(last_at(Fidelity::cycle));
    EXPECT_NEAR(static_cast<double>(last_at(Fidelity::lt)), at_cycle, 0.015 * at_cycle) << rate;
  }
}

}  // namespace
}  // namespace vrpipe
