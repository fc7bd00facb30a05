#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/memory.h>

namespace vrpipe {

struct MemoryPlace;

/// The clock of a cache, in whose cycles all of its other parameters are.
class OwnClock {
 public:
  struct Parameter : Integer {
    explicit Parameter(ParameterSet& owner)
        : Integer(owner, "frequency_mhz", 0, 0, 1'000'000, "MHz", "VR-Pipe: one clock for the GPU",
                  "of its clock, in whose cycles its other parameters are, and which is no faster than that of the "
                  "units; 0: it is theirs") {}
  };
  /// Of `slot`. Throws UserError for a clock faster than that of the units, which it meets once in a cycle.
  OwnClock(const char* slot, std::uint32_t frequency_mhz, const RenderContext& context);

  /// 0 if it is that of the units.
  std::uint64_t period_ps() const { return period_ps_; }
  /// Cycles of the units for one of its own.
  double ratio() const {
    return period_ps_ == 0 ? 1.0 : static_cast<double>(period_ps_) / static_cast<double>(units_ps_);
  }
  /// Bytes that each port moves in a cycle of its own: what is bound to it says so of a cycle of the units, or leaves it to
  /// the cache, which moves `own`.
  std::vector<unsigned> port_bytes(MemoryPlace place, unsigned own) const;
  /// A timing in its own cycles, in those of the units.
  MemoryBehaviour::TimingParameters of_units(const MemoryBehaviour::TimingParameters& own) const;

 private:
  std::uint64_t units_ps_;
  std::uint64_t period_ps_;
};

}  // namespace vrpipe
