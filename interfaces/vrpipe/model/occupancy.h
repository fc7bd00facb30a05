#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// What a unit's time goes on: tallies of its kinds of work. A unit can do no more than fill its busiest resource, so
/// the cycles of a resource's kinds are at most those of the run.
class Occupancy {
 public:
  /// `frame_end` outlives it.
  Occupancy(const FrameEnd& frame_end, std::vector<WorkKind> kinds)
      : kinds_(std::move(kinds)), tallies_(most_work_kinds, WorkTally(frame_end)) {}

  /// Items of a kind, an index into the kinds, that keep the unit from cycle `from` to `until` - 1.
  void add(unsigned kind, std::uint64_t items, Cycle from, Cycle until) { tallies_[kind].add(items, from, until); }

  std::size_t kinds() const { return kinds_.size(); }

  /// Items of a kind so far.
  std::uint64_t items(unsigned kind) const { return static_cast<std::uint64_t>(tallies_[kind].items()); }
  /// One for each kind, up to the end of the frame.
  std::vector<OccupancyPart> parts(Cycle end) const {
    std::vector<OccupancyPart> parts;
    for (std::size_t i = 0; i < kinds_.size(); ++i) {
      const WorkKind& kind = kinds_[i];
      parts.push_back({kind.name, kind.resource, tallies_[i].items(end) * kind.cycles_per_item, kind.is_throughput});
    }
    return parts;
  }

 private:
  std::vector<WorkKind> kinds_;
  std::vector<WorkTally> tallies_;  ///< also of kinds that are not declared, which the unit asks for
};

}  // namespace vrpipe
