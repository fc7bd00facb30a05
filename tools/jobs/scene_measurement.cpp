#include "jobs/scene_measurement.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/scene.h>

#include "host/stdout_to_stderr.h"
#include "host/stopwatch.h"

namespace vrpipe::tools {

double SceneMeasurement::early_termination_ratio() const {
  if (fragments_remaining == 0) return 0;
  return static_cast<double>(fragments_blended) / static_cast<double>(fragments_remaining);
}

double splat_side(const Draw& draw, double share) {
  if (draw.splats.empty()) return 0;
  std::vector<double> areas;
  areas.reserve(draw.splats.size());
  for (const Splat& s : draw.splats) {
    const double a = double{s.ax} * s.ax + double{s.ay} * s.ay, b = double{s.bx} * s.bx + double{s.by} * s.by;
    areas.push_back(4 * std::sqrt(a * b));
  }
  const auto last = static_cast<double>(areas.size() - 1);
  const auto place = areas.begin() + static_cast<std::ptrdiff_t>(last * share);
  std::nth_element(areas.begin(), place, areas.end());
  return std::sqrt(*place);
}

SceneMeasurement measure_scene(const std::string& scene) {
  SceneMeasurement measured;
  SceneRequest asked;
  asked.scene = scene;
  asked.scene_cache = false;
  const auto start = std::chrono::steady_clock::now();
  const LoadedScene loaded = load_scene(asked);
  measured.load_seconds = seconds_since(start);
  measured.name = loaded.summary.name;
  measured.width = loaded.draw.width;
  measured.height = loaded.draw.height;
  measured.gaussians_total = loaded.summary.gaussians_total;
  measured.gaussians_visible = loaded.summary.gaussians_visible;
  measured.side_median = splat_side(loaded.draw, 0.5);
  measured.side_ninth_decile = splat_side(loaded.draw, 0.9);
  for (const char* variant : {"baseline", "het"}) {
    RunRequest request;
    request.platform = &platforms().front();
    request.variant = variant_named(variant);
    request.fidelity = Fidelity::functional;
    request.termination = Termination::strict;
    const StdoutToStderr redirected;
    fresh_simulation();
    const RunResult result = simulate(request, loaded.draw);
    if (!request.variant.early_termination) {
      measured.fragments_rasterized = result.counts.fragments_rasterized;
      measured.quads_rasterized = result.counts.quads_rasterized;
      measured.fragments_blended = result.counts.fragments_blended;
    } else {
      measured.fragments_remaining = result.counts.fragments_blended;
    }
  }
  return measured;
}

}  // namespace vrpipe::tools
