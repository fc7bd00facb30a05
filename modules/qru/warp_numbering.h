#pragma once

#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/screen_tiling.h>

namespace vrpipe {

/// Numbers the warps of a GPC in launch order, of the frame and of their screen tile, by which PROP keeps the order.
class WarpNumbering {
 public:
  explicit WarpNumbering(const RenderContext& context)
      : grid_(context.frame->width(), context.frame->height()), next_of_tile_(grid_.tiles()) {}

  void number(Warp& warp) {
    warp.sequence = next_++;
    warp.tile_sequence = next_of_tile_[grid_.index(warp.tile)]++;
  }
  /// A mark has the number of the warp that follows.
  void number_mark(Warp& mark) const { mark.sequence = next_; }

 private:
  ScreenTiling grid_;
  std::uint32_t next_ = 0;
  std::vector<std::uint32_t> next_of_tile_;
};

}  // namespace vrpipe
