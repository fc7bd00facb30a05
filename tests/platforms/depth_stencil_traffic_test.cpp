// The z-cache of ZROP, connected to memory: on whole frames, at every fidelity.

#include <map>

#include <gtest/gtest.h>

#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/wiring.h>
#include <vrpipe/workloads/microbench.h>
#include <vrpipe/workloads/scene.h>

#include "support/fidelities.h"
#include "support/foreign_memory.h"
#include "support/measured_scenes.h"
#include "support/mixed_frames.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::fidelities_with_time;
using testing::request_of;
using testing::run;
using testing::same_image;
using testing::statistic;
using testing::strictly;

Platform with_z_traffic(const std::string& name = "agx-orin-ideal-memory") {
  Platform platform = platform_named(name);
  platform.wire = [wire = platform.wire](Netlist& netlist) {
    wire(netlist);
    connect_depth_stencil_traffic(netlist);
  };
  return platform;
}

RunRequest z_traffic_request(const Platform& platform, const std::string& variant, Fidelity fidelity,
                             const std::function<void(RunRequest&)>& change = nullptr) {
  RunRequest request = request_of(variant, fidelity, change);
  request.platform = &platform;
  request.effects = EffectChoice::everything();
  // What is missed is read, unless a test says otherwise.
  request.settings.insert(request.settings.begin(), {"zrop", "fast_clear", "off"});
  return request;
}

/// Splats over most of the image, so opaque that pixels terminate.
Draw terminating_draw(std::uint32_t width, std::uint32_t height, std::uint32_t splats, std::uint64_t seed) {
  Draw draw = testing::random_draw(width, height, splats, seed);
  const auto w = static_cast<float>(width);
  const auto h = static_cast<float>(height);
  for (unsigned i = 0; i < 6; ++i) draw.splats.push_back(testing::round_splat(w / 2, h / 2, w + h, 0.95F));
  const Draw behind = testing::random_draw(width, height, splats, seed + 1);
  draw.splats.insert(draw.splats.end(), behind.splats.begin(), behind.splats.end());
  return draw;
}

TEST(DepthStencilTraffic, IsWhatTheZCachesMove) {
  const Draw draw = terminating_draw(160, 128, 600, 41);
  for (const char* name : {"agx-orin-ideal-memory", "desktop"}) {
    const Platform platform = with_z_traffic(name);
    for (const char* variant : {"het", "het+qm"}) {
      for (const Fidelity fidelity : fidelities_with_time()) {
        const std::string what = std::string(name) + " " + variant + " " + name_of(fidelity);
        const RunResult result = run(z_traffic_request(platform, variant, fidelity,
                                                       [](RunRequest& request) {
                                                         request.settings = {{"zrop", "cache_bytes", "4096"}};
                                                       }),
                                     draw);
        // An access for each quad that is tested and for each update, of one sector.
        const std::uint64_t accesses =
            statistic(result, "zrop.quads_tested") + statistic(result, "zrop.termination_updates");
        EXPECT_EQ(statistic(result, "zrop.cache.line_accesses"), accesses) << what;
        EXPECT_EQ(statistic(result, "zrop.cache.sector_accesses"), accesses) << what;
        EXPECT_EQ(statistic(result, "l2.depth_stencil_bytes_read"), statistic(result, "zrop.cache.bytes_filled"))
            << what;
        EXPECT_EQ(statistic(result, "l2.depth_stencil_bytes_written"),
                  statistic(result, "zrop.cache.bytes_written_back"))
            << what;
        EXPECT_EQ(statistic(result, "zrop.cache.bytes_filled"), 32 * statistic(result, "zrop.cache.sector_misses"))
            << what;
        // All of the surface is covered, a sector for each 4x2 pixels, by whichever GPC.
        EXPECT_EQ(statistic(result, "zrop.cache.sector_misses_compulsory"), 160U * 128 / 8) << what;
        EXPECT_GT(statistic(result, "zrop.cache.bytes_written_back"), 0U) << what;
      }
    }
  }
}

TEST(DepthStencilTraffic, ACacheThatHoldsTheSurfaceReadsEachSectorOnceAndWritesNothing) {
  const Draw draw = terminating_draw(128, 96, 300, 42);
  for (const char* name : {"agx-orin-ideal-memory", "desktop"}) {
    const Platform platform = with_z_traffic(name);
    for (const Fidelity fidelity : fidelities_with_time()) {
      const RunResult result = run(z_traffic_request(platform, "het", fidelity,
                                                     [](RunRequest& request) {
                                                       request.settings = {{"zrop", "cache_bytes", "65536"}};
                                                     }),
                                   draw);
      EXPECT_EQ(statistic(result, "l2.depth_stencil_bytes_read"), 128U * 96 * 4) << name << " " << name_of(fidelity);
      EXPECT_EQ(statistic(result, "l2.depth_stencil_bytes_written"), 0U) << name << " " << name_of(fidelity);
    }
  }
}

