#pragma once

#include <memory>
#include <vector>

#include "bound/bound.h"
#include "bound/other_slots.h"

#include <vrpipe/pipeline/barrier_plan.h>

namespace vrpipe {

/// Counts what the units of a GPC do in a run without time, for its bound: by what they count, and by taps on the links.
///
/// Where `cycle` may flush bins at other times, what a quad terminates may spare others later than here; so only quads are
/// counted whose pixels are not all terminated by what was blended before: no run is spared these, however early it
/// flushes its bins. And where screen tiles may be blended in another order each sector is filled once: the cache may miss
/// it no more often. The same holds of the z-cache, always, of which what late tests fill is left out. What Hi-Z may hide
/// from some run is left out too: up to the tests, quads count that survive them.
class WorkCounter {
 public:
  /// The bound and `others` outlive it.
  WorkCounter(const Configuration& configuration, unsigned gpc, PhaseBound& bound, OtherSlots& others);
  ~WorkCounter();
  /// With what has been done so far; after the run as well.
  void end_phase();

 private:
  class Survivors;
  template <class Item, class Function>
  void tap(Pipeline::Place place, const char* port, Function function);
  UntimedUnit* unit(Pipeline::Place place) const { return bound_.pipeline().at[place]; }
  /// So far.
  std::uint64_t items(Pipeline::Place place, unsigned kind) const;
  /// Of the phase.
  void count(Pipeline::Place place, unsigned kind);
  void count_front_end();
  void count();

  PhaseBound& bound_;
  OtherSlots& others_;
  const unsigned gpc_;
  const bool counts_late_;           ///< late tests, unless some run may be spared them
  const bool hides_at_other_times_;  ///< Hi-Z, told earlier than here by bins that time out
  const BarrierPlan barriers_;
  std::unique_ptr<Survivors> survivors_;
  std::vector<std::shared_ptr<void>> taps_;
  Work before_;                         ///< of the phases before
  std::uint64_t z_sectors_before_ = 0;  ///< the same, all that were filled
};

}  // namespace vrpipe
