// What is said to bound a run, checked by experiment: halving the named cost takes cycles away, halving any other does
// not.
#include <algorithm>

#include <vrpipe/platforms/simulation.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

/// A cost, and the setting that halves it.
struct TimingParameters {
  const char* unit;
  const char* part;
  Setting halved;
};

const std::vector<TimingParameters>& timings() {
  static const std::vector<TimingParameters> all{{"draw", "warps", {"draw", "warps_per_1024_cycles", "176"}},
                                                 {"vpo", "triangles", {"vpo", "triangles_per_cycle", "4"}},
                                                 {"raster", "coarse tests", {"raster", "coarse_tiles_per_cycle", "16"}},
                                                 {"raster", "fine tiles", {"raster", "fine_tiles_per_cycle", "4"}},
                                                 {"prop", "colours", {"prop", "color_bytes_per_cycle", "128"}},
                                                 {"sm", "fragments", {"sm", "cores", "32"}},
                                                 {"crop", "blend", {"crop", "bytes_per_cycle", "128"}},
                                                 {"crop", "sectors", {"crop", "sectors_per_cycle", "32"}},
                                                 {"l2", "bytes", {"l2", "bytes_per_cycle", "256"}}};
  return all;
}

double cycles_with(RunRequest request, const Draw& draw, const std::vector<Setting>& settings) {
  for (const Setting& setting : settings) {
    // A setting of the same parameter in the request gives way.
    auto& given = request.settings;
    given.erase(std::remove_if(given.begin(), given.end(),
                               [&](const Setting& s) {
                                 return s.unit == setting.unit && s.parameter == setting.parameter;
                               }),
                given.end());
    given.push_back(setting);
  }
  return static_cast<double>(*run(request, draw).cycles);
}

std::string slot_of(const std::string& unit) { return unit.substr(unit.rfind('.') + 1); }

/// Splats of some quads each, all over the image: CROP bounds them, and its cache does not hold them.
const Draw& scene() {
  static const Draw draw = [] {
    Draw made = draw_of(256, 256);
    for (std::uint64_t i = 0; i < 5000; ++i) {
      made.splats.push_back(round_splat(uniform(1, 4 * i, 0, 256), uniform(1, 4 * i + 1, 0, 256),
                                        uniform(1, 4 * i + 2, 0.7F, 2), uniform(1, 4 * i + 3, 0.2F, 0.9F)));
    }
    return made;
  }();
  return draw;
}

/// The bottleneck of a request that makes one unit slow is that unit, and the experiment agrees.
void expect_bound_by(const std::string& unit, const std::string& part, const RunRequest& request,
                     const Setting& halved) {
  const std::string what = request.variant.name + " " + name_of(request.fidelity);
  const RunResult result = run(request, scene());
  ASSERT_TRUE(result.bottleneck.has_value()) << what;
  EXPECT_EQ(slot_of(result.bottleneck->unit), unit) << what;
  double sum = 0;
  double named = 0;
  for (const auto& [name, share] : result.bottleneck->parts) {
    sum += share;
    if (name == part) named = share;
  }
  EXPECT_NEAR(sum, result.bottleneck->occupancy, 1e-12) << what;
  EXPECT_GT(result.bottleneck->occupancy, 0.9) << what;
  EXPECT_GT(named, 0.5) << what << ": " << part;

  const auto before = static_cast<double>(*result.cycles);
  const double faster = cycles_with(request, scene(), {halved});
  // All that hides behind it comes to light, so it need not be the half.
  EXPECT_LT(faster, before * 0.95) << what << ": " << halved.unit << "." << halved.parameter;
  for (const TimingParameters& other : timings()) {
    if (other.unit == unit) continue;
    const double stays = cycles_with(request, scene(), {other.halved});
    EXPECT_GT(stays, before * 0.98) << what << ": " << other.unit << " " << other.part;
  }
}

RunRequest slowed(const char* variant, const std::vector<Setting>& settings, Fidelity fidelity = Fidelity::cycle) {
  return request_of(variant, fidelity, [&](RunRequest& request) { request.settings = settings; });
}

TEST(Bottleneck, OfTheBaselineIsCropAndNotPropBesideIt) {
  const RunRequest request = request_of("baseline");
  expect_bound_by("crop", "blend", request, {"crop", "bytes_per_cycle", "128"});
  // What sectors take, blending has.
  const double before = cycles_with(request, scene(), {});
  const RunResult result = run(request, scene());
  double sectors = 0;
  for (const auto& [name, share] : result.bottleneck->parts) sectors += name == "sectors" ? share : 0;
  const double without = cycles_with(request, scene(), {{"crop", "sectors_per_cycle", "32"}});
  EXPECT_NEAR((before - without) / before, sectors / 2, 0.02);
  EXPECT_GT(sectors, 0.03);
}

