#pragma once

#include <algorithm>
#include <vector>

#include <vrpipe/draw.h>
#include <vrpipe/payload.h>
#include <vrpipe/render_state.h>
#include <vrpipe/tile_grid.h>

namespace vrpipe {

/// Numbers the warps of a GPC in launch order, of the draw and of their screen tile, by which PROP keeps the order.
class WarpNumbering {
 public:
  explicit WarpNumbering(const RenderState& state)
      : grid_(state.draw->width, state.draw->height), next_of_tile_(grid_.tiles()) {}

  void number(Warp& warp) {
    warp.sequence = next_++;
    warp.tile_sequence = next_of_tile_[grid_.index(warp.tile)]++;
  }
  /// The end of the draw comes after its warps; the next draw's count from 0.
  void number_end(Warp& end) {
    end.sequence = next_;
    next_ = 0;
    std::fill(next_of_tile_.begin(), next_of_tile_.end(), 0);
  }

 private:
  TileGrid grid_;
  std::uint32_t next_ = 0;
  std::vector<std::uint32_t> next_of_tile_;
};

}  // namespace vrpipe
