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
  /// Of one warp at most, in thousandths of a cycle.
  std::uint64_t longest() const {
    return price_.warp_thousandths +
           quads_per_warp * (std::uint64_t{price_.visit_thousandths} + price_.discard_thousandths);
  }
  /// A primitive's quads in a screen tile.
  struct Visit {
    TileId tile;
    std::uint32_t primitive = ~0U;
    std::uint64_t taken = 0;  ///< by them
    std::uint64_t paid = 0;   ///< for them
  };
  /// Of a warp, in thousandths of a cycle: what it adds to those before.
  std::uint64_t of(const Warp& warp) {
    return of(warp, last_, [](const Visit&, std::uint32_t) { return true; });
  }
  /// The least of it in any company: a primitive comes to a tile once. `last` is of this tile.
  std::uint64_t least_of(const Warp& warp, Visit& last) const {
    return of(warp, last, [](const Visit& before, std::uint32_t primitive) {
      return before.primitive == ~0U || primitive >= before.primitive;
    });
  }

 private:
  template <class Counts>
  std::uint64_t of(const Warp& warp, Visit& last, Counts counts) const {
    const bool discards = context_.state(warp.quads[0].draw).discards();  // all are of one state
    const std::uint64_t of_visit = price_.visit_thousandths + (discards ? price_.discard_thousandths : 0);
    std::uint64_t price = 0;
    for (unsigned i = 0; i < warp.count; ++i) {
      const std::uint32_t primitive = primitive_order(warp.quads[i]);
      if (!counts(last, primitive)) continue;
      if (primitive != last.primitive || warp.tile != last.tile) {
        last = {warp.tile, primitive, 0, of_visit};
        price += of_visit;
      }
      last.taken += price_.warp_thousandths;  // eighths of the thousandths of a warp
      if (const std::uint64_t due = last.taken / quads_per_warp; due > last.paid) {
        price += due - last.paid;
        last.paid = due;
      }
    }
    return price;
  }

  const RenderContext& context_;
  const HandOverPrice price_;
  Visit last_;
};

}  // namespace vrpipe
