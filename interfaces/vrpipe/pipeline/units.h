#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <vrpipe/component/statistic.h>
#include <vrpipe/kernel/rate.h>
#include <vrpipe/memory/cache_statistics.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/render_context.h>

/// The slots of the pipeline. Each is a *functional model* (a Behaviour): what a unit does and at which rates, without
/// SystemC and without time. Timing models (modules/<unit>/) give it sockets and time; see docs/glossary.md.
///
/// Functional models that turn a stream into batches work by steps: a call takes items until a batch comes out or the
/// items are used up. So one serves a timing model that moves a few quads a cycle and a loop that runs a whole draw.

namespace vrpipe {

/// How fast a unit works: what its timing model asks for.
struct Throughput {
  std::uint32_t items_per_cycle = 1;  ///< peak rate
  std::uint32_t latency_cycles = 1;   ///< from the last item in to the first item out
};

/// A slot's class declares the counters that reports and the checks of conservation need; every unit of the slot counts
/// them. Others are its own.
class Behaviour : public StatisticSet {
 public:
  virtual ~Behaviour() = default;
  /// The unit as its author wrote it: itself, or what stands behind the checks (checked_behaviours.h).
  virtual const Behaviour& unit() const { return *this; }
  Behaviour& unit() { return const_cast<Behaviour&>(static_cast<const Behaviour*>(this)->unit()); }
};

/// Slot `draw`: issues the splats of a frame's draws as vertex warps.
class DrawBehaviour : public Behaviour {
 public:
  /// The next warp, of one draw, or the mark before a clear and before a draw of another state (Frame::commands); false
  /// after the last.
  virtual bool next(VertexWarp& out) = 0;
  /// Vertex warps in 1024 cycles.
  virtual std::uint32_t warps_per_1024_cycles() const = 0;
};

/// Slot `vpo`: primitive assembly, culling, clipping to the viewport, bounding boxes.
class VpoBehaviour : public Behaviour {
 public:
  /// The visible triangles of a splat of a draw, in order. Returns how many of `out` are set (0 to 2).
  virtual unsigned assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) = 0;
  virtual Throughput cost() const = 0;  ///< items: triangles

  DrawCounter primitives{*this, "primitives", "triangles", "triangles handed to the GPCs"};
};

/// Slot `tgc`: collects primitives per tile grid.
class TgcBehaviour : public Behaviour {
 public:
  /// Primitives of one tile grid that are to be rasterised in `clip` now.
  struct Flush {
    PixelRect clip;
    std::vector<Primitive> primitives;
  };
  /// Starts to enter a primitive into the bins of the grids that it touches.
  virtual void begin(const Primitive& primitive) = 0;
  /// Whether the primitive of `begin` has bins left to enter.
  virtual bool entering() const = 0;
  /// Enters one bin, or evicts one to make room. True when `out` was flushed (its old contents are replaced).
  virtual bool step(Flush& out) = 0;
  /// Flushes what is left, the bin allocated first going first; false when nothing is.
  virtual bool drain(Flush& out) = 0;
  virtual Throughput cost() const = 0;              ///< items: bin entries
  virtual std::uint32_t largest_flush() const = 0;  ///< primitives
  virtual std::uint64_t storage_bytes() const = 0;  ///< of hardware

  Counter flushes{*this, "flushes", "flushes", "bins handed to the rasteriser; 0 where a unit passes through"};
};

/// Slot `raster`: setup, coarse and fine rasterisation of one primitive at a time.
class RasterBehaviour : public Behaviour {
 public:
  /// Sets up a primitive, to be rasterised in `clip`.
  virtual void begin(const Primitive& primitive, const PixelRect& clip) = 0;
  /// Advances to the next raster tile that coarse rasterisation keeps, and gives its quads (0 to 16).
  /// `coarse_tests` counts the raster tiles tested on the way; `new_screen_tile` tells whether it is the first raster
  /// tile kept of its screen tile. False, with `coarse_tests` set, when the primitive is done.
  virtual bool next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) = 0;
  struct Cost {
    std::uint32_t setup_latency_cycles;
    std::uint32_t setup_interval_cycles;        ///< between primitives
    std::uint32_t coarse_tiles_per_cycle;       ///< raster tiles tested
    std::uint32_t fine_tiles_per_cycle;         ///< raster tiles made into quads
    std::uint32_t screen_tile_interval_cycles;  ///< between (primitive, screen tile) pairs
    std::uint32_t quads_per_cycle;              ///< handed to TC
  };
  virtual Cost cost() const = 0;

  DrawCounter quads_rasterized{*this, "quads_rasterized", "quads", "with at least one covered sample"};
  DrawCounter fragments_rasterized{*this, "fragments_rasterized", "fragments", "covered samples"};
};

