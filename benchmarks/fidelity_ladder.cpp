// What each fidelity costs in accuracy and brings in speed: measured beside wanted, against `cycle`.
//   fidelity_ladder [--repeat N] [SCENE ...]
// A SCENE is a file or builtin:NAME; without one, the built-in scenes and the robot of tests/data.
// Accuracy: every level and variant of every scene, once. Rates: of one large frame, every level and variant in turn, N times
// (default: 5), the median: of the measured draw of tests/data, or of the first SCENE. The slowest variant counts.
// Rates are rasterised quads per second of processor time of the simulation alone.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/scene.h>

#include "support/data.h"

namespace vrpipe {

namespace {

struct Level {
  Fidelity fidelity;
  double cycles_percent;    ///< wanted: error of the cycles at most; 0: no mark
  double speedup_percent;   ///< wanted: error of the speed-up over the baseline at most
  double quads_per_second;  ///< wanted: at least
};
constexpr std::array<Level, 4> levels{{{Fidelity::functional, 0, 0, 10e6},
                                       {Fidelity::bound, 25, 15, 9e6},
                                       {Fidelity::lt, 10, 5, 8e6},
                                       {Fidelity::cycle, 0, 0, 4e6}}};

struct Run {
  double cycles = 0;
  double quads_per_second = 0;
};

struct Worst {
  double cycles_percent = 0;
  double speedup_percent = 0;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double percent(double value, double reference) { return 100.0 * (value / reference - 1.0); }

Run run_once(const Draw& draw, const Variant& variant, Fidelity fidelity) {
  RunRequest request;
  request.platform = &platform_named("agx-orin-ideal-memory");
  request.variant = variant;
  request.fidelity = fidelity;
  fresh_simulation();
  const RunResult result = simulate(request, draw);
  return {static_cast<double>(result.cycles.value_or(0)),
          static_cast<double>(result.counts.quads_rasterized) / result.cpu_seconds};
}

/// The levels with time that one of the others beats in error and rate; `cycle` has no error.
std::string dominated_by(std::size_t level, const std::array<double, levels.size()>& error,
                         const std::array<double, levels.size()>& rate) {
  std::string names;
  for (std::size_t other = 1; other < levels.size() && level > 0; ++other) {
    if (error[other] >= error[level] || rate[other] <= rate[level]) continue;
    names += std::string(names.empty() ? "dominated by " : ", ") + name_of(levels[other].fidelity);
  }
  return names;
}

void measure_accuracy(const SceneRequest& request, std::array<Worst, levels.size()>& worst) {
  const LoadedScene scene = load_scene(request);
  std::array<double, levels.size()> baseline{};
  for (const Variant& variant : variants()) {
    std::array<Run, levels.size()> runs;
    for (std::size_t i = 0; i < levels.size(); ++i) runs[i] = run_once(scene.draw, variant, levels[i].fidelity);
    std::array<double, levels.size()> error{};
    std::array<double, levels.size()> rate{};
    for (std::size_t i = 0; i < levels.size(); ++i) {
      if (!variant.quad_merging && !variant.early_termination) baseline[i] = runs[i].cycles;
      error[i] = std::fabs(percent(runs[i].cycles, runs.back().cycles));
      rate[i] = runs[i].quads_per_second;
    }
    for (std::size_t i = 0; i < levels.size(); ++i) {
      std::printf("%-28s %-9s %-11s", scene.summary.name.c_str(), variant.name.c_str(), name_of(levels[i].fidelity));
      if (runs[i].cycles == 0) {
        std::printf(" %12s %9s %9s %12s %9.1f\n", "", "", "", "", rate[i] / 1e6);
        continue;
      }
      const double speedup = baseline[i] / runs[i].cycles;
      const double speedup_error = percent(speedup, baseline.back() / runs.back().cycles);
      worst[i].cycles_percent = std::max(worst[i].cycles_percent, error[i]);
      worst[i].speedup_percent = std::max(worst[i].speedup_percent, std::fabs(speedup_error));
      std::printf(" %12.0f %+8.2f%% %9.3f %+11.2f%% %9.1f  %s\n", runs[i].cycles,
                  percent(runs[i].cycles, runs.back().cycles), speedup, speedup_error, rate[i] / 1e6,
                  dominated_by(i, error, rate).c_str());
    }
    std::fflush(stdout);
  }
}

/// Prints every variant's; returns the lowest.
std::array<double, levels.size()> measure_rates(const SceneRequest& request, int repeat) {
  const LoadedScene scene = load_scene(request);
  std::array<std::vector<std::vector<double>>, levels.size()> rates;  // by variant and run
  rates.fill(std::vector<std::vector<double>>(variants().size()));
  for (int run = 0; run < repeat; ++run) {
    for (std::size_t i = 0; i < levels.size(); ++i) {
      for (std::size_t v = 0; v < variants().size(); ++v) {
        rates[i][v].push_back(run_once(scene.draw, variants()[v], levels[i].fidelity).quads_per_second);
      }
    }
  }
  std::printf("\nMquads/s: medians of %d runs of %s\n%-11s", repeat, scene.summary.name.c_str(), "fidelity");
  for (const Variant& variant : variants()) std::printf(" %9s", variant.name.c_str());
  std::array<double, levels.size()> lowest{};
  for (std::size_t i = 0; i < levels.size(); ++i) {
    std::printf("\n%-11s", name_of(levels[i].fidelity));
    std::vector<double> medians;
    for (const std::vector<double>& runs : rates[i]) medians.push_back(median(runs));
    for (const double rate : medians) std::printf(" %9.1f", rate / 1e6);
    lowest[i] = *std::min_element(medians.begin(), medians.end());
  }
  return lowest;
}

int run(const std::vector<std::string>& arguments) {
  int repeat = 5;
  std::vector<SceneRequest> scenes;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--repeat" && i + 1 < arguments.size()) {
      repeat = std::max(1, std::stoi(arguments[++i]));
    } else if (arguments[i].rfind('-', 0) == 0) {
      const bool help = arguments[i] == "--help";
      std::fprintf(
          help ? stdout : stderr,
          "usage: fidelity_ladder [--repeat N] [SCENE ...]\n"
          "SCENE: a file or builtin:NAME; without one the small built-in scenes and the robot of tests/data\n");
      return help ? 0 : 2;
    } else {
      scenes.emplace_back().scene = arguments[i];
    }
  }
  const bool all = scenes.empty();
  const testing::UnpackedFile robot("robot.ply");
  if (all) {
    for (const BuiltinSceneInfo& info : builtin_scenes()) {
      if (!info.stands_for) scenes.emplace_back().scene = "builtin:" + info.name;
    }
    SceneRequest& request = scenes.emplace_back();
    request.scene = robot.path().string();
    request.size = ImageSize{640, 480};
    request.eye = Vec3{-2.0, -1.5, -2.0};
    request.look_at = Vec3{0.0, -0.35, 0.0};
    request.up = Vec3{0.0, -1.0, 0.0};
    request.fovy_degrees = 45;
  }
  std::printf("%-28s %-9s %-11s %12s %9s %9s %12s %9s\n", "scene", "variant", "fidelity", "cycles", "error", "speed-up",
              "error", "Mquads/s");
  std::array<Worst, levels.size()> worst;
  for (const SceneRequest& scene : scenes) measure_accuracy(scene, worst);

