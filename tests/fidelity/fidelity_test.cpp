// The fidelities beside one another: what strict termination makes the same on all of them, and how cycles may differ.
#include <algorithm>
#include <cmath>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/scene.h>

#include "support/simulate.h"
#include "tc/tc.h"

namespace vrpipe {
namespace {

using namespace testing;

constexpr Fidelity timed_rungs[] = {Fidelity::bound, Fidelity::lt, Fidelity::cycle};

std::string what(const RunRequest& request) {
  return request.variant.name + " " + name_of(request.format) + " " + name_of(request.fidelity) + " on " +
         request.platform->name;
}

/// Counts and image of a strict request, the same at every fidelity; and a bound that is one.
void expect_same_on_every_rung(RunRequest request, const Draw& draw) {
  request.termination = Termination::strict;
  request.fidelity = Fidelity::functional;
  const RunResult functional = run(request, draw);
  Cycle bound = 0;
  for (const Fidelity fidelity : timed_rungs) {
    request.fidelity = fidelity;
    const RunResult result = run(request, draw);
    EXPECT_EQ(result.counts.named(), functional.counts.named()) << what(request);
    EXPECT_TRUE(same_image(result.framebuffer.color, functional.framebuffer.color)) << what(request);
    ASSERT_TRUE(result.cycles.has_value()) << what(request);
    if (fidelity == Fidelity::bound) bound = *result.cycles;
    if (fidelity == Fidelity::cycle) {
      EXPECT_LE(bound, *result.cycles) << what(request);
    }
  }
}

TEST(Fidelity, NamesAreThoseOfTheContract) {
  std::vector<std::string> names;
  for (const Fidelity fidelity : fidelities()) {
    names.emplace_back(name_of(fidelity));
    EXPECT_EQ(fidelity_named(names.back()), fidelity);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"functional", "bound", "lt", "cycle"}));
}

TEST(Fidelity, AnUnknownNameIsAnErrorThatNamesTheNearest) {
  try {
    fidelity_named("cicle");
    FAIL() << "accepted";
  } catch (const UserError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("unknown fidelity 'cicle' (--fidelity)"), std::string::npos) << text;
    EXPECT_NE(text.find("did you mean cycle?"), std::string::npos) << text;
    EXPECT_NE(text.find("There are functional, bound, lt, cycle"), std::string::npos) << text;
  }
}

/// Whatever is under way when a pixel terminates, those that are not late are the fragments up to the one that takes it past
/// the threshold, which strict termination blends and no other.
TEST(Fidelity, FragmentsThatAreNotBlendedLateAreThoseOfStrictTermination) {
  SceneRequest scene;
  scene.scene = "builtin:object";
  scene.size = ImageSize{120, 80};
  const LoadedScene loaded = load_scene(scene);
  const std::uint64_t in_time =
      run(request_of("het", Fidelity::functional, strictly), loaded.draw).counts.fragments_blended;
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::lt, Fidelity::cycle}) {
    const RunResult result = run(request_of("het", fidelity), loaded.draw);
    std::uint64_t late = 0;
    for (const StatisticReport& statistic : result.statistics) {
      if (statistic.name == "crop.fragments_blended_late") late = statistic.value;
    }
    EXPECT_GT(late, 0U) << name_of(fidelity);
    EXPECT_EQ(result.counts.fragments_blended - late, in_time) << name_of(fidelity);
  }
}

TEST(Fidelity, StrictImagesAndCountsAreTheSameOnBuiltinScenes) {
  for (const BuiltinSceneInfo& info : builtin_scenes()) {
    if (info.stands_for) continue;  // large, and of the same kinds
    SceneRequest scene;
    scene.scene = "builtin:" + info.name;
    scene.size = ImageSize{160, 96};
    scene.fovy_degrees = 15;
    const LoadedScene loaded = load_scene(scene);
    // All variants of one scene; of the others the one that has all.
    for (const Variant& variant : variants()) {
      if (&info == &builtin_scenes().front() || variant.name == "het+qm")
        expect_same_on_every_rung(request_of(variant.name), loaded.draw);
    }
  }
}

TEST(Fidelity, AnEmptyDrawTakesNoWorkOnAnyRung) {
  for (const Variant& variant : variants()) expect_same_on_every_rung(request_of(variant.name), draw_of(64, 64));
}

