#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

#include "support/builders.h"
#include "support/mixed_reference.h"
#include "support/simulate.h"

/// Random frames of meshes and splats, and what they come to.

namespace vrpipe::testing {

inline constexpr std::uint32_t mixed_frame_width = 80;
inline constexpr std::uint32_t mixed_frame_height = 56;

inline MeshVertex random_vertex(std::uint64_t seed, std::uint64_t k) {
  return {uniform(seed, k, -20, mixed_frame_width + 20.0F),
          uniform(seed, k + 1, -20, mixed_frame_height + 20.0F),
          uniform(seed, k + 2, 0, 1),
          uniform(seed, k + 3, 0.1F, 2),
          uniform(seed, k + 4, 0, 1),
          uniform(seed, k + 5, 0, 1),
          uniform(seed, k + 6, 0, 1),
          uniform(seed, k + 7, -1, 1),
          uniform(seed, k + 8, -1, 1),
          uniform(seed, k + 9, -1, 1)};
}

/// Triangles that face either way and cut one another.
inline std::shared_ptr<Draw> random_mesh(std::uint32_t triangles, std::uint64_t seed) {
  auto draw = std::make_shared<Draw>(draw_of(mixed_frame_width, mixed_frame_height));
  for (std::uint32_t i = 0; i < triangles; ++i) {
    MeshTriangle& triangle = draw->mesh.emplace_back();
    for (unsigned vertex = 0; vertex < 3; ++vertex)
      triangle.vertices[vertex] = random_vertex(seed, 100 * i + 20 * vertex);
  }
  return draw;
}

/// Front to back.
inline std::shared_ptr<Draw> random_splats(std::uint32_t splats, std::uint64_t seed) {
  auto draw = std::make_shared<Draw>(random_draw(mixed_frame_width, mixed_frame_height, splats, seed));
  for (std::uint32_t i = 0; i < splats; ++i)
    draw->splats[i].depth = (static_cast<float>(i) + 0.5F) / static_cast<float>(splats);
  return draw;
}

inline DrawState depth_alone(CullMode cull) {
  DrawState state;
  state.shader = FragmentShader::none;
  state.depth = {true, Compare::less, true};
  state.cull = cull;
  return state;
}
inline DrawState tested_splats(const DrawState& of_request) {
  DrawState state = of_request;
  state.depth = {true, Compare::less, false};
  return state;
}
inline DrawState color_of_mesh(CullMode cull, bool lit) {
  DrawState state;
  state.shader = lit ? FragmentShader::lit : FragmentShader::vertex;
  state.light = {0.6F, 0, 0.8F, 0.25F};
  state.depth = {true, Compare::equal, false};
  state.cull = cull;
  return state;
}

/// Depth of the mesh, splats in front of it, its colour under what they leave.
inline Frame mixed_frame(std::uint64_t seed, const RunRequest& request) {
  Frame frame(mixed_frame_width, mixed_frame_height);
  frame.set_depth_format(static_cast<DepthFormat>(seed % 3));
  const CullMode cull = static_cast<CullMode>(seed / 3 % 3);
  const auto mesh = random_mesh(12, seed);
  frame.draw(mesh, depth_alone(cull), "depth");
  frame.draw(random_splats(60, seed + 1000), tested_splats(draw_state_of(request)), "splats");
  frame.draw(mesh, color_of_mesh(cull, seed % 2 == 0), "mesh");
  return frame;
}

/// Stencil and depth of any kind, tested before shading and after it, in several draws and clears.
inline Frame random_frame(std::uint64_t seed, const RunRequest& request) {
  Frame frame(mixed_frame_width, mixed_frame_height);
  frame.set_depth_format(static_cast<DepthFormat>(mix(seed) % 3));
  auto pick = [&, k = std::uint64_t{0}](unsigned choices) mutable {
    return static_cast<unsigned>(mix(seed ^ mix(++k)) % choices);
  };
  const unsigned draws = 3 + pick(5);
  for (unsigned i = 0; i < draws; ++i) {
    if (pick(5) == 0) {
      Clear clear;
      clear.color = pick(4) == 0;
      clear.depth = pick(2) == 0;
      clear.stencil = pick(2) == 0;
      clear.depth_value = 0.25F * static_cast<float>(pick(5));
      clear.stencil_value = static_cast<std::uint8_t>(pick(128));
      frame.clear(clear);
    }
    const bool is_mesh = pick(2) == 0;
    DrawState state = draw_state_of(request);
    state.early_termination = state.early_termination && pick(2) == 0;
    state.depth = {pick(4) != 0, static_cast<Compare>(pick(compares)), pick(2) == 0};
    state.stencil.test = pick(2) == 0;
    for (StencilFace* face : {&state.stencil.front, &state.stencil.back}) {
      face->compare = static_cast<Compare>(pick(compares));
      face->stencil_fail = static_cast<StencilOperation>(pick(stencil_operations));
      face->depth_fail = static_cast<StencilOperation>(pick(stencil_operations));
      face->pass = static_cast<StencilOperation>(pick(stencil_operations));
      face->reference = static_cast<std::uint8_t>(pick(128));
      face->read_mask = static_cast<std::uint8_t>(pick(256));
      face->write_mask = static_cast<std::uint8_t>(pick(256));
    }
    if (is_mesh) {
      state.shader = std::array{FragmentShader::vertex, FragmentShader::lit, FragmentShader::none}[pick(3)];
      state.light = {0, 1, 0, 0.5F};
      state.cull = static_cast<CullMode>(pick(3));
    } else if (pick(4) == 0) {
      state.shader = FragmentShader::none;
    }
    state.late_tests = state.shader != FragmentShader::none && mix(31 * seed + i) % 3 == 0;
    frame.draw(is_mesh ? random_mesh(1 + pick(10), seed + i) : random_splats(1 + pick(40), seed + i), state,
               "draw " + std::to_string(i));
  }
  return frame;
}

/// That an image is the reference's within its bound; `slack`: of what termination leaves out.
inline void expect_image(const RunResult& result, const MixedReference& reference, double slack) {
  unsigned wrong = 0;
  for (std::uint32_t y = 0; y < mixed_frame_height; ++y) {
    for (std::uint32_t x = 0; x < mixed_frame_width; ++x) {
      const std::size_t index = std::size_t{y} * mixed_frame_width + x;
      const auto pixel = result.framebuffer.color.pixel(x, y);
      for (unsigned channel = 0; channel < 4; ++channel) {
        const double bound =
            (channel == 3 ? reference.bound[index].alpha : reference.bound[index].color) + slack + 2e-5;
        const double off = std::fabs(static_cast<double>(pixel[channel]) - reference.rgba[index][channel]);
        if (off > bound && ++wrong < 4) {
          ADD_FAILURE() << "pixel " << x << "," << y << " channel " << channel << ": " << pixel[channel] << " for "
                        << reference.rgba[index][channel] << ", " << bound << " is allowed";
        }
      }
    }
  }
}

/// That depth and stencil are the reference's to the bit.
inline void expect_depth_stencil(const RunResult& result, const MixedReference& reference) {
  const DepthStencilSurface& surface = result.framebuffer.depth_stencil;
  unsigned wrong = 0;
  for (std::uint32_t y = 0; y < reference.height; ++y) {
    for (std::uint32_t x = 0; x < reference.width; ++x) {
      const TileId tile{static_cast<std::uint16_t>(x / 16), static_cast<std::uint16_t>(y / 16)};
      const DepthStencilQuad& quad = surface.quad(surface.grid().place(tile, (y % 16) / 2 * 8 + (x % 16) / 2));
      const unsigned lane = y % 2 * 2 + x % 2;
      const std::size_t index = std::size_t{y} * reference.width + x;
      wrong += quad.depth[lane] != reference.depth[index] || quad.stencil[lane] != reference.stencil[index];
    }
  }
  EXPECT_EQ(wrong, 0U);
}

/// Frames in strict termination, at each fidelity in each variant.
class FidelityAndVariant : public ::testing::TestWithParam<std::tuple<Fidelity, std::string>> {
 protected:
  RunRequest request() const {
    RunRequest request = request_of(std::get<1>(GetParam()), std::get<0>(GetParam()), strictly);
    // The fragment shader's, so that no fragment's fate depends on it.
    request.settings = {{"state", "exponential", "exact"}};
    return request;
  }
  static RunResult run(const RunRequest& request, const Frame& frame) {
    fresh_simulation();
    return simulate(request, frame);
  }
};
inline auto every_fidelity_and_variant() {
  return ::testing::Combine(::testing::ValuesIn(fidelities()), ::testing::Values("baseline", "qm", "het", "het+qm"));
}
inline std::string name_of_fidelity_and_variant(const ::testing::TestParamInfo<FidelityAndVariant::ParamType>& each) {
  const std::string& variant = std::get<1>(each.param);
  return name_of(std::get<0>(each.param)) + ("_" + (variant == "het+qm" ? std::string("both") : variant));
}

}  // namespace vrpipe::testing
