#pragma once

#include <algorithm>
#include <cstdint>

namespace vrpipe {

/// What blending takes where the quads of one cycle share a sector (pairs_in_sector): those that go together take a cycle,
/// or as long as they take one by one if that is longer. In parts of a cycle.
class SectorGroup {
 public:
  /// Where a quad is.
  struct Place {
    std::uint64_t line = 0;     ///< its address, or what stands for it
    std::uint32_t sectors = 0;  ///< of the line, a bit each
    friend bool operator==(const Place& a, const Place& b) { return a.line == b.line && a.sectors == b.sectors; }
  };

  /// `most`: quads that go together.
  SectorGroup(unsigned most, std::uint64_t parts_of_a_cycle) : most_(most), cycle_(parts_of_a_cycle) {}

  /// Whether a quad may go with the last ones.
  bool takes(const Place& place) const { return quads_ > 0 && quads_ < most_ && place == place_; }
  /// What a quad that takes `own` by itself adds to the time of those that it goes with.
  std::uint64_t price_of_next(std::uint64_t own) const { return std::max(cycle_, own_ + own) - std::max(cycle_, own_); }

  /// A quad is blended in a cycle of its own, or with the last ones; returns its price.
  std::uint64_t begin(const Place& place, std::uint64_t own) {
    place_ = place;
    quads_ = 1;
    own_ = own;
    return std::max(cycle_, own_);
  }
  std::uint64_t join(std::uint64_t own) {
    ++quads_;
    return lengthen(own);
  }
  /// The last one takes more by itself than was known; returns what that adds.
  std::uint64_t lengthen(std::uint64_t more) {
    const std::uint64_t price = price_of_next(more);
    own_ += more;
    return price;
  }

 private:
  unsigned most_;
  std::uint64_t cycle_;
  Place place_;
  unsigned quads_ = 0;     ///< that go together
  std::uint64_t own_ = 0;  ///< what they take one by one
};

}  // namespace vrpipe
