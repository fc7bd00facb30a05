#include "sm/sm.h"

#include <algorithm>
#include <cmath>

#include <vrpipe/exp2.h>
#include <vrpipe/registry.h>

namespace vrpipe {

namespace {
constexpr float alpha_max = 0.99F;
constexpr float half_log2_e = 0.72134752F;
// Of the axes' determinant, px^2: below it the inverse overflows, and flushing denormals would decide.
constexpr float smallest_determinant = 1e-30F;

/// Sample positions of the quads of a screen tile, by column and by row.
struct Samples {
  Lanes x[quads_per_tile_row];
  Lanes y[quads_per_tile_row];
  Samples() {
    for (unsigned i = 0; i < quads_per_tile_row; ++i) {
      x[i] = 2.0F * static_cast<float>(i) + Lanes{0.5F, 1.5F, 0.5F, 1.5F};
      y[i] = 2.0F * static_cast<float>(i) + Lanes{0.5F, 0.5F, 1.5F, 1.5F};
    }
  }
};
const Samples samples;

/// What a colour target of 16 bits can hold; NaN gives 0.
float clamp_color(float value) { return std::min(std::max(0.0F, value), half_max); }
}  // namespace

SplatShader::SplatShader(const Parameters& parameters, const RenderState& state) : state_(state) {
  cost_.cores = parameters.cores;
  cost_.schedulers_per_core = parameters.schedulers_per_core;
  cost_.lanes_per_scheduler = parameters.lanes_per_scheduler;
  cost_.warps_per_core = parameters.warps_per_core;
  static_cast<void>(cost_.fragment_slots());  // refused at every fidelity, also where slots have no numbers
  cost_.vertex_warps = parameters.vertex_warps;
  cost_.warps_to_one_core = parameters.warps_to_one_core;
  // The first instructions compute addresses and load; the rest waits for the attributes.
  const auto program = [&](std::uint32_t instructions, std::uint32_t latency) {
    const std::uint32_t loads = std::min(instructions, 4U);
    return std::vector<ShaderSegment>{{loads, parameters.attribute_latency_cycles}, {instructions - loads, latency}};
  };
  cost_.vertex = program(parameters.vertex_instructions, parameters.fragment_latency_cycles);
  cost_.fragment = program(parameters.fragment_instructions, parameters.fragment_latency_cycles);
  cost_.merge = {{parameters.merge_instructions, parameters.merge_latency_cycles}};
}

void SplatShader::load(std::uint32_t index) {
  loaded_ = index;
  const Splat& splat = state_.draw->splats[index];
  const float determinant = splat.ax * splat.by - splat.ay * splat.bx;
  // A splat without extent has alpha = opacity wherever it is rasterised at all.
  const float scale = std::fabs(determinant) >= smallest_determinant ? splat.r / determinant : 0.0F;
  const float largest = std::max({splat.red, splat.green, splat.blue});
  const float least = std::min({splat.red, splat.green, splat.blue});
  if (!(least >= 0.0F && largest <= half_max)) ++colors_clamped;
  attributes_ = {
      splat.cx,         splat.cy,      splat.by * scale,       -splat.bx * scale,        -splat.ay * scale,
      splat.ax * scale, splat.opacity, clamp_color(splat.red), clamp_color(splat.green), clamp_color(splat.blue)};
}

template <Exponential Kind>
inline LanePair SplatShader::alpha_at(LanePair x, LanePair y) const {
  const Attributes& splat = attributes_;
  const LanePair dx = x - splat.cx;
  const LanePair dy = y - splat.cy;
  const LanePair u = dx * splat.m00 + dy * splat.m01;
  const LanePair v = dx * splat.m10 + dy * splat.m11;
  const LanePair squared = u * u + v * v;
  const LanePair alpha = shader_exp2<Kind>(squared * -half_log2_e) * splat.opacity;
  // So written that NaN stays NaN, and the pruning test prunes it.
  return select(alpha > alpha_max, LanePair{} + alpha_max, alpha);
}

void SplatShader::shade(const Warp& warp, ShadedWarp& out) {
  switch (state_.exponential) {
    case Exponential::exact: return shade_warp<Exponential::exact>(warp, out);
    case Exponential::ex2: return shade_warp<Exponential::ex2>(warp, out);
    case Exponential::fp16: return shade_warp<Exponential::fp16>(warp, out);
    case Exponential::table256: return shade_warp<Exponential::table256>(warp, out);
    case Exponential::table16: return shade_warp<Exponential::table16>(warp, out);
  }
}

template <Exponential Kind>
void SplatShader::shade_warp(const Warp& warp, ShadedWarp& out) {
  out.tile = warp.tile;
  out.sequence = warp.sequence;
  out.tile_sequence = warp.tile_sequence;
  out.end_of_draw = false;
  ++fragment_warps;
  quads_shaded += warp.count;
  // Sample positions are sums of small integers and halves: exact.
  const auto x = static_cast<float>(warp.tile.x * screen_tile_pixels);
  const auto y = static_cast<float>(warp.tile.y * screen_tile_pixels);
  unsigned count = 0;
  unsigned shaded = 0;
  unsigned pruned = 0;
  bool previous_lives = false;
  unsigned backs_of_pairs = 0;  // a bit a quad
  for (unsigned left = warp.merge_pairs; left != 0; left &= left - 1) backs_of_pairs |= 2U << (2 * __builtin_ctz(left));
  const auto finish = [&](unsigned i, LaneMask live, const QuadColor& color) {
    const Quad& quad = warp.quads[i];
    shaded += popcount(quad.coverage);
    pruned += popcount(static_cast<LaneMask>(quad.coverage & ~live));
    const bool back_of_pair = (backs_of_pairs >> i & 1U) != 0;
    if (live == 0) {
      ++quads_pruned;
    } else if (back_of_pair && previous_lives) {
      LaneMask& front = out.live[count - 1];
      out.color[count - 1] = blend_front_to_back(out.color[count - 1], color);
      fragments_merged += popcount(static_cast<LaneMask>(front & live));
      front = static_cast<LaneMask>(front | live);
      out.last_primitive[count - 1] = primitive_order(quad);
      ++quads_merged;
    } else {
      out.color[count] = color;
      out.position[count] = quad.position;
      out.live[count] = live;
      out.first_primitive[count] = primitive_order(quad);
      out.last_primitive[count] = primitive_order(quad);
      ++count;
    }
    previous_lives = live != 0;
  };
  for (unsigned i = 0, together = 0; i < warp.count; i += together) {
    // Two quads of a splat at a time; a single one twice.
    const Quad& quad = warp.quads[i];
    together = i + 1 < warp.count && warp.quads[i + 1].splat == quad.splat ? 2 : 1;
    const Quad& last = warp.quads[i + together - 1];
    if (quad.splat != loaded_) load(quad.splat);
    LanePair alpha = alpha_at<Kind>(x + join(samples.x[quad.position % quads_per_tile_row],
                                             samples.x[last.position % quads_per_tile_row]),
                                    y + join(samples.y[quad.position / quads_per_tile_row],
                                             samples.y[last.position / quads_per_tile_row]));
    const LanePairBits kept =
        (alpha >= state_.pruning_threshold) & join(expand_mask(quad.coverage), expand_mask(last.coverage));
    alpha = floats_of<LanePair>(bits_of(alpha) & kept);
    const LanePair red = alpha * attributes_.red;
    const LanePair green = alpha * attributes_.green;
    const LanePair blue = alpha * attributes_.blue;
    const unsigned live = sign_mask(kept);
    finish(i, live & all_lanes, {first_of(red), first_of(green), first_of(blue), first_of(alpha)});
    if (together == 1) continue;
    finish(i + 1, static_cast<LaneMask>(live >> 4U),
           {second_of(red), second_of(green), second_of(blue), second_of(alpha)});
  }
  fragments_shaded += shaded;
  fragments_pruned += pruned;
  out.count = static_cast<std::uint8_t>(count);
}

void SplatShader::shade_vertices(const VertexWarp&) { ++vertex_warps; }

namespace {
const Registrar<SplatShader, SmBehaviour> registrar("sm", "splat-shader",
                                                    "Gaussian splatting shaders with alpha pruning and quad merging");
}

}  // namespace vrpipe
