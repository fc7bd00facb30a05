#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

struct TcTime;

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
  /// What its work takes: the parameters of its timing models (modules/tc/tc.h).
  virtual const TcTime& time() const = 0;

  void add_to(Counts& counts, const CountOf& of) const override { counts.tc_flushes += of(flushes); }

  Counter quads{*this, "quads", "quads", "taken into bins"};
  Counter flushes{*this, "flushes", "flushes", "bins handed to PROP"};
};

/// Where TC keeps the quads of a flushed bin until QRU has formed its warps.
struct BinStorage {
  TcBehaviour::Flush flush;
  bool in_use = false;
};

/// The slot's kinds of work.
struct TcWork {
  enum : unsigned { quads, beats };
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_tc(const std::string& name, const RenderContext& context,
                                    std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