/// A TC of another make, which has its time-out in every mode.
struct ImpatientTc : TileCoalescing {
  ImpatientTc(const Parameters& parameters, const RenderContext& context) : TileCoalescing(parameters, context) {}
  const TcTime& time() const override { return time_; }

 private:
  static TcTime after_three_cycles() {
    TcParameters parameters;
    parameters.set("tc", "idle_timeout_cycles", "3");
    return TcTime(parameters);
  }
  const TcTime time_ = after_three_cycles();
};
const Registrar<ImpatientTc, TcBehaviour> impatient("tc", "impatient", "flushes bins after three idle cycles");

TEST(Fidelity, StrictTerminationHasNoTimeOutWhateverTheUnitAsksFor) {
  const Draw draw = random_draw(150, 90, 400, 8);
  RunRequest request = request_of("het+qm");
  // RASTER is kept waiting, so that TC idles.
  request.settings = {{"draw", "warps_per_1024_cycles", "16"}};
  request.units = {{"tc", "impatient"}};
  EXPECT_GT(statistic(run(request, draw), "tc.flushes_timed_out"), 0U);
  expect_same_on_every_rung(request, draw);
  strictly(request);
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    request.fidelity = fidelity;
    EXPECT_EQ(statistic(run(request, draw), "tc.flushes_timed_out"), 0U) << name_of(fidelity);
  }
}

TEST(Fidelity, RandomStallsChangeNothingButTime) {
  const Draw draw = random_draw(120, 80, 300, 4);
  for (const Variant& variant : variants()) {
    RunRequest request = request_of(variant.name, Fidelity::functional, strictly);
    const RunResult functional = run(request, draw);
    request.fidelity = Fidelity::lt;
    const Cycle unstalled = *run(request, draw).cycles;
    for (const std::uint64_t seed : {11ULL, 12ULL, 13ULL}) {
      request.stall_seed = seed;
      request.stall_per_256 = 96;
      const RunResult result = run(request, draw);
      EXPECT_EQ(result.counts.named(), functional.counts.named()) << what(request) << ", seed " << seed;
      EXPECT_TRUE(same_image(result.framebuffer.color, functional.framebuffer.color))
          << what(request) << ", seed " << seed;
      EXPECT_GT(*result.cycles, unstalled) << what(request) << ", seed " << seed;
    }
  }
}

/// Every link as narrow as it can be, and nothing but one of each: whatever waits for something waits long.
TEST(Fidelity, NarrowUnitsNeitherLockNorChangeTheResult) {
  const Draw draw = random_draw(120, 80, 200, 5);
  for (const Variant& variant : variants()) {
    expect_same_on_every_rung(
        request_of(variant.name, Fidelity::functional,
                   [](RunRequest& request) {
                     request.settings = {
                         {"sm", "cores", "1"},   {"sm", "warps_per_core", "1"},    {"sm", "vertex_warps", "1"},
                         {"tc", "bins", "2"},    {"tc", "bin_quads", "3"},         {"tc", "flush_queue_bins", "1"},
                         {"tgc", "bins", "1"},   {"crop", "input_quads", "1"},     {"crop", "cache_bytes", "128"},
                         {"crop", "mshrs", "1"}, {"zrop", "quads_per_cycle", "1"}, {"raster", "quads_per_cycle", "1"}};
                   }),
        draw);
  }
}

TEST(Fidelity, TheBoundIsBelowCycleWhateverTheBottleneck) {
  const Draw draw = random_draw(200, 150, 1500, 6);
  const std::vector<std::vector<Setting>> bottlenecks{
      {{"draw", "warps_per_1024_cycles", "4"}},
      {{"vpo", "triangles_per_cycle", "1"}},
      {{"raster", "setup_interval_cycles", "40"}},
      {{"raster", "coarse_tiles_per_cycle", "1"}},
      {{"raster", "fine_tiles_per_cycle", "1"}, {"raster", "quads_per_cycle", "1"}},
      {{"raster", "screen_tile_interval_cycles", "20"}},
      {{"tc", "quads_per_cycle", "1"}},
      {{"zrop", "quads_per_cycle", "1"}},
      {{"qru", "quads_per_cycle", "1"}},
      {{"sm", "cores", "1"}},
      {{"crop", "cache_bytes", "1024"}},
      {{"l2", "bytes_per_cycle", "32"}, {"crop", "cache_bytes", "1024"}},
      {{"l2", "frequency_mhz", "100"}, {"crop", "cache_bytes", "1024"}}};
  for (const auto& settings : bottlenecks) {
    for (const char* variant : {"baseline", "het+qm"}) {
      RunRequest request = request_of(variant, Fidelity::bound, strictly);
      request.settings = settings;
      request.settings.push_back({"prop", "order", "draw"});  // in which the bound knows what the cache misses
      const Cycle bound = *run(request, draw).cycles;
      request.fidelity = Fidelity::cycle;
      const Cycle cycles = *run(request, draw).cycles;
      const std::string name = settings.front().unit + "." + settings.front().parameter + " " + variant;
      EXPECT_LE(bound, cycles) << name;
      EXPECT_GT(bound, cycles / 3) << name;
    }
  }
}

