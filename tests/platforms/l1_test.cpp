// An L1 of its own between an SM array and the L2, instead of those in the cores: on whole frames, at every fidelity.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/wiring.h>

#include "support/foreign_memory.h"
#include "support/recorded_traffic.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::LookUps;
using testing::replay;
using testing::Replayed;
using testing::request_of;
using testing::run;
using testing::same_image;
using testing::statistic;
using testing::strictly;

/// A platform whose SM arrays have nothing of their own between them and memory, and an L1 there if `implementation` is
/// given.
Platform without_own_l1s(const std::string& name, const char* implementation = nullptr) {
  Platform platform = platform_named(name);
  platform.settings.push_back({"sm", "l1_bytes", "0"});
  platform.wire = [wire = platform.wire, implementation](Netlist& netlist) {
    wire(netlist);
    connect_attribute_traffic(netlist);
    if (implementation != nullptr) insert_l1(netlist, implementation);
  };
  return platform;
}
Platform with_l1(const std::string& name) { return without_own_l1s(name, "sectored-cache"); }

RunRequest on(const Platform& platform, const std::string& variant, Fidelity fidelity,
              std::vector<Setting> settings = {}) {
  RunRequest request = request_of(variant, fidelity);
  request.platform = &platform;
  request.settings = std::move(settings);
  request.effects = EffectChoice::everything();
  return request;
}

/// 64 lines in sets of 4.
const std::vector<Setting> small_l1 = {{"l1", "bytes", "8192"}, {"l1", "ways", "4"}, {"l1", "banks", "4"}};

bool has_statistic(const RunResult& result, const std::string& prefix) {
  return std::any_of(result.statistics.begin(), result.statistics.end(),
                     [&](const StatisticReport& report) { return report.name.rfind(prefix, 0) == 0; });
}

TEST(L1OfAnArray, StandsBetweenItAndTheL2) {
  Netlist netlist(1);
  wire_pipeline(netlist);
  EXPECT_THROW(insert_l1(netlist), UserError) << "bound to nothing";
  Netlist connected(2);
  wire_pipeline(connected);
  connect_attribute_traffic(connected);
  insert_l1(connected);
  EXPECT_EQ(connected.bound_to("gpc1.l1"), std::vector<std::string>{"gpc1.sm"});
  EXPECT_EQ(connected.bound_to("l2"), (std::vector<std::string>{"gpc0.crop", "gpc1.crop", "gpc0.l1", "gpc1.l1"}));
}

TEST(L1OfAnArray, PassesOnWhatItLacksAndWhatIsWritten) {
  const std::uint32_t splats = 800;
  const Draw draw = testing::random_draw(128, 96, splats, 41);
  for (const char* name : {"agx-orin", "desktop"}) {
    const Platform platform = with_l1(name);
    for (const char* variant : {"baseline", "het+qm"}) {
      for (const Fidelity fidelity : fidelities()) {
        const std::string what = std::string(name) + " " + variant + " " + name_of(fidelity);
        const RunResult result = run(on(platform, variant, fidelity, small_l1), draw);
        EXPECT_EQ(statistic(result, "l1.vertex_bytes_read"), splats * 48) << what;
        EXPECT_EQ(statistic(result, "l1.attribute_bytes_written"), result.counts.primitives * 352) << what;
        EXPECT_EQ(statistic(result, "l1.cache.bytes_filled"), 32 * statistic(result, "l1.cache.sector_misses")) << what;
        EXPECT_EQ(statistic(result, "l1.cache.bytes_written_back"), 0U) << what;
        EXPECT_EQ(32 * statistic(result, "l1.attribute_sectors"), statistic(result, "l1.attribute_bytes_read")) << what;
        EXPECT_GT(statistic(result, "l1.attribute_sectors"), 2 * statistic(result, "l1.attribute_sector_misses"))
            << what;
        // Each reads its pieces of a primitive for itself.
        EXPECT_GE(statistic(result, "l1.attribute_bytes_read"), 2 * 32 * result.counts.warps) << what;
        EXPECT_EQ(statistic(result, "l1.color_reads"), 0U) << what;
        EXPECT_FALSE(has_statistic(result, "sm.l1")) << what;
        // Without time an L2 that holds everything is not asked.
        if (!has_statistic(result, "l2.")) continue;
        EXPECT_EQ(statistic(result, "l2.attribute_bytes_read"), 32 * statistic(result, "l1.attribute_sector_misses"))
            << what;
        EXPECT_EQ(statistic(result, "l2.vertex_bytes_read"), 32 * statistic(result, "l1.vertex_sector_misses")) << what;
        EXPECT_EQ(statistic(result, "l2.attribute_bytes_written"), result.counts.primitives * 352) << what;
        if (std::string(name) == "desktop") continue;
        EXPECT_EQ(statistic(result, "l2.cache.bytes_filled"), statistic(result, "dram.color_bytes_read") +
                                                                  statistic(result, "dram.depth_stencil_bytes_read") +
                                                                  statistic(result, "dram.vertex_bytes_read"))
            << what << ": attributes were written before";
      }
    }
  }
}

