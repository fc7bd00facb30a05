#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/units.h>

namespace vrpipe {

/// A kind of work that takes a unit's time.
struct WorkKind {
  const char* name;        ///< one word for reports, e.g. "blend"
  unsigned resource;       ///< of the unit, from 0: kinds of one resource take turns, resources work side by side
  double cycles_per_item;  ///< that an item keeps the resource
  bool is_throughput;      ///< utilization, work over peak rate, counts this kind
};

/// What a unit's time goes on: tallies of its kinds of work. A unit can do no more than fill its busiest resource, so
/// the cycles of a resource's kinds are at most those of the run.
class Occupancy {
 public:
  /// `frame_end` outlives it.
  Occupancy(const FrameEnd& frame_end, std::vector<WorkKind> kinds)
      : kinds_(std::move(kinds)), tallies_(kinds_.size(), WorkTally(frame_end)) {}

  /// Items of a kind, an index into the kinds, that keep the unit from cycle `from` to `until` - 1, or for a cycle.
  void add(unsigned kind, std::uint64_t items, Cycle from, Cycle until) { tallies_[kind].add(items, from, until); }
  void add(unsigned kind, std::uint64_t items, Cycle at) { tallies_[kind].add(items, at); }

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
  std::vector<WorkTally> tallies_;
};

// The kinds of work of each slot, and what they cost by the unit's own words: the same at every fidelity.

struct DrawWork {
  enum : unsigned { warps };  ///< in cycles between a warp and the next
  static std::vector<WorkKind> kinds();
};
struct VpoWork {
  enum : unsigned { triangles };
  static std::vector<WorkKind> kinds(const Throughput& timing);
};
struct TgcWork {
  enum : unsigned { entries, primitives };
  static std::vector<WorkKind> kinds(const Throughput& timing);
};
struct RasterWork {
  enum : unsigned { setup, coarse, fine, pairs, quads };
  static std::vector<WorkKind> kinds(const RasterBehaviour::TimingParameters& timing);
};
struct TcWork {
  enum : unsigned { quads, beats };
  static std::vector<WorkKind> kinds(const TcBehaviour::TimingParameters& timing);
};
struct PropWork {
  enum : unsigned { bins, tested, color, empty_warps, late };  ///< `late`: quads to be tested late
  static std::vector<WorkKind> kinds(const PropBehaviour::TimingParameters& timing);
};
struct ZropWork {
  /// Quads tested before shading, cycles with updates, sectors moved, quads tested after shading; in thousandths of a cycle,
  /// what the blocks that quads touch take beyond their number, and lines that move.
  enum : unsigned { tests, updates, sectors, late_tests, blocks, lines };
  static std::vector<WorkKind> kinds(const ZropBehaviour::TimingParameters& timing);
};
struct QruWork {
  enum : unsigned { quads, launches };  ///< quads examined in cycles without a launch, which ends a cycle
  static std::vector<WorkKind> kinds(const Throughput& timing);
};
struct SmWork {
  /// Warp instructions; and handing warps to cores, in thousandths of a cycle.
  enum : unsigned { vertex, fragment, merge, launches };
  static std::vector<WorkKind> kinds(const SmBehaviour::TimingParameters& timing);
};
struct CropWork {
  /// Quads blended, what moves in its time (sectors, or lines where these have a price), and what hazards waste of the
  /// blender, and quads that have no neighbour to go with (pairs_in_sector): shares of a cycle, of which one has
  /// `parts_of_a_cycle`.
  enum : unsigned { blend, sectors, forwarding, unpaired };
  static std::uint64_t parts_of_a_cycle(const CropBehaviour::TimingParameters& timing) {
    return std::uint64_t{timing.blend_rate.items} * timing.moves_in_a_cycle();
  }
  static std::vector<WorkKind> kinds(const CropBehaviour::TimingParameters& timing);
};

}  // namespace vrpipe