/// The knee: 24 screen tiles of 1 KiB each, which the splats of a frame cover one after another, again and again.
TEST(DepthStencilTraffic, HasItsKneeWhereTheTilesInUseFit) {
  Draw draw = testing::draw_of(96, 64);
  for (unsigned i = 0; i < 40; ++i) draw.splats.push_back(testing::round_splat(48, 32, 200, 0.02F));
  const Platform platform = with_z_traffic();
  std::vector<double> missed;
  for (const char* bytes : {"4096", "8192", "16384", "32768", "65536"}) {
    const RunResult result = run(z_traffic_request(platform, "het", Fidelity::cycle,
                                                   [&](RunRequest& request) {
                                                     request.settings = {{"zrop", "cache_bytes", bytes}};
                                                   }),
                                 draw);
    missed.push_back(static_cast<double>(statistic(result, "zrop.cache.sector_misses")) / (96 * 64 / 8));
  }
  EXPECT_EQ(missed[3], 1) << "each sector once";
  EXPECT_EQ(missed[4], 1);
  EXPECT_GT(missed[2], 5) << "least recently used lines go just before they are wanted";
  EXPECT_GE(missed[0], missed[1]);
  EXPECT_GE(missed[1], missed[2]);
}

TEST(DepthStencilTraffic, AFrameThatDoesNotTerminateEarlyHasNone) {
  const Draw draw = testing::random_draw(96, 64, 200, 43);
  const Platform platform = with_z_traffic();
  for (const Fidelity fidelity : fidelities_with_time()) {
    const RunResult connected = run(z_traffic_request(platform, "baseline", fidelity), draw);
    EXPECT_EQ(statistic(connected, "l2.depth_stencil_reads"), 0U);
    EXPECT_EQ(connected.cycles, run(request_of("baseline", fidelity), draw).cycles) << name_of(fidelity);
  }
}

TEST(DepthStencilTraffic, ChangesNothingButTimeInStrictTermination) {
  const Draw draw = terminating_draw(96, 96, 300, 44);
  for (const char* name : {"agx-orin-ideal-memory", "desktop", "agx-orin"}) {
    const Platform platform = with_z_traffic(name);
    for (const char* variant : {"het", "het+qm"}) {
      const RunResult expected = run(request_of(variant, Fidelity::functional,
                                                [&](RunRequest& request) {
                                                  strictly(request);
                                                  request.platform = &platform_named(name);
                                                }),
                                     draw);
      for (const Fidelity fidelity : fidelities()) {
        for (std::uint64_t seed = 0; seed < 4; ++seed) {
          const std::string what =
              std::string(name) + " " + variant + " " + name_of(fidelity) + " " + std::to_string(seed);
          const auto pick = [&](std::uint64_t salt, std::initializer_list<const char*> values) {
            return std::string(*(values.begin() + mix(seed * 16 + salt) % values.size()));
          };
          const RunResult result =
              run(z_traffic_request(platform, variant, fidelity,
                                    [&](RunRequest& request) {
                                      strictly(request);
                                      request.settings = {{"zrop", "cache_bytes", pick(1, {"128", "1024", "16384"})},
                                                          {"zrop", "mshrs", pick(2, {"1", "8", "384"})},
                                                          {"zrop", "input_quads", pick(3, {"1", "40", "512"})},
                                                          {"zrop", "input_updates", pick(4, {"1", "64"})},
                                                          {"zrop", "sectors_per_cycle", pick(5, {"1", "16"})},
                                                          {"zrop", "quads_per_cycle", pick(6, {"3", "16"})},
                                                          {"zrop", "updates_per_cycle", pick(7, {"1", "4"})},
                                                          {"zrop", "line_bytes", pick(8, {"64", "128"})},
                                                          {"zrop", "fast_clear", pick(9, {"on", "off"})}};
                                      if (fidelity != Fidelity::cycle) return;
                                      request.stall_seed = seed + 1;
                                      request.stall_per_256 = 40;
                                      request.tick_order_seed = seed + 7;
                                    }),
                  draw);
          EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << what;
          EXPECT_EQ(result.counts.named(), expected.counts.named()) << what;
        }
      }
    }
  }
}

TEST(DepthStencilTraffic, DoesNotDependOnTheOrderOfTicks) {
  const Draw draw = terminating_draw(96, 64, 300, 45);
  const Platform platform = with_z_traffic();
  RunRequest request = z_traffic_request(platform, "het+qm", Fidelity::cycle);
  request.settings = {{"zrop", "cache_bytes", "2048"}};
  const RunResult expected = run(request, draw);
  for (std::uint64_t seed = 1; seed < 4; ++seed) {
    request.tick_order_seed = seed;
    const RunResult result = run(request, draw);
    EXPECT_EQ(result.result_hash, expected.result_hash);
    EXPECT_EQ(statistic(result, "zrop.cache.sector_misses"), statistic(expected, "zrop.cache.sector_misses"));
  }
}

