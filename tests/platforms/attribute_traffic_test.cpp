// Vertices and attributes that come from memory: on whole frames, at every fidelity with time.

#include <gtest/gtest.h>

#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/wiring.h>

#include "support/fidelities.h"
#include "support/foreign_memory.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::fidelities_with_time;
using testing::request_of;
using testing::run;
using testing::same_image;
using testing::statistic;
using testing::strictly;

Platform with_attribute_traffic(const std::string& name = "agx-orin-ideal-memory") {
  Platform platform = platform_named(name);
  platform.wire = [wire = platform.wire](Netlist& netlist) {
    wire(netlist);
    connect_attribute_traffic(netlist);
  };
  return platform;
}

RunRequest attribute_traffic_request(const Platform& platform, const std::string& variant, Fidelity fidelity,
                                     const std::function<void(RunRequest&)>& change = nullptr) {
  RunRequest request = request_of(variant, fidelity, change);
  request.platform = &platform;
  request.effects = EffectChoice::everything();
  return request;
}

TEST(AttributeTrafficOfAFrame, IsWhatItsSplatsAndPrimitivesNeed) {
  const std::uint32_t splats = 800;
  const Draw draw = testing::random_draw(128, 96, splats, 31);
  for (const char* name : {"agx-orin-ideal-memory", "desktop"}) {
    const Platform platform = with_attribute_traffic(name);
    for (const char* variant : {"baseline", "het+qm"}) {
      for (const Fidelity fidelity : fidelities_with_time()) {
        const std::string what = std::string(name) + " " + variant + " " + name_of(fidelity);
        const RunResult result = run(attribute_traffic_request(platform, variant, fidelity), draw);
        EXPECT_EQ(statistic(result, "l2.vertex_bytes_read"), splats * 48) << what;
        EXPECT_EQ(statistic(result, "l2.vertex_reads"), splats * 48 / 128) << what << ": whole lines";
        EXPECT_EQ(statistic(result, "l2.vertex_writes"), 0U) << what;
        EXPECT_EQ(statistic(result, "l2.attribute_bytes_written"), result.counts.primitives * 352) << what;
        EXPECT_LT(result.counts.primitives, 2 * splats) << "some are culled";

        // What the L1s lack comes from L2, and nothing else does.
        EXPECT_EQ(statistic(result, "l2.attribute_bytes_read"), statistic(result, "sm.l1.bytes_filled")) << what;
        EXPECT_EQ(32 * statistic(result, "sm.l1.sector_misses"), statistic(result, "sm.l1.bytes_filled")) << what;
        EXPECT_EQ(statistic(result, "sm.l1.sector_hits") + statistic(result, "sm.l1.sector_misses"),
                  statistic(result, "sm.l1.sector_accesses"))
            << what;
        // A warp reads two sectors of a primitive at least, and of eight at most.
        EXPECT_GE(statistic(result, "sm.l1.sector_accesses"), 2 * result.counts.warps) << what;
        EXPECT_LE(statistic(result, "sm.l1.sector_accesses"), 16 * result.counts.warps) << what;
        EXPECT_GT(statistic(result, "sm.l1.sector_hits"), 1000U) << what;
        EXPECT_EQ(statistic(result, "sm.l1.bytes_written_back"), 0U) << what;
      }
    }
  }
}

TEST(AttributeTrafficOfAFrame, ALargeL1OfOneCoreReadsEachPrimitiveOnce) {
  const Draw draw = testing::random_draw(96, 64, 300, 32);
  const Platform platform = with_attribute_traffic();
  for (const Fidelity fidelity : fidelities_with_time()) {
    const RunResult result =
        run(attribute_traffic_request(platform, "baseline", fidelity,
                                      [](RunRequest& request) {
                                        request.settings = {{"sm", "cores", "4"}, {"sm", "l1_bytes", "1048576"}};
                                      }),
            draw);
    EXPECT_EQ(statistic(result, "sm.l1.sector_misses"), statistic(result, "sm.l1.sector_misses_compulsory"));
    // Each core may read each primitive once; not every primitive has a quad.
    EXPECT_LE(statistic(result, "l2.attribute_bytes_read"), 4 * result.counts.primitives * 64);
    const RunResult small =
        run(attribute_traffic_request(platform, "baseline", fidelity,
                                      [](RunRequest& request) {
                                        request.settings = {{"sm", "cores", "4"}, {"sm", "l1_bytes", "1024"}};
                                      }),
            draw);
    EXPECT_GT(statistic(small, "l2.attribute_bytes_read"), statistic(result, "l2.attribute_bytes_read"));
  }
}

