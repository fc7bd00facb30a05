// What caches count in whole runs, against caches by their definition that are fed with what those were asked for, in the
// order in which they looked it up.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <vrpipe/pipeline/payload.h>
#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/wiring.h>

#include "support/recorded_traffic.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::Counted;
using testing::LookUps;
using testing::ReferenceCache;
using testing::replay;
using testing::Replayed;
using testing::request_of;
using testing::run;
using testing::statistic;

struct Pressure {
  const char* platform;
  const char* variant;
  Replacement replacement;
  std::uint32_t bytes;
  std::string text() const { return fmt::format("{} {} {} KB", platform, variant, bytes / 1024); }
};
// Attributes alone go round in 64 KB.
constexpr Pressure pressures[] = {{"agx-orin", "baseline", Replacement::lru, 65536},
                                  {"agx-orin", "baseline", Replacement::fifo, 262144},
                                  {"agx-orin", "het+qm", Replacement::lru, 262144},
                                  {"agx-orin-lpddr5", "baseline", Replacement::lru, 262144}};

CacheOrganization organization_of(const Pressure& pressure) {
  CacheOrganization organization;
  organization.bytes = pressure.bytes;
  organization.ways = 16;
  organization.replacement = pressure.replacement;
  return organization;
}

LookUps& of_l2() { return testing::record_look_ups("l2"); }

struct Recorded {
  RunResult result;
  decltype(LookUps::events) events;
};

/// A run at `cycle` whose L2 holds a part of what is asked for, made once.
const Recorded& record(const Pressure& pressure) {
  static std::map<const Pressure*, Recorded> made;
  if (const auto found = made.find(&pressure); found != made.end()) return found->second;
  of_l2().events.clear();
  RunRequest request = request_of(pressure.variant, Fidelity::cycle);
  request.platform = &platform_named(pressure.platform);
  request.units = {{"l2", "recorded"}};
  request.settings = {{"l2", "bytes", std::to_string(pressure.bytes)},
                      {"l2", "replacement", pressure.replacement == Replacement::fifo ? "fifo" : "lru"},
                      {"sm", "attribute_buffer_bytes", "65536"},
                      {"crop", "cache_bytes", "2048"},
                      {"zrop", "fast_clear", "off"}};
  RunResult result = run(request, testing::random_draw(384, 256, 1200, 31));
  return made.emplace(&pressure, Recorded{std::move(result), of_l2().events}).first->second;
}

const std::map<MemoryTraffic, std::string> traffic_names = {{MemoryTraffic::color, "color"},
                                                            {MemoryTraffic::depth_stencil, "depth_stencil"},
                                                            {MemoryTraffic::vertex, "vertex"},
                                                            {MemoryTraffic::attribute, "attribute"}};