TEST(L1OfAnArray, ThatHoldsThemAllReadsEachSectorOfAttributesOnce) {
  const Draw draw = testing::random_draw(96, 64, 300, 42);
  const Platform platform = with_l1("agx-orin");
  for (const char* variant : {"baseline", "het+qm"}) {
    for (const Fidelity fidelity : fidelities()) {
      const std::string what = std::string(variant) + " " + name_of(fidelity);
      const RunResult result = run(on(platform, variant, fidelity), draw);
      EXPECT_EQ(statistic(result, "l1.cache.sector_misses"), statistic(result, "l1.cache.sector_misses_compulsory"))
          << what;
      // Two sectors of each primitive that has a quad, whichever cores want it.
      EXPECT_LE(statistic(result, "l2.attribute_bytes_read"), result.counts.primitives * 64) << what;
      EXPECT_GT(statistic(result, "l2.attribute_bytes_read"), result.counts.primitives * 20) << what;
      const RunResult few = run(on(platform, variant, fidelity, small_l1), draw);
      EXPECT_GT(statistic(few, "l2.attribute_bytes_read"), statistic(result, "l2.attribute_bytes_read")) << what;
    }
  }
}

// The L2 of desktop takes as long for any address, so the buffer's size decides nothing else.
TEST(L1OfAnArray, HitsNothingThatAnotherArrayHasOverwritten) {
  const Draw draw = testing::random_draw(128, 96, 1500, 50);
  const Platform platform = with_l1("desktop");
  for (const char* variant : {"baseline", "het+qm"}) {
    for (const Fidelity fidelity : fidelities()) {
      const std::string what = std::string(variant) + " " + name_of(fidelity);
      const RunResult rounds = run(on(platform, variant, fidelity, {{"sm", "attribute_buffer_bytes", "65536"}}), draw);
      const RunResult none = run(on(platform, variant, fidelity, {{"sm", "attribute_buffer_bytes", "67108864"}}), draw);
      ASSERT_GT(statistic(rounds, "l1.attribute_bytes_written"), 8U * 65536) << what;
      EXPECT_EQ(rounds.result_hash, none.result_hash) << what;
      EXPECT_EQ(statistic(rounds, "l1.attribute_sector_misses"), statistic(none, "l1.attribute_sector_misses")) << what;
      EXPECT_EQ(statistic(rounds, "l1.cache.sector_misses_compulsory"),
                statistic(none, "l1.cache.sector_misses_compulsory"))
          << what;
    }
  }
}

TEST(L1OfAnArray, MissesWhatACacheByItsDefinitionMisses) {
  LookUps& look_ups = testing::record_look_ups("l1");
  const Platform platform = without_own_l1s("agx-orin", "recorded");
  for (const char* variant : {"baseline", "het+qm"}) {
    for (const char* replacement : {"lru", "fifo"}) {
      for (const std::uint32_t kilobytes : {8U, 64U}) {
        const std::string what = std::string(variant) + " " + replacement + " " + std::to_string(kilobytes) + " KB";
        look_ups.events.clear();
        std::vector<Setting> settings = small_l1;
        settings.push_back({"l1", "bytes", std::to_string(kilobytes * 1024)});
        settings.push_back({"l1", "replacement", replacement});
        const RunResult result =
            run(on(platform, variant, Fidelity::cycle, settings), testing::random_draw(256, 160, 900, 43));
        CacheOrganization organization;
        organization.bytes = kilobytes * 1024;
        organization.ways = 4;
        organization.replacement = std::string(replacement) == "fifo" ? Replacement::fifo : Replacement::lru;
        Replayed expected = replay(organization, look_ups.events, true, false);
        const testing::Counted attributes = expected.of[MemoryTraffic::attribute];
        const testing::Counted vertices = expected.of[MemoryTraffic::vertex];
        EXPECT_EQ(statistic(result, "l1.attribute_sectors"), attributes.needed) << what;
        EXPECT_EQ(statistic(result, "l1.attribute_sector_misses"), attributes.missed) << what;
        EXPECT_EQ(statistic(result, "l1.vertex_sector_misses"), vertices.missed) << what;
        EXPECT_EQ(statistic(result, "l1.cache.sector_misses"), attributes.missed + vertices.missed) << what;
        EXPECT_EQ(statistic(result, "l2.attribute_bytes_read"), 32 * attributes.filled) << what;
        EXPECT_EQ(statistic(result, "l2.vertex_bytes_read"), 32 * vertices.filled) << what;
        EXPECT_EQ(attributes.written_back + vertices.written_back, 0U) << what;
        // What is asked for is what is looked up.
        EXPECT_EQ(32 * attributes.needed, statistic(result, "l1.attribute_bytes_read")) << what;
        EXPECT_GT(attributes.missed, 2000U) << what;
        EXPECT_GT(attributes.needed, 2 * attributes.missed) << what;
      }
    }
  }
}

