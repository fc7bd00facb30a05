#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/error.h>
#include <vrpipe/payload.h>

namespace vrpipe {

/// Watches that the quads of every position are blended in draw order. On in every run.
class BlendOrderMonitor {
 public:
  BlendOrderMonitor(std::uint32_t width, std::uint32_t height)
      : tiles_x_((width + screen_tile_pixels - 1) / screen_tile_pixels),
        next_(std::size_t{tiles_x_} * ((height + screen_tile_pixels - 1) / screen_tile_pixels) * positions_per_tile) {}

  /// Quads `from` to `to` - 1 of a warp. Throws SimulationFault when a primitive comes after a later one.
  void blended(const ShadedWarp& warp, unsigned from, unsigned to, std::uint64_t cycle) {
    std::uint32_t* const tile = &next_[place_of(warp.tile, 0)];
    for (unsigned i = from; i < to; ++i) {
      std::uint32_t& next = tile[warp.position[i]];
      if (warp.first_primitive[i] < next || warp.last_primitive[i] < warp.first_primitive[i]) {
        fault(warp, i, next, cycle);
      }
      next = warp.last_primitive[i] + 1;
    }
  }
  void blended(const ShadedWarp& warp, unsigned index, std::uint64_t cycle) { blended(warp, index, index + 1, cycle); }
  /// A quad of this position will be blended before long. Inlined, or GCC drops the call.
  [[gnu::always_inline]] void prefetch(TileId tile, unsigned position) const {
    __builtin_prefetch(&next_[place_of(tile, position)], 1);
  }

 private:
  std::size_t place_of(TileId tile, unsigned position) const {
    return (std::size_t{tile.y} * tiles_x_ + tile.x) * positions_per_tile + position;
  }
  [[noreturn]] static void fault(const ShadedWarp& warp, unsigned index, std::uint32_t next, std::uint64_t cycle);

  std::uint32_t tiles_x_;
  std::vector<std::uint32_t> next_;
};

}  // namespace vrpipe
