#pragma once

#include <deque>

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/slots/tgc.h>

namespace vrpipe {

/// Tile grid coalescing (paper 5.3): bins of primitives, a bin per tile grid. A bin is flushed when it is full, when a
/// primitive of a new grid finds all bins taken (the one allocated first goes), and at a mark.
class TileGridCoalescing : public TgcBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer bins{*this, "bins", 128, 1, 65536, "bins", source::paper_table, "tile grids collected at a time"};
    Integer bin_primitives{*this,
                           "bin_primitives",
                           16,
                           1,
                           65536,
                           "primitives",
                           source::paper_table,
                           "primitives in a full bin; a splat is two"};
    Integer grid_tiles{*this, "grid_tiles", 4, 1, 64, "screen tiles", source::paper_table, "side of a tile grid"};
    Integer entries_per_cycle{*this,
                              "entries_per_cycle",
                              2,
                              1,
                              64,
                              "entries",
                              source::open,
                              "bins that primitives enter in a cycle; matches the rate of VPO"};
    Integer latency_cycles{*this,
                           "latency_cycles",
                           4,
                           1,
                           1000,
                           "cycles",
                           source::open,
                           "from the flush decision to the first primitive at the rasteriser"};
  };
  TileGridCoalescing(const Parameters& parameters, const RenderContext& context);

  void begin(const Primitive& primitive) override;
  bool entering() const override { return grid_y_ < grid_y_end_; }
  bool step(Flush& out) override;
  bool drain(Flush& out) override;
  Throughput timing() const override { return {entries_per_cycle_, latency_cycles_}; }
  std::uint32_t largest_flush() const override { return bin_primitives_; }
  /// (4 B pointer x 3 vertices x primitives + 2 B grid id) x bins (paper, table of hardware cost).
  std::uint64_t storage_bytes() const override;

  Counter bins_begun{*this, "bins_begun", "bins", "given to a tile grid; less `flushes`, those in use"};
  Counter evictions{*this, "evictions", "flushes", "of these, to make room"};
  Histogram flush_sizes{*this, Histogram::Buckets::log2(), "primitives_per_flush", "primitives", "in a flushed bin"};

 private:
  struct Bin {
    std::uint32_t grid = 0;
    std::vector<Primitive> primitives;
  };
  void flush_bin(std::uint32_t bin, Flush& out);
  PixelRect area_of_grid(std::int32_t x, std::int32_t y) const;  ///< by its place among the grids
  /// Of those that the primitive may cover.
  bool owns_pixels_in_grid() const;
  void skip_foreign_grids();
  void advance();

  const RenderContext& context_;
  const std::uint32_t bins_limit_;
  const std::uint32_t bin_primitives_;
  const std::int32_t grid_pixels_;
  const std::uint32_t grids_x_;
  const std::uint32_t entries_per_cycle_;
  const std::uint32_t latency_cycles_;

  std::vector<Bin> bins_;
  std::vector<std::uint32_t> free_;
  std::deque<std::uint32_t> allocation_order_;
  std::vector<std::int32_t> bin_of_grid_;  ///< -1: none
  EffectGate eviction_gate_;

  Primitive primitive_;
  std::int32_t grid_x_ = 0;
  std::int32_t grid_x_begin_ = 0;
  std::int32_t grid_x_end_ = 0;
  std::int32_t grid_y_ = 0;
  std::int32_t grid_y_end_ = 0;
};

/// The baseline: no TGC, primitives go on one by one.
class TgcPassThrough : public TgcBehaviour {
 public:
  struct Parameters : ParameterSet {};
  TgcPassThrough(const Parameters&, const RenderContext& context);

  void begin(const Primitive& primitive) override;
  bool entering() const override { return pending_; }
  bool step(Flush& out) override;
  bool drain(Flush&) override { return false; }
  Throughput timing() const override { return {2, 1}; }
  std::uint32_t largest_flush() const override { return 1; }
  std::uint64_t storage_bytes() const override { return 0; }

 private:
  Primitive primitive_;
  bool pending_ = false;
};

}  // namespace vrpipe