TEST(DepthStencilTraffic, AFastClearReadsOnlyWhatWasWrittenBack) {
  const Draw draw = terminating_draw(160, 128, 600, 46);
  for (const char* name : {"agx-orin-ideal-memory", "desktop"}) {
    const Platform platform = with_z_traffic(name);
    for (const Fidelity fidelity : fidelities_with_time()) {
      const RunResult result =
          run(z_traffic_request(platform, "het", fidelity,
                                [](RunRequest& request) {
                                  request.settings = {{"zrop", "cache_bytes", "1024"}, {"zrop", "fast_clear", "on"}};
                                }),
              draw);
      const std::string what = std::string(name) + " " + name_of(fidelity);
      const std::uint64_t read = statistic(result, "zrop.cache.bytes_filled");
      const std::uint64_t spared = statistic(result, "zrop.cache.sectors_as_cleared");
      EXPECT_EQ(read + 32 * spared, 32 * statistic(result, "zrop.cache.sector_misses")) << what;
      EXPECT_EQ(statistic(result, "l2.depth_stencil_bytes_read"), read) << what;
      EXPECT_GE(spared, statistic(result, "zrop.cache.sector_misses_compulsory")) << what;
      EXPECT_GT(read, 0U) << what;
    }
  }
}

TEST(DepthStencilTraffic, TimedFidelitiesStayNearCycleAndTheBoundBelow) {
  SceneRequest scene;
  scene.scene = "builtin:object";
  scene.size = ImageSize{128, 112};
  scene.fovy_degrees = 20;
  const LoadedScene loaded = load_scene(scene);
  const Draw& draw = loaded.draw;
  for (const char* name : {"agx-orin-ideal-memory", "agx-orin", "desktop"}) {
    const Platform platform = with_z_traffic(name);
    for (const char* bytes : {"4096", "16384"}) {
      if (std::string(name) != "agx-orin-ideal-memory" && std::string(bytes) != "4096") continue;
      const auto small = [&](RunRequest& request) { request.settings = {{"zrop", "cache_bytes", bytes}}; };
      const RunResult clocked = run(z_traffic_request(platform, "het", Fidelity::cycle, small), draw);
      const auto cycles = static_cast<double>(*clocked.cycles);
      const auto misses = static_cast<double>(statistic(clocked, "zrop.cache.sector_misses"));
      const RunResult result = run(z_traffic_request(platform, "het", Fidelity::lt, small), draw);
      // Misses are many or few where the tiles in use just fit.
      const std::string what = std::string(name) + " " + bytes;
      EXPECT_NEAR(static_cast<double>(*result.cycles) / cycles, 1, 0.1) << what;
      EXPECT_NEAR(static_cast<double>(statistic(result, "zrop.cache.sector_misses")) / misses, 1, 0.25) << what;
      EXPECT_LE(*run(z_traffic_request(platform, "het", Fidelity::bound, small), draw).cycles, *clocked.cycles) << name;
    }
  }
}

/// Behind an L2 that misses lies a DRAM; without time both count what is asked of them.
TEST(DepthStencilTraffic, IsCountedWithoutTimeWhereMemoryWantsToKnow) {
  const Draw draw = terminating_draw(128, 96, 600, 47);
  const Platform platform = with_z_traffic("agx-orin");
  const auto clocked = static_cast<double>(
      statistic(run(z_traffic_request(platform, "het", Fidelity::cycle, strictly), draw), "zrop.cache.sector_misses"));
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::bound}) {
    const RunResult result = run(z_traffic_request(platform, "het", fidelity, strictly), draw);
    EXPECT_EQ(statistic(result, "l2.depth_stencil_bytes_read"), statistic(result, "zrop.cache.bytes_filled"));
    EXPECT_EQ(statistic(result, "l2.depth_stencil_bytes_written"), statistic(result, "zrop.cache.bytes_written_back"));
    EXPECT_EQ(statistic(result, "zrop.cache.sector_misses_compulsory"), 128U * 96 / 8);
    EXPECT_NEAR(static_cast<double>(statistic(result, "zrop.cache.sector_misses")) / clocked, 1, 0.1);
  }
}

