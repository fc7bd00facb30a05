#pragma once

#include "mesh_shader.h"
#include "sm_parameters.h"

#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

/// The SM array of a GPC: the splatting shaders and the merge extension (paper 2.2, 5.3).
///
/// Fragment shader: u, v are the sample's coordinates along the splat's axes in sigmas, from the pixel centre;
/// alpha = min(0.99, opacity * 2^(-log2(e)/2 (u^2 + v^2))); alpha below the pruning threshold is discarded; the output
/// is (alpha r, alpha g, alpha b, alpha) in single precision. Merging: f_fb of the pair, dead lanes being (0,0,0,0).
class SplatShader : public SmBehaviour {
 public:
  using Parameters = SmParameters;
  /// Throws UserError for an array that cannot be (SmTime).
  SplatShader(const Parameters& parameters, const RenderContext& context);

  void shade(const Warp& warp, ShadedWarp& out) override;
  void shade_vertices(const VertexWarp&) override {}
  const SmTime& time() const override { return time_; }

  Counter colors_clamped{*this, "colors_clamped", "splats",
                         "set-ups of a splat with a colour below 0 or beyond the largest half"};

 protected:
  SmTime time_;

 private:
  /// What the fragment shader needs of a splat.
  struct Attributes {
    LanePair red_green, blue_one;  ///< the colour, opaque, at a quad's samples
    std::uint32_t splat = ~0U;
    float cx, cy;
    float m00, m01, m10, m11;  ///< pixels to sigmas along the two axes
    float opacity;
  };
  /// Its shape, for the samples of two quads.
  struct Shape {
    LanePair cx, cy, m00, m01, m10, m11, opacity;
    [[gnu::always_inline]] explicit Shape(const Attributes& both)
        : cx(splat_pair(both.cx)),
          cy(splat_pair(both.cy)),
          m00(splat_pair(both.m00)),
          m01(splat_pair(both.m01)),
          m10(splat_pair(both.m10)),
          m11(splat_pair(both.m11)),
          opacity(splat_pair(both.opacity)) {}
    [[gnu::always_inline]] Shape(const Attributes& a, const Attributes& b)
        : cx(join(splat_lanes(a.cx), splat_lanes(b.cx))),
          cy(join(splat_lanes(a.cy), splat_lanes(b.cy))),
          m00(join(splat_lanes(a.m00), splat_lanes(b.m00))),
          m01(join(splat_lanes(a.m01), splat_lanes(b.m01))),
          m10(join(splat_lanes(a.m10), splat_lanes(b.m10))),
          m11(join(splat_lanes(a.m11), splat_lanes(b.m11))),
          opacity(join(splat_lanes(a.opacity), splat_lanes(b.opacity))) {}
  };
  void set_up(Attributes& attributes, const Quad& quad);
  using AttributeTable = std::array<Attributes, 32>;
  const Attributes& attributes_of(AttributeTable& table, const Quad& quad);
  /// Of a warp's threads, a bit each.
  struct Threads {
    std::uint32_t covered = 0;
    std::uint32_t live = 0;          ///< of these, not pruned
    std::uint32_t merged = 0;        ///< of back quads that their fronts take up, where both are live
    std::uint32_t merged_quads = 0;  ///< the first of each such quad
  };
  // What takes the colours of a warp's quads, in their order: those of all, or, one behind the other, of those that live, as they
  // are exported. Behind the last may come one that is dead.
  struct AllColors {
    void put(unsigned index, LaneMask, const ChannelPairs& color) { of_quad[index] = color; }
    ChannelPairs of_quad[quads_per_warp];
  };
  template <NumberFormat Export>
  struct LiveColors {
    /// Written in any case, since a branch would be mispredicted too often.
    void put(unsigned, LaneMask live, const ChannelPairs& color);
    QuadColor* next;
  };
  /// Chosen by the precision of the hardware.
  template <NumberFormat Shading>
  void choose_merging(NumberFormat merging, NumberFormat exports);
  template <NumberFormat Shading, NumberFormat Merging, NumberFormat Export>
  void shade_in(const Warp& warp, ShadedWarp& out);
  /// Says as well which threads live.
  template <NumberFormat Shading, class Colors>
  void shade_quads(const Warp& warp, Threads& threads, Colors& colors);
  template <Exponential Kind, NumberFormat Shading, class Colors>
  void shade_splats(const Warp& warp, Threads& threads, Colors& colors);
  template <class Colors>
  void shade_mesh(const Warp& warp, Threads& threads, Colors& colors);
  template <class Colors>
  void shade_by_alpha(const Warp& warp, Threads& threads, Colors& colors);
  /// Shades a warp with pairs, merges them, and hands on what lives.
  template <NumberFormat Shading, NumberFormat Merging, NumberFormat Export>
  [[gnu::noinline]] void shade_pairs(const Warp& warp, Threads& threads, ShadedWarp& out);
  /// Puts quads without a live fragment in their places among those that are handed on, and says what all cover.
  void add_pruned(const Warp& warp, const Threads& threads, ShadedWarp& out) const;
  void count(const Warp& warp, const Threads& threads);
  void tell_merged(const Warp& warp, std::uint32_t threads) const;
  /// Alpha at the samples of two quads.
  template <Exponential Kind, NumberFormat Format>
  static LanePair alpha_at(LanePair x, LanePair y, const Shape& splats, float alpha_max);

  const RenderContext& context_;
  EffectGate several_draws_gate_;
  EffectGate mesh_gate_;
  EffectGate color_reads_gate_;
  EffectGate pairing_gate_;
  const bool several_draws_;
  // What the precision calls for, chosen once.
  void (SplatShader::*shade_in_)(const Warp&, ShadedWarp&) = nullptr;
  float alpha_max_;
  /// Of the splats last set up, by the low bits of their number; two tables, so that the two quads' are there at once.
  AttributeTable attributes_of_first_;
  AttributeTable attributes_of_second_;
  MeshShader mesh_;
};

}  // namespace vrpipe