TEST(L1OfAnArray, ChangesNothingButTimeInStrictTermination) {
  const Draw draw = testing::random_draw(96, 96, 500, 44);
  for (const char* name : {"agx-orin", "desktop"}) {
    const Platform platform = with_l1(name);
    const Platform none = without_own_l1s(name);
    for (const char* variant : {"baseline", "qm", "het", "het+qm"}) {
      const RunResult expected = run(request_of(variant, Fidelity::functional,
                                                [&](RunRequest& request) {
                                                  strictly(request);
                                                  request.platform = &platform_named(name);
                                                }),
                                     draw);
      for (const Fidelity fidelity : fidelities()) {
        for (std::uint64_t seed = 0; seed < 3; ++seed) {
          const std::string what =
              std::string(name) + " " + variant + " " + name_of(fidelity) + " " + std::to_string(seed);
          const auto pick = [&](std::uint64_t salt, std::initializer_list<const char*> values) {
            return std::string(*(values.begin() + mix(seed * 16 + salt) % values.size()));
          };
          RunRequest request =
              on(seed == 2 ? none : platform, variant, fidelity, {{"sm", "l1_mshrs", pick(4, {"1", "8", "384"})}});
          strictly(request);
          if (seed < 2) {
            const std::vector<Setting> of_l1 = {{"l1", "latency_cycles", pick(1, {"1", "38", "900"})},
                                                {"l1", "bytes", pick(2, {"1024", "786432"})},
                                                {"l1", "ways", "2"},
                                                {"l1", "banks", pick(3, {"1", "4"})},
                                                {"l1", "mshrs", pick(5, {"1", "96"})},
                                                {"l1", "write_backs", pick(6, {"1", "32"})},
                                                {"l1", "write_policy", pick(7, {"write-through", "write-back"})},
                                                {"l1", "port_requests", pick(8, {"1", "512"})}};
            request.settings.insert(request.settings.end(), of_l1.begin(), of_l1.end());
          }
          if (fidelity == Fidelity::cycle) {
            request.stall_seed = seed + 1;
            request.stall_per_256 = 40;
            request.tick_order_seed = seed + 7;
          }
          const RunResult result = run(request, draw);
          EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << what;
          EXPECT_EQ(result.counts.named(), expected.counts.named()) << what;
          if (seed < 2) {
            EXPECT_GT(statistic(result, "l1.cache.sector_hits"), 1000U) << what;
          }
        }
      }
    }
  }
}

TEST(L1OfAnArray, DoesNotDependOnTheOrderOfTicks) {
  const Draw draw = testing::random_draw(96, 64, 400, 45);
  const Platform platform = with_l1("agx-orin");
  RunRequest request = on(platform, "het+qm", Fidelity::cycle, small_l1);
  const RunResult expected = run(request, draw);
  for (std::uint64_t seed = 1; seed < 4; ++seed) {
    request.tick_order_seed = seed;
    const RunResult result = run(request, draw);
    EXPECT_EQ(result.result_hash, expected.result_hash);
    EXPECT_EQ(statistic(result, "l1.cache.sector_misses"), statistic(expected, "l1.cache.sector_misses"));
  }
}

