#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/slots/behaviour.h>
#include <vrpipe/pipeline/slots/kernel_work.h>

namespace vrpipe {

/// The splats that each screen tile is rendered from, in draw order. Tiles are numbered as ScreenTiling has them.
struct TileLists {
  std::vector<std::uint32_t> begin;   ///< of each tile's list in `splats`, and then the end of the last
  std::vector<std::uint32_t> splats;  ///< their numbers in the frame

  std::size_t tiles() const { return begin.empty() ? 0 : begin.size() - 1; }
  const std::uint32_t* of(std::size_t tile) const { return splats.data() + begin[tile]; }
  std::uint32_t length(std::size_t tile) const { return begin[tile + 1] - begin[tile]; }
};

/// Slot `binning`: which tiles a splat is rendered in, and the kernels that find it out and sort.
class BinningBehaviour : public Behaviour {
 public:
  /// Of all splats of the frame. Once.
  virtual TileLists make_lists() = 0;
  /// Those that made them, in order.
  virtual std::vector<KernelWork> kernels() const = 0;

  Counter pairs{*this, "pairs", "pairs", "entries of all lists: splats, once for each tile that they touch"};
  Counter empty_tiles{*this, "empty_tiles", "tiles", "whose list is empty"};
  Histogram list_lengths{*this, Histogram::Buckets::log2(), "list_lengths", "splats", "in the list of a tile"};

  /// For the platform, of any unit.
  void count(const TileLists& lists) {
    pairs += lists.splats.size();
    for (std::size_t tile = 0; tile < lists.tiles(); ++tile) {
      list_lengths.see(lists.length(tile));
      if (lists.length(tile) == 0) ++empty_tiles;
    }
  }
};

}  // namespace vrpipe
