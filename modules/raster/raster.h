#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "hi_z.h"

#include <vrpipe/component/parameter.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/pipeline_stages.h>
#include <vrpipe/pipeline/effects.h>
#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/raster.h>

namespace vrpipe {

/// Of a RASTER: one of your own derives its parameters from these.
struct RasterParameters : ParameterSet {
  Integer setup_latency_cycles{*this,
                               "setup_latency_cycles",
                               10,
                               1,
                               1000,
                               "cycles",
                               "ATTILA, Emerald: set-up latency 10",
                               "of setting up a primitive's edge functions"};
  Real setup_interval_cycles{
      *this,
      "setup_interval_cycles",
      1,
      0.001,
      1000,
      "cycles",
      source::open,
      "from one set-up to the next; the 8 to 10 cycles that a set-up takes are a latency, not an interval"};
  Real bare_setup_interval_cycles{*this,
                                  "bare_setup_interval_cycles",
                                  0,
                                  0,
                                  1000,
                                  "cycles",
                                  "left open by the paper; measured on a GH100 graphics GPC: at most 2.9",
                                  "the same of a primitive of which fragments read no attributes, as where nothing is "
                                  "shaded; 0: setup_interval_cycles"};
  Real rectangle_setup_interval_cycles{
      *this,
      "rectangle_setup_interval_cycles",
      0,
      0,
      1000,
      "cycles",
      "left open by the paper; measured on a GH100 graphics GPC: 4.17",
      "the same of a filled rectangle of which fragments read attributes; 0: setup_interval_cycles"};
  Integer coarse_tiles_per_cycle{*this,
                                 "coarse_tiles_per_cycle",
                                 8,
                                 1,
                                 1024,
                                 "raster tiles",
                                 "ATTILA: 16x16 scan tiles, two a cycle",
                                 "raster tiles tested against the edges in a cycle"};
  Integer fine_tiles_per_cycle{*this,
                               "fine_tiles_per_cycle",
                               2,
                               1,
                               64,
                               "raster tiles",
                               "Emerald: 2 fine tiles a cycle and cluster",
                               "raster tiles made into quads in a cycle"};
  Real screen_tile_interval_cycles{*this,
                                   "screen_tile_interval_cycles",
                                   1,
                                   0.001,
                                   1000,
                                   "cycles",
                                   source::open,
                                   "between (primitive, screen tile) pairs; assumed: Emerald has no such interval, and "
                                   "with its registered rates speed-ups are nearly the same (agx-orin-emerald-2)"};
  Integer quads_per_cycle{*this,
                          "quads_per_cycle",
                          16,
                          1,
                          16,
                          "quads",
                          "measured on a GH100 graphics GPC: 64 pixels a cycle",
                          "quads handed to TC in a cycle"};
};

/// What RASTER's work takes, by its parameters: all that its models of `cycle`, `lt` and `bound` ask for.
struct RasterTime {
  RasterTime(const RasterParameters& parameters, const RenderContext& context)
      : setup_latency_cycles(parameters.setup_latency_cycles),
        setup_interval_thousandths(parameters.setup_interval_cycles.thousandths()),
        bare_setup_interval_thousandths(parameters.bare_setup_interval_cycles > 0
                                            ? parameters.bare_setup_interval_cycles.thousandths()
                                            : setup_interval_thousandths),
        rectangle_setup_interval_thousandths(parameters.rectangle_setup_interval_cycles > 0
                                                 ? parameters.rectangle_setup_interval_cycles.thousandths()
                                                 : setup_interval_thousandths),
        coarse_tiles_per_cycle(parameters.coarse_tiles_per_cycle),
        fine_tiles_per_cycle(parameters.fine_tiles_per_cycle),
        screen_tile_interval_thousandths(parameters.screen_tile_interval_cycles.thousandths()),
        quads_per_cycle(parameters.quads_per_cycle),
        context_(context) {}

