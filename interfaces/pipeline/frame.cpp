#include <vrpipe/pipeline/frame.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

namespace {

constexpr std::uint32_t largest_side = 16384;
constexpr std::uint64_t most_splats = std::uint64_t{1} << 31;  // primitives are numbered in 32 bits

auto fields_of(const DrawState& state) {
  return std::tie(state.early_termination, state.termination_threshold, state.termination_inclusive,
                  state.pruning_threshold, state.splat_extent, state.obb_padding, state.depth, state.stencil,
                  state.late_tests, state.early_tests, state.cull, state.shader, state.light, state.blend);
}

}  // namespace

bool operator==(const Light& a, const Light& b) {
  return std::tie(a.x, a.y, a.z, a.ambient) == std::tie(b.x, b.y, b.z, b.ambient);
}

bool operator==(const DrawState& a, const DrawState& b) { return fields_of(a) == fields_of(b); }

float DrawState::terminating_alpha() const {
  // To exceed a threshold is to reach the next float.
  return termination_inclusive ? termination_threshold
                               : std::nextafter(termination_threshold, std::numeric_limits<float>::infinity());
}

const char* name_of(Termination termination) { return termination == Termination::strict ? "strict" : "paper"; }

Termination termination_named(const std::string& name) {
  for (const Termination termination : {Termination::paper, Termination::strict}) {
    if (name == name_of(termination)) return termination;
  }
  throw UserError("unknown termination '" + name + "'", "--termination", "there is no such rule",
                  "use paper or strict");
}

Frame::Frame(std::uint32_t width, std::uint32_t height) : width_(width), height_(height) {
  if (width == 0 || height == 0 || width > largest_side || height > largest_side) {
    throw UserError(fmt::format("unusable size {}x{}", width, height), "frame",
                    fmt::format("a side is 0 or beyond {} pixels", largest_side),
                    fmt::format("use 1 to {}", largest_side));
  }
}

std::shared_ptr<Frame> Frame::of(const Draw& draw, const DrawState& state) {
  auto frame = std::make_shared<Frame>(draw.width, draw.height);
  frame->draw(std::shared_ptr<const Draw>(&draw, [](const Draw*) {}), state);
  return frame;
}

void Frame::draw(std::shared_ptr<const Draw> geometry, const DrawState& state, std::string name, std::uint32_t first,
                 std::uint32_t splats) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    throw UserError(fmt::format("cannot draw '{}'", name), fmt::format("draw {} of the frame", draws_.size()), why,
                    remedy);
  };
  if (geometry->width != width_ || geometry->height != height_) {
    refuse(fmt::format("it is made for {}x{} pixels, the frame has {}x{}", geometry->width, geometry->height, width_,
                       height_),
           "make all draws for one size");
  }
  const std::size_t there = geometry->size();
  if (geometry->is_mesh()) {
    if (!geometry->splats.empty() || !geometry->triangles.empty()) {
      refuse("it is a mesh that has splats as well", "draw them apart");
    }
    if (state.shader == FragmentShader::splat) refuse("it is a mesh, and its shader is that of splats", "use another");
  } else if (there > 0 && (state.shader == FragmentShader::vertex || state.shader == FragmentShader::lit)) {
    refuse("it has splats, and its shader is that of a mesh", "use that of splats");
  }
  if (state.late_tests && state.shader == FragmentShader::none) {
    refuse("its tests are to come after shading, and it shades nothing", "leave late_tests out, or shade it");
  }
  if (state.late_tests && state.early_tests) {
    refuse("its tests are to come before shading and after it", "leave late_tests or early_tests out");
  }
  if (state.early_termination && !state.blend) {
    refuse("it terminates early, and does not blend", "leave early_termination or blend out");
  }
  if (reads_color(state.shader) && geometry->is_mesh())
    refuse("it is a mesh, and its shader is none of a mesh", "use another");
  if (!writes_color(state.shader) && reads_color(state.shader) && !state.writes_depth_stencil()) {
    refuse("its shader writes no colour, and it writes neither depth nor stencil", "have it write the stencil");
  }
  for (const StencilFace* face : {&state.stencil.front, &state.stencil.back}) {
    if (face->bits != stencil_bits && face->bits != all_stencil_bits)
      refuse(fmt::format("its stencil has bits {:#x}", face->bits), "use 0x7f or 0xff");
    if (face->reference > face->bits) {
      refuse(fmt::format("its stencil reference is {}", face->reference),
             "use 0 to 127: the highest bit is termination's");
    }
  }
  has_all_stencil_bits_ = has_all_stencil_bits_ || state.stencil.has_all_bits();
  if (has_all_stencil_bits_ && (state.early_termination || terminates_early())) {
    refuse("a draw terminates early, and one has all bits of the stencil", "leave the highest to termination");
  }
  if (!geometry->triangles.empty() && geometry->triangles.size() != there) {
    refuse(fmt::format("it has {} triangles for {} splats", geometry->triangles.size(), there),
           "give one for each splat, or none");
  }
  if (splats == ~0U && first <= there) splats = static_cast<std::uint32_t>(there - first);
  if (first > there || splats > there - first) {
    refuse(fmt::format("splats {} to {} of {}", first, std::uint64_t{first} + splats, there), "draw what is there");
  }
  if (draws_.size() == most_draws) refuse(fmt::format("a frame has {} draws at most", most_draws), "use fewer");
  if (std::uint64_t{splats_} + splats > most_splats) refuse("a frame has 2^31 splats at most", "use fewer");
  Command command;
  command.is_draw = true;
  command.draw = static_cast<DrawIndex>(draws_.size());
  command.changes_state = !draws_.empty() && draws_.back().state != state;
  add(command);
  draws_.push_back({std::move(name), state, std::move(geometry), first, splats, splats_, epoch_});
  splats_ += splats;
}

