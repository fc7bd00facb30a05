#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// The programs that a frame's fragment warps run: one for each shader, with and without merging.
template <class Program>
class FragmentPrograms {
 public:
  /// @param make  gives the Program of (shader, whether it merges); only of shaders that the frame has, and of splats
  template <class Make>
  FragmentPrograms(const Frame& frame, Make&& make) {
    add(FragmentShader::splat, make);
    for (const DrawCall& call : frame.draws()) {
      if (shader_of(call.state.shader).empty()) add(call.state.shader, make);
      several_ = several_ || call.state.shader != FragmentShader::splat;
      shaders_.push_back(call.state.shader);
    }
  }
  const Program& of(const Warp& warp) const {
    // All quads are of one state.
    const FragmentShader shader = several_ ? shaders_[warp.quads[0].draw] : FragmentShader::splat;
    return shader_of(shader)[warp.merge_pairs != 0 ? 1 : 0];
  }
  /// Calls `each(Program&)` for all.
  template <class Each>
  void for_each(Each&& each) {
    for (std::vector<Program>& of_shader : programs_) {
      for (Program& program : of_shader) each(program);
    }
  }

 private:
  static constexpr unsigned fragment_shaders = static_cast<unsigned>(FragmentShader::alpha_threshold) + 1;
  template <class Make>
  void add(FragmentShader shader, Make&& make) {
    programs_[static_cast<unsigned>(shader)] = {make(shader, false), make(shader, true)};
  }
  const std::vector<Program>& shader_of(FragmentShader shader) const {
    return programs_[static_cast<unsigned>(shader)];
  }

  std::array<std::vector<Program>, fragment_shaders> programs_;
  std::vector<FragmentShader> shaders_;  ///< by draw
  bool several_ = false;
};

}  // namespace vrpipe
