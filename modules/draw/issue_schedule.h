#pragma once

#include <algorithm>
#include <cstdint>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/draw.h>

namespace vrpipe {

/// When vertex warps are due: at an even rate from cycle 0 on, so that a stall is caught up. A barrier is none: behind it
/// nothing can be fetched ahead, and the rate begins anew.
class IssueSchedule {
 public:
  IssueSchedule(const DrawBehaviour& behaviour, const RenderContext& context)
      : context_(context),
        rate_of_warps_(behaviour.warps_per_1024_cycles()),
        rate_of_rectangles_(behaviour.rectangle_warps_per_1024_cycles()),
        rate_(rate_of_warps_) {}
  /// What DRAW issues next, a warp or a mark; false after the last.
  bool next(DrawBehaviour& behaviour, VertexWarp& out) {
    const bool is_there = behaviour.next(out);
    if (is_there && out.mark == Mark::none) turn_to(out);
    return is_there;
  }
  /// That warp.
  Cycle due() const { return due(issued_); }
  /// It is issued; returns the cycles from its turn to that of the one after it.
  Cycle issue() {
    ++issued_;
    return due(issued_) - due(issued_ - 1);
  }
  void restart(Cycle now) {
    begin_ = std::max(now, due());  // the turn of the last warp is over first
    issued_ = 0;
  }

 private:
  void turn_to(const VertexWarp& warp) {
    const std::uint32_t rate = draws_rectangles(context_.draw(warp.draw)) ? rate_of_rectangles_ : rate_of_warps_;
    if (rate == rate_) return;
    begin_ += (issued_ * 1024 + rate_ - 1) / rate_;  // all of the turn of the last one
    issued_ = 0;
    rate_ = rate;
  }
  Cycle due(std::uint64_t warp) const { return begin_ + warp * 1024 / rate_; }

  const RenderContext& context_;
  const std::uint32_t rate_of_warps_;
  const std::uint32_t rate_of_rectangles_;
  std::uint32_t rate_;
  Cycle begin_ = 0;
  std::uint64_t issued_ = 0;  ///< since then
};

}  // namespace vrpipe
