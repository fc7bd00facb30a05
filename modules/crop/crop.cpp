#include "crop/crop.h"
#include "crop/sectors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <vrpipe/registry.h>

namespace vrpipe {

template <ColorFormat Format, BlendRounding Rounding>
ColorRop<Format, Rounding>::ColorRop(const CropParameters& parameters, const RenderState& state)
    : signals_(state.early_termination),
      // Passing an exclusive threshold is reaching the next float.
      threshold_(state.termination_inclusive
                     ? state.termination_threshold
                     : std::nextafter(state.termination_threshold, std::numeric_limits<float>::infinity())),
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
void ColorRop<Format, Rounding>::look_up(const ShadedWarp& warp, unsigned from, unsigned to, CacheLookUp& out) {
  if (!cache_) cache_ = make_crop_cache(cost_, *surface_);
  const auto sector_shift = static_cast<unsigned>(__builtin_ctz(cost_.sector_bytes));
  const auto line_shift = static_cast<unsigned>(__builtin_ctz(cost_.line_bytes));
  const std::uint64_t line_mask = cost_.line_bytes - 1;
  constexpr std::uint32_t bytes_per_quad = 4 * bytes_per_pixel(Format);
  const std::uint32_t first_sectors = sectors_of_quad(Format, sector_shift);
  const std::uint64_t tile = surface_->address(warp.tile, 0);
  // Where a line of the tile is in `out.lines`, if it is there. Without branches, which would be mispredicted.
  std::array<std::uint8_t, positions_per_tile> place_of;
  std::uint64_t seen = 0;
  unsigned count = 0;
  for (unsigned i = from; i < to; ++i) {
    const std::uint64_t offset = std::uint64_t{morton_order[warp.position[i]]} * bytes_per_quad;
    const std::uint64_t line = offset >> line_shift;
    const std::uint32_t sectors = first_sectors << ((offset & line_mask) >> sector_shift);
    const bool is_new = (seen >> line & 1U) == 0;
    seen |= std::uint64_t{1} << line;
    const unsigned place = is_new ? count : place_of[line];
    place_of[line] = static_cast<std::uint8_t>(place);
    out.lines[place].address = tile + (line << line_shift);
    out.lines[place].sectors = (is_new ? 0 : out.lines[place].sectors) | sectors;
    count += is_new ? 1U : 0U;
    out.line_of[i] = static_cast<std::uint8_t>(place);
    out.sectors_of[i] = sectors;
  }
  out.count = count;
  for (unsigned line = 0; line < out.count; ++line) cache_->access(out.lines[line]);
}

// Out of line, so that the common case stays short.
template <ColorFormat Format, BlendRounding Rounding>
void ColorRop<Format, Rounding>::count_trouble(TileId tile, unsigned position, LaneBits lanes, const QuadColor& color,
                                               const QuadColor& destination, const QuadColor& stored) {
  const QuadColor sum = blend_front_to_back(destination, color);
  const LaneBits saturated =
      lanes & ((sum.red > largest_color) | (sum.green > largest_color) | (sum.blue > largest_color));
  colors_saturated += popcount(sign_mask(saturated));

  const LaneBits swallowed = lanes & (stored.alpha == destination.alpha) & ~passes(stored.alpha);
  if (sign_mask(swallowed) == 0) return;
  const std::uint32_t tiles_x = (surface_->width() + screen_tile_pixels - 1) / screen_tile_pixels;
  const std::uint32_t tiles_y = (surface_->height() + screen_tile_pixels - 1) / screen_tile_pixels;
  if (swallowed_.empty()) swallowed_.assign(std::size_t{tiles_x} * tiles_y * positions_per_tile, splat_lanes(1.0F));
  Lanes& transmittance = swallowed_[(std::size_t{tile.y} * tiles_x + tile.x) * positions_per_tile + position];
  fragments_swallowed += popcount(sign_mask(swallowed));
  transmittance = select(swallowed, transmittance * (1.0F - color.alpha), transmittance);
  const LaneBits stuck = passes(1.0F - (1.0F - stored.alpha) * transmittance) & (transmittance >= 0.0F) & swallowed;
  if (sign_mask(stuck) == 0) return;
  pixels_stuck += popcount(sign_mask(stuck));
  transmittance = select(stuck, splat_lanes(-1.0F), transmittance);
}

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
  const LaneBits passed = passes(blended.alpha);
  LaneBits trouble = (blended.alpha == previous) & ~passed;
  if constexpr (largest_color < std::numeric_limits<float>::infinity()) {
    trouble |= (blended.red >= largest_color) | (blended.green >= largest_color) | (blended.blue >= largest_color);
  }
  if (sign_mask(trouble & lanes) != 0) count_trouble(tile, position, lanes, color, destination, blended);
  destination = blended;
  if (!signals_) return {0, changed};
  LaneBits terminated = passed & lanes;
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
