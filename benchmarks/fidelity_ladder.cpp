// What each fidelity costs in accuracy and brings in speed: measured beside wanted, against `cycle`.
//   fidelity_ladder [--repeat N] [SCENE ...]      (default: 3, and the built-in scenes)
// A scene is a file or builtin:NAME. Rates are rasterised quads per second of processor time of this process, the median
// of N runs of each rung in turn; a rung's rate is that of its slowest variant.
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/scene.h>

namespace vrpipe {

namespace {

struct Rung {
  Fidelity fidelity;
  double cycles_percent;    ///< wanted: error of the cycles at most; 0: no mark
  double speedup_percent;   ///< wanted: error of the speed-up over the baseline at most
  double quads_per_second;  ///< wanted: at least
};
constexpr std::array<Rung, 5> rungs{{{Fidelity::functional, 0, 0, 10e6},
                                     {Fidelity::bound, 25, 15, 9e6},
                                     {Fidelity::lt, 10, 5, 8e6},
                                     {Fidelity::at, 3, 2, 6e6},
                                     {Fidelity::cycle, 0, 0, 4e6}}};

struct Worst {
  double cycles_percent = 0;
  double speedup_percent = 0;
  double quads_per_second = INFINITY;
};

double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double percent(double value, double reference) { return 100.0 * (value / reference - 1.0); }

std::array<Worst, rungs.size()> climb(const std::string& name, int repeat) {
  SceneRequest scene;
  scene.scene = name;
  const LoadedScene loaded = load_scene(scene);
  std::array<Worst, rungs.size()> worst;
  std::array<double, rungs.size()> baseline{};
  for (const Variant& variant : variants()) {
    std::array<double, rungs.size()> cycles{};
    std::array<std::vector<double>, rungs.size()> rates;
    for (int run = 0; run < repeat; ++run) {
      for (std::size_t i = 0; i < rungs.size(); ++i) {
        RunRequest request;
        request.platform = &platforms().front();
        request.variant = variant;
        request.fidelity = rungs[i].fidelity;
        fresh_simulation();
        const double start = processor_seconds();
        const RunResult result = simulate(request, loaded.draw);
        rates[i].push_back(static_cast<double>(result.counts.quads_rasterized) / (processor_seconds() - start));
        cycles[i] = static_cast<double>(result.cycles.value_or(0));
      }
    }
    if (!variant.quad_merging && !variant.early_termination) baseline = cycles;
    for (std::size_t i = 0; i < rungs.size(); ++i) {
      const double rate = median(rates[i]);
      worst[i].quads_per_second = std::min(worst[i].quads_per_second, rate);
      if (rungs[i].fidelity == Fidelity::functional) {
        std::printf("%-18s %-9s %-11s %12s %9s %12s %9.1f\n", name.c_str(), variant.name.c_str(),
                    name_of(rungs[i].fidelity), "", "", "", rate / 1e6);
        continue;
      }
      const double cycles_error = percent(cycles[i], cycles.back());
      const double speedup_error = percent(baseline[i] / cycles[i], baseline.back() / cycles.back());
      worst[i].cycles_percent = std::max(worst[i].cycles_percent, std::fabs(cycles_error));
      worst[i].speedup_percent = std::max(worst[i].speedup_percent, std::fabs(speedup_error));
      std::printf("%-18s %-9s %-11s %12.0f %+8.2f%% %+11.2f%% %9.1f\n", name.c_str(), variant.name.c_str(),
                  name_of(rungs[i].fidelity), cycles[i], cycles_error, speedup_error, rate / 1e6);
      std::fflush(stdout);
    }
  }
  return worst;
}

int run(const std::vector<std::string>& arguments) {
  int repeat = 3;
  std::vector<std::string> scenes;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--repeat" && i + 1 < arguments.size()) {
      repeat = std::max(1, std::stoi(arguments[++i]));
    } else {
      scenes.push_back(arguments[i]);
    }
  }
  if (scenes.empty()) {
    for (const std::string& name : builtin_scene_names()) scenes.push_back("builtin:" + name);
  }
  std::printf("%-18s %-9s %-11s %12s %9s %12s %9s\n", "scene", "variant", "fidelity", "cycles", "error", "speed-up err",
              "Mquads/s");
  std::array<Worst, rungs.size()> worst;
  for (const std::string& scene : scenes) {
    const std::array<Worst, rungs.size()> here = climb(scene, repeat);
    for (std::size_t i = 0; i < rungs.size(); ++i) {
      worst[i].cycles_percent = std::max(worst[i].cycles_percent, here[i].cycles_percent);
      worst[i].speedup_percent = std::max(worst[i].speedup_percent, here[i].speedup_percent);
      worst[i].quads_per_second = std::min(worst[i].quads_per_second, here[i].quads_per_second);
    }
  }
  std::printf("\nworst of all scenes and variants, and wanted\n");
  std::printf("%-11s %9s %9s %12s %9s %9s %9s\n", "fidelity", "cycles", "wanted", "speed-up", "wanted", "Mquads/s",
              "wanted");
  for (std::size_t i = 0; i < rungs.size(); ++i) {
    const Rung& rung = rungs[i];
    const bool met = (rung.cycles_percent == 0 || worst[i].cycles_percent <= rung.cycles_percent) &&
                     (rung.speedup_percent == 0 || worst[i].speedup_percent <= rung.speedup_percent) &&
                     worst[i].quads_per_second >= rung.quads_per_second;
    std::printf("%-11s %8.2f%% %8.0f%% %11.2f%% %8.0f%% %9.1f %9.0f  %s", name_of(rung.fidelity),
                worst[i].cycles_percent, rung.cycles_percent, worst[i].speedup_percent, rung.speedup_percent,
                worst[i].quads_per_second / 1e6, rung.quads_per_second / 1e6, met ? "met" : "MISSED");
    for (std::size_t j = 1; j + 1 < rungs.size(); ++j) {
      if (i == 0 || i + 1 == rungs.size() || worst[j].cycles_percent >= worst[i].cycles_percent ||
          worst[j].quads_per_second <= worst[i].quads_per_second) {
        continue;
      }
      std::printf(", dominated by %s", name_of(rungs[j].fidelity));
    }
    std::printf("\n");
  }
  return 0;
}

}  // namespace

}  // namespace vrpipe

int main(int argc, char** argv) {
  try {
    return vrpipe::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fidelity_ladder: %s\n", error.what());
    return 2;
  }
}
