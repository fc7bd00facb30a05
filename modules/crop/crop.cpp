#include "crop/crop.h"

#include <algorithm>

#include <vrpipe/registry.h>

namespace vrpipe {

template <ColorFormat Format, BlendRounding Rounding>
ColorRop<Format, Rounding>::ColorRop(const CropParameters& parameters, const RenderState& state)
    : state_(state),
      drops_late_(state.early_termination && state.termination == Termination::strict),
      checks_previous_(parameters.previous_alpha_check),
      cost_{std::clamp(parameters.bytes_per_cycle / (4 * bytes_per_pixel(Format)), 1U, ColorBeat::capacity),
            parameters.input_quads,
            parameters.latency_cycles,
            parameters.forwarding,
            parameters.cache_bytes,
            parameters.line_bytes,
            parameters.sector_bytes,
            parameters.mshrs,
            parameters.sectors_per_cycle,
            parameters.writes_unchanged} {}

template <ColorFormat Format, BlendRounding Rounding>
CropBehaviour::Outcome ColorRop<Format, Rounding>::blend(TileId tile, unsigned position, LaneMask live,
                                                         const QuadColor& color) {
  QuadColor& destination = surface_->quad(tile, position);
  LaneBits lanes = expand_mask(live);
  if (drops_late_) {
    const LaneBits open = lanes & ~passes(destination.alpha);
    const LaneMask kept = sign_mask(open);
    fragments_dropped_late += popcount(static_cast<LaneMask>(live & ~kept));
    if (kept == 0) {
      ++quads_dropped_late;
      return {0, false};
    }
    lanes = open;
    live = kept;
  }
  ++quads_blended;
  fragments_blended += popcount(live);
  QuadColor blended;
  if constexpr (Rounding == BlendRounding::measured) {
    blended = blend_function(Format, Rounding)(destination, color);
  } else {
    blended = blend_into_target<Format, Rounding>(destination, color);
  }
  const Lanes previous = destination.alpha;
  blended = select(lanes, blended, destination);
  const LaneBits difference =
      (bits_of(blended.red) ^ bits_of(destination.red)) | (bits_of(blended.green) ^ bits_of(destination.green)) |
      (bits_of(blended.blue) ^ bits_of(destination.blue)) | (bits_of(blended.alpha) ^ bits_of(destination.alpha));
  const bool changed = sign_mask(difference != 0) != 0;
  destination = blended;
  if (!state_.early_termination) return {0, changed};
  LaneBits terminated = passes(destination.alpha) & lanes;
  if (checks_previous_) terminated &= ~passes(previous);
  const LaneMask signalled = sign_mask(terminated);
  if (signalled != 0) ++termination_signals;
  return {signalled, changed};
}

namespace {

template <ColorFormat Format>
std::unique_ptr<Behaviour> make_for_format(const CropParameters& parameters, const RenderState& state) {
  switch (state.blend_rounding) {
    case BlendRounding::rne: return std::make_unique<ColorRop<Format, BlendRounding::rne>>(parameters, state);
    case BlendRounding::rtz: return std::make_unique<ColorRop<Format, BlendRounding::rtz>>(parameters, state);
    case BlendRounding::measured: return std::make_unique<ColorRop<Format, BlendRounding::measured>>(parameters, state);
  }
  return nullptr;
}

std::unique_ptr<Behaviour> make(const ParameterSet& set, const RenderState& state) {
  const auto& parameters = dynamic_cast<const CropParameters&>(set);
  switch (state.format) {
    case ColorFormat::rgba8: return make_for_format<ColorFormat::rgba8>(parameters, state);
    case ColorFormat::rgba16f: return make_for_format<ColorFormat::rgba16f>(parameters, state);
    case ColorFormat::rgba32f: return make_for_format<ColorFormat::rgba32f>(parameters, state);
  }
  return nullptr;
}

[[maybe_unused]] const bool registered = [] {
  Implementation implementation;
  implementation.slot = "crop";
  implementation.name = "color-rop";
  implementation.description = "front-to-back blending behind a colour cache, alpha test for termination";
  implementation.make_parameters = [] { return std::make_unique<CropParameters>(); };
  implementation.make_behaviour = make;
  Registry::instance().add(std::move(implementation));
  return true;
}();

}  // namespace

}  // namespace vrpipe
