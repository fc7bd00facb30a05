#pragma once

#include <cstdint>

#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// Quads that are blended one by one, of which two go in one cycle if they share a sector and the second is there by then.
class SectorPairs {
 public:
  /// Where a quad is.
  struct Place {
    std::uint64_t line = 0;     ///< its address
    std::uint32_t sectors = 0;  ///< of the line, a bit each
  };

  /// Whether a quad that can be blended in a cycle goes with the last one.
  bool joins(const Place& place, Cycle there) const {
    return is_first_ && there <= at_ && place.line == last_.line && place.sectors == last_.sectors;
  }
  /// A quad is blended with the last one, or in a cycle of its own.
  void join() { is_first_ = false; }
  void blended(const Place& place, Cycle at) {
    last_ = place;
    at_ = at;
    is_first_ = true;
  }

 private:
  Place last_;
  Cycle at_ = 0;
  bool is_first_ = false;  ///< nothing has gone with the last one
};

}  // namespace vrpipe
