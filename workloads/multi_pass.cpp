#include <vrpipe/workloads/multi_pass.h>

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {
namespace {

/// Two triangles that cover every pixel of a frame once.
std::shared_ptr<const Draw> full_screen(std::uint32_t width, std::uint32_t height) {
  auto draw = std::make_shared<Draw>();
  draw->width = width;
  draw->height = height;
  Splat splat{};
  splat.opacity = 1;
  draw->splats.assign(2, splat);
  const auto right = static_cast<float>(width);
  const auto bottom = static_cast<float>(height);
  draw->triangles = {{{0, right, 0}, {0, 0, bottom}}, {{right, right, 0}, {0, bottom, bottom}}};
  return draw;
}

DrawState batch_state(DrawState state) {
  state.stencil.test = true;
  for (StencilFace* face : {&state.stencil.front, &state.stencil.back}) {
    *face = StencilFace();
    face->compare = Compare::equal;
  }
  return state;
}

/// By the rule of the batches.
DrawState threshold_state(const DrawState& batch) {
  DrawState state;
  state.termination_threshold = batch.termination_threshold;
  state.termination_inclusive = batch.termination_inclusive;
  state.shader = FragmentShader::alpha_threshold;
  state.stencil.test = true;
  for (StencilFace* face : {&state.stencil.front, &state.stencil.back}) {
    face->pass = StencilOperation::replace;
    face->reference = 1;
  }
  return state;
}

}  // namespace

std::shared_ptr<Frame> multi_pass_frame(const Draw& splats, const DrawState& state, std::uint32_t passes) {
  auto frame = std::make_shared<Frame>(splats.width, splats.height);
  draw_in_passes(*frame, std::shared_ptr<const Draw>(&splats, [](const Draw*) {}), state, passes);
  return frame;
}

void draw_in_passes(Frame& frame, std::shared_ptr<const Draw> splats, const DrawState& state, std::uint32_t passes,
                    const std::string& name, std::uint32_t first, std::uint32_t count) {
  if (passes == 1) return frame.draw(std::move(splats), state, name, first, count);
  const auto refuse = [](const std::string& why, const std::string& remedy) {
    throw UserError("cannot draw in passes", "--multi-pass", why, remedy);
  };
  const std::uint64_t there = splats->splats.size();
  if (first > there) refuse(fmt::format("splats from {} on of {}", first, there), "draw what is there");
  const std::uint64_t all = std::min<std::uint64_t>(count, there - first);
  if (passes == 0 || passes > all) {
    refuse(fmt::format("{} splats do not make {} batches", all, passes),
           fmt::format("use 1 to as many as there are splats, {} at most", most_passes));
  }
  if (state.stencil.test) refuse("the draw has a stencil test of its own", "leave that out");
  const DrawState batch = batch_state(state);
  const DrawState threshold = threshold_state(state);
  const std::shared_ptr<const Draw> screen = full_screen(frame.width(), frame.height());
  const std::string of = name.empty() ? std::string() : name + ", ";
  for (std::uint64_t pass = 0; pass < passes; ++pass) {
    if (pass > 0) frame.draw(screen, threshold, fmt::format("{}end of pass {}", of, pass));
    const auto from = static_cast<std::uint32_t>(pass * all / passes);
    const auto to = static_cast<std::uint32_t>((pass + 1) * all / passes);
    frame.draw(splats, batch, fmt::format("{}pass {}", of, pass + 1), first + from, to - from);
  }
}

}  // namespace vrpipe
