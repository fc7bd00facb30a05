#include "crop/crop.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "crop/checked_crop.h"
#include "crop/in_shader_time.h"

#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

template <ColorFormat Format, BlendRounding Rounding>
ColorRop<Format, Rounding>::ColorRop(const CropParameters& parameters, const RenderContext& context)
    : context_(context),
      termination_gate_(context, "zrop.termination"),
      late_drops_gate_(context, "crop.late_drops"),
      rounding_loss_gate_(context, "crop.rounding_loss"),
      saturation_gate_(context, "crop.saturation"),
      several_draws_gate_(context, "draw.several_draws"),
      cache_order_gate_(context, "crop.cache_order"),
      watches_saturation_(saturation_gate_.is_active()),
      replaces_(context.frame->replaces_color()),
      checks_previous_(parameters.previous_alpha_check),
      time_(parameters, Format) {
  if (!EffectGate(context, "cache.details").is_active()) cache_statistics.leave_out_details();
  several_draws_ =
      several_draws_gate_.is_active() || (context.frame->draws().size() > 1 && several_draws_gate_.enter());
  if (!context.frame->draws().empty()) set_draw(0);
}

template <ColorFormat Format, BlendRounding Rounding>
void ColorRop<Format, Rounding>::set_draw(DrawIndex draw) {
  const DrawState& state = context_.state(draw);
  draw_ = draw;
  signals_ = state.early_termination && termination_gate_.enter();
  threshold_ = state.terminating_alpha();
  drops_late_ = state.early_termination && context_.termination == Termination::strict && late_drops_gate_.enter();
  way_ = !state.blend ? Way::replacing : signals_ || drops_late_ || watches_saturation_ ? Way::asking : Way::plain;
}

template <ColorFormat Format, BlendRounding Rounding>
void ColorRop<Format, Rounding>::attach(ColorSurface& surface) {
  CropBehaviour::attach(surface);
  const bool drops_late = context_.termination == Termination::strict && context_.frame->terminates_early();
  if (drops_late) terminated_.assign(surface.grid().quads(), 0);
}

template <ColorFormat Format, BlendRounding Rounding>
void ColorRop<Format, Rounding>::pass(Mark mark) {
  const Clear* const clear = context_.frame->clear_of(mark);
  if (clear == nullptr) return;
  const ScreenTiling& grid = surface_->grid();
  if (clear->color) check_end();
  for (std::size_t tile = 0; tile < grid.tiles(); ++tile) {
    if (!context_.placement.owns(grid.tile(tile))) continue;
    const auto first = static_cast<std::ptrdiff_t>(tile * positions_per_tile);
    if (clear->color) {
      surface_->clear(grid.tile(tile));
      if (!lost_to_rounding_.empty())
        std::fill_n(lost_to_rounding_.begin() + first, positions_per_tile, splat_lanes(1.0F));
    }
    if (clear->termination && !terminated_.empty()) {
      std::fill_n(terminated_.begin() + first, positions_per_tile, LaneMask{0});
    }
  }
}

template <ColorFormat Format, BlendRounding Rounding>
void ColorRop<Format, Rounding>::check_end() {
  if constexpr (largest_color < std::numeric_limits<float>::infinity()) {
    if (watches_saturation_ || surface_ == nullptr) return;
    for (std::size_t place = 0; place < surface_->grid().quads(); ++place) {
      const QuadColor& quad = surface_->quad(place);
      const LaneBits saturated =
          (quad.red >= largest_color) | (quad.green >= largest_color) | (quad.blue >= largest_color);
      if (sign_mask(saturated) != 0 && !saturation_gate_.enter()) return;
    }
  }
}

template <ColorFormat Format, BlendRounding Rounding>
SectoredCache* ColorRop<Format, Rounding>::cache() {
  if (!cache_) {
    CacheOrganization organization = time_.cache;
    if (!cache_order_gate_.is_active()) organization.replacement = Replacement::random;  // which keeps no order
    cache_.emplace(organization, cache_statistics);
    if (!cache_order_gate_.is_active()) cache_->before_eviction([this] { cache_order_gate_.enter(); });
  }
  return &*cache_;
}

