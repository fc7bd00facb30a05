#include "sm/sm.h"

#include "sm/imitated_merging.h"
#include "sm/live_quads.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/arithmetic/exp2.h>

#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {
constexpr float half_log2_e = 0.72134752F;
// Of the axes' determinant, px^2: below it the inverse overflows, and flushing denormals would decide.
constexpr float smallest_determinant = 1e-30F;

/// Sample positions of the quads of a screen tile.
struct Samples {
  struct OfQuad {
    Lanes x, y;
  } of[positions_per_tile];
  Samples() {
    for (unsigned position = 0; position < positions_per_tile; ++position) {
      const auto x = static_cast<float>(2 * (position % quads_per_tile_row));
      const auto y = static_cast<float>(2 * (position / quads_per_tile_row));
      of[position] = {x + Lanes{0.5F, 1.5F, 0.5F, 1.5F}, y + Lanes{0.5F, 0.5F, 1.5F, 1.5F}};
    }
  }
};
const Samples samples;

/// Of a value that is computed with, or kept, in a format.
template <NumberFormat Format, class Floats>
inline Floats in_format(Floats value) {
  return Format == NumberFormat::fp16 ? round_to_half(value) : value;
}
template <NumberFormat Format>
inline ChannelPairs in_format(const ChannelPairs& color) {
  return {in_format<Format>(color.red_green), in_format<Format>(color.blue_alpha)};
}

/// Two fragments as one: in binary16 1 - alpha is rounded, then each multiply-add once.
template <NumberFormat Format>
inline ChannelPairs merged_in_format(const ChannelPairs& front, const ChannelPairs& back) {
  if constexpr (Format == NumberFormat::fp32) {
    return blend_front_to_back(front, back);
  } else {
    const ChannelPairs first = in_format<Format>(front);
    const ChannelPairs second = in_format<Format>(back);
    const LanePair transmittance = in_format<Format>(second_twice(1.0F - first.blue_alpha));
    return {in_format<Format>(first.red_green + transmittance * second.red_green),
            in_format<Format>(first.blue_alpha + transmittance * second.blue_alpha)};
  }
}

/// What a colour target of 16 bits can hold; NaN gives 0.
float clamp_color(float value) { return std::min(std::max(0.0F, value), half_max); }

/// Threads of a warp whose bit is set.
unsigned threads_in(std::uint32_t mask) { return static_cast<unsigned>(__builtin_popcount(mask)); }

/// The threads of a warp whose quads are of a draw, a bit each.
std::uint32_t threads_of(const Warp& warp, DrawIndex draw) {
  std::uint32_t threads = 0;
  for (unsigned i = 0; i < warp.count; ++i) threads |= warp.quads[i].draw == draw ? 0xfU << (4 * i) : 0U;
  return threads;
}
}  // namespace

SplatShader::SplatShader(const Parameters& parameters, const RenderContext& context)
    : time_(parameters, context.precision),
      context_(context),
      several_draws_gate_(context, "draw.several_draws"),
      mesh_gate_(context, "sm.mesh_shading"),
      color_reads_gate_(context, "sm.color_reads"),
      pairing_gate_(context, "qru.pairing"),
      several_draws_(several_draws_gate_.is_active() ||
                     (context.frame->draws().size() > 1 && several_draws_gate_.enter())),
      alpha_max_(context.precision.alpha_max),
      mesh_(context) {
  const DevicePrecision& precision = context.precision;
  if (precision.shading == NumberFormat::fp16) {
    alpha_max_ = round_to_half(alpha_max_);
    choose_merging<NumberFormat::fp16>(precision.merging, precision.export_format);
  } else {
    choose_merging<NumberFormat::fp32>(precision.merging, precision.export_format);
  }
}

