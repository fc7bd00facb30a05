#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/model/untimed.h>

#include "elaboration/untimed_gpu.h"

namespace vrpipe {

/// The time of units in slots of plugins, which PhaseBound knows nothing of: what they did, up to the last quad, times what
/// they say of it (UntimedUnit::work). No draw is shorter than its busiest unit is busy.
class OtherSlots {
 public:
  /// @param spares  what happens behind TC: a run with time may be spared work of this one
  OtherSlots(const UntimedGpu& gpu, bool spares);

  /// What the slots in front of RASTER did comes before this: RASTER sends a quad.
  void quad_rasterized(unsigned gpc) { note(Place::before_raster, gpc); }
  /// And so what those between it and TC did: TC has taken the quad.
  void quad_collected(unsigned gpc) { note(Place::before_tc, gpc); }
  /// And those behind TC: the quads of a bin have been blended or dropped.
  void bin_ended(unsigned gpc) { note(Place::behind_tc, gpc); }

  /// Of a unit, none if it says nothing or is of no other slot.
  std::vector<OccupancyPart> parts(const std::string& path) const;
  /// Units of which the bound knows nothing: a reason each.
  const std::vector<std::string>& unknown() const { return unknown_; }

 private:
  enum class Place : std::uint8_t { before_raster, before_tc, behind_tc };
  struct Other {
    const UntimedGpu::Placed* placed;
    Place place;
    UntimedUnit::Items items;  ///< by kind of work, up to the last quad
  };
  void note(Place place, unsigned gpc);
  const Other* find(const std::string& path) const;

  std::vector<Other> others_;
  std::vector<std::string> unknown_;
};

}  // namespace vrpipe
