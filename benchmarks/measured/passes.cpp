// Early termination by software, in passes, beside what was measured on the GPU.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>

#include "measured/gpu.h"
#include "support/measured_scenes.h"

namespace vrpipe::measured {

namespace {

using testing::MeasuredScene;

Mode in_passes(std::uint32_t passes) {
  return passes == 1 ? mode_named("stencil test, all pass") : Mode{"", ColorFormat::rgba16f, {}, passes};
}

/// Cycles of the draws between batches that draw nothing.
double updates_alone(const Gpu& gpu, const Draw& draw, std::uint32_t passes) {
  Draw nothing = draw;
  nothing.splats.resize(passes);
  Mode mode = in_passes(passes);
  mode.off_screen = true;
  return gpu.cycles(nothing, mode);
}

Draw draw_of(const std::string& scene) {
  return scene == "trained" ? testing::measured_draw() : testing::measured_scene(scene).draw;
}

}  // namespace

void compare_passes(const Gpu& gpu, bool is_short) {
  std::printf("%-10s%7s%27s%27s%17s%27s\n", "", "", "fragments, M     ", "cycles, M     ", "other target",
              "between alone   ");
  std::printf("%-10s%7s", "scene", "passes");
  std::printf("%10s%10s%7s%10s%10s%7s%10s%7s%10s%10s%7s\n", "measured", "counted", "%", "measured", "predicted", "%",
              "measured", "%", "measured", "predicted", "%");
  double sum = 0;
  unsigned rows = 0;
  Draw draw;
  std::string drawn;
  for (const MeasuredScene& row : testing::measured_passes()) {
    const auto passes = static_cast<std::uint32_t>(row.count("passes"));
    if (is_short && (row.name != "sweep-50k" || passes != 4)) continue;
    if (std::exchange(drawn, row.name) != row.name) draw = draw_of(row.name);
    if (is_short) draw.splats.resize(draw.splats.size() / 20);
    const RunResult result = gpu.run(draw, in_passes(passes));
    const double predicted = Gpu::megacycles(result);
    std::printf("%-10s%7u", row.name.c_str(), passes);
    const bool is_counted = row.values.count("fragments") != 0;
    if (is_counted) {
      print_in_columns(10, 2, row.values.at("fragments") / 1e6,
                       static_cast<double>(result.counts.fragments_shaded) / 1e6);
      print_in_columns(10, 3, row.values.at("cycles_with_barrier"), predicted);
    } else {
      std::printf("%54s", "");
    }
    const double of_other = row.values.at("cycles");
    std::printf("%10.3f%+7.1f", of_other, percent(predicted, of_other));
    if (row.values.count("updates_alone") != 0)
      print_in_columns(10, 3, row.values.at("updates_alone"), updates_alone(gpu, draw, passes));
    std::printf("\n");
    std::fflush(stdout);
    sum += std::fabs(percent(predicted, is_counted ? row.values.at("cycles_with_barrier") : of_other));
    ++rows;
  }
  std::printf("%-17s%54.1f\n", "mean of errors", sum / rows);
}

}  // namespace vrpipe::measured