void SplatShader::set_up(Attributes& attributes, const Quad& quad) {
  const Splat& splat = context_.draw(quad.draw).splat(quad.splat);
  const float determinant = splat.ax * splat.by - splat.ay * splat.bx;
  // A splat without extent has alpha = opacity wherever it is rasterised at all.
  const float scale = std::fabs(determinant) >= smallest_determinant ? splat.r / determinant : 0.0F;
  const float largest = std::max({splat.red, splat.green, splat.blue});
  const float least = std::min({splat.red, splat.green, splat.blue});
  if (!(least >= 0.0F && largest <= half_max)) ++colors_clamped;
  attributes = {join(splat_lanes(clamp_color(splat.red)), splat_lanes(clamp_color(splat.green))),
                join(splat_lanes(clamp_color(splat.blue)), splat_lanes(1.0F)),
                quad.splat,
                splat.cx,
                splat.cy,
                splat.by * scale,
                -splat.bx * scale,
                -splat.ay * scale,
                splat.ax * scale,
                splat.opacity};
  const DevicePrecision& precision = context_.precision;
  const bool computes_in_half = precision.shading == NumberFormat::fp16;
  if (precision.attributes == AttributeFormat::fp32 && !computes_in_half) return;
  // Beyond the largest half they saturate: infinite, they would make a NaN of a sample at the very centre.
  for (float* const value : {&attributes.m00, &attributes.m01, &attributes.m10, &attributes.m11})
    *value = round_to_half(std::clamp(*value, -half_max, half_max));
  const auto kept = [&](float value) {
    if (precision.attributes == AttributeFormat::quantized) value = round_to_unorm<255>(splat_lanes(value))[0];
    return precision.attributes == AttributeFormat::fp16 || computes_in_half ? round_to_half(value) : value;
  };
  attributes.opacity = kept(attributes.opacity);
  attributes.red_green =
      join(splat_lanes(kept(first_of(attributes.red_green)[0])), splat_lanes(kept(second_of(attributes.red_green)[0])));
  attributes.blue_one = join(splat_lanes(kept(first_of(attributes.blue_one)[0])), splat_lanes(1.0F));
}

const SplatShader::Attributes& SplatShader::attributes_of(AttributeTable& table, const Quad& quad) {
  Attributes& attributes = table[quad.splat % table.size()];
  if (attributes.splat != quad.splat) set_up(attributes, quad);
  return attributes;
}

template <Exponential Kind, NumberFormat Format>
inline LanePair SplatShader::alpha_at(LanePair x, LanePair y, const Shape& splats, float alpha_max) {
  // In binary16 the second product is of a fused multiply-add: 22 bits, which single precision holds.
  const auto rounded = [](LanePair value) { return in_format<Format>(value); };
  const LanePair dx = rounded(x - splats.cx);
  const LanePair dy = rounded(y - splats.cy);
  const LanePair u = rounded(rounded(dx * splats.m00) + dy * splats.m01);
  const LanePair v = rounded(rounded(dx * splats.m10) + dy * splats.m11);
  const LanePair squared = rounded(rounded(u * u) + v * v);
  const LanePair power = rounded(squared * in_format<Format>(LanePair{} - half_log2_e));
  const LanePair alpha = rounded(rounded(shader_exp2<Kind>(power)) * splats.opacity);
  // So written that NaN stays NaN, and the pruning test prunes it.
  return select(alpha > alpha_max, LanePair{} + alpha_max, alpha);
}

[[gnu::always_inline]] inline void SplatShader::count(const Warp& warp, const Threads& threads) {
  fragments_of_back_quads += threads_in(threads.live & (threads.merged_quads * all_lanes));
  // The threads of each draw, most often of one.
  for (std::uint32_t left = ~0U >> (4 * (quads_per_warp - warp.count)); left != 0;) {
    const DrawIndex draw = warp.quads[static_cast<unsigned>(__builtin_ctz(left)) / 4].draw;
    const std::uint32_t of_draw = several_draws_ ? threads_of(warp, draw) : left;
    const std::uint32_t covered = threads.covered & of_draw;
    const std::uint32_t live = threads.live & of_draw;
    const std::uint32_t quads = of_draw & 0x11111111U;  // a bit a quad
    const std::uint32_t live_quads = (live | live >> 1U | live >> 2U | live >> 3U) & quads;
    quads_shaded.add(draw, threads_in(quads));
    fragments_shaded.add(draw, threads_in(covered));
    quads_pruned.add(draw, threads_in(quads & ~live_quads));
    fragments_pruned.add(draw, threads_in(covered & ~live));
    if (threads.merged_quads != 0) {
      quads_merged.add(draw, threads_in(threads.merged_quads & of_draw));
      fragments_merged.add(draw, threads_in(threads.merged & of_draw));
    }
    left &= ~of_draw;
  }
}

