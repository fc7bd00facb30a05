#include "raster/hi_z.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <vrpipe/pipeline/frame_facts.h>

namespace vrpipe {

std::uint32_t top_of_step(DepthFormat format, unsigned bits, std::uint32_t stored) {
  if (format != DepthFormat::d32f) {
    const unsigned stored_bits = format == DepthFormat::d16 ? 16 : 24;
    return bits >= stored_bits ? stored : stored | ((1U << (stored_bits - bits)) - 1);
  }
  // The last float below the next step; exact, since a float has 24 bits.
  const auto steps = static_cast<double>(1U << bits);
  const double next = std::floor(depth_of(format, stored) * steps) + 1;
  return next >= steps ? store_depth(format, 1) : std::max(stored, store_depth(format, next / steps) - 1);
}

HiZ::HiZ(const RenderContext& context, unsigned bits)
    : context_(context),
      plan_(context),
      format_(context.frame->depth_format()),
      bits_(bits),
      is_strict_(context.termination == Termination::strict),
      tiling_(context.frame->width(), context.frame->height()) {
  if (is_used()) bounds_.assign(4 * tiling_.tiles(), store_depth(format_, 1));
}

bool HiZ::begin(const Primitive& primitive) {
  if (plan_.epoch(primitive.draw) != epoch_) {
    epoch_ = plan_.epoch(primitive.draw);
    const std::uint32_t cleared = store_depth(format_, static_cast<double>(plan_.cleared_to(primitive.draw)));
    std::fill(bounds_.begin(), bounds_.end(), top_of_step(format_, bits_, cleared));
    staged_.clear();
  }
  if (!plan_.culls(primitive.draw)) return false;
  compare_ = context_.state(primitive.draw).depth.compare;
  plane_ = DepthPlane(context_, primitive.draw, primitive.splat, primitive.triangle);
  nearest_ = store_depth(format_, plane_.nearest());
  farthest_ = store_depth(format_, plane_.farthest());
  return true;
}

bool HiZ::hides(TileId tile, unsigned part, const PixelRect& area) const {
  const std::uint32_t bound = bounds_[place_of(tile, part)];
  if (fails(nearest_, bound)) return true;
  if (!fails(farthest_, bound)) return false;
  return fails(store_depth(format_, plane_.nearest_in(area)), bound);
}

void HiZ::store(std::size_t place, std::uint32_t bound) { bounds_[place] = std::min(bounds_[place], bound); }

void HiZ::update(const HiZUpdate& update) {
  if (!is_used()) return;
  if (update.mark != Mark::none) {
    for (const Staged& staged : staged_) store(staged.place, staged.bound);
    return staged_.clear();
  }
  if (update.epoch != epoch_) return;
  const std::size_t place = place_of(update.tile, update.part);
  const std::uint32_t bound = top_of_step(format_, bits_, update.farthest);
  if (is_strict_) {
    staged_.push_back({place, bound});
  } else {
    store(place, bound);
  }
}

void HiZ::hold_as(const HiZ& other) {
  bounds_ = other.bounds_;
  staged_ = other.staged_;
  epoch_ = other.epoch_;
}

namespace {
const EffectRegistrar hi_z_effect{
    {"raster",
     "hi_z",
     "",
     EffectKind::functional,
     "raster tiles that lie behind all that is stored there are dropped before they are filled",
     "no draw has its depth tested where something nearer may be stored (HiZPlan)",
     "a bound for each raster tile, and the link zrop.hi_z that lowers them",
     "in HiZPlan, of which DRAW, the rasteriser, TC and ZROP each have one",
     {"zrop.hi_z"},
     [](const EffectQuestion& asked) {
       if (HiZPlan(asked.context).is_used())
         return EffectDecision::keep(fmt::format("{} of {} draws test depth or stencil, and depth is stored",
                                                 asked.facts.testing_depth_stencil, asked.facts.draws));
       return EffectDecision::omit(asked.facts.testing_depth_stencil == 0
                                       ? "no draw tests depth"
                                       : "no draw tests depth where something nearer may be stored");
     }}};
}  // namespace

}  // namespace vrpipe