TEST(L1OfAnArray, ThatIsSlowMakesASlowFrame) {
  const Draw draw = testing::random_draw(96, 64, 1500, 46);
  const Platform platform = with_l1("agx-orin");
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    const RunResult usual = run(on(platform, "baseline", fidelity), draw);
    const RunResult one_bank =
        run(on(platform, "baseline", fidelity, {{"l1", "banks", "1"}, {"l1", "bank_bytes_per_cycle", "16"}}), draw);
    EXPECT_GT(*one_bank.cycles, *usual.cycles) << name_of(fidelity);
    // It passes 16 bytes a cycle at most, whatever goes through.
    EXPECT_GE(16 * *one_bank.cycles, statistic(one_bank, "l1.attribute_bytes_read")) << name_of(fidelity);
    ASSERT_TRUE(one_bank.bottleneck);
    EXPECT_EQ(one_bank.bottleneck->unit, "gpc0.l1") << name_of(fidelity);
    EXPECT_GT(testing::utilization(usual, "l1"), 0) << name_of(fidelity);
  }
}

// As the mark of the fidelity ladder.
TEST(L1OfAnArray, TakesAsLongAtEachFidelity) {
  const Draw draw = testing::random_draw(192, 128, 3000, 47);
  const Platform platform = with_l1("agx-orin");
  for (const char* variant : {"baseline", "het+qm"}) {
    const std::vector<Setting> usual;
    const std::vector<Setting> one_bank = {{"l1", "banks", "1"}, {"l1", "bank_bytes_per_cycle", "16"}};
    for (const std::vector<Setting>& settings : {usual, small_l1, one_bank}) {
      const auto cycles = [&](Fidelity fidelity) {
        return static_cast<double>(*run(on(platform, variant, fidelity, settings), draw).cycles);
      };
      const double cycle = cycles(Fidelity::cycle);
      const std::string what = std::string(variant) + (settings.empty() ? "" : " " + settings[0].parameter);
      EXPECT_NEAR(cycles(Fidelity::lt) / cycle, 1, 0.10) << what;
      EXPECT_LE(cycles(Fidelity::bound), cycle) << what;
    }
  }
}

TEST(L1OfAnArray, MayBeAMemoryOfAnotherMake) {
  const Draw draw = testing::random_draw(96, 64, 400, 48);
  Platform platform = with_l1("agx-orin");
  std::uint64_t requests = 0;
  class Dram final : public foreign::Dram {
   public:
    Dram(const std::string& name, std::uint64_t& count)
        : foreign::Dram(name.c_str(), sc_core::sc_time(1, sc_core::SC_NS), sc_core::sc_time(40, sc_core::SC_NS),
                        sc_core::sc_time(70, sc_core::SC_NS)),
          count_(count) {}
    ~Dram() override { count_ = requests; }

   private:
    std::uint64_t& count_;
  };
  platform.wire = [wire = platform.wire, &requests](Netlist& netlist) {
    wire(netlist);
    netlist.replace_memory("gpc0.l1", [&requests](const std::string& name, unsigned) -> ForeignMemory {
      auto dram = std::make_unique<Dram>(name, requests);
      tlm::tlm_base_target_socket_b<32>& socket = dram->socket;
      return {std::move(dram), {&socket}};
    });
  };
  RunRequest functional = request_of("het+qm", Fidelity::functional, strictly);
  const RunResult expected = run(functional, draw);
  for (const Fidelity fidelity : fidelities()) {
    RunRequest request = on(platform, "het+qm", fidelity);
    strictly(request);
    requests = 0;
    const RunResult result = run(request, draw);
    EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << name_of(fidelity);
    EXPECT_EQ(result.counts.named(), expected.counts.named()) << name_of(fidelity);
    const bool has_time = fidelity != Fidelity::functional && fidelity != Fidelity::bound;
    EXPECT_EQ(requests > 2 * result.counts.warps, has_time) << name_of(fidelity);
    EXPECT_EQ(statistic(result, "l2.attribute_reads"), 0U) << name_of(fidelity);
  }
}

TEST(L1OfAnArray, MayBeMissing) {
  const Draw draw = testing::random_draw(96, 64, 400, 49);
  const Platform none = without_own_l1s("agx-orin");
  const Platform usual = platform_named("agx-orin");
  for (const Fidelity fidelity : fidelities()) {
    const RunResult result = run(on(none, "baseline", fidelity), draw);
    const RunResult cached = run(on(usual, "baseline", fidelity), draw);
    // All that the embedded ones were asked for.
    EXPECT_EQ(statistic(result, "l2.attribute_bytes_read"), 32 * statistic(cached, "sm.l1.sector_accesses"))
        << name_of(fidelity);
    EXPECT_FALSE(has_statistic(result, "sm.l1")) << name_of(fidelity);
    EXPECT_FALSE(has_statistic(result, "l1.")) << name_of(fidelity);
  }
}

}  // namespace
}  // namespace vrpipe