template <NumberFormat Export>
inline void SplatShader::LiveColors<Export>::put(unsigned, LaneMask live, const ChannelPairs& color) {
  store(in_format<Export>(color), *next);
  next += live != 0;
}

void SplatShader::shade(const Warp& warp, ShadedWarp& out) { (this->*shade_in_)(warp, out); }

template <NumberFormat Shading>
void SplatShader::choose_merging(NumberFormat merging, NumberFormat exports) {
  constexpr NumberFormat single = NumberFormat::fp32;
  constexpr NumberFormat half = NumberFormat::fp16;
  if (merging == half) {
    shade_in_ =
        exports == half ? &SplatShader::shade_in<Shading, half, half> : &SplatShader::shade_in<Shading, half, single>;
  } else {
    shade_in_ = exports == half ? &SplatShader::shade_in<Shading, single, half>
                                : &SplatShader::shade_in<Shading, single, single>;
  }
}

template <NumberFormat Shading, NumberFormat Merging, NumberFormat Export>
void SplatShader::shade_in(const Warp& warp, ShadedWarp& out) {
  ++fragment_warps;
  out.tile = warp.tile;
  out.sequence = warp.sequence;
  out.tile_sequence = warp.tile_sequence;
  out.mark = Mark::none;
  const QuadLanes lanes(warp);
  Threads threads;
  threads.covered = lanes.covered();
  if (warp.merge_pairs != 0 && pairing_gate_.enter()) {
    shade_pairs<Shading, Merging, Export>(warp, threads, out);
  } else {
    LiveColors<Export> colors{out.color.data()};
    shade_quads<Shading>(warp, threads, colors);
    lanes.put_live(threads.live, several_draws_, out);
  }
  if (__builtin_expect(context_.hands_on_coverage, 0)) add_pruned(warp, threads, out);
  if (threads.merged != 0 && context_.fragments != nullptr) tell_merged(warp, threads.merged);
  count(warp, threads);
}

template <NumberFormat Shading, class Colors>
[[gnu::always_inline]] inline void SplatShader::shade_quads(const Warp& warp, Threads& threads, Colors& colors) {
  const FragmentShader shader = context_.state(warp.quads[0].draw).shader;  // all quads' state
  if (__builtin_expect(shader == FragmentShader::alpha_threshold, 0)) return shade_by_alpha(warp, threads, colors);
  if (__builtin_expect(shader != FragmentShader::splat, 0)) return shade_mesh(warp, threads, colors);
  switch (context_.precision.exponential) {
    case Exponential::exact: return shade_splats<Exponential::exact, Shading>(warp, threads, colors);
    case Exponential::ex2: return shade_splats<Exponential::ex2, Shading>(warp, threads, colors);
    case Exponential::fp16: return shade_splats<Exponential::fp16, Shading>(warp, threads, colors);
    case Exponential::table256: return shade_splats<Exponential::table256, Shading>(warp, threads, colors);
    case Exponential::table16: return shade_splats<Exponential::table16, Shading>(warp, threads, colors);
  }
}

