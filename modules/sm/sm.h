#pragma once

#include "attribute_traffic.h"
#include "mesh_shader.h"

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

/// The SM array of a GPC: the splatting shaders and the merge extension (paper 2.2, 5.3).
///
/// Fragment shader: u, v are the sample's coordinates along the splat's axes in sigmas, from the pixel centre;
/// alpha = min(0.99, opacity * 2^(-log2(e)/2 (u^2 + v^2))); alpha below the pruning threshold is discarded; the output
/// is (alpha r, alpha g, alpha b, alpha) in single precision. Merging: f_fb of the pair, dead lanes being (0,0,0,0).
class SplatShader : public SmBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer cores{*this, "cores", 16, 1, 1024, "cores", source::paper_table, "SIMT cores of the GPC"};
    Integer schedulers_per_core{
        *this, "schedulers_per_core", 4, 1, 64, "schedulers", source::paper_table, "warp schedulers"};
    Integer lanes_per_scheduler{*this,
                                "lanes_per_scheduler",
                                16,
                                1,
                                32,
                                "lanes",
                                source::paper_table,
                                "a warp instruction issues for 32 / lanes cycles"};
    Integer warps_per_core{
        *this, "warps_per_core", 48, 1, 256, "warps", "Accel-Sim, SM87_ORIN: 48 warps", "fragment warps in flight"};
    Integer vertex_warps{
        *this,        "vertex_warps",
        32,           1,
        1024,         "warps",
        source::open, "vertex warps in flight in the array, kept apart so that the pipeline cannot lock"};
    Integer warps_to_one_core{*this,
                              "warps_to_one_core",
                              8,
                              1,
                              256,
                              "warps",
                              "measured on a GH100 graphics GPC: 64 quads to one SM, SMs in turn",
                              "consecutive warps of a screen tile that go to the same core"};
    Real warp_launch_cycles{*this,
                            "warp_launch_cycles",
                            0,
                            0,
                            1000,
                            "cycles",
                            "left open by the paper; measured on a GH100 graphics GPC with 2 TPCs: 2.5",
                            "of handing a warp to a core; 0: a warp a cycle"};
    Real visit_launch_cycles{
        *this,
        "visit_launch_cycles",
        0,
        0,
        1000,
        "cycles",
        "left open by the paper; measured on a GH100 graphics GPC with 2 TPCs: 4",
        "beside that, of handing over a primitive's quads in a screen tile; the longer of the two counts"};
    Real discard_launch_cycles{*this,
                               "discard_launch_cycles",
                               0,
                               0,
                               1000,
                               "cycles",
                               "left open by the paper; measured on a GH100 graphics GPC with 2 TPCs: 1.7",
                               "on top of that, of a program that discards"};
    Real discard_warp_cycles{*this,
                             "discard_warp_cycles",
                             0,
                             0,
                             1000,
                             "cycles",
                             "left open by the paper; measured on a GH100 graphics GPC with 2 TPCs: 1.03",
                             "on top of warp_launch_cycles, of a program that discards"};
    Integer vertex_instructions{*this,        "vertex_instructions",
                                20,           1,
                                1000,         "instructions",
                                source::open, "of the vertex shader: centre plus two semi-axes"};
    Integer fragment_instructions{*this,        "fragment_instructions",
                                  24,           1,
                                  1000,         "instructions",
                                  source::open, "of the fragment shader: attributes, dot product, ex2, prune, export"};
    Integer mesh_instructions{*this,
                              "mesh_instructions",
                              29,
                              1,
                              1000,
                              "instructions",
                              source::open,
                              "of the fragment shader of meshes: 4 to fetch, 1/w and its reciprocal, 6 "
                              "attributes, 3 and a square root for the normal, 6 for the light, 3 for the "
                              "colour, 4 to export"};
    Integer alpha_threshold_instructions{
        *this,
        "alpha_threshold_instructions",
        5,
        1,
        1000,
        "instructions",
        source::open,
        "of the shader that discards what has not terminated: 2 for the pixel, load, compare, discard"};
    Integer merge_instructions{
        *this,        "merge_instructions",
        13,           1,
        1000,         "instructions",
        source::open, "issue slots of a merge: 4 shuffles of two slots, 1 subtraction, 4 multiply-adds"};
    Integer attribute_latency_cycles{*this,
                                     "attribute_latency_cycles",
                                     146,
                                     0,
                                     10000,
                                     "cycles",
                                     "Accel-Sim, SM87_ORIN: L2 latency",
                                     "of fetching vertices, or attributes, where the memory port is not connected"};
    Integer attribute_bytes{*this,
                            "attribute_bytes",
                            40,
                            4,
                            attribute_bytes_per_splat / 2,
                            "bytes",
                            "the fragment shader's 10 values: centre, 2x2 matrix, opacity, colour",
                            "of its attributes that are read for a primitive, where the memory port is connected"};
    Integer attribute_buffer_bytes{*this,
                                   "attribute_buffer_bytes",
                                   1 << 20,
                                   1 << 16,
                                   1 << 30,
                                   "bytes",
                                   source::open,
                                   "of the circular buffer that attributes are written to; what is overwritten is "
                                   "taken to be needed no more"};
    Integer attribute_writes{*this,        "attribute_writes",
                             640,          1,
                             65536,        "accesses",
                             source::open, "of attributes in flight; enough for what draw issues at the latency of L2"};
    Integer memory_bytes_per_cycle{*this,
                                   "memory_bytes_per_cycle",
                                   32,
                                   32,
                                   1024,
                                   "bytes",
                                   "Accel-Sim, SM87_ORIN: flits of 40 bytes carry 32, for each cluster",
                                   "that the memory port has in each direction for each core"};
    Integer l1_bytes{
        *this,
        "l1_bytes",
        49152,
        0,
        1 << 20,
        "bytes",
        source::paper_table,
        "L1 of a core, through which attributes are read; lines of 128 bytes, sectors of 32; 0: none, they "
        "are read from what the memory port is bound to"};
    Integer l1_ways{*this, "l1_ways", 0, 0, 1 << 13, "ways", source::open, "of a set of an L1; 0: fully associative"};
    Integer l1_mshrs{*this,
                     "l1_mshrs",
                     384,
                     1,
                     65536,
                     "sectors",
                     "Accel-Sim, SM87_ORIN: 384 MSHRs of a first-level cache",
                     "that an L1, or a core without one, has asked for and not got"};
    Integer l1_latency_cycles{*this,
                              "l1_latency_cycles",
                              38,
                              0,
                              10000,
                              "cycles",
                              "Accel-Sim, SM87_ORIN: L1 latency",
                              "from the launch until what the L1 holds is there; what it lacks takes as long as memory "
                              "says, and not less"};
    Integer fragment_latency_cycles{*this,
                                    "fragment_latency_cycles",
                                    75,
                                    0,
                                    10000,
                                    "cycles",
                                    "Accel-Sim, SM87_ORIN: 4 cycles an instruction, 23 a special function",
                                    "of the dependent instructions beyond their issue slots"};
    Integer merge_latency_cycles{*this,        "merge_latency_cycles",
                                 30,           0,
                                 10000,        "cycles",
                                 source::open, "of shuffle and partial blend beyond their issue slots"};
  };
  /// Throws UserError for an array that cannot be.
  SplatShader(const Parameters& parameters, const RenderContext& context);

  void shade(const Warp& warp, ShadedWarp& out) override;
  void shade_vertices(const VertexWarp&) override {}
  TimingParameters timing() const override { return timing_; }

  Counter colors_clamped{*this, "colors_clamped", "splats",
                         "set-ups of a splat with a colour below 0 or beyond the largest half"};

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
  TimingParameters timing_;
  /// Of the splats last set up, by the low bits of their number; two tables, so that the two quads' are there at once.
  AttributeTable attributes_of_first_;
  AttributeTable attributes_of_second_;
  MeshShader mesh_;
};

}  // namespace vrpipe
