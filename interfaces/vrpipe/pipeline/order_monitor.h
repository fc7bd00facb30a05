#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/screen_tiling.h>

namespace vrpipe {

/// Watches that the quads of every position are blended in draw order. On in every run.
class BlendOrderMonitor {
 public:
  BlendOrderMonitor(std::uint32_t width, std::uint32_t height) : grid_(width, height), next_(grid_.quads()) {}

  /// Quads `from` to `to` - 1 of a warp. Throws SimulationFault when a primitive comes after a later one.
  void blended(const ShadedWarp& warp, unsigned from, unsigned to, std::uint64_t cycle) {
    const std::size_t tile = grid_.place(warp.tile, 0);
    for (unsigned i = from; i < to; ++i) blended(tile + warp.position[i], warp, i, cycle);
  }
  /// A quad of a warp, whose place in the grid is known.
  void blended(std::size_t place, const ShadedWarp& warp, unsigned index, std::uint64_t cycle) {
    std::uint32_t& next = next_[place];
    const std::uint32_t last = warp.last_primitive[index];
    if (warp.first_primitive[index] < next || last < warp.first_primitive[index]) fault(warp, index, next, cycle);
    next = last + 1;
  }
  /// A quad of this place will be blended before long. Inlined, or GCC drops the call.
  [[gnu::always_inline]] void prefetch(std::size_t place) const { __builtin_prefetch(&next_[place], 1); }
  /// Quads of the screen tile whose first has this place will be.
  [[gnu::always_inline]] void prefetch_tile(std::size_t tile) const {
    constexpr unsigned in_a_line = 16;  // of a host's cache
    for (unsigned position = 0; position < positions_per_tile; position += in_a_line) prefetch(tile + position);
  }

 private:
  friend class PixelOrderMonitor;
  [[noreturn]] static void fault(const ShadedWarp& warp, unsigned index, std::uint32_t next, std::uint64_t cycle);

  ScreenTiling grid_;
  std::vector<std::uint32_t> next_;
};

/// The same of every pixel, where the quads of a position wait for one another only if they share one.
class PixelOrderMonitor {
 public:
  PixelOrderMonitor(std::uint32_t width, std::uint32_t height) : grid_(width, height), next_(grid_.quads()) {}

  void blended(const ShadedWarp& warp, unsigned from, unsigned to, std::uint64_t cycle) {
    const std::size_t tile = grid_.place(warp.tile, 0);
    for (unsigned i = from; i < to; ++i) {
      for (unsigned lane = 0; lane < 4; ++lane) {
        if ((warp.live[i] >> lane & 1U) == 0) continue;
        std::uint32_t& next = next_[tile + warp.position[i]][lane];
        if (warp.first_primitive[i] < next) BlendOrderMonitor::fault(warp, i, next, cycle);
        next = warp.last_primitive[i] + 1;
      }
    }
  }

 private:
  ScreenTiling grid_;
  std::vector<std::array<std::uint32_t, 4>> next_;
};

}  // namespace vrpipe