template <class Colors>
[[gnu::noinline]] void SplatShader::shade_mesh(const Warp& warp, Threads& threads, Colors& colors) {
  constexpr auto row = static_cast<std::int32_t>(quads_per_tile_row);
  const auto color_of = [&](const Quad& quad) {
    return mesh_.shade(quad, static_cast<std::int32_t>(warp.tile.x * screen_tile_pixels) + 2 * (quad.position % row),
                       static_cast<std::int32_t>(warp.tile.y * screen_tile_pixels) + 2 * (quad.position / row));
  };
  const bool shades = mesh_gate_.enter();
  for (unsigned i = 0; i < warp.count; ++i) {
    const Quad& quad = warp.quads[i];
    colors.put(i, quad.coverage, channel_pairs(shades ? color_of(quad) : QuadColor{}));
  }
  threads.live = threads.covered;
}

template <class Colors>
[[gnu::noinline]] void SplatShader::shade_by_alpha(const Warp& warp, Threads& threads, Colors& colors) {
  const bool reads = color_reads_gate_.enter();
  const float threshold = context_.state(warp.quads[0].draw).terminating_alpha();
  for (unsigned i = 0; i < warp.count; ++i) {
    const Quad& quad = warp.quads[i];
    const Lanes alpha = surface_->quad(warp.tile, quad.position).alpha;
    const unsigned live = quad.coverage & (reads ? static_cast<unsigned>(sign_mask(alpha >= threshold)) : 0U);
    colors.put(i, static_cast<LaneMask>(live), ChannelPairs{});
    threads.live |= live << (4 * i);
  }
}

template <Exponential Kind, NumberFormat Shading, class Colors>
[[gnu::noinline]] void SplatShader::shade_splats(const Warp& warp, Threads& threads, Colors& colors) {
  // All quads' state. Alphas in binary16 are compared with a threshold in binary16: 1/255 is less there than in single precision.
  const float threshold = context_.state(warp.quads[0].draw).pruning_threshold;
  const float pruning_threshold = Shading == NumberFormat::fp16 ? round_to_half(threshold) : threshold;
  // Sample positions are sums of small integers and halves: exact.
  const auto x = static_cast<float>(warp.tile.x * screen_tile_pixels);
  const auto y = static_cast<float>(warp.tile.y * screen_tile_pixels);
  // Two quads at a time, which may be a pair; of an odd number the last is its own neighbour, not covered.
  const unsigned last = warp.count - 1U;
  const std::uint32_t covered = threads.covered;
  std::uint32_t live_of_warp = 0;
  for (unsigned i = 0; i < warp.count; i += 2) {
    const Quad& first = warp.quads[i];
    const Quad& second = warp.quads[i + (i < last)];
    const Attributes& of_first = attributes_of(attributes_of_first_, first);
    const bool is_same = first.splat == second.splat;
    const Attributes& of_second = is_same ? of_first : attributes_of(attributes_of_second_, second);
    const Samples::OfQuad& at_first = samples.of[first.position];
    const Samples::OfQuad& at_second = samples.of[second.position];
    const LanePair alpha = alpha_at<Kind, Shading>(x + join(at_first.x, at_second.x), y + join(at_first.y, at_second.y),
                                                   is_same ? Shape(of_first) : Shape(of_first, of_second), alpha_max_);
    const LanePairBits kept = (alpha >= pruning_threshold) & expand_mask_pair(covered >> (4 * i));
    const LanePair visible = floats_of<LanePair>(bits_of(alpha) & kept);
    const unsigned live = sign_mask(kept);
    const LanePair to_first = first_twice(visible);
    const LanePair to_second = second_twice(visible);
    colors.put(i, static_cast<LaneMask>(live & all_lanes),
               in_format<Shading>(ChannelPairs{to_first * of_first.red_green, to_first * of_first.blue_one}));
    colors.put(i + 1, static_cast<LaneMask>(live >> 4U),
               in_format<Shading>(ChannelPairs{to_second * of_second.red_green, to_second * of_second.blue_one}));
    live_of_warp |= live << (4 * i);
  }
  threads.live = live_of_warp;
}

