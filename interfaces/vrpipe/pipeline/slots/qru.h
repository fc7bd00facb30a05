#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/pipeline_stages.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// Slot `qru`: forms warps from the surviving quads of a bin.
class QruBehaviour : public Behaviour {
 public:
  /// Examines quads of a bin, until all `count` are examined or a warp is complete. Returns the number examined, 0 only
  /// together with a launch; `launched` tells whether `out` was filled. Quads of draws that are tested late or
  /// not blended are not to be merged (DrawState::merges).
  virtual unsigned examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) = 0;
  /// At the end of a bin: the next warp of what is left; false when nothing is.
  virtual bool finish_bin(Warp& out) = 0;
  virtual Throughput timing() const = 0;            ///< items: quads examined
  virtual std::uint64_t storage_bytes() const = 0;  ///< of hardware

  /// Called by the modules with each warp that is launched, so that energy and reports know of any unit's.
  void count(const Warp& warp) {
    ++warps;
    pairs += static_cast<unsigned>(__builtin_popcount(warp.merge_pairs));
    quads_launched += warp.count;
    warp_sizes.see(warp.count);
  }

  static constexpr Histogram::Buckets warp_size_buckets = Histogram::Buckets::linear(1, quads_per_warp + 2);
  Counter warps{*this, "warps", "warps", "launched"};
  Counter pairs{*this, "pairs", "pairs", "of quads marked for merging, in these"};
  Counter quads_launched{*this, "quads", "quads", "in these"};
  Histogram warp_sizes{*this, warp_size_buckets, "quads_per_warp", "quads", "in a warp launched"};
};

/// The slot's kinds of work, and what they cost by the unit's own words: the same at every fidelity.
struct QruWork {
  enum : unsigned { quads, launches };  ///< quads examined in cycles without a launch, which ends a cycle
  static std::vector<WorkKind> kinds(const Throughput& timing);
  /// Of the warps that it sends.
  static PipelineStages pipeline(const Throughput& timing) { return PipelineStages::of_latency(timing.latency_cycles); }
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_qru(const std::string& name, const RenderContext& context,
                                     std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
