// What `gh100-gpc` predicts of a draw that was measured on the GPU itself, beside the measurement.
//   measured_gpu [--fidelity NAME] [--short]
// The draw is tests/data/measured_draw.spl.xz: 211,320 splats of a trained scene at 800x800, with boxes of its own. Cycles of
// the GPU are of its clock, 1980 MHz (tests/data/README.md). Nothing of the platform was fitted to it. --short takes a
// twentieth of the splats, of which nothing was measured, to see that it works.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/draw_list.h>
#include <vrpipe/workloads/multi_pass.h>

#include "support/data.h"

namespace vrpipe {

namespace {

struct Mode {
  const char* name;
  double measured;  ///< millions of cycles
  ColorFormat format = ColorFormat::rgba16f;
  std::function<void(DrawState&)> change = {};
  std::uint32_t passes = 1;
  bool terminates = false;  ///< strictly, in bin order
  bool off_screen = false;
};

void test_stencil(DrawState& state, Compare compare) {
  state.stencil.test = true;
  state.stencil.front.compare = state.stencil.back.compare = compare;
}

const std::vector<Mode>& modes() {
  constexpr double baseline = 15.885;
  static const std::vector<Mode> all = {
      {"RGBA16F", baseline},
      {"RGBA8", 11.586, ColorFormat::rgba8},
      {"RGBA32F", 98.168, ColorFormat::rgba32f},
      {"not blended", 14.524, ColorFormat::rgba16f, [](DrawState& state) { state.blend = false; }},
      {"stencil test, all pass", 17.442, ColorFormat::rgba16f,
       [](DrawState& state) { test_stencil(state, Compare::always); }},
      {"stencil test, all killed", 7.718, ColorFormat::rgba16f,
       [](DrawState& state) { test_stencil(state, Compare::none); }},
      {"pruned in the shader", 9.733, ColorFormat::rgba16f, [](DrawState& state) { state.pruning_threshold = 1; }},
      {"vertices only", 1.229, ColorFormat::rgba16f, {}, 1, false, true},
      {"ideal early termination", baseline / 1.419, ColorFormat::rgba16f, {}, 1, true},
      {"multi-pass, N = 2", baseline / 0.925, ColorFormat::rgba16f, {}, 2},
      {"multi-pass, N = 4", baseline / 0.939, ColorFormat::rgba16f, {}, 4},
      {"multi-pass, N = 8", baseline / 1.041, ColorFormat::rgba16f, {}, 8},
      {"multi-pass, N = 16", baseline / 1.053, ColorFormat::rgba16f, {}, 16},
      {"multi-pass, N = 32", baseline / 1.032, ColorFormat::rgba16f, {}, 32},
  };
  return all;
}

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

class Gpu {
 public:
  explicit Gpu(Fidelity fidelity) : fidelity_(fidelity) {}

  double cycles(const Draw& splats, const Mode& mode) const {
    RunRequest request;
    request.platform = &platform_named("gh100-gpc");
    request.variant = variant_named(mode.terminates ? "het" : "baseline");
    request.termination = mode.terminates ? Termination::strict : Termination::paper;
    request.fidelity = fidelity_;
    request.format = mode.format;
    request.settings = {{"state", "obb_padding", "0"}};  // the list has the boxes that were drawn
    DrawState state = draw_state_of(request);
    state.early_termination = mode.terminates;
    if (mode.change) mode.change(state);
    Draw moved;
    if (mode.off_screen) {
      moved = splats;
      for (Splat& splat : moved.splats) splat.cx += 8192;
    }
    const auto frame = multi_pass_frame(mode.off_screen ? moved : splats, state, mode.passes);
    fresh_simulation();
    return static_cast<double>(simulate(request, *frame).cycles.value_or(0)) / 1e6;
  }

 private:
  Fidelity fidelity_;
};

double percent(double predicted, double measured) { return 100 * (predicted / measured - 1); }

void compare_modes(const Gpu& gpu, const Draw& draw) {
  std::printf("%-28s%12s%12s%10s\n", "millions of cycles", "measured", "predicted", "%");
  double sum = 0;
  for (const Mode& mode : modes()) {
    const double predicted = gpu.cycles(draw, mode);
    std::printf("%-28s%12.3f%12.3f%+10.1f\n", mode.name, mode.measured, predicted, percent(predicted, mode.measured));
    std::fflush(stdout);
    sum += std::fabs(percent(predicted, mode.measured));
  }
  std::printf("%-28s%34.1f\n", "mean of the absolute errors", sum / static_cast<double>(modes().size()));
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
      const auto mode = std::find_if(modes().begin(), modes().end(),
                                     [&](const Mode& each) { return each.name == std::string(name); });
      const double predicted = gpu.cycles(arranged, *mode);
      std::printf("%8.2f%7.2f%+6.1f", measured, predicted, percent(predicted, measured));
      std::fflush(stdout);
      sum += std::fabs(percent(predicted, measured));
    }
    std::printf("\n");
  }
  std::printf("%-17s%63.1f\n", "mean of the absolute errors", sum / static_cast<double>(3 * orders().size()));
}

}  // namespace

}  // namespace vrpipe

int main(int argc, char** argv) try {
  vrpipe::Fidelity fidelity = vrpipe::Fidelity::cycle;
  bool is_short = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--short") == 0) {
      is_short = true;
    } else if (std::strcmp(argv[i], "--fidelity") == 0 && i + 1 < argc) {
      fidelity = vrpipe::fidelity_named(argv[++i]);
    } else {
      std::fprintf(stderr, "measured_gpu: unknown argument %s\n", argv[i]);
      return 2;
    }
  }
  const vrpipe::testing::UnpackedFile file("measured_draw.spl");
  vrpipe::Draw draw = vrpipe::read_draw_list(file.path()).draw;
  if (is_short) draw.splats.resize(draw.splats.size() / 20);
  const vrpipe::Gpu gpu(fidelity);
  vrpipe::compare_modes(gpu, draw);
  vrpipe::compare_orders(gpu, draw);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "measured_gpu: %s\n", error.what());
  return 2;
}