void SplatShader::tell_merged(const Warp& warp, std::uint32_t threads) const {
  for (unsigned i = 0; i < warp.count; ++i) {
    const auto lanes = static_cast<LaneMask>(threads >> (4 * i) & all_lanes);
    if (lanes == 0) continue;
    context_.fragments->happened(FragmentFate::merged, warp.tile, warp.quads[i].position, lanes);
  }
}

template <NumberFormat Shading, NumberFormat Merging, NumberFormat Export>
void SplatShader::shade_pairs(const Warp& warp, Threads& threads, ShadedWarp& out) {
  // First the colours of all, then what becomes of them: a branch on that waits for the exponential.
  AllColors colors;
  shade_quads<Shading>(warp, threads, colors);
  unsigned count = 0;
  // Written whether the quad lives or not, since a branch would be mispredicted too often.
  const auto put = [&](const Quad& quad, LaneMask live, const ChannelPairs& color) {
    store(in_format<Export>(color), out.color[count]);
    out.position[count] = quad.position;
    out.live[count] = live;
    out.first_primitive[count] = out.last_primitive[count] = primitive_order(quad);
    if (several_draws_) out.draw[count] = quad.draw;
    count += live != 0;
  };
  const auto live_in = [&](unsigned quad) { return static_cast<LaneMask>(threads.live >> (4 * quad) & all_lanes); };
  const unsigned last = warp.count - 1U;
  for (unsigned i = 0; i < warp.count; i += 2) {
    const LaneMask front = live_in(i);
    const LaneMask back = i < last ? live_in(i + 1) : LaneMask{0};
    const ChannelPairs& of_front = colors.of_quad[i];
    const ChannelPairs& of_back = colors.of_quad[i + 1];
    if ((warp.merge_pairs >> (i / 2) & 1U) != 0 && front != 0 && back != 0) {
      put(warp.quads[i], static_cast<LaneMask>(front | back), merged_in_format<Merging>(of_front, of_back));
      out.last_primitive[count - 1] = primitive_order(warp.quads[i + 1]);
      threads.merged |= (unsigned{front} & back) << (4 * i + 4);
      threads.merged_quads |= 1U << (4 * i + 4);
    } else {
      put(warp.quads[i], front, of_front);
      put(warp.quads[i + (i < last)], back, of_back);
    }
  }
  out.count = static_cast<std::uint8_t>(count);
}

[[gnu::noinline]] void SplatShader::add_pruned(const Warp& warp, const Threads& threads, ShadedWarp& out) const {
  if (context_.state(warp.quads[0].draw).tests_late()) {  // what that leaves is all that takes part
    out.covered = out.live;
    return;
  }
  unsigned from = out.count;
  unsigned to = warp.count - threads_in(threads.merged_quads);
  out.count = static_cast<std::uint8_t>(to);
  LaneMask of_back = 0;
  // Those that survive move towards the end, so the last goes first.
  for (unsigned i = warp.count; i-- > 0;) {
    const Quad& quad = warp.quads[i];
    if ((threads.merged_quads >> (4 * i) & 1U) != 0) {
      of_back = quad.coverage;
      continue;
    }
    --to;
    out.covered[to] = static_cast<LaneMask>(quad.coverage | std::exchange(of_back, LaneMask{0}));
    if ((threads.live >> (4 * i) & all_lanes) != 0) {
      --from;
      out.color[to] = out.color[from];
      out.position[to] = out.position[from];
      out.live[to] = out.live[from];
      out.first_primitive[to] = out.first_primitive[from];
      out.last_primitive[to] = out.last_primitive[from];
      out.draw[to] = out.draw[from];
    } else {
      out.color[to] = QuadColor{};
      out.position[to] = quad.position;
      out.live[to] = 0;
      out.first_primitive[to] = out.last_primitive[to] = primitive_order(quad);
      out.draw[to] = quad.draw;
    }
  }
}