template <ColorFormat Format, BlendRounding Rounding>
void ColorRop<Format, Rounding>::look_up(const ShadedWarp& warp, unsigned from, unsigned to, CacheLookUp& out) {
  if (!cache_) cache();
  const std::uint64_t tile = surface_->address(warp.tile, 0);
  // Without branches on whether a line is new, which would be mispredicted.
  std::array<std::uint8_t, quads_per_warp> needed;
  std::array<std::uint8_t, quads_per_warp> first_quad;
  std::uint64_t seen = 0;
  unsigned count = 0;
  for (unsigned i = from; i < to; ++i) {
    const QuadSectors& quad = time_.sectors_of_quads()[warp.position[i]];
    needed[count] = static_cast<std::uint8_t>(quad.line);
    first_quad[count] = static_cast<std::uint8_t>(i);
    count += (seen >> quad.line & 1U) == 0;
    seen |= std::uint64_t{1} << quad.line;
    sectors_needed_[quad.line] |= quad.sectors;
  }
  LineAccess* access = out.lines.data();
  unsigned missed = 0;
  for (unsigned i = 0; i < count; ++i) {
    const unsigned line = needed[i];
    access->address = tile + std::uint64_t{line} * time_.cache.line_bytes;
    access->sectors = std::exchange(sectors_needed_[line], 0);
    if (replaces_) access->known = context_.state(warp.draw[from]).blend ? 0 : ~0U;  // all quads' state
    cache_->look_up(*access);
    out.line_of[line] = access->line;
    if (access->missed == 0) continue;
    out.first_quad[missed++] = first_quad[i];
    ++access;
  }
  out.count = missed;
  // All quads need as many sectors.
  cache_->accessed(to - from, (to - from) * time_.sectors_of_a_quad());
}

// Out of line, so that the common case stays short.
template <ColorFormat Format, BlendRounding Rounding>
void ColorRop<Format, Rounding>::count_anomalies(std::size_t place, LaneMask live, const QuadColor& color,
                                                 LanePair red_green, LanePair blue_alpha) {
  const QuadColor& stored = surface_->quad(place);
  QuadColor destination;
  store({red_green, blue_alpha}, destination);
  const LaneBits lanes = expand_mask(live);
  if (watches_saturation_) {
    const QuadColor sum = blend_front_to_back(destination, color);
    const LaneBits saturated =
        lanes & ((sum.red > largest_color) | (sum.green > largest_color) | (sum.blue > largest_color));
    colors_saturated += popcount(sign_mask(saturated));
  }

  const LaneBits lost = lanes & (stored.alpha == destination.alpha) & ~passes(stored.alpha);
  if (sign_mask(lost) == 0) return;
  if (lost_to_rounding_.empty() && !rounding_loss_gate_.enter()) return;
  if (lost_to_rounding_.empty()) lost_to_rounding_.assign(surface_->grid().quads(), splat_lanes(1.0F));
  Lanes& transmittance = lost_to_rounding_[place];
  fragments_lost_to_rounding += popcount(sign_mask(lost));
  transmittance = select(lost, transmittance * (1.0F - color.alpha), transmittance);
  const LaneBits stuck = passes(1.0F - (1.0F - stored.alpha) * transmittance) & (transmittance >= 0.0F) & lost;
  if (sign_mask(stuck) == 0) return;
  pixels_stuck += popcount(sign_mask(stuck));
  transmittance = select(stuck, splat_lanes(-1.0F), transmittance);
}