/// Slot `tc`: collects quads per screen tile.
class TcBehaviour : public Behaviour {
 public:
  enum class FlushReason : std::uint8_t { full, evicted, timed_out, end_of_draw };
  struct Flush {
    TileId tile;
    FlushReason reason = FlushReason::full;
    std::vector<Quad> quads;
  };
  /// Takes quads `from`.. of a beat until all are taken or a bin is flushed. Returns the number taken, 0 only together
  /// with a flush; `flushed` tells whether `out` was filled. What `out` held before is replaced.
  virtual unsigned insert(const QuadBeat& beat, unsigned from, Flush& out, bool& flushed) = 0;
  /// Flushes the bin whose turn it is (the shipped unit's: allocated first); false when all are empty.
  virtual bool flush_oldest(FlushReason reason, Flush& out) = 0;
  struct Cost {
    std::uint32_t quads_per_cycle;
    std::uint32_t latency_cycles;
    std::uint32_t idle_timeout_cycles;  ///< without an incoming quad until bins are flushed; 0: never
    std::uint32_t flush_queue_bins;     ///< flushed bins that wait for PROP
    /// The time-out that applies. None in strict termination: the contents of bins would depend on time.
    std::uint32_t timeout_in(Termination termination) const {
      return termination == Termination::strict ? 0 : idle_timeout_cycles;
    }
  };
  virtual Cost cost() const = 0;

  Counter quads{*this, "quads", "quads", "taken into bins"};
  Counter flushes{*this, "flushes", "flushes", "bins handed to PROP"};
};

/// Slot `prop`: hands bins to ZROP and on to QRU, and shaded warps to CROP in order.
class PropBehaviour : public Behaviour {
 public:
  enum class Order : std::uint8_t { draw, tile };
  struct Cost {
    std::uint32_t quads_per_cycle;  ///< TC to ZROP to QRU
    Rate color_rate;                ///< of quads to CROP, of this draw's format
    std::uint32_t latency_cycles;
    Order order;
  };
  virtual Cost cost() const = 0;
};

/// Strict termination: what the bins tested so far will have terminated, whenever their quads reach CROP.
class FunctionalRunAhead {
 public:
  virtual ~FunctionalRunAhead() = default;
  /// A mark has come by, after all bins before it.
  virtual void pass(Mark mark) = 0;
  /// Takes the survivors of a part of a bin, as soon as that is tested, through merging, shading and blending; with the
  /// last of a bin, `terminated` has what all of them newly terminate.
  virtual void tested(const QuadBeat& survivors, std::vector<TerminationSignal>& terminated) = 0;
};

/// Slot `zrop`: depth and stencil test, termination test and update.
class ZropBehaviour : public Behaviour {
 public:
  /// Before the first test. One that overrides it calls it.
  virtual void attach(DepthStencilSurface& surface) { surface_ = &surface; }
  const DepthStencilSurface* surface() const { return surface_; }
  /// Removes dead samples, and quads without a live one, from the beat; its tile and `last_of_bin` stay. Of its quads all
  /// are of one state; they may be of several draws.
  virtual void test(QuadBeat& beat) = 0;
  /// Sets the termination bit (stencil MSB) of the signalled pixels, unless they have been cleared since: then the
  /// signal's epoch has passed.
  virtual void update(const TerminationSignal& signal) = 0;
  /// A mark comes by, after all tests before it: a clear of termination is done (Frame::clear_of), for this GPC's tiles.
  virtual void pass(Mark mark) = 0;
  /// Strict mode at fidelities with time: termination comes from `run_ahead`, and `update` only costs time.
  virtual void follow(FunctionalRunAhead& run_ahead) = 0;
  struct Cost {
    std::uint32_t quads_per_cycle;
    std::uint32_t latency_cycles;
    std::uint32_t updates_per_cycle;  ///< signals; a cycle with updates tests no quads: one z-cache port
  };
  virtual Cost cost() const = 0;

