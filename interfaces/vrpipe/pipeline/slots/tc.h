#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

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
  struct TimingParameters {
    std::uint32_t quads_per_cycle;
    std::uint32_t latency_cycles;
    std::uint32_t idle_timeout_cycles;  ///< without an incoming quad until bins are flushed; 0: never
    std::uint32_t flush_queue_bins;     ///< flushed bins that wait for PROP
    /// The time-out that applies. None in strict termination: the contents of bins would depend on time.
    std::uint32_t timeout_in(Termination termination) const {
      return termination == Termination::strict ? 0 : idle_timeout_cycles;
    }
  };
  virtual TimingParameters timing() const = 0;

  void add_to(Counts& counts, const CountOf& of) const override { counts.tc_flushes += of(flushes); }

  Counter quads{*this, "quads", "quads", "taken into bins"};
  Counter flushes{*this, "flushes", "flushes", "bins handed to PROP"};
};

/// Where TC keeps the quads of a flushed bin until QRU has formed its warps.
struct BinStorage {
  TcBehaviour::Flush flush;
  bool in_use = false;
};

/// The slot's kinds of work, and what they cost by the unit's own words: the same at every fidelity.
struct TcWork {
  enum : unsigned { quads, beats };
  static std::vector<WorkKind> kinds(const TcBehaviour::TimingParameters& timing);
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_tc(const std::string& name, const RenderContext& context,
                                    std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
