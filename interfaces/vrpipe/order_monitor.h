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

  /// Throws SimulationFault when a primitive comes after a later one.
  void blended(const ShadedWarp& warp, unsigned index, std::uint64_t cycle) {
    std::uint32_t& next =
        next_[(std::size_t{warp.tile.y} * tiles_x_ + warp.tile.x) * positions_per_tile + warp.position[index]];
    if (warp.first_primitive[index] < next || warp.last_primitive[index] < warp.first_primitive[index]) {
      throw SimulationFault("crop", cycle,
                            "primitive " + std::to_string(warp.first_primitive[index]) +
                                " is blended after primitive " + std::to_string(next - 1) + " in tile " +
                                std::to_string(warp.tile.x) + "," + std::to_string(warp.tile.y) + " position " +
                                std::to_string(warp.position[index]));
    }
    next = warp.last_primitive[index] + 1;
  }

 private:
  std::uint32_t tiles_x_;
  std::vector<std::uint32_t> next_;
};

}  // namespace vrpipe
