#pragma once

#include <algorithm>
#include <cstdint>

#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

/// What handing fragment warps to cores takes: so much for a full warp, a part of one in proportion, and at least so much
/// for the quads of a primitive in a screen tile that come one after the other (measured on a GH100 graphics GPC).
class HandOver {
 public:
  HandOver(const SmBehaviour::TimingParameters& timing, const RenderContext& context)
      : context_(context), price_(timing.hand_over) {}
  bool is_on() const { return price_.is_on(); }
  /// Of a warp, in thousandths of a cycle: what it adds to those before.
  std::uint64_t of(const Warp& warp) {
    const bool discards = context_.state(warp.quads[0].draw).discards();  // all are of one state
    const std::uint64_t of_visit = price_.visit_thousandths + (discards ? price_.discard_thousandths : 0);
    std::uint64_t price = 0;
    for (unsigned i = 0; i < warp.count; ++i) {
      const std::uint32_t primitive = primitive_order(warp.quads[i]);
      if (primitive != primitive_ || warp.tile != tile_) {
        primitive_ = primitive;
        tile_ = warp.tile;
        taken_ = 0;
        paid_ = of_visit;
        price += of_visit;
      }
      taken_ += price_.warp_thousandths;  // eighths of the thousandths of a warp
      if (const std::uint64_t due = taken_ / quads_per_warp; due > paid_) {
        price += due - paid_;
        paid_ = due;
      }
    }
    return price;
  }

 private:
  const RenderContext& context_;
  const HandOverPrice price_;
  TileId tile_;
  std::uint32_t primitive_ = ~0U;
  std::uint64_t taken_ = 0;  ///< by the quads of the primitive in the tile
  std::uint64_t paid_ = 0;   ///< for them
};

}  // namespace vrpipe
