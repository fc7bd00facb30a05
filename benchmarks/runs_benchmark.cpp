// Whole frames: simulated cycles and rasterised quads per second of processor time, for every variant and two fidelities.
// VRPIPE_SCENE names another scene than the default one: a file, or builtin:NAME.
#include <cstdlib>

#include <benchmark/benchmark.h>

#include <vrpipe/platforms/simulation.h>
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
  request.platform = &platforms().front();
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

#define FRAMES(fidelity)                                                                                          \
  BENCHMARK_CAPTURE(frame, fidelity##_baseline, "baseline", Fidelity::fidelity)                                   \
      ->UseManualTime()                                                                                           \
      ->Unit(benchmark::kSecond);                                                                                 \
  BENCHMARK_CAPTURE(frame, fidelity##_qm, "qm", Fidelity::fidelity)->UseManualTime()->Unit(benchmark::kSecond);   \
  BENCHMARK_CAPTURE(frame, fidelity##_het, "het", Fidelity::fidelity)->UseManualTime()->Unit(benchmark::kSecond); \
  BENCHMARK_CAPTURE(frame, fidelity##_het_qm, "het+qm", Fidelity::fidelity)->UseManualTime()->Unit(benchmark::kSecond)

FRAMES(functional);
FRAMES(cycle);

}  // namespace

}  // namespace vrpipe

BENCHMARK_MAIN();