namespace {
// With few cores SMs bound most draws, whose order of warps decides: lt is up to 21 % off (benchmarks/lt_errors).
const SlotRegistrar sm_slot{{"sm", 90, "splat-shader", "", true, check_sm}, {{"cores", 4, 1024}}};
const Registrar<SplatShader, SmBehaviour> registrar("sm", "splat-shader",
                                                    "Gaussian splatting shaders with alpha pruning and quad merging",
                                                    false, Trust::trusted, true);
const Registrar<ImitatedMerging, SmBehaviour> imitated_merging(
    "sm", "imitated-merging", "the splat shader with shuffles, blends and discards in place of quad merging", false,
    Trust::trusted);
const EffectRegistrar mesh_shading_effect{
    {"sm",
     "mesh_shading",
     "splat-shader",
     EffectKind::functional,
     "shaders of meshes: vertex attributes, interpolated perspective-correct, and light",
     "no draw is of a mesh",
     "planes of attributes for the triangles that were shaded last",
     "before a warp of a mesh is shaded",
     {},
     [](const EffectQuestion& asked) {
       const FrameFacts& facts = asked.facts;
       if (facts.of_meshes == 0) return EffectDecision::omit("no draw is of a mesh");
       return EffectDecision::keep(fmt::format("{} of {} draws are of meshes", facts.of_meshes, facts.draws));
     }}};
const EffectRegistrar color_reads_effect{
    {"sm",
     "color_reads",
     "splat-shader",
     EffectKind::functional,
     "shaders that read the colour target",
     "no draw has one",
     "a look at the target for each quad",
     "before a warp with such a shader is shaded",
     {},
     [](const EffectQuestion& asked) {
       const FrameFacts& facts = asked.facts;
       if (facts.reading_color == 0) return EffectDecision::omit("no shader reads the colour target");
       return EffectDecision::keep(
           fmt::format("the shaders of {} of {} draws read it", facts.reading_color, facts.draws));
     }}};
const EffectRegistrar attribute_fetch_effect{
    {"sm",
     "attribute_fetch",
     "",
     EffectKind::timing,
     "the traffic of vertices and attributes, and L1s",
     "the SM array's memory port is bound to nothing, or at this fidelity to nothing that counts",
     "L1s in the cores, and the memory port's accesses",
     "before a vertex warp is shaded, where memory is connected",
     {},
     [](const EffectQuestion& asked) {
       if (!asked.memory_connected)
         return EffectDecision::omit(asked.counts_work ? "the SM array's memory port is bound to nothing"
                                                       : "no memory is followed at this fidelity");
       const AddressMap& map = asked.facts.addresses;
       return EffectDecision::keep(fmt::format("{:.1f} MB of vertices, {:.1f} MB of attributes",
                                               1e-6 * static_cast<double>(map.vertices.bytes + map.primitives.bytes),
                                               1e-6 * static_cast<double>(map.attributes.bytes)));
     }}};

// Not decided: why stands in place of a predicate.
const EffectRegistrar alpha_pruning_effect{
    {"sm",
     "alpha_pruning",
     "splat-shader",
     EffectKind::functional,
     "fragments of a small alpha are dropped",
     "a fifth of a splat's oriented box lies outside the ellipse of alpha 1/255; "
     "without the comparison nothing is saved",
     "a comparison for eight fragments",
     "",
     {},
     nullptr}};
const EffectRegistrar alpha_clamp_effect{
    {"sm",
     "alpha_clamp",
     "splat-shader",
     EffectKind::functional,
     "alpha is at most 0.99",
     "one instruction for eight fragments: to leave it out costs as much as it saves",
     "a selection",
     "",
     {},
     nullptr}};
const EffectRegistrar scheduling_effect{
    {"sm",
     "scheduling",
     "",
     EffectKind::timing,
     "warps wait for a scheduler, and hide one another's latencies",
     "warps leave in another order without: no bound on the cycles is known for schedulers of several servers (Graham)",
     "schedulers and their queues",
     "",
     {},
     nullptr}};
}  // namespace

}  // namespace vrpipe