  const std::uint32_t setup_latency_cycles;
  const std::uint32_t setup_interval_thousandths;            ///< of a cycle, between primitives
  const std::uint32_t bare_setup_interval_thousandths;       ///< the same without attributes
  const std::uint32_t rectangle_setup_interval_thousandths;  ///< and between rectangles
  const std::uint32_t coarse_tiles_per_cycle;                ///< raster tiles tested
  const std::uint32_t fine_tiles_per_cycle;                  ///< raster tiles made into quads
  const std::uint32_t screen_tile_interval_thousandths;      ///< of a cycle, between (primitive, screen tile) pairs
  const std::uint32_t quads_per_cycle;                       ///< handed to TC

  /// What the set-up of a draw's primitive takes.
  struct SetUp {
    unsigned work;  ///< RasterWork
    std::uint32_t thousandths;
  };
  SetUp set_up(DrawIndex draw) const {
    const DrawCall& call = context_.draw(draw);
    if (!reads_attributes(call.state.shader)) return {RasterWork::bare_setup, bare_setup_interval_thousandths};
    if (draws_rectangles(call)) return {RasterWork::rectangle_setup, rectangle_setup_interval_thousandths};
    return {RasterWork::setup, setup_interval_thousandths};
  }

  /// Of beats of quads.
  PipelineStages pipeline() const { return PipelineStages::of_latency(setup_latency_cycles, fine_tiles_per_cycle); }
  /// As in RasterWork.
  std::vector<WorkKind> kinds() const {
    return {{"set-up", 0, setup_interval_thousandths / 1000.0, false},
            {"coarse tests", 1, 1.0 / coarse_tiles_per_cycle, false},
            {"fine tiles", 2, 1.0 / fine_tiles_per_cycle, false},
            {"screen tiles", 3, screen_tile_interval_thousandths / 1000.0, false},
            {"quads", 4, 1.0 / quads_per_cycle, true},
            {"bare set-up", 0, bare_setup_interval_thousandths / 1000.0, false},
            {"set-up of rectangles", 0, rectangle_setup_interval_thousandths / 1000.0, false}};
  }

 private:
  const RenderContext& context_;
};

/// Setup, coarse and fine rasterisation (paper 5.1): fixed point, samples at pixel centres, top-left rule, so that the
/// two triangles of a splat never share a sample. Screen tiles row by row, raster tiles row by row within.
class TileRasterizer : public RasterBehaviour {
 public:
  struct Parameters : RasterParameters {
    Switch half_tile_order{*this, "half_tile_order", false,
                           "left open by the paper; measured on a GH100 graphics GPC: on",
                           "quads of a raster tile come half by half, 4x8 pixels each, not row by row"};
    Switch hi_z{*this, "hi_z", true, "all GPUs since HyperZ (ATI, 2000)",
                "raster tiles behind all that is stored there are dropped before fine rasterisation"};
    Integer hi_z_bits{*this,
                      "hi_z_bits",
                      14,
                      1,
                      24,
                      "bits",
                      "AMD's HTILE: 14 bits of an 8x8 tile's farthest depth",
                      "that Hi-Z keeps of a raster tile's farthest depth, rounded up"};
  };
  TileRasterizer(const Parameters& parameters, const RenderContext& context);

  void begin(const Primitive& primitive, const PixelRect& clip) override;
  bool next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) override;
  void update(const HiZUpdate& update) override;
  void hold_as(const Behaviour& other) override;
  bool waits_at(Mark mark) const override { return hi_z_ != nullptr && hi_z_->waits_at(mark); }
  const RasterTime& time() const override { return time_; }

  MinMax widest_edge{*this, MinMax::Of::largest, "widest_edge", "bits",
                     "sign included, that the largest edge function needs over the samples of the viewport"};
  Counter hi_z_tests{*this, "hi_z_tests", "raster tiles", "that coarse rasterisation keeps and Hi-Z looks at"};
  Counter hi_z_culled{*this, "hi_z_culled", "raster tiles", "dropped: they lie behind all that is stored there"};
  Counter hi_z_updates{*this, "hi_z_updates", "raster tiles", "whose farthest depth came from ZROP"};
  Counter wide_edges{*this, "wide_edges", "primitives", "that need 64-bit edge functions inside a raster tile"};