TEST(AttributeTrafficOfAFrame, ChangesNothingButTimeInStrictTermination) {
  const Draw draw = testing::random_draw(96, 96, 500, 33);
  for (const char* name : {"agx-orin-ideal-memory", "desktop"}) {
    const Platform platform = with_attribute_traffic(name);
    for (const char* variant : {"baseline", "qm", "het", "het+qm"}) {
      const RunResult expected = run(request_of(variant, Fidelity::functional,
                                                [&](RunRequest& request) {
                                                  strictly(request);
                                                  request.platform = &platform_named(name);
                                                }),
                                     draw);
      for (const Fidelity fidelity : fidelities_with_time()) {
        for (std::uint64_t seed = 0; seed < 3; ++seed) {
          const std::string what =
              std::string(name) + " " + variant + " " + name_of(fidelity) + " " + std::to_string(seed);
          const auto pick = [&](std::uint64_t salt, std::initializer_list<const char*> values) {
            return std::string(*(values.begin() + mix(seed * 16 + salt) % values.size()));
          };
          const RunResult result = run(
              attribute_traffic_request(platform, variant, fidelity,
                                        [&](RunRequest& request) {
                                          strictly(request);
                                          request.settings = {{"l2", "latency_cycles", pick(1, {"1", "146", "900"})},
                                                              {"l2", "bytes_per_cycle", pick(2, {"32", "128", "1024"})},
                                                              {"sm", "l1_bytes", pick(3, {"128", "1024", "49152"})},
                                                              {"sm", "l1_mshrs", pick(4, {"1", "8", "384"})},
                                                              {"sm", "l1_latency_cycles", pick(5, {"0", "38", "200"})},
                                                              {"sm", "attribute_writes", pick(6, {"1", "640"})},
                                                              {"sm", "attribute_bytes", pick(7, {"4", "40", "352"})}};
                                          if (fidelity != Fidelity::cycle) return;
                                          request.stall_seed = seed + 1;
                                          request.stall_per_256 = 40;
                                          request.tick_order_seed = seed + 7;
                                        }),
              draw);
          EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << what;
          EXPECT_EQ(result.counts.named(), expected.counts.named()) << what;
          // What runs ahead without time moves nothing, and what repeats it moves all.
          EXPECT_EQ(statistic(result, "l2.attribute_bytes_written"), result.counts.primitives * 352) << what;
          EXPECT_GE(statistic(result, "sm.l1.line_accesses"), result.counts.warps) << what;
        }
      }
    }
  }
}

TEST(AttributeTrafficOfAFrame, DoesNotDependOnTheOrderOfTicks) {
  const Draw draw = testing::random_draw(96, 64, 400, 34);
  const Platform platform = with_attribute_traffic();
  RunRequest request = attribute_traffic_request(platform, "het+qm", Fidelity::cycle);
  const RunResult expected = run(request, draw);
  for (std::uint64_t seed = 1; seed < 4; ++seed) {
    request.tick_order_seed = seed;
    const RunResult result = run(request, draw);
    EXPECT_EQ(result.result_hash, expected.result_hash);
    EXPECT_EQ(statistic(result, "sm.l1.sector_misses"), statistic(expected, "sm.l1.sector_misses"));
  }
}

TEST(AttributeTrafficOfAFrame, SlowerMemoryMakesASlowerFrame) {
  const Draw draw = testing::random_draw(96, 64, 1500, 35);
  const Platform platform = with_attribute_traffic();
  for (const Fidelity fidelity : fidelities_with_time()) {
    Cycle before = 0;
    for (const char* bytes : {"1024", "32"}) {
      const RunResult result = run(attribute_traffic_request(platform, "baseline", fidelity,
                                                             [&](RunRequest& request) {
                                                               request.settings = {{"l2", "bytes_per_cycle", bytes}};
                                                             }),
                                   draw);
      EXPECT_GT(*result.cycles, before) << bytes << " " << name_of(fidelity);
      before = *result.cycles;
      // The SM's port moves no more than it can.
      const std::uint64_t moved = statistic(result, "l2.vertex_bytes_read") +
                                  statistic(result, "l2.attribute_bytes_read") +
                                  statistic(result, "l2.attribute_bytes_written");
      EXPECT_GE(*result.cycles * std::stoull(bytes), moved) << bytes << " " << name_of(fidelity);
    }
  }
}

