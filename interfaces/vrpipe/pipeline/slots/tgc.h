#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/pipeline_stages.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

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
  virtual Throughput timing() const = 0;            ///< items: bin entries
  virtual std::uint32_t largest_flush() const = 0;  ///< primitives
  virtual std::uint64_t storage_bytes() const = 0;  ///< of hardware

  void add_to(Counts& counts, const CountOf& of) const override { counts.tgc_flushes += of(flushes); }

  Counter flushes{*this, "flushes", "flushes", "bins handed to the rasteriser; 0 where a unit passes through"};
  /// A unit of one's own that does not count them has those counted that leave it.
  Counter entries{*this, "entries", "entries", "primitives entered into bins; one for each grid touched"};
};

/// The slot's kinds of work, and what they cost by the unit's own words: the same at every fidelity.
struct TgcWork {
  enum : unsigned { entries, primitives };
  static std::vector<WorkKind> kinds(const Throughput& timing);
  /// Of the jobs that it sends.
  static PipelineStages pipeline(const Throughput& timing) { return PipelineStages::of_latency(timing.latency_cycles); }
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_tgc(const std::string& name, const RenderContext& context,
                                     std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
