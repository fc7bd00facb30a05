#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe::testing {

/// A splat of standard deviations `sigma_a`, `sigma_b` pixels along axes turned by `angle`, whose box ends where alpha
/// is 1/255.
inline Splat splat_at(float x, float y, float sigma_a, float sigma_b, float angle, float opacity, float red = 1,
                      float green = 1, float blue = 1) {
  const float r = std::sqrt(std::fmax(0.0F, 2 * std::log(255 * opacity)));
  const float c = std::cos(angle);
  const float s = std::sin(angle);
  return {x, y, c * sigma_a * r, s * sigma_a * r, -s * sigma_b * r, c * sigma_b * r, r, 0, red, green, blue, opacity};
}

inline Splat round_splat(float x, float y, float sigma, float opacity, float red = 1, float green = 1, float blue = 1) {
  return splat_at(x, y, sigma, sigma, 0, opacity, red, green, blue);
}

/// An axis-parallel box of one alpha (but for the falloff's last bits: its sigmas are 0).
inline Splat flat_box(float x0, float y0, float x1, float y1, float alpha, float red = 1, float green = 1,
                      float blue = 1) {
  return {(x0 + x1) / 2, (y0 + y1) / 2, (x1 - x0) / 2, 0, 0, (y1 - y0) / 2, 0, 0, red, green, blue, alpha};
}

inline Draw draw_of(std::uint32_t width, std::uint32_t height, std::vector<Splat> splats = {}) {
  Draw draw;
  draw.width = width;
  draw.height = height;
  draw.splats = std::move(splats);
  return draw;
}

/// A frame of this draw alone, which it refers to.
/// A GPC of several, to which the screen tiles go one by one along rows, a tile further in each row.
inline Placement placement_of(unsigned gpcs, unsigned gpc, unsigned width, unsigned height) {
  return {gpcs, gpc,
          std::make_shared<TileOwners>(width, height, [gpcs](TileId tile) { return (tile.x + tile.y) % gpcs; })};
}

inline RenderContext context_of(const Draw& draw, const DrawState& state = {}) {
  RenderContext context;
  context.frame = Frame::of(draw, state);
  return context;
}

inline RenderContext context_of(const Frame& frame) {
  RenderContext context;
  context.frame = std::make_shared<Frame>(frame);
  return context;
}
/// A draw that a frame can keep.
inline std::shared_ptr<const Draw> geometry_of(std::uint32_t width, std::uint32_t height,
                                               std::vector<Splat> splats = {}) {
  return std::make_shared<Draw>(draw_of(width, height, std::move(splats)));
}
inline DrawState pruned_at(float threshold) {
  DrawState state;
  state.pruning_threshold = threshold;
  return state;
}

/// Of a draw that sets the stencil to 1 where a pixel has come to the threshold.
inline DrawState alpha_threshold_state(float threshold = 0.996F) {
  DrawState state;
  state.shader = FragmentShader::alpha_threshold;
  state.termination_threshold = threshold;
  state.stencil.test = true;
  state.stencil.front.pass = StencilOperation::replace;
  state.stencil.front.reference = 1;
  return state;
}

/// Gives the context a frame whose draws have another state.
inline void change_state(RenderContext& context, const std::function<void(DrawState&)>& change) {
  auto changed = std::make_shared<Frame>(*context.frame);
  changed->change_states(change);
  context.frame = std::move(changed);
}
inline void terminate_early(RenderContext& context, bool on = true) {
  change_state(context, [on](DrawState& state) { state.early_termination = on; });
}

/// A number in [low, high) from a seed and an index.
inline float uniform(std::uint64_t seed, std::uint64_t index, float low, float high) {
  return low + (high - low) * static_cast<float>(mix(seed ^ mix(index)) >> 40U) / 16777216.0F;
}

/// Splats of many sizes, shapes, opacities and colours, on and around the image; some are far larger than it.
inline Draw random_draw(std::uint32_t width, std::uint32_t height, std::uint32_t splats, std::uint64_t seed) {
  Draw draw = draw_of(width, height);
  const auto w = static_cast<float>(width);
  const auto h = static_cast<float>(height);
  for (std::uint32_t i = 0; i < splats; ++i) {
    const std::uint64_t k = 16ULL * i;
    const float size = std::exp(uniform(seed, k, -1.0F, 2.2F));
    const float thin = std::exp(uniform(seed, k + 1, -2.0F, 0.0F));
    draw.splats.push_back(splat_at(uniform(seed, k + 2, -0.1F * w, 1.1F * w), uniform(seed, k + 3, -0.1F * h, 1.1F * h),
                                   i % 37 == 0 ? 100 * size : size, size * thin, uniform(seed, k + 4, 0, 6.2F),
                                   i % 5 == 0 ? 1.0F : uniform(seed, k + 5, 0.006F, 1.0F), uniform(seed, k + 6, 0, 1),
                                   uniform(seed, k + 7, 0, 1), uniform(seed, k + 8, 0, 1)));
  }
  return draw;
}

/// A triangle that covers exactly the four samples of the quad at pixel (x, y), both even.
inline ScreenTriangle one_quad_triangle(float x, float y) {
  return {{x - 0.45F, x + 2.45F, x + 1.0F}, {y + 0.4F, y + 0.4F, y + 2.3F}};
}

/// 0, 1, 2, ...
inline std::vector<unsigned> numbers(unsigned count) {
  std::vector<unsigned> all;
  for (unsigned i = 0; i < count; ++i) all.push_back(i);
  return all;
}

/// What is no work but a mark, of any stream that has them.
template <class Item>
Item marked(Mark mark = Mark::end_of_frame) {
  Item item;
  item.mark = mark;
  return item;
}

/// A beat of full quads of one tile, at these positions, of splats first, first + 1, ...
inline QuadBeat beat_of(TileId tile, const std::vector<unsigned>& positions, std::uint32_t first_splat = 0,
                        bool last_of_bin = false) {
  QuadBeat beat;
  beat.tile = tile;
  beat.last_of_bin = last_of_bin;
  for (const unsigned position : positions) {
    beat.quads[beat.count++] = {first_splat++, static_cast<std::uint8_t>(position), all_lanes, 0, 0};
  }
  return beat;
}

inline QuadBeat end_beat() { return marked<QuadBeat>(); }

inline QuadColor color_of(float red, float green, float blue, float alpha) {
  return {splat_lanes(red), splat_lanes(green), splat_lanes(blue), splat_lanes(alpha)};
}

}  // namespace vrpipe::testing
