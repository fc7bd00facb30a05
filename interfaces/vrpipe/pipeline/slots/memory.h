#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/memory/memory_request.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// Slots `l2` and `dram`: a memory, to whose ports the memory ports of units are bound, and which may have another one
/// below it.
class MemoryBehaviour : public Behaviour {
 public:
  /// An access, without time, after all those before it. It is counted here, and what it needs from below is accessed
  /// there.
  virtual void access(const MemoryRequest& request) = 0;
  /// Whether `access` finds anything out. Without time an ideal memory is not worth asking.
  virtual bool follows_accesses() const { return true; }
  /// Whether it cannot do without a memory below.
  virtual bool needs_below() const { return false; }
  /// The memory below, which outlives this one.
  void set_below(MemoryBehaviour& below) { below_ = &below; }

  /// By `access`: to those above, and from the memory below.
  virtual MemoryBytes delivered() const { return {}; }
  virtual MemoryBytes memory_bytes() const { return {}; }
  // For `bound`:
  /// From now on counts what `least_occupancy` follows from.
  void count_least() { counts_least_ = true; }
  /// How long what was accessed keeps it busy at least, in cycles of a period in picoseconds.
  virtual std::vector<OccupancyPart> least_occupancy(double /*period_ps*/) const { return {}; }

  struct TimingParameters {
    std::uint32_t latency_cycles;   ///< at least, from request to data
    std::uint32_t bytes_per_cycle;  ///< at most, of a port
  };
  virtual TimingParameters timing() const = 0;

 protected:
  MemoryBehaviour* below_ = nullptr;
  bool counts_least_ = false;
};

}  // namespace vrpipe