TEST(Fidelity, LtStaysNearCycle) {
  SceneRequest scene;
  scene.scene = "builtin:object";
  scene.size = ImageSize{160, 160};
  scene.fovy_degrees = 15;
  const LoadedScene loaded = load_scene(scene);
  for (const Variant& variant : variants()) {
    const auto cycles = static_cast<double>(*run(request_of(variant.name), loaded.draw).cycles);
    const auto result = static_cast<double>(*run(request_of(variant.name, Fidelity::lt), loaded.draw).cycles);
    EXPECT_NEAR(result / cycles, 1, 0.03) << variant.name;
  }
}

TEST(Fidelity, EveryRungWithTimeReportsWhatItsUnitsDid) {
  const Draw draw = random_draw(200, 120, 500, 7);
  const RunResult cycle = run(request_of("het+qm"), draw);
  for (const Fidelity fidelity : {Fidelity::bound, Fidelity::lt}) {
    const RunResult result = run(request_of("het+qm", fidelity), draw);
    ASSERT_EQ(result.units.size(), cycle.units.size());
    ASSERT_EQ(result.utilization.size(), cycle.utilization.size());
    for (std::size_t i = 0; i < cycle.units.size(); ++i) {
      EXPECT_EQ(result.units[i].name, cycle.units[i].name);
      std::uint64_t sum = 0;
      for (const std::uint64_t cycles : result.units[i].cycles) sum += cycles;
      EXPECT_EQ(sum, *result.cycles) << result.units[i].name << " " << name_of(fidelity);
    }
    for (std::size_t i = 0; i < cycle.utilization.size(); ++i) {
      EXPECT_EQ(result.utilization[i].first, cycle.utilization[i].first);
      EXPECT_GE(result.utilization[i].second, 0.0);
      EXPECT_LE(result.utilization[i].second, 1.0) << result.utilization[i].first << " " << name_of(fidelity);
    }
    EXPECT_EQ(result.kernel_events > 0, fidelity != Fidelity::bound);
    EXPECT_LT(result.kernel_events, cycle.kernel_events) << name_of(fidelity);
  }
}

TEST(Fidelity, ADeadlockIsNamedOnEveryRungWithLinks) {
  const Platform platform =
      edited("agx-orin-ideal-memory", [](Netlist& netlist) { netlist.disconnect("gpc0.prop.out_release"); });
  const Draw draw = random_draw(64, 64, 200, 10);
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    for (const char* variant : {"baseline", "het+qm"}) {
      RunRequest request = request_of(variant, fidelity);
      request.platform = &platform;
      request.settings = {{"sm", "cores", "1"}, {"sm", "warps_per_core", "2"}};
      try {
        run(request, draw);
        ADD_FAILURE() << what(request) << " ended";
      } catch (const SimulationFault& fault) {
        const std::string text = fault.what();
        EXPECT_NE(text.find("deadlock"), std::string::npos) << what(request) << ": " << text;
        EXPECT_NE(text.find("sm"), std::string::npos) << what(request) << ": " << text;
      }
    }
  }
}

TEST(Fidelity, ResultsAreTheSameFromRunToRun) {
  const Draw draw = random_draw(150, 90, 400, 8);
  for (const Fidelity fidelity : timed_rungs) {
    const RunRequest request = request_of("het+qm", fidelity);
    EXPECT_EQ(run(request, draw).result_hash, run(request, draw).result_hash) << name_of(fidelity);
  }
}

}  // namespace
}  // namespace vrpipe