template <ColorFormat Format, BlendRounding Rounding>
template <typename ColorRop<Format, Rounding>::Way How>
[[gnu::always_inline]] inline CropBehaviour::Outcome ColorRop<Format, Rounding>::blend_into(
    QuadColor& destination, std::size_t place, LaneMask live, const QuadColor& color, Tally& tally) {
  if constexpr (How == Way::replacing) return replace(destination, place, live, color, tally);
  if (How == Way::asking && drops_late_) {
    const auto closed = static_cast<LaneMask>(live & terminated_[place]);
    tally.fragments_dropped += popcount(closed);
    live = static_cast<LaneMask>(live ^ closed);
    if (live == 0) {
      ++tally.quads_dropped;
      return {0, false};
    }
  }
  ++tally.quads_blended;
  tally.fragments_blended += popcount(live);
  const ChannelPairs before = channel_pairs(destination);
  ChannelPairs blended;
  if constexpr (Rounding == BlendRounding::measured) {
    blended = channel_pairs(blend_function(Format, Rounding)(destination, color));
  } else {
    blended = blend_into_target<Format, Rounding>(before, channel_pairs(color));
  }
  const LanePairBits kept = expand_mask_twice(live);
  blended.red_green = select(kept, blended.red_green, before.red_green);
  blended.blue_alpha = select(kept, blended.blue_alpha, before.blue_alpha);
  store(blended, destination);
  const bool changed = any_bit((bits_of(blended.red_green) ^ bits_of(before.red_green)) |
                               (bits_of(blended.blue_alpha) ^ bits_of(before.blue_alpha)));
  const auto of_alpha = [](LanePairBits of_blue_alpha) { return sign_mask(of_blue_alpha) >> 4U; };
  const LanePairBits passed = blended.blue_alpha >= threshold_;
  unsigned signalled = 0;
  if (How == Way::asking && signals_) {
    const unsigned late = of_alpha(before.blue_alpha >= threshold_) & live;
    tally.fragments_late += popcount(static_cast<LaneMask>(late));
    signalled = of_alpha(passed) & live;
    if (checks_previous_) signalled &= ~late;
    if (signalled != 0) {
      ++tally.signals;
      if (drops_late_) terminated_[place] = static_cast<LaneMask>(terminated_[place] | signalled);
    }
  }
  unsigned anomaly = ~of_alpha((blended.blue_alpha != before.blue_alpha) | passed);
  if constexpr (How == Way::asking && largest_color < std::numeric_limits<float>::infinity()) {
    if (watches_saturation_) {
      const unsigned red_green = sign_mask(blended.red_green >= largest_color);
      const unsigned blue = sign_mask(blended.blue_alpha >= largest_color);
      anomaly |= red_green | red_green >> 4U | blue;  // alpha, in the upper bits, is none of it
    }
  }
  if ((anomaly & live) != 0) count_anomalies(place, live, color, before.red_green, before.blue_alpha);
  return {static_cast<LaneMask>(signalled), changed};
}

template <ColorFormat Format, BlendRounding Rounding>
[[gnu::noinline]] CropBehaviour::Outcome ColorRop<Format, Rounding>::replace(QuadColor& destination, std::size_t place,
                                                                             LaneMask live, const QuadColor& color,
                                                                             Tally& tally) {
  ++tally.quads_blended;
  tally.fragments_blended += popcount(live);
  // Behind nothing, so that what the format makes of a colour is the same with and without blending.
  const QuadColor stored = blend_function(Format, Rounding)(QuadColor{}, color);
  const LaneBits lanes = expand_mask(live);
  if (watches_saturation_) {
    const LaneBits saturated =
        lanes & ((color.red > largest_color) | (color.green > largest_color) | (color.blue > largest_color));
    colors_saturated += popcount(sign_mask(saturated));
  }
  if (!lost_to_rounding_.empty()) {
    lost_to_rounding_[place] = select(lanes, splat_lanes(1.0F), lost_to_rounding_[place]);
  }
  destination = {select(lanes, stored.red, destination.red), select(lanes, stored.green, destination.green),
                 select(lanes, stored.blue, destination.blue), select(lanes, stored.alpha, destination.alpha)};
  // What was there has not been read, so nobody knows whether it is another value.
  return {0, true};
}

template <ColorFormat Format, BlendRounding Rounding>
void ColorRop<Format, Rounding>::tell(std::size_t place, LaneMask live) const {
  const TileId tile = surface_->grid().tile(place / positions_per_tile);
  const auto position = static_cast<unsigned>(place % positions_per_tile);
  const auto closed = static_cast<LaneMask>(drops_late_ && way_ != Way::replacing ? live & terminated_[place] : 0);
  if (closed != 0) context_.fragments->happened(FragmentFate::terminated, tile, position, closed);
  if (live != closed) {
    context_.fragments->happened(FragmentFate::blended, tile, position, static_cast<LaneMask>(live ^ closed));
  }
}

template <ColorFormat Format, BlendRounding Rounding>
template <typename ColorRop<Format, Rounding>::Way How>
[[gnu::always_inline]] inline CropBehaviour::Outcome ColorRop<Format, Rounding>::blend_one(std::size_t place,
                                                                                           LaneMask live,
                                                                                           const QuadColor& color) {
  Tally tally;
  const Outcome outcome = blend_into<How>(surface_->quad(place), place, live, color, tally);
  count(draw_, tally);
  return outcome;
}