 private:
  /// Of the three edges, a word each; the fourth has no sample outside that the third has inside.
  using OfEdges = std::int64_t __attribute__((vector_size(sizeof(Words))));
  /// Of a screen tile's raster tiles, a word each.
  using OfParts = OfEdges;
  /// By dx_ and dy_.
  void set_up_tiles();
  /// Samples of a raster tile that are inside, 4 bits for each of its 4x4 quads: by the values at its first one.
  std::uint64_t coverage_of_narrow(const OfEdges& value) const;
  std::uint64_t coverage_of_wide(const OfEdges& value) const;
  void set_up_rectangle();
  void tell(const QuadBeat& made) const;
  /// Those of a raster tile of the screen tile that are not masked off.
  std::uint64_t in_area(unsigned part) const;
  /// Goes on to the next screen tile, and tests its raster tiles against the edges; false if there is none.
  bool enter_tile();
  [[gnu::noinline]] static void take_by_halves(QuadBeat& tile);
  /// Whether Hi-Z culls a raster tile of the screen tile.
  [[gnu::noinline]] bool is_hidden(unsigned part);
  /// Where a raster tile of the screen tile begins.
  std::int32_t x_of(unsigned part) const;
  std::int32_t y_of(unsigned part) const;

  const RenderContext& context_;
  TriangleSnapper snapper_;
  const RasterTime time_;
  bool wide_ = false;
  OfEdges dx_{}, dy_{};            ///< a pixel to the right, and down
  OfEdges right_{};                ///< to the next screen tile
  OfEdges below_{};                ///< and to the next row of them
  OfEdges at_part_[4] = {};        ///< at a raster tile's first sample, from that of the screen tile
  OfParts most_in_parts_[3] = {};  ///< of an edge, at the samples where it is largest
  // Within a raster tile, in the lower 32 bits if they are not wide:
  LanePairBits samples_[3] = {};  ///< of an edge, at the samples of the first column's upper quads
  OfEdges next_column_{};         ///< to those of the next column
  OfEdges lower_quads_{};         ///< and of the lower quads
  Primitive primitive_;
  std::uint32_t first_bits_ = 0;  ///< the upper half of the word of its quad at position 0, without coverage
  PixelRect area_;                ///< bounds of the primitive within the clip
  PixelRect mask_area_;           ///< outside which samples are masked off
  bool is_masked_ = false;        ///< whether its screen tiles reach beyond that
  std::int32_t next_x_ = 0;       ///< the screen tile to enter next, in tiles
  std::int32_t next_y_ = 0;
  std::int32_t tile_x_begin_ = 0;
  std::int32_t tile_x_end_ = 0;
  std::int32_t tile_y_end_ = 0;
  OfEdges at_next_{};  ///< the edges at its first sample
  OfEdges at_row_{};   ///< and at that of the first in its row
  // The screen tile that was entered last:
  TileId tile_;
  OfEdges at_tile_{};
  // Of its raster tiles 0 to 3, a bit each:
  unsigned left_ = 0;  ///< to be tested, as far as `next` has not come to them
  unsigned kept_ = 0;  ///< of these, not outside an edge
  bool tile_counted_ = false;
  std::unique_ptr<HiZ> hi_z_;  ///< where it can cull anything
  bool tests_hi_z_ = false;    ///< for the primitive
  EffectGate wide_edges_gate_;
  EffectGate binned_gate_;
  EffectGate ownership_gate_;
  const bool by_halves_;     ///< quads of a raster tile, not by rows
  const bool shares_tiles_;  ///< with other GPCs
};

}  // namespace vrpipe
