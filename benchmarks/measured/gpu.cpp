#include "measured/gpu.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <vector>

#include <vrpipe/workloads/multi_pass.h>

namespace vrpipe::measured {

namespace {

void test_stencil(DrawState& state, Compare compare) {
  state.stencil.test = true;
  state.stencil.front.compare = state.stencil.back.compare = compare;
}

const std::vector<Mode>& modes() {
  static const std::vector<Mode> all = {
      {"RGBA16F"},
      {"RGBA8", ColorFormat::rgba8},
      {"RGBA32F", ColorFormat::rgba32f},
      {"not blended", ColorFormat::rgba16f, [](DrawState& state) { state.blend = false; }},
      {"stencil test, all pass", ColorFormat::rgba16f, [](DrawState& state) { test_stencil(state, Compare::always); }},
      {"stencil test, all killed", ColorFormat::rgba16f, [](DrawState& state) { test_stencil(state, Compare::none); }},
      {"pruned in the shader", ColorFormat::rgba16f, [](DrawState& state) { state.pruning_threshold = 1; }},
      {"vertices only", ColorFormat::rgba16f, {}, 1, false, true},
      {"ideal early termination", ColorFormat::rgba16f, {}, 1, true},
      {"multi-pass, N = 2", ColorFormat::rgba16f, {}, 2},
      {"multi-pass, N = 4", ColorFormat::rgba16f, {}, 4},
      {"multi-pass, N = 8", ColorFormat::rgba16f, {}, 8},
      {"multi-pass, N = 16", ColorFormat::rgba16f, {}, 16},
      {"multi-pass, N = 32", ColorFormat::rgba16f, {}, 32},
      {"in the shader", ColorFormat::rgba16f, {}, 1, false, false, "in-shader"},
      {"in the shader, no lock", ColorFormat::rgba16f, {}, 1, false, false, "in-shader-no-lock"},
  };
  return all;
}

}  // namespace

const Mode& mode_named(const std::string& name) {
  const auto mode = std::find_if(modes().begin(), modes().end(), [&](const Mode& each) { return each.name == name; });
  if (mode == modes().end()) throw std::logic_error("no mode " + name);
  return *mode;
}

RunResult Gpu::run(const Draw& draw, const Mode& mode) const {
  RunRequest request;
  request.platform = &platform_named(platform_);
  request.variant = variant_named(mode.terminates ? "het" : mode.variant);
  request.termination = mode.terminates ? Termination::strict : Termination::paper;
  request.fidelity = fidelity_;
  request.format = mode.format;
  request.settings = {{"state", "obb_padding", "0"}};  // the splats have the boxes that were drawn
  request.settings.insert(request.settings.end(), settings_.begin(), settings_.end());
  DrawState state = draw_state_of(request);
  state.early_termination = mode.terminates;
  if (mode.change) mode.change(state);
  Draw moved;
  if (mode.off_screen) {
    moved = draw;
    for (Splat& splat : moved.splats) splat.cx += 8192;
  }
  const auto frame = multi_pass_frame(mode.off_screen ? moved : draw, state, mode.passes);
  fresh_simulation();
  return simulate(request, *frame);
}

void print_in_columns(int width, int digits, double measured, double predicted) {
  std::printf("%*.*f%*.*f%+7.1f", width, digits, measured, width, digits, predicted, percent(predicted, measured));
}

}  // namespace vrpipe::measured