void Frame::preset_stencil(std::vector<std::uint8_t> values) {
  if (values.size() != std::size_t{width_} * height_) {
    throw UserError("cannot preset the stencil", "frame",
                    fmt::format("there are {} values for {}x{} pixels", values.size(), width_, height_),
                    "give one for each pixel");
  }
  stencil_ = std::make_shared<const std::vector<std::uint8_t>>(std::move(values));
}

void Frame::clear(Clear clear) {
  if (!(clear.depth_value >= 0 && clear.depth_value <= 1) || clear.stencil_value > stencil_bits) {
    throw UserError("cannot clear", "frame",
                    fmt::format("depth {} or stencil {} is out of range", clear.depth_value, clear.stencil_value),
                    "clear depth to 0 to 1, stencil to 0 to 127");
  }
  Command command;
  command.clear = clear;
  add(command);
  if (clear.termination) ++epoch_;
}

void Frame::add(const Command& command) {
  constexpr std::size_t most_commands = 0xfffe;  // marks have 16 bits
  if (commands_.size() == most_commands) {
    throw UserError("cannot draw the frame", "frame", fmt::format("it has more than {} commands", most_commands),
                    "use fewer");
  }
  commands_.push_back(command);
}

Frame Frame::gone_on_with(std::uint32_t drawn) const {
  Frame frame = *this;
  frame.drawn_ = drawn;
  std::uint16_t passed = 0;
  for (const DrawCall& call : draws_) {
    if (call.base < drawn) passed = call.epoch;
  }
  for (DrawCall& call : frame.draws_) call.epoch = static_cast<std::uint16_t>(call.epoch - passed);
  return frame;
}

void Frame::change_states(const std::function<void(DrawState&)>& change) {
  for (DrawCall& call : draws_) change(call.state);
  for (Command& command : commands_) {
    command.changes_state = command.is_draw && command.draw > 0 &&
                            draws_[command.draw].state != draws_[command.draw - std::size_t{1}].state;
  }
}

bool Frame::terminates_early() const {
  return std::any_of(draws_.begin(), draws_.end(), [](const DrawCall& call) { return call.state.early_termination; });
}

bool Frame::replaces_color() const {
  return std::any_of(draws_.begin(), draws_.end(), [](const DrawCall& call) { return !call.state.blend; });
}

bool Frame::tests_depth_stencil() const {
  return std::any_of(draws_.begin(), draws_.end(),
                     [](const DrawCall& call) { return call.state.tests_depth_stencil(); });
}

bool Frame::tests_late() const {
  return std::any_of(draws_.begin(), draws_.end(), [](const DrawCall& call) { return call.state.tests_late(); });
}

bool Frame::needs_zrop() const {
  return std::any_of(draws_.begin(), draws_.end(), [](const DrawCall& call) {
    return call.state.reads_depth_stencil() || call.state.shader == FragmentShader::none;
  });
}

bool Frame::clears_depth_stencil(Mark mark) const {
  const Clear* const clear = clear_of(mark);
  if (clear == nullptr) return false;
  return std::none_of(draws_.begin(), draws_.end(), [&](const DrawCall& call) {
    const DrawState& state = call.state;
    return (state.early_termination && !clear->termination) || (state.depth.test && !clear->depth) ||
           (state.stencil.test && !clear->stencil);
  });
}

const Clear* Frame::clear_of(Mark mark) const {
  if (mark == Mark::none || mark == Mark::end_of_frame) return nullptr;
  const Command& command = commands_[static_cast<std::size_t>(mark) - 1];
  return command.is_draw ? nullptr : &command.clear;
}

}  // namespace vrpipe
