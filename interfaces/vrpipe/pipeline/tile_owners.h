#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// GPCs of a platform at most.
constexpr unsigned most_gpcs = 256;
using GpcSet = std::bitset<most_gpcs>;

/// Which GPC owns each screen tile of a frame: the answers of the platform's map (slot wdx), asked for once.
class TileOwners {
 public:
  /// For a frame of so many pixels. `owner_of` gives a number below `most_gpcs`.
  TileOwners(unsigned width, unsigned height, const std::function<unsigned(TileId)>& owner_of);

  unsigned owner_of(TileId tile) const { return owners_[std::size_t{tile.y} * columns_ + tile.x]; }
  /// The GPCs that own screen tiles of a rectangle within the frame, which is not empty.
  GpcSet owners_in(const PixelRect& pixels) const;
  /// Whether one of them is `gpc`; the rectangle is cut to the frame.
  bool has_any(unsigned gpc, const PixelRect& pixels) const;

 private:
  template <class Look>
  void look_at(const PixelRect& pixels, Look&& look) const;

  std::uint32_t columns_, rows_;
  std::vector<std::uint8_t> owners_;  ///< row by row
};

}  // namespace vrpipe
