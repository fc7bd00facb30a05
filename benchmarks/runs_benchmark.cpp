// Whole frames: simulated cycles and rasterised quads per second of processor time, for every variant and two fidelities.
// And how long it takes to make each of the stand-ins for the paper's scenes.
// VRPIPE_SCENE names another scene than the default one: a file, or builtin:NAME.
#include <cstdlib>

#include <benchmark/benchmark.h>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/scene.h>

namespace vrpipe {

namespace {

const Draw& draw() {
  static const LoadedScene scene = [] {
    SceneRequest request;
    if (const char* const name = std::getenv("VRPIPE_SCENE")) request.scene = name;
    return load_scene(request);
  }();
  return scene.draw;
}

void frame(benchmark::State& state, const char* variant, Fidelity fidelity) {
  RunRequest request;
  request.platform = &platform_named("agx-orin-ideal-memory");
  request.variant = variant_named(variant);
  request.fidelity = fidelity;
  double cpu_seconds = 0;
  std::uint64_t quads = 0;
  std::uint64_t cycles = 0;
  draw();
  for (auto _ : state) {
    fresh_simulation();
    const RunResult result = simulate(request, draw());
    cpu_seconds = result.cpu_seconds;
    quads = result.counts.quads_rasterized;
    cycles = result.cycles.value_or(0);
    state.SetIterationTime(cpu_seconds);
  }
  state.counters["quads"] = static_cast<double>(quads);
  state.counters["quads_per_second"] = static_cast<double>(quads) / cpu_seconds;
  if (cycles != 0) state.counters["cycles_per_second"] = static_cast<double>(cycles) / cpu_seconds;
}

/// Wall time, since all processors take part.
void make(benchmark::State& state, const char* name) {
  std::uint64_t gaussians = 0;
  for (auto _ : state) gaussians = make_builtin_scene(name).gaussians.size();
  state.counters["gaussians_per_second"] =
      benchmark::Counter(static_cast<double>(gaussians), benchmark::Counter::kIsIterationInvariantRate);
}

#define STAND_IN(name) BENCHMARK_CAPTURE(make, name, #name)->UseRealTime()->Unit(benchmark::kSecond)

#define FRAMES(fidelity)                                                                                          \
  BENCHMARK_CAPTURE(frame, fidelity##_baseline, "baseline", Fidelity::fidelity)                                   \
      ->UseManualTime()                                                                                           \
      ->Unit(benchmark::kSecond);                                                                                 \
  BENCHMARK_CAPTURE(frame, fidelity##_qm, "qm", Fidelity::fidelity)->UseManualTime()->Unit(benchmark::kSecond);   \
  BENCHMARK_CAPTURE(frame, fidelity##_het, "het", Fidelity::fidelity)->UseManualTime()->Unit(benchmark::kSecond); \
  BENCHMARK_CAPTURE(frame, fidelity##_het_qm, "het+qm", Fidelity::fidelity)->UseManualTime()->Unit(benchmark::kSecond)

STAND_IN(kitchen);
STAND_IN(bonsai);
STAND_IN(train);
STAND_IN(truck);
STAND_IN(lego);
STAND_IN(palace);
STAND_IN(building);
STAND_IN(rubble);
FRAMES(functional);
FRAMES(cycle);

}  // namespace

}  // namespace vrpipe

BENCHMARK_MAIN();
