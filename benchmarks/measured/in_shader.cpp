// Blending in the shader, with a lock and without, beside what was measured on the GPU.
#include <cmath>
#include <cstdio>
#include <string>

#include "measured/gpu.h"
#include "support/measured_scenes.h"

namespace vrpipe::measured {

namespace {

using testing::MeasuredScene;

/// Pixels of which a channel is off by more than 1/255.
double wrong_pixels(const ColorSurface& image, const ColorSurface& reference) {
  double wrong = 0;
  for (std::uint32_t y = 0; y < image.height(); ++y) {
    for (std::uint32_t x = 0; x < image.width(); ++x) {
      const auto is = image.pixel(x, y), ought = reference.pixel(x, y);
      bool is_off = false;
      for (unsigned channel = 0; channel < 4; ++channel)
        is_off = is_off || std::fabs(is[channel] - ought[channel]) > 1.0F / 255;
      wrong += is_off ? 1 : 0;
    }
  }
  return 100 * wrong / (static_cast<double>(image.width()) * image.height());
}

void compare(const Gpu& gpu, const MeasuredScene& scene) {
  const RunResult rop = gpu.run(scene.draw, mode_named("RGBA16F"));
  const RunResult ordered = gpu.run(scene.draw, mode_named("in the shader"));
  const RunResult racing = gpu.run(scene.draw, mode_named("in the shader, no lock"));
  const auto cycles = [&](const char* column) { return scene.values.at(column) / 1e6; };
  const double of_rop = Gpu::megacycles(rop), with = Gpu::megacycles(ordered), without = Gpu::megacycles(racing);
  const auto region = scene.values.find("region");
  std::printf("%-10s%6s", scene.name.c_str(),
              region == scene.values.end() ? "" : std::to_string(static_cast<int>(region->second)).c_str());
  print_in_columns(9, 2, cycles("ordered"), with);
  print_in_columns(9, 2, cycles("ordered") / cycles("rop"), with / of_rop);
  print_in_columns(9, 2, cycles("no_lock"), without);
  print_in_columns(9, 2, cycles("no_lock") / cycles("rop"), without / of_rop);
  const auto wrong = scene.values.find("wrong");
  if (wrong != scene.values.end())
    std::printf("%8.1f%8.1f", 100 * wrong->second, wrong_pixels(racing.framebuffer.color, ordered.framebuffer.color));
  std::printf("\n");
  std::fflush(stdout);
}

/// Nobody knows whether the lock takes as many cycles of another clock, or as long.
void compare_clocks(const Gpu& gpu, const Draw& draw) {
  const Gpu in_cycles(gpu.fidelity(), "agx-orin"),
      as_long(gpu.fidelity(), "agx-orin", {{"crop", "lock_clock_mhz", "1980"}});
  const double rop = in_cycles.cycles(draw, mode_named("RGBA16F"));
  std::printf("\n%-44s%12s%12s\n", "trained on agx-orin, 612 MHz", "M cycles", "over ROP");
  const auto row = [&](const char* name, double cycles) {
    std::printf("%-44s%12.2f%12.2f\n", name, cycles, cycles / rop);
  };
  row("ROP", rop);
  row("ordered lock, cycles of any clock", in_cycles.cycles(draw, mode_named("in the shader")));
  row("ordered lock, as long at any clock", as_long.cycles(draw, mode_named("in the shader")));
  row("no lock", in_cycles.cycles(draw, mode_named("in the shader, no lock")));
}

}  // namespace

void compare_in_shader(const Gpu& gpu, bool is_short) {
  std::printf("%-16s%25s%25s%25s%25s%16s\n", "millions of", "ordered lock  ", "over ROP  ", "no lock  ", "over ROP  ",
              "wrong, %");
  std::printf("%-16s", "cycles");
  for (unsigned i = 0; i < 4; ++i) std::printf("%9s%9s%7s", "meas.", "pred.", "%");
  std::printf("%8s%8s\n", "meas.", "pred.");
  for (MeasuredScene& scene : testing::measured_in_shader_scenes()) {
    if (is_short && scene.name != "8x8" && scene.name != "trained") continue;
    if (scene.name == "trained") scene.draw = testing::measured_draw();
    if (is_short) scene.draw.splats.resize(scene.draw.splats.size() / 200);
    compare(gpu, scene);
    if (scene.name == "trained") compare_clocks(gpu, scene.draw);
  }
}

}  // namespace vrpipe::measured
