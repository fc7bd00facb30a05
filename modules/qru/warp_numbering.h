#pragma once

#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/screen_tiling.h>
#include <vrpipe/pipeline/slots/qru.h>

namespace vrpipe {

/// Numbers the warps of a GPC in launch order, of the frame and of their screen tile, by which PROP keeps the order, and has
/// them counted.
class WarpNumbering {
 public:
  /// The unit outlives it.
  WarpNumbering(const RenderContext& context, QruBehaviour& behaviour)
      : unit_(dynamic_cast<QruBehaviour&>(behaviour.unit())),
        grid_(context.frame->width(), context.frame->height()),
        next_of_tile_(grid_.tiles()) {}

  void number(Warp& warp) {
    unit_.count(warp);
    warp.sequence = next_++;
    warp.tile_sequence = next_of_tile_[grid_.index(warp.tile)]++;
  }
  /// A mark has the number of the warp that follows.
  void number_mark(Warp& mark) const { mark.sequence = next_; }

 private:
  QruBehaviour& unit_;
  ScreenTiling grid_;
  std::uint32_t next_ = 0;
  std::vector<std::uint32_t> next_of_tile_;
};

}  // namespace vrpipe