  SceneRequest frame = scenes.front();
  const testing::UnpackedFile measured_draw("measured_draw.spl");
  if (all) {
    frame = SceneRequest();
    frame.scene = measured_draw.path().string();
  }
  const std::array<double, levels.size()> rates = measure_rates(frame, repeat);

  std::printf("\n\nerrors: the worst of all scenes and variants; rates: the slowest variant\n");
  std::printf("%-11s %9s %9s %12s %9s %9s %9s\n", "fidelity", "cycles", "wanted", "speed-up", "wanted", "Mquads/s",
              "wanted");
  std::array<double, levels.size()> errors{};
  for (std::size_t i = 0; i < levels.size(); ++i) errors[i] = worst[i].cycles_percent;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const Level& level = levels[i];
    std::printf("%-11s", name_of(level.fidelity));
    if (level.cycles_percent > 0) {
      std::printf(" %8.2f%% %8.0f%% %11.2f%% %8.0f%%", worst[i].cycles_percent, level.cycles_percent,
                  worst[i].speedup_percent, level.speedup_percent);
    } else {
      std::printf(" %9s %9s %12s %9s", "", "", "", "");
    }
    const bool met = (level.cycles_percent == 0 || (worst[i].cycles_percent <= level.cycles_percent &&
                                                    worst[i].speedup_percent <= level.speedup_percent)) &&
                     rates[i] >= level.quads_per_second;
    std::printf(" %9.1f %9.0f  %s  %s\n", rates[i] / 1e6, level.quads_per_second / 1e6, met ? "met" : "MISSED",
                dominated_by(i, errors, rates).c_str());
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
