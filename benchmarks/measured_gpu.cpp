// What `gh100-gpc` predicts of a draw that was measured on the GPU itself, beside the measurement.
//   measured_gpu [--fidelity NAME] [--short] [--synthetic] [--uniform] [--in-shader] [--passes]
// The draw is tests/data/measured_draw.spl.xz: 211,320 splats of a trained scene at 800x800, with boxes of its own. Cycles of
// the GPU are of its clock, 1980 MHz (tests/data/README.md). Nothing of the platform was fitted to it. --short takes one
// splat in two hundred, of which nothing was measured, to see that it works. --synthetic draws three scenes of
// synthetic splats instead, --uniform splats of one size each, --in-shader both of these where the shader blends, --passes the
// scenes, and the draw, with early termination by software.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/arithmetic/random.h>

#include "measured/gpu.h"
#include "support/measured_scenes.h"

namespace vrpipe::measured {

namespace {

/// Of the trained scene, millions of cycles.
struct Measured {
  const char* mode;
  double cycles;
};

constexpr double baseline = 15.885;
constexpr Measured measurements[] = {
    {"RGBA16F", baseline},
    {"RGBA8", 11.586},
    {"RGBA32F", 98.168},
    {"not blended", 14.524},
    {"stencil test, all pass", 17.442},
    {"stencil test, all killed", 7.718},
    {"pruned in the shader", 9.733},
    {"vertices only", 1.229},
    {"ideal early termination", baseline / 1.419},
    {"multi-pass, N = 2", baseline / 0.925},
    {"multi-pass, N = 4", baseline / 0.939},
    {"multi-pass, N = 8", baseline / 1.041},
    {"multi-pass, N = 16", baseline / 1.053},
    {"multi-pass, N = 32", baseline / 1.032},
};

/// The splats in another order; the same quads.
struct Order {
  const char* name;
  double rgba16f, rgba8, killed;  ///< millions of cycles, measured
  std::function<void(std::vector<Splat>&)> arrange;
};

/// Of the screen tile of a splat's centre.
std::uint64_t tile_of(const Splat& splat) {
  const auto tile = [](float at) { return static_cast<std::uint64_t>(std::max(at, 0.0F)) / screen_tile_pixels; };
  return tile(splat.cy) << 16U | tile(splat.cx);
}

void shuffle(std::vector<Splat>& splats) {
  for (std::size_t i = splats.size(); i > 1; --i) std::swap(splats[i - 1], splats[mix(i) % i]);
}
void sort_by_tile(std::vector<Splat>& splats) {
  std::stable_sort(splats.begin(), splats.end(),
                   [](const Splat& a, const Splat& b) { return tile_of(a) < tile_of(b); });
}
void take_tiles_in_turn(std::vector<Splat>& splats) {
  sort_by_tile(splats);
  std::vector<std::pair<std::size_t, std::size_t>> turns;  // of its tile, in all
  std::size_t turn = 0;
  for (std::size_t i = 0; i < splats.size(); ++i) {
    turn = i > 0 && tile_of(splats[i]) == tile_of(splats[i - 1]) ? turn + 1 : 0;
    turns.emplace_back(turn, i);
  }
  std::sort(turns.begin(), turns.end());
  std::vector<Splat> arranged;
  for (const auto& [of_tile, index] : turns) arranged.push_back(splats[index]);
  splats = std::move(arranged);
}

const std::vector<Order>& orders() {
  static const std::vector<Order> all = {{"as drawn", 15.91, 11.64, 7.74, {}},
                                         {"shuffled", 15.16, 9.33, 5.79, shuffle},
                                         {"sorted by tile", 16.40, 10.36, 5.79, sort_by_tile},
                                         {"tiles in turn", 14.78, 9.75, 5.62, take_tiles_in_turn}};
  return all;
}

void compare_modes(const Gpu& gpu, const Draw& draw) {
  std::printf("%-28s%12s%12s%10s\n", "millions of cycles", "measured", "predicted", "%");
  double sum = 0;
  for (const auto& [mode, measured] : measurements) {
    const double predicted = gpu.cycles(draw, mode_named(mode));
    std::printf("%-28s%12.3f%12.3f%+10.1f\n", mode, measured, predicted, percent(predicted, measured));
    std::fflush(stdout);
    sum += std::fabs(percent(predicted, measured));
  }
  std::printf("%-28s%34.1f\n", "mean of the absolute errors", sum / static_cast<double>(std::size(measurements)));
}

void compare_orders(const Gpu& gpu, const Draw& draw) {
  std::printf("\n%-17s%21s%21s%21s\n%-17s", "order of splats", "RGBA16F", "RGBA8", "all killed", "");
  for (unsigned i = 0; i < 3; ++i) std::printf("%8s%7s%6s", "meas.", "pred.", "%");
  std::printf("\n");
  double sum = 0;
  for (const Order& order : orders()) {
    Draw arranged = draw;
    if (order.arrange) order.arrange(arranged.splats);
    const std::pair<const char*, double> columns[] = {{"RGBA16F", order.rgba16f},
                                                      {"RGBA8", order.rgba8},
                                                      {"stencil test, all killed", order.killed}};
    std::printf("%-17s", order.name);
    for (const auto& [name, measured] : columns) {
      const double predicted = gpu.cycles(arranged, mode_named(name));
      std::printf("%8.2f%7.2f%+6.1f", measured, predicted, percent(predicted, measured));
      std::fflush(stdout);
      sum += std::fabs(percent(predicted, measured));
    }
    std::printf("\n");
  }
  std::printf("%-17s%63.1f\n", "mean of the absolute errors", sum / static_cast<double>(3 * orders().size()));
}

}  // namespace

}  // namespace vrpipe::measured

int main(int argc, char** argv) try {
  vrpipe::Fidelity fidelity = vrpipe::Fidelity::cycle;
  bool is_short = false, is_synthetic = false, is_uniform = false, is_in_shader = false, is_passes = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--short") == 0) {
      is_short = true;
    } else if (std::strcmp(argv[i], "--synthetic") == 0) {
      is_synthetic = true;
    } else if (std::strcmp(argv[i], "--uniform") == 0) {
      is_uniform = true;
    } else if (std::strcmp(argv[i], "--in-shader") == 0) {
      is_in_shader = true;
    } else if (std::strcmp(argv[i], "--passes") == 0) {
      is_passes = true;
    } else if (std::strcmp(argv[i], "--fidelity") == 0 && i + 1 < argc) {
      fidelity = vrpipe::fidelity_named(argv[++i]);
    } else {
      std::fprintf(stderr, "measured_gpu: unknown argument %s\n", argv[i]);
      return 2;
    }
  }
  const vrpipe::measured::Gpu gpu(fidelity);
  if (is_synthetic) vrpipe::measured::compare_scenes(gpu, is_short);
  if (is_uniform) vrpipe::measured::compare_uniform(gpu, is_short);
  if (is_in_shader) vrpipe::measured::compare_in_shader(gpu, is_short);
  if (is_passes) vrpipe::measured::compare_passes(gpu, is_short);
  if (is_synthetic || is_uniform || is_in_shader || is_passes) return 0;
  vrpipe::Draw draw = vrpipe::testing::measured_draw();
  if (is_short) draw.splats.resize(draw.splats.size() / 200);
  vrpipe::measured::compare_modes(gpu, draw);
  vrpipe::measured::compare_orders(gpu, draw);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "measured_gpu: %s\n", error.what());
  return 2;
}