TEST(AttributeTrafficOfAFrame, TakesAMemoryOfAnotherMake) {
  const Draw draw = testing::random_draw(96, 64, 400, 36);
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.wire = [](Netlist& netlist) {
    wire_pipeline(netlist);
    connect_attribute_traffic(netlist);
    netlist.add_memory("dram", [](const std::string& name, unsigned) -> ForeignMemory {
      using sc_core::sc_time;
      auto dram = std::make_unique<foreign::Dram>(name.c_str(), sc_time(1, sc_core::SC_NS), sc_time(40, sc_core::SC_NS),
                                                  sc_time(70, sc_core::SC_NS));
      tlm::tlm_base_target_socket_b<32>& socket = dram->socket;
      return {std::move(dram), {&socket}};
    });
    netlist.connect_memory("l2", "dram");
  };
  const RunResult expected = run(request_of("het+qm", Fidelity::functional, strictly), draw);
  for (const Fidelity fidelity : fidelities_with_time()) {
    const RunResult result = run(attribute_traffic_request(platform, "het+qm", fidelity, strictly), draw);
    EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << name_of(fidelity);
    EXPECT_EQ(result.counts.named(), expected.counts.named()) << name_of(fidelity);
    // Attributes are written before they are read, so they are never fetched from below.
    EXPECT_GT(statistic(result, "l2.attribute_bytes_read"), 0U) << name_of(fidelity);
    EXPECT_LE(statistic(result, "l2.cache.bytes_filled"), 400U * 48 + 96 * 64 * 8) << name_of(fidelity);
  }
}

/// Behind an L2 that misses lies a DRAM; without time both count what is asked of them.
TEST(AttributeTrafficOfAFrame, GoesThroughAnL2ThatMissesAtEveryFidelity) {
  const std::uint32_t splats = 800;
  const Draw draw = testing::random_draw(96, 96, splats, 38);
  const Platform platform = with_attribute_traffic("agx-orin");
  for (const char* variant : {"baseline", "het+qm"}) {
    const RunResult expected = run(request_of(variant, Fidelity::functional, strictly), draw);
    const RunResult clocked = run(attribute_traffic_request(platform, variant, Fidelity::cycle, strictly), draw);
    for (const Fidelity fidelity : fidelities()) {
      const std::string what = std::string(variant) + " " + name_of(fidelity);
      const RunResult result = run(attribute_traffic_request(platform, variant, fidelity, strictly), draw);
      EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << what;
      EXPECT_EQ(result.counts.named(), expected.counts.named()) << what;
      EXPECT_EQ(statistic(result, "l2.vertex_bytes_read"), splats * 48) << what;
      EXPECT_EQ(statistic(result, "l2.attribute_bytes_written"), result.counts.primitives * 352) << what;
      EXPECT_EQ(statistic(result, "l2.attribute_bytes_read"), statistic(result, "sm.l1.bytes_filled")) << what;
      // Without time cores take other warps than where slots are full.
      const auto read = static_cast<double>(statistic(clocked, "l2.attribute_bytes_read"));
      EXPECT_NEAR(static_cast<double>(statistic(result, "l2.attribute_bytes_read")) / read, 1, 0.25) << what;
      if (fidelity != Fidelity::bound) continue;
      EXPECT_LE(*result.cycles, *clocked.cycles) << what;
    }
  }
}

TEST(AttributeTrafficOfAFrame, MayStayUnconnected) {
  const Draw draw = testing::random_draw(64, 64, 300, 37);
  for (const Fidelity fidelity : fidelities_with_time()) {
    const RunResult result = run(request_of("baseline", fidelity), draw);
    EXPECT_EQ(statistic(result, "l2.vertex_reads"), 0U);
    EXPECT_EQ(statistic(result, "l2.attribute_writes"), 0U);
    for (const StatisticReport& report : result.statistics) EXPECT_EQ(report.name.find("sm.l1"), std::string::npos);
  }
}

}  // namespace
}  // namespace vrpipe