  DrawCounter quads_tested{*this, "quads_tested", "quads", "that entered the termination test"};
  DrawCounter quads_depth_stencil_failed{*this, "quads_depth_stencil_failed", "quads",
                                         "that lost their last fragment to the depth or stencil test"};
  DrawCounter fragments_depth_stencil_failed{*this, "fragments_depth_stencil_failed", "fragments",
                                             "that failed the depth or stencil test"};
  DrawCounter quads_terminated{*this, "quads_terminated", "quads",
                               "that lost their last fragment to the termination test"};
  DrawCounter fragments_terminated{*this, "fragments_terminated", "fragments", "that failed the termination test"};
  Counter termination_updates{*this, "termination_updates", "signals", "received from CROP, one for a quad's pixels"};

 protected:
  DepthStencilSurface* surface_ = nullptr;
};

/// Slot `qru`: forms warps from the surviving quads of a bin.
class QruBehaviour : public Behaviour {
 public:
  /// Examines quads of a bin, until all `count` are examined or a warp is complete. Returns the number examined, 0 only
  /// together with a launch; `launched` tells whether `out` was filled.
  virtual unsigned examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) = 0;
  /// At the end of a bin: the next warp of what is left; false when nothing is.
  virtual bool finish_bin(Warp& out) = 0;
  virtual Throughput cost() const = 0;              ///< items: quads examined
  virtual std::uint64_t storage_bytes() const = 0;  ///< of hardware
};

/// A shader as its scheduler sees it: instructions to issue, then cycles until the next can issue.
struct ShaderSegment {
  std::uint32_t instructions;
  std::uint32_t stall_cycles;
};

/// Slot `sm`: vertex and fragment shading, alpha pruning, quad merging.
class SmBehaviour : public Behaviour {
 public:
  /// Shades, prunes and merges: fills `out` but for its slot and its pool, which are the module's.
  virtual void shade(const Warp& warp, ShadedWarp& out) = 0;
  virtual void shade_vertices(const VertexWarp& warp) = 0;
  struct Cost {
    std::uint32_t cores;
    std::uint32_t schedulers_per_core;
    std::uint32_t lanes_per_scheduler;  ///< a divisor of 32
    std::uint32_t warps_per_core;
    std::uint32_t vertex_warps;       ///< of the array that may be in flight
    std::uint32_t warps_to_one_core;  ///< consecutive warps of a tile that go to one core
    std::vector<ShaderSegment> vertex;
    std::vector<ShaderSegment> fragment;
    std::vector<ShaderSegment> merge;  ///< appended for a warp with pairs
    /// Fragment warps in flight in the array. Throws UserError if they are more than slots have numbers.
    std::uint32_t fragment_slots() const;
    /// Cycles for which an instruction of a warp has its scheduler.
    std::uint32_t cycles_per_instruction() const { return 32 / lanes_per_scheduler; }
    /// Warp instructions that the array issues at most.
    double instructions_per_cycle() const { return double{1} * cores * schedulers_per_core / cycles_per_instruction(); }
  };
  virtual Cost cost() const = 0;

  DrawCounter quads_shaded{*this, "quads_shaded", "quads", "launched in fragment warps"};
  DrawCounter fragments_shaded{*this, "fragments_shaded", "fragments", "live samples launched"};
  DrawCounter quads_pruned{*this, "quads_pruned", "quads", "that lost their last fragment to alpha pruning"};
  DrawCounter fragments_pruned{*this, "fragments_pruned", "fragments", "with alpha below the threshold"};
  /// Of a pair, its back quad's draw; what is left is its front quad's.
  DrawCounter quads_merged{*this, "quads_merged", "quads", "taken away by merging, one a pair with two live quads"};
  DrawCounter fragments_merged{*this, "fragments_merged", "fragments", "taken away by merging, where both are live"};
  Counter fragment_warps{*this, "fragment_warps", "warps", "of fragments"};
};