TEST(Bottleneck, IsTheUnitThatASettingMakesSlow) {
  expect_bound_by("crop", "forwarding",
                  slowed("baseline", {{"crop", "forwarding", "off"}, {"crop", "latency_cycles", "400"}}),
                  {"crop", "latency_cycles", "200"});
  expect_bound_by("raster", "set-up", slowed("baseline", {{"raster", "setup_interval_cycles", "30"}}),
                  {"raster", "setup_interval_cycles", "15"});
  expect_bound_by("raster", "screen tiles", slowed("baseline", {{"raster", "screen_tile_interval_cycles", "20"}}),
                  {"raster", "screen_tile_interval_cycles", "10"});
  // With slots to spare: how long PROP keeps them counts otherwise.
  expect_bound_by("sm", "fragments", slowed("baseline", {{"sm", "cores", "2"}, {"sm", "warps_per_core", "128"}}),
                  {"sm", "cores", "4"});
  expect_bound_by("qru", "quads", slowed("qm", {{"qru", "quads_per_cycle", "1"}}), {"qru", "quads_per_cycle", "2"});
  expect_bound_by("draw", "warps", slowed("baseline", {{"draw", "warps_per_1024_cycles", "3"}}),
                  {"draw", "warps_per_1024_cycles", "6"});
}

TEST(Bottleneck, IsTheSameAtEveryFidelityWithTime) {
  for (const Variant& variant : variants()) {
    const RunResult exact = run(request_of(variant.name), scene());
    for (const Fidelity fidelity : {Fidelity::lt}) {
      const RunResult result = run(request_of(variant.name, fidelity), scene());
      EXPECT_EQ(result.bottleneck->unit, exact.bottleneck->unit) << variant.name;
      EXPECT_NEAR(result.bottleneck->occupancy, exact.bottleneck->occupancy, 0.02) << variant.name;
      ASSERT_EQ(result.units.size(), exact.units.size());
      for (std::size_t i = 0; i < result.units.size(); ++i) {
        EXPECT_NEAR(result.units[i].occupancy, exact.units[i].occupancy, 0.05)
            << variant.name << " " << name_of(fidelity) << " " << result.units[i].name;
      }
    }
    EXPECT_EQ(run(request_of(variant.name, Fidelity::bound), scene()).bottleneck->unit, exact.bottleneck->unit);
  }
}

TEST(Bottleneck, OfAPortIsItsFlits) {
  for (const Fidelity fidelity : {Fidelity::bound, Fidelity::lt, Fidelity::cycle}) {
    const RunResult result = run(request_of("baseline", fidelity,
                                            [](RunRequest& request) {
                                              strictly(request);
                                              request.platform = &platform_named("gh100-gpc");
                                              request.settings = {{"prop", "order", "draw"}};
                                            }),
                                 scene());
    EXPECT_EQ(result.bottleneck->unit, "gpc0.crop") << name_of(fidelity);
    const auto& parts = result.bottleneck->parts;
    const auto flits = std::find_if(parts.begin(), parts.end(), [](const auto& part) { return part.first == "flits"; });
    ASSERT_NE(flits, parts.end()) << name_of(fidelity);
    const double gone = flits->second * static_cast<double>(*result.cycles);
    const auto counted = [&](const char* name) { return static_cast<double>(statistic(result, name)); };
    const double written = counted("crop.cache.sectors_written_back");
    EXPECT_GE(gone, written + counted("crop.cache.line_misses"))
        << name_of(fidelity) << ": each line is read and written";
    EXPECT_LE(gone, written + counted("crop.cache.sector_misses") + 2 * counted("crop.cache.line_misses"))
        << name_of(fidelity);
  }
}

TEST(Bottleneck, IsThereWhereTimeIs) {
  EXPECT_FALSE(run(request_of("baseline", Fidelity::functional), scene()).bottleneck.has_value());
}

// 16, 32 and 48 bytes a cycle took the same cycles once.
TEST(Rates, BytesACycleMeanWhatTheySay) {
  const auto cycles = [](const char* bytes, Fidelity fidelity) {
    return cycles_with(request_of("baseline", fidelity), scene(),
                       {{"crop", "bytes_per_cycle", bytes}, {"prop", "color_bytes_per_cycle", bytes}});
  };
  const auto quads =
      static_cast<double>(run(request_of("baseline", Fidelity::functional), scene()).counts.quads_blended);
  for (const Fidelity fidelity : {Fidelity::bound, Fidelity::lt, Fidelity::cycle}) {
    for (const char* bytes : {"16", "24", "32", "48"}) {
      const double least = quads * 32 / std::stod(bytes);
      EXPECT_GE(cycles(bytes, fidelity), least) << bytes << " " << name_of(fidelity);
      EXPECT_LE(cycles(bytes, fidelity), least * 1.2) << bytes << " " << name_of(fidelity);
    }
  }
}

}  // namespace
}  // namespace vrpipe