TEST(RecordedTraffic, OfTheL2MakesTheHitsMissesAndWriteBacksOfACacheByItsDefinition) {
  for (const Pressure& pressure : pressures) {
    const auto& [result, events] = record(pressure);
    Replayed expected = replay(organization_of(pressure), events, true);
    std::uint64_t looked_up = 0;
    for (const auto& [part, served] : events) looked_up += served ? 0 : part.bytes;
    std::uint64_t asked = 0;
    for (const auto& [traffic, name] : traffic_names) {
      const Counted& counted = expected.of[traffic];
      const std::string what = pressure.text() + " " + name;
      EXPECT_EQ(statistic(result, "l2." + name + "_sectors"), counted.needed) << what;
      EXPECT_EQ(statistic(result, "l2." + name + "_sector_misses"), counted.missed) << what;
      EXPECT_EQ(statistic(result, "dram." + name + "_bytes_read"), 32 * counted.filled) << what;
      EXPECT_EQ(statistic(result, "dram." + name + "_bytes_written"), 32 * counted.written_back) << what;
      asked += statistic(result, "l2." + name + "_bytes_read") + statistic(result, "l2." + name + "_bytes_written");
      const bool any = traffic != MemoryTraffic::depth_stencil || std::string(pressure.variant) == "het+qm";
      EXPECT_EQ(counted.missed > 500, any) << what;
    }
    EXPECT_EQ(looked_up, asked) << pressure.text();
    EXPECT_EQ(statistic(result, "l2.attribute_lines_held"), expected.held) << pressure.text();
    EXPECT_GT(expected.held, 1000U) << pressure.text();
    EXPECT_GT(expected.of.at(MemoryTraffic::color).written_back, 10'000U) << pressure.text();
  }
}

// Without them what differs is which line goes where one is waited for: little, where a set has others.
TEST(RecordedTraffic, OfTheL2MissesNearlyAsMuchInACacheWithoutPins) {
  for (const Pressure& pressure : pressures) {
    if (pressure.bytes == 65536) continue;
    const auto& [result, events] = record(pressure);
    for (const auto& [traffic, counted] : replay(organization_of(pressure), events, false).of) {
      const auto missed = static_cast<double>(statistic(result, "l2." + traffic_names.at(traffic) + "_sector_misses"));
      EXPECT_NEAR(missed / static_cast<double>(counted.missed), 1, 0.005)
          << pressure.text() << traffic_names.at(traffic);
    }
  }
}

TEST(RecordedTraffic, OfTheColourCacheMakesTheHitsAndMissesOfACacheWithoutTime) {
  constexpr std::uint32_t width = 192;
  constexpr std::uint32_t height = 128;
  const Draw draw = testing::random_draw(width, height, 700, 33);
  const ColorSurface surface(width, height, ColorFormat::rgba16f);
  for (const char* platform : {"agx-orin-ideal-memory", "desktop", "agx-orin"}) {
    for (const char* variant : {"baseline", "het+qm"}) {
      for (const std::uint32_t bytes : {2048U, 16384U}) {
        CacheOrganization organization;
        organization.bytes = bytes;
        std::map<std::string, ReferenceCache> caches;  // by link
        auto observers = std::make_shared<Observers>();
        observers->on_link<ColorBeat>("prop.color", [&](const auto& passed) {
          ReferenceCache& cache = caches.try_emplace(passed.link, organization).first->second;
          for (unsigned i = 0; i < passed.item.count; ++i) {
            const ColorQuad& quad = passed.item.quads[i];
            cache.access(surface.address(quad.warp->tile, quad.position()), 32, false);
          }
        });
        RunRequest request = request_of(variant);
        request.platform = &platform_named(platform);
        request.settings = {{"crop", "cache_bytes", std::to_string(bytes)}};
        request.observers = observers;
        const RunResult result = run(request, draw);
        std::uint64_t hits = 0;
        std::uint64_t compulsory = 0;
        std::uint64_t capacity = 0;
        std::uint64_t evicted = 0;
        for (const auto& [link, cache] : caches) {
          hits += cache.hits;
          compulsory += cache.compulsory;
          capacity += cache.capacity;
          evicted += cache.evicted;
        }
        const std::string what = std::string(platform) + " " + variant + " " + std::to_string(bytes);
        EXPECT_EQ(statistic(result, "crop.cache.sector_hits"), hits) << what;
        EXPECT_EQ(statistic(result, "crop.cache.sector_misses_compulsory"), compulsory) << what;
        EXPECT_EQ(statistic(result, "crop.cache.sector_misses_capacity"), capacity) << what;
        EXPECT_EQ(statistic(result, "crop.cache.lines_evicted"), evicted) << what;
        EXPECT_EQ(statistic(result, "l2.color_bytes_read"), 32 * (compulsory + capacity)) << what;
        EXPECT_GT(capacity, bytes == 2048 ? 1000U : 0U) << what;
      }
    }
  }
}

TEST(TrafficToDram, IsWhatIsTouchedForTheFirstTimeWhereAllFitsIntoL2) {
  const std::uint32_t width = 128;
  const std::uint32_t height = 96;
  auto splats = testing::random_draw(width, height, 500, 34).splats;
  const auto geometry = testing::geometry_of(width, height, splats);
  for (const char* name : {"agx-orin", "agx-orin-lpddr5"}) {
    for (const char* variant : {"baseline", "het+qm"}) {
      for (const Fidelity fidelity : fidelities()) {
        RunRequest request = request_of(variant, fidelity);
        request.platform = &platform_named(name);
        request.effects = EffectChoice::everything();
        std::uint64_t of_color = 0;
        for (const unsigned draws : {1U, 3U}) {
          const bool fast_clear = draws == 3;
          request.settings = {{"crop", "cache_bytes", "2048"}, {"zrop", "fast_clear", fast_clear ? "on" : "off"}};
          Frame frame(width, height);
          for (unsigned i = 0; i < draws; ++i) frame.draw(geometry, draw_state_of(request));
          fresh_simulation();
          const RunResult result = simulate(request, frame);
          const std::string what =
              std::string(name) + " " + variant + " " + name_of(fidelity) + " " + std::to_string(draws) + " draws";
          const std::uint64_t first = statistic(result, "l2.cache.sector_misses_compulsory");
          EXPECT_EQ(statistic(result, "l2.cache.sector_misses"), first) << what;
          EXPECT_GT(statistic(result, "l2.cache.sector_hits"), first) << what;
          EXPECT_EQ(statistic(result, "l2.cache.bytes_written_back"), 0U) << what;
          EXPECT_EQ(statistic(result, "dram.attribute_bytes_read"), 0U) << what << ": they were written";
          const std::uint64_t color = statistic(result, "dram.color_bytes_read");
          EXPECT_LE(color, ColorSurface::size_bytes(width, height, ColorFormat::rgba16f)) << what;
          const std::uint64_t depth_stencil = statistic(result, "dram.depth_stencil_bytes_read");
          EXPECT_EQ(depth_stencil > 0, std::string(variant) == "het+qm" && !fast_clear) << what;
          EXPECT_EQ(color + depth_stencil + statistic(result, "dram.vertex_bytes_read"),
                    statistic(result, "l2.cache.bytes_filled"))
              << what;
          if (draws > 1) {
            EXPECT_EQ(color, of_color) << what << ": the first has fetched it";
          }
          of_color = color;
          for (const auto& [traffic, written] : traffic_names) {
            EXPECT_EQ(statistic(result, "dram." + written + "_bytes_written"), 0U) << what;
          }
        }
        EXPECT_GT(of_color, 50'000U);
      }
    }
  }
}

// 16 splats over all of 128x128 pixels, so that the surface is gone over again and again: 1024 lines, 16 in each of 64
// sets. Nothing else goes through this L2.
TEST(TrafficToDram, OfColourHasItsKneeWhereTheSurfaceFitsIntoL2) {
  constexpr std::uint64_t surface = 128 * 1024;
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.wire = [](Netlist& netlist) {
    wire_pipeline(netlist);
    wire_dram(netlist, "lpddr3-1600");
  };
  const Draw draw = testing::draw_of(128, 128, std::vector<Splat>(16, testing::flat_box(-1, -1, 130, 130, 0.05F)));
  for (const Fidelity fidelity : fidelities()) {
    for (const unsigned ways : {8U, 12U, 14U, 16U, 18U, 32U}) {
      RunRequest request = request_of("baseline", fidelity);
      request.platform = &platform;
      request.effects = EffectChoice::everything();
      request.settings = {{"l2", "bytes", std::to_string(ways * 64 * 128)},
                          {"l2", "ways", std::to_string(ways)},
                          {"crop", "cache_bytes", "2048"}};
      const RunResult result = run(request, draw);
      const std::string what = std::string(name_of(fidelity)) + " " + std::to_string(ways * 8) + " KB";
      const std::uint64_t read = statistic(result, "dram.color_bytes_read");
      const std::uint64_t written = statistic(result, "dram.color_bytes_written");
      if (ways >= 16) {
        EXPECT_EQ(read, surface) << what;
        EXPECT_EQ(written, 0U) << what;
      } else {
        EXPECT_GT(read, 3 * surface) << what;
        EXPECT_GT(written, 2 * surface) << what;
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