template <ColorFormat Format, BlendRounding Rounding>
CropBehaviour::Outcome ColorRop<Format, Rounding>::blend(DrawIndex draw, std::size_t place, LaneMask live,
                                                         const QuadColor& color) {
  if (draw != draw_) set_draw(draw);
  if (context_.fragments != nullptr) tell(place, live);
  switch (way_) {
    case Way::plain: return blend_one<Way::plain>(place, live, color);
    case Way::asking: return blend_one<Way::asking>(place, live, color);
    case Way::replacing: break;
  }
  return blend_one<Way::replacing>(place, live, color);
}

template <ColorFormat Format, BlendRounding Rounding>
template <typename ColorRop<Format, Rounding>::Way How>
[[gnu::always_inline]] inline void ColorRop<Format, Rounding>::blend_run(const ShadedWarp& warp, unsigned from,
                                                                         unsigned to, Outcomes& outcomes) {
  const std::size_t tile = surface_->grid().place(warp.tile, 0);
  QuadColor* const quads = &surface_->quad(tile);
  Tally tally;
  for (unsigned i = from; i < to; ++i) {
    const unsigned position = warp.position[i];
    outcomes[i] = blend_into<How>(quads[position], tile + position, warp.live[i], warp.color[i], tally);
  }
  count(draw_, tally);
}

template <ColorFormat Format, BlendRounding Rounding>
void ColorRop<Format, Rounding>::blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes) {
  if (context_.fragments != nullptr) return CropBehaviour::blend_quads(warp, from, to, outcomes);
  while (from < to) {
    const DrawIndex draw = warp.draw[from];
    if (draw != draw_) set_draw(draw);
    unsigned end = to;
    if (several_draws_) {
      const auto is_other = [&](DrawIndex other) { return other != draw; };
      end = static_cast<unsigned>(std::find_if(warp.draw.begin() + from, warp.draw.begin() + to, is_other) -
                                  warp.draw.begin());
    }
    switch (way_) {
      case Way::plain: blend_run<Way::plain>(warp, from, end, outcomes); break;
      case Way::asking: blend_run<Way::asking>(warp, from, end, outcomes); break;
      case Way::replacing: blend_run<Way::replacing>(warp, from, end, outcomes); break;
    }
    from = end;
  }
}

// For units outside this library that derive from them.
template class ColorRop<ColorFormat::rgba8, BlendRounding::rne>;
template class ColorRop<ColorFormat::rgba8, BlendRounding::rtz>;
template class ColorRop<ColorFormat::rgba8, BlendRounding::measured>;
template class ColorRop<ColorFormat::rgba16f, BlendRounding::rne>;
template class ColorRop<ColorFormat::rgba16f, BlendRounding::rtz>;
template class ColorRop<ColorFormat::rgba16f, BlendRounding::measured>;
template class ColorRop<ColorFormat::rgba32f, BlendRounding::rne>;
template class ColorRop<ColorFormat::rgba32f, BlendRounding::rtz>;
template class ColorRop<ColorFormat::rgba32f, BlendRounding::measured>;
template class ColorRop<ColorFormat::rgba16, BlendRounding::rne>;
template class ColorRop<ColorFormat::rgba16, BlendRounding::rtz>;
template class ColorRop<ColorFormat::srgb8, BlendRounding::rne>;
template class ColorRop<ColorFormat::srgb8, BlendRounding::rtz>;