/// Slot `crop`: blends quads into the colour target and tests for termination.
class CropBehaviour : public Behaviour {
 public:
  /// Before the first blend. One that overrides it calls it.
  virtual void attach(ColorSurface& surface) { surface_ = &surface; }
  const ColorSurface* surface() const { return surface_; }
  /// A mark comes by, after all blends before it: a clear is done (Frame::clear_of), for this GPC's tiles.
  virtual void pass(Mark mark) = 0;
  struct Outcome {
    LaneMask terminated;  ///< pixels to signal: those that newly passed the termination threshold (HET only)
    bool changed;         ///< whether a stored value is another one than before
  };
  /// Blends the live samples of a quad of a draw into the one at a place of the surface's grid.
  virtual Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) = 0;
  /// The same for a quad of a warp, which timing models that blend quad by quad call.
  virtual Outcome blend_quad(std::size_t place, const ShadedWarp& warp, unsigned index) {
    return blend(warp.draw[index], place, warp.live[index], warp.color[index]);
  }
  /// By quad of a warp.
  using Outcomes = std::array<Outcome, quads_per_warp>;
  /// Blends quads `from` to `to` - 1 of a warp, in this order.
  virtual void blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes) {
    for (unsigned i = from; i < to; ++i) {
      outcomes[i] = blend_quad(surface_->grid().place(warp.tile, warp.position[i]), warp, i);
    }
  }

  /// What the colour cache does for a line that quads need.
  struct LineAccess {
    std::uint32_t line = 0;          ///< of the cache, from 0
    std::uint32_t sectors = 0;       ///< of the line that the quads need, a bit each
    std::uint32_t filled = 0;        ///< of these, not there yet
    std::uint32_t written_back = 0;  ///< dirty sectors of what the line held
    bool replaced = false;           ///< the line held something else, or nothing, before
    std::uint64_t address = 0;       ///< of the line, bytes
    std::uint64_t old_address = 0;   ///< of what it held
  };
  /// And for quads of a warp; quad `i` needs `sectors_of[i]` of the line in `lines[line_of[i]]`.
  struct CacheLookUp {
    unsigned count = 0;  ///< of lines, in the order in which they are needed first
    std::array<LineAccess, quads_per_warp> lines;
    std::array<std::uint8_t, quads_per_warp> line_of{};
    std::array<std::uint32_t, quads_per_warp> sectors_of{};
  };
  /// Looks quads `from` to `to` - 1 of a warp up, before their `blend`, in the order of blending. The cache sees this
  /// order alone, so that which sectors move does not depend on when; for timing models that do not follow fills through the
  /// cache themselves. Without a cache, no line is needed.
  virtual void look_up(const ShadedWarp&, unsigned /*from*/, unsigned /*to*/, CacheLookUp& out) { out.count = 0; }
  /// After a `blend` whose sectors are dirty for it.
  virtual void make_dirty(std::uint32_t /*line*/, std::uint32_t /*sectors*/) {}
  struct Cost {
    Rate blend_rate;               ///< of quads, of this draw's format
    std::uint32_t input_quads;     ///< queue between tag look-up and blending
    std::uint32_t latency_cycles;  ///< of blending, termination test included
    bool forwards;                 ///< overlapping quads need not wait for `latency_cycles`
    std::uint32_t cache_bytes;
    std::uint32_t line_bytes;
    std::uint32_t sector_bytes;
    std::uint32_t mshrs;              ///< sectors in flight
    std::uint32_t sectors_per_cycle;  ///< filled or written back
    bool writes_unchanged;            ///< a blend that changes no value makes its sector dirty all the same
    /// Throws UserError for a cache that cannot be: sizes are powers of two, quad <= line <= cache, sector <= line, at
    /// most 32 sectors a line.
    void check_cache(ColorFormat format) const;
  };
  virtual Cost cost() const = 0;

  DrawCounter quads_blended{*this, "quads_blended", "quads", "blended"};
  DrawCounter fragments_blended{*this, "fragments_blended", "fragments", "blended"};
  DrawCounter quads_dropped_late{*this, "quads_dropped_late", "quads",
                                 "of which CROP finds every pixel terminated (strict)"};
  DrawCounter fragments_dropped_late{*this, "fragments_dropped_late", "fragments",
                                     "whose pixel CROP finds terminated (strict)"};
  DrawCounter quads_late_failed{*this, "quads_late_failed", "quads", "that fail a late depth or stencil test"};
  DrawCounter fragments_late_failed{*this, "fragments_late_failed", "fragments",
                                    "that fail a late depth or stencil test"};
  DrawCounter termination_signals{*this, "termination_signals", "signals", "sent to ZROP, one for a quad's pixels"};
  /// Of the colour cache; its accesses are quads. Whoever simulates it counts: the unit in `look_up`, or the timing model
  /// that follows fills through the cache.
  SectoredCacheStatistics cache_statistics{*this, "cache"};

 protected:
  ColorSurface* surface_ = nullptr;
};

}  // namespace vrpipe