TEST(DepthStencilTraffic, TakesAMemoryOfAnotherMake) {
  const Draw draw = terminating_draw(96, 64, 200, 48);
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.wire = [](Netlist& netlist) {
    wire_pipeline(netlist);
    netlist.add_memory("dram", [](const std::string& name, unsigned) -> ForeignMemory {
      using sc_core::sc_time;
      auto dram = std::make_unique<foreign::Dram>(name.c_str(), sc_time(1, sc_core::SC_NS), sc_time(40, sc_core::SC_NS),
                                                  sc_time(70, sc_core::SC_NS));
      tlm::tlm_base_target_socket_b<32>& socket = dram->socket;
      return {std::move(dram), {&socket}};
    });
    netlist.connect_memory("l2", "dram");
    connect_depth_stencil_traffic(netlist);
  };
  const RunResult expected = run(request_of("het+qm", Fidelity::functional, strictly), draw);
  for (const Fidelity fidelity : fidelities_with_time()) {
    const RunResult result = run(z_traffic_request(platform, "het+qm", fidelity,
                                                   [](RunRequest& request) {
                                                     strictly(request);
                                                     request.settings = {{"zrop", "cache_bytes", "1024"}};
                                                   }),
                                 draw);
    EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << name_of(fidelity);
    EXPECT_EQ(result.counts.named(), expected.counts.named()) << name_of(fidelity);
    EXPECT_GT(statistic(result, "l2.depth_stencil_bytes_read"), 96U * 64 * 4) << name_of(fidelity);
  }
}

/// What a beat changes may be of a line that went when another one of the same beat came, which is still held fast.
TEST(DepthStencilTraffic, ACacheOfOneLineTakesChangesOfSeveral) {
  const Platform platform = with_z_traffic();
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const RunRequest functional = request_of("baseline", Fidelity::functional);
    const Frame frame = testing::random_frame(seed, functional);
    const RunResult expected = run(functional, frame);
    for (const char* replacement : {"lru", "fifo", "random"}) {
      for (const Fidelity fidelity : fidelities_with_time()) {
        SCOPED_TRACE(std::string(replacement) + " " + name_of(fidelity) + " " + std::to_string(seed));
        const RunResult result = run(
            z_traffic_request(platform, "baseline", fidelity,
                              [&](RunRequest& of) {
                                of.settings = {{"zrop", "cache_bytes", "128"}, {"zrop", "replacement", replacement}};
                              }),
            frame);
        EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color));
        EXPECT_EQ(result.counts.named(), expected.counts.named());
      }
    }
  }
}

// Of a real GPU's draw; at lt flits of second looks, which come later, held up the first looks behind them.
TEST(DepthStencilTraffic, TagsAreLookedAtAsFarAheadAtLtAsAtCycle) {
  const Draw draw = testing::measured_draw();
  std::map<Fidelity, double> reads;
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    RunRequest request = request_of("baseline", fidelity);
    request.platform = &platform_named("gh100-gpc");
    DrawState state = draw_state_of(request);
    state.stencil.test = true;
    state.stencil.front.compare = state.stencil.back.compare = Compare::none;
    Frame frame(draw.width, draw.height);
    frame.draw(geometry_of(draw.width, draw.height, draw.splats), state, "", 100'000, 1500);
    reads[fidelity] = static_cast<double>(statistic(run(request, frame), "l2.depth_stencil_reads"));
  }
  EXPECT_NEAR(reads[Fidelity::lt], reads[Fidelity::cycle], 0.03 * reads[Fidelity::cycle]);
}

// More tiles in turn than the z-cache has lines: a line has gone for others before its test changes it.
TEST(DepthStencilTraffic, WhatIsChangedOfALineThatHasGoneTakesNoLine) {
  constexpr unsigned tiles = 64, rounds = 20;
  const microbench::FramePointer frame =
      microbench::boxes_of_tiles({{0, 0, 2, 2}}, tiles, rounds, microbench::BoxesAre::stencil_written, {});
  for (const Fidelity fidelity : fidelities_with_time()) {
    SCOPED_TRACE(name_of(fidelity));
    RunRequest request = request_of("baseline", fidelity);
    const Platform platform = platform_named("gh100-gpc");
    request.platform = &platform;
    const RunResult result = run(request, *frame);
    EXPECT_EQ(statistic(result, "zrop.cache.bytes_filled"), 32U * tiles * rounds) << "each test reads anew";
  }
}

TEST(DepthStencilTraffic, MayStayUnconnected) {
  const Draw draw = testing::random_draw(64, 64, 300, 49);
  for (const Fidelity fidelity : fidelities_with_time()) {
    const RunResult result = run(request_of("het", fidelity), draw);
    EXPECT_EQ(statistic(result, "l2.depth_stencil_reads"), 0U);
    for (const StatisticReport& report : result.statistics)
      EXPECT_EQ(report.name.find("zrop.cache"), std::string::npos);
  }
}

}  // namespace
}  // namespace vrpipe