namespace {
const SlotRegistrar crop_slot{
    {"crop", 100, "color-rop", "", true, check_crop},
    {},
    {{"out_done", [](const RenderContext& context) { return BarrierPlan(context).is_used(); },
      "a draw of the frame reads the colour target, and nobody tells DRAW when all before it is blended",
      "connect it to draw.in_done_N, as wire_gpc does"}}};

[[maybe_unused]] const bool crop_registered = [] {
  Implementation implementation =
      CropMaker<ColorRop>::implementation("color-rop",
                                          "front-to-back blending behind a colour cache, alpha test for termination");
  implementation.trust = Trust::trusted;
  Registry::instance().add(std::move(implementation));
  return true;
}();

const EffectRegistrar late_drops_effect{
    {"crop",
     "late_drops",
     "",
     EffectKind::functional,
     "strict termination: fragments whose pixel CROP finds terminated are dropped there",
     "termination is not strict, or no draw terminates early",
     "a mask of terminated pixels for each quad of the target",
     "where a draw begins that terminates early in strict order",
     {},
     [](const EffectQuestion& asked) {
       if (asked.facts.terminating == 0) return EffectDecision::omit("no draw terminates early");
       if (asked.context.termination != Termination::strict) return EffectDecision::omit("termination is not strict");
       return EffectDecision::keep(fmt::format("{} draws terminate early, in strict order", asked.facts.terminating));
     }}};
const EffectRegistrar rounding_loss_effect{
    {"crop",
     "rounding_loss",
     "color-rop",
     EffectKind::functional,
     "the anomaly counters of fragments and pixels whose alpha is lost to rounding",
     "until a fragment's is",
     "the transmittance of what was lost, for each pixel of the target",
     "at the first such fragment",
     {},
     [](const EffectQuestion&) { return EffectDecision::watch("fragments whose alpha is lost to rounding"); }}};
const EffectRegistrar saturation_effect{
    {"crop",
     "saturation",
     "color-rop",
     EffectKind::functional,
     "the anomaly counter of colours beyond the format's largest",
     "no colour of the frame is larger than 1/16 of that: blending front to back sums weights up to 1, and what "
     "rounding "
     "adds to a pixel whose alpha is stuck ends below 4 times the largest colour",
     "two comparisons for each quad that is blended",
     "at the end of the frame, and before a clear: no stored colour is that large",
     {},
     [](const EffectQuestion& asked) {
       if (asked.context.format == ColorFormat::rgba32f) return EffectDecision::omit("RGBA32F has no largest colour");
       const auto largest = static_cast<double>(largest_color_of(asked.context.format));
       const auto here = static_cast<double>(asked.facts.largest_color);
       const std::string numbers = fmt::format("colours up to {:.3g}; the format's largest is {:g}", here, largest);
       return here <= largest / 16 ? EffectDecision::omit(numbers) : EffectDecision::keep(numbers);
     }}};
const EffectRegistrar blend_hazard_effect{
    {"crop",
     "blend_hazard",
     "",
     EffectKind::timing,
     "a quad waits until an overlapping one has left the blending pipeline",
     "crop.forwarding is on: it takes the value in the pipeline; or shaders blend, who wait for a lock or not at all",
     "a list of the quads in the pipeline, looked through for each quad",
     "before a quad is blended without forwarding",
     {},
     [](const EffectQuestion& asked) {
       if (dynamic_cast<const InShaderParameters*>(&asked.parameters) != nullptr)
         return EffectDecision::omit("the shader blends");
       const auto* const crop = dynamic_cast<const CropParameters*>(&asked.parameters);
       if (crop == nullptr) return EffectDecision::keep("the unit is not of this library");
       if (crop->forwarding) return EffectDecision::omit("crop.forwarding=on");
       return EffectDecision::keep(fmt::format("crop.forwarding=off, {} cycles", std::uint32_t{crop->latency_cycles}));
     }}};

const EffectRegistrar cache_order_effect{
    {"crop",
     "cache_order",
     "color-rop",
     EffectKind::timing,
     "which line of the colour cache goes for another",
     "the lines of all screen tiles that primitives touch fit in the cache, which is fully associative; or there is no "
     "time",
     "the order in which lines were used",
     "where a line is to go",
     {},
     [](const EffectQuestion& asked) {
       if (!asked.counts_work && !asked.memory_connected)
         return EffectDecision::omit("nobody asks for what the cache misses");
       if (asked.counts_work && !asked.has_time) return EffectDecision::keep("the bound follows from what goes");
       const CacheOrganization cache = asked.as<CropParameters>().cache.organization();
       const std::uint64_t bytes = screen_tile_pixels * screen_tile_pixels * bytes_per_pixel(asked.context.format);
       const std::uint64_t touched = asked.facts.tiles_touched * (bytes / cache.line_bytes);
       const std::string numbers = fmt::format("at most {} lines are touched, and {} held", touched, cache.lines());
       if (cache.sets() > 1) return EffectDecision::keep(fmt::format("{} sets: {}", cache.sets(), numbers));
       return touched <= cache.lines() ? EffectDecision::omit(numbers) : EffectDecision::keep(numbers);
     }}};

}  // namespace

}  // namespace vrpipe
