#pragma once

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "crop_parameters.h"
#include "crop_time.h"

#include <vrpipe/memory/sectored_cache.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/crop.h>

namespace vrpipe {

/// Colour ROP (paper 3.1, 5.2): blends in arrival order; the alpha test unit signals terminated pixels.
/// Blending: single-precision multiply, single-precision add, one rounding to the format.
template <ColorFormat Format, BlendRounding Rounding>
class ColorRop : public CropBehaviour {
 public:
  /// Throws UserError for a cache that cannot be.
  ColorRop(const CropParameters& parameters, const RenderContext& context);

  void attach(ColorSurface& surface) override;
  void pass(Mark mark) override;
  Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) override;
  void blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes) override;
  void look_up(const ShadedWarp& warp, unsigned from, unsigned to, CacheLookUp& out) override;
  void check_end() override;
  SectoredCache* cache() override;
  const CropTime& time() const override { return time_; }

  Counter fragments_lost_to_rounding{
      *this, "fragments_lost_to_rounding", "fragments",
      "blended below the threshold whose alpha is lost to rounding: the pixel keeps its own"};
  Counter pixels_stuck{*this, "pixels_stuck", "pixels",
                       "kept below the threshold by rounding: the alpha lost would have taken them past it"};
  Counter colors_saturated{*this, "colors_saturated", "fragments", "that took a colour beyond the format's largest"};

 private:
  static constexpr float largest_color = largest_color_of(Format);

  /// What was done, to be counted for a draw.
  struct Tally {
    unsigned quads_blended = 0, fragments_blended = 0, fragments_late = 0;
    unsigned quads_dropped = 0, fragments_dropped = 0, signals = 0;
  };
  [[gnu::always_inline]] void count(DrawIndex draw, const Tally& tally) {
    quads_blended.add(draw, tally.quads_blended);
    fragments_blended.add(draw, tally.fragments_blended);
    if (tally.fragments_late != 0) fragments_blended_late.add(draw, tally.fragments_late);
    if (tally.quads_dropped != 0) quads_dropped_late.add(draw, tally.quads_dropped);
    if (tally.fragments_dropped != 0) fragments_dropped_late.add(draw, tally.fragments_dropped);
    if (tally.signals != 0) termination_signals.add(draw, tally.signals);
  }
  /// Blends for a draw from here on.
  [[gnu::noinline]] void set_draw(DrawIndex draw);
  /// Tells who looks what becomes of a quad's fragments, before it is blended.
  void tell(std::size_t place, LaneMask live) const;
  /// What becomes of a draw's quads. They are blended, and that is all, or there is more to ask (signals, late drops,
  /// saturation), or the colours of live samples take the places of those that are there.
  enum class Way : std::uint8_t { plain, asking, replacing };
  template <Way>
  Outcome blend_into(QuadColor& destination, std::size_t place, LaneMask live, const QuadColor& color, Tally& tally);
  Outcome replace(QuadColor& destination, std::size_t place, LaneMask live, const QuadColor& color, Tally& tally);
  template <Way>
  Outcome blend_one(std::size_t place, LaneMask live, const QuadColor& color);
  template <Way>
  void blend_run(const ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes);
  LaneBits passes(Lanes alpha) const { return alpha >= threshold_; }
  /// After a blend of `color` into a quad that held the channels given.
  [[gnu::noinline]] void count_anomalies(std::size_t place, LaneMask live, const QuadColor& color, LanePair red_green,
                                         LanePair blue_alpha);

  const RenderContext& context_;
  bool several_draws_ = false;
  DrawIndex draw_ = 0;  ///< that is blended, with its state:
  Way way_ = Way::plain;
  bool signals_ = false;
  float threshold_ = 0;  ///< that alpha reaches to be terminated
  bool drops_late_ = false;
  EffectGate termination_gate_;
  EffectGate late_drops_gate_;
  EffectGate rounding_loss_gate_;
  EffectGate saturation_gate_;
  EffectGate several_draws_gate_;
  EffectGate cache_order_gate_;
  const bool watches_saturation_;
  const bool replaces_;  ///< in any draw
  /// By quad, in strict termination: the pixels that were signalled.
  std::vector<LaneMask> terminated_;
  /// By quad, once a fragment was lost to rounding: transmittance of those that were; negative once counted as stuck.
  std::vector<Lanes> lost_to_rounding_;
  const bool checks_previous_;
  const CropTime time_;
  /// By line of a screen tile, in a look-up; none after it.
  std::array<std::uint32_t, positions_per_tile> sectors_needed_{};
  std::optional<SectoredCache> cache_;  ///< once looked up here; the timing model of `cycle` has one of its own
};

/// Makes a CROP, ColorRop or what derives from it, for the draw's format and rounding.
template <template <ColorFormat, BlendRounding> class Rop>
class CropMaker {
 public:
  static std::unique_ptr<Behaviour> make(const ParameterSet& set, const RenderContext& context) {
    const auto& parameters = dynamic_cast<const CropParameters&>(set);
    switch (context.format) {
      case ColorFormat::rgba8: return make_for<ColorFormat::rgba8>(parameters, context);
      case ColorFormat::rgba16f: return make_for<ColorFormat::rgba16f>(parameters, context);
      case ColorFormat::rgba32f: return make_for<ColorFormat::rgba32f>(parameters, context);
      case ColorFormat::rgba16: return make_for<ColorFormat::rgba16>(parameters, context);
      case ColorFormat::srgb8: return make_for<ColorFormat::srgb8>(parameters, context);
    }
    return nullptr;
  }
  /// To be registered.
  static Implementation implementation(const char* name, const char* description) {
    Implementation implementation;
    implementation.slot = "crop";
    implementation.name = name;
    implementation.description = description;
    implementation.make_parameters = [] { return std::make_unique<CropParameters>(); };
    implementation.make_behaviour = make;
    return implementation;
  }

 private:
  template <ColorFormat Format>
  static std::unique_ptr<Behaviour> make_for(const CropParameters& parameters, const RenderContext& context) {
    check_rounding(Format, context.precision.blend_rounding);
    switch (context.precision.blend_rounding) {
      case BlendRounding::rne: return std::make_unique<Rop<Format, BlendRounding::rne>>(parameters, context);
      case BlendRounding::rtz: return std::make_unique<Rop<Format, BlendRounding::rtz>>(parameters, context);
      case BlendRounding::measured:
        if constexpr (is_measured(Format))
          return std::make_unique<Rop<Format, BlendRounding::measured>>(parameters, context);
    }
    return nullptr;
  }
};

}  // namespace vrpipe
