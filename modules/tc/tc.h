#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/pipeline_stages.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/hi_z_plan.h>
#include <vrpipe/pipeline/late_plan.h>
#include <vrpipe/pipeline/screen_tiling.h>
#include <vrpipe/pipeline/slots/tc.h>

namespace vrpipe {

/// Of a TC: one of your own derives its parameters from these.
struct TcParameters : ParameterSet {
  Integer bins{*this, "bins", 32, 1, 65536, "bins", source::paper_table, "screen tiles collected at a time"};
  Integer bin_quads{*this, "bin_quads", 128, 1, 4096, "quads", source::paper_table, "quads in a full bin"};
  Integer quads_per_cycle{*this,        "quads_per_cycle",
                          16,           1,
                          16,           "quads",
                          source::open, "quads taken into bins in a cycle; the rasteriser's peak"};
  Integer latency_cycles{
      *this, "latency_cycles", 4, 1, 1000, "cycles", source::open, "from the flush decision to the first quad at PROP"};
  Integer idle_timeout_cycles{*this,
                              "idle_timeout_cycles",
                              150,
                              0,
                              1000000,
                              "cycles",
                              source::measured,
                              "without an incoming quad until bins are flushed; 0 never; not in strict termination"};
  Integer flush_queue_bins{
      *this, "flush_queue_bins", 2, 1, 1024, "bins", source::open, "flushed bins that wait for PROP before TC stops"};
};

/// What TC's work takes, by its parameters: all that its models of `cycle`, `lt` and `bound` ask for.
struct TcTime {
  explicit TcTime(const TcParameters& parameters)
      : quads_per_cycle(parameters.quads_per_cycle),
        latency_cycles(parameters.latency_cycles),
        idle_timeout_cycles(parameters.idle_timeout_cycles),
        flush_queue_bins(parameters.flush_queue_bins) {}

  const std::uint32_t quads_per_cycle;
  const std::uint32_t latency_cycles;
  const std::uint32_t idle_timeout_cycles;  ///< without an incoming quad until bins are flushed; 0: never
  const std::uint32_t flush_queue_bins;     ///< flushed bins that wait for PROP

  /// The time-out that applies. None in strict termination: the contents of bins would depend on time.
  std::uint32_t timeout_in(Termination termination) const {
    return termination == Termination::strict ? 0 : idle_timeout_cycles;
  }
  /// Of flushed bins, beats of quads.
  PipelineStages pipeline() const { return PipelineStages::of_latency(latency_cycles); }
  /// As in TcWork.
  std::vector<WorkKind> kinds() const {
    return {{"quads", 0, 1.0 / quads_per_cycle, true}, {"read-out", 1, 1.0, false}};
  }
};

/// Tile coalescing (paper 5.1, 7.1): bins of quads, a bin per screen tile, replaced first in, first out.
class TileCoalescing : public TcBehaviour {
 public:
  using Parameters = TcParameters;
  TileCoalescing(const Parameters& parameters, const RenderContext& context);

  unsigned insert(const QuadBeat& beat, unsigned from, Flush& out, bool& flushed) override;
  bool flush_oldest(FlushReason reason, Flush& out) override;
  const TcTime& time() const override { return time_; }

  Counter bins_begun{*this, "bins_begun", "bins", "given to a screen tile; less `flushes`, those in use"};
  Counter flushes_full{*this, "flushes_full", "flushes", "because the bin was full"};
  Counter flushes_evicted{*this, "flushes_evicted", "flushes", "because another tile needed the bin"};
  Counter flushes_timed_out{*this, "flushes_timed_out", "flushes", "because no quad came for the time-out"};
  Counter flushes_end_of_draw{*this, "flushes_end_of_draw", "flushes",
                              "before a clear or a draw of another state, and at the end of the frame"};
  Histogram flush_sizes{*this, Histogram::Buckets::log2(), "quads_per_flush", "quads", "in a flushed bin"};

 private:
  struct Bin {
    TileId tile;
    std::uint32_t count = 0;
    std::vector<Quad> quads;  ///< as many as it has room for, of which it holds `count`
  };
  // Out of line: most beats go into a bin that is there and does not get full.
  [[gnu::noinline]] void flush_bin(std::uint32_t bin, FlushReason reason, Flush& out);
  /// Flushes a full bin.
  [[gnu::noinline]] void flush_full(std::uint32_t bin, Flush& out);
  /// Gives a bin to a tile; false if none is free.
  [[gnu::noinline]] bool begin_bin(TileId tile);

  const std::uint32_t bin_quads_;
  const ScreenTiling grid_;
  const TcTime time_;
  std::vector<Bin> bins_;
  std::vector<std::uint32_t> free_;
  std::deque<std::uint32_t> allocation_order_;
  std::vector<std::int32_t> bin_of_tile_;  ///< -1: none
  EffectGate eviction_gate_;
};

/// The marks that TC hands on. Behind it a bin, and so a warp, is of one state, and a change of state has nothing to stop; but
/// Hi-Z may wait for one to come to ZROP, ZROP for one behind late tests, and DRAW for one to come to CROP.
class PassingMarks {
 public:
  explicit PassingMarks(const RenderContext& context)
      : frame_(*context.frame), hi_z_(context), late_(context), barriers_(context) {}
  bool has(Mark mark) const {
    return mark == Mark::end_of_frame || frame_.clear_of(mark) != nullptr || hi_z_.waits_at(mark) ||
           late_.waits_at(mark) || barriers_.is_barrier(mark);
  }

 private:
  const Frame& frame_;
  const HiZPlan hi_z_;
  const LatePlan late_;
  const BarrierPlan barriers_;
};

}  // namespace vrpipe
