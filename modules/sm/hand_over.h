#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include <vrpipe/kernel/rate.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

/// What handing fragment warps to cores takes: so much for a warp, and beside that so much for a visit, the quads of a
/// primitive in a screen tile that come one after the other; the longer of the two counts (measured on a GH100 graphics GPC). Of a
/// warp of pairs, a primitive's quads are one visit, whatever is between them: assumed, since no GPU merges.
class HandOver {
 public:
  HandOver(const SmTime& time, const RenderContext& context) : context_(context), price_(time.hand_over) {}
  bool is_on() const { return is_on_; }
  /// In thousandths of a cycle.
  struct Price {
    std::uint64_t warp = 0;
    std::uint64_t visits = 0;
  };
  /// A primitive's quads in a screen tile.
  struct Visit {
    TileId tile;
    std::uint32_t primitive = ~0U;
  };
  /// Of a warp that follows those before.
  Price of(const Warp& warp) {
    return {of_warp(warp), of_visits(warp, last_, [](const Visit&, std::uint32_t) { return true; })};
  }
  /// The least of it in any company: its quads may fill other warps, and a primitive comes to a tile once. `last` is of this
  /// tile.
  Price least_of(const Warp& warp, Visit& last) const {
    return {of_warp(warp) * warp.count / quads_per_warp,
            of_visits(warp, last, [](const Visit& before, std::uint32_t primitive) {
              return before.primitive == ~0U || primitive >= before.primitive;
            })};
  }
  /// What is not done when the last warp is launched, at most.
  Price most_left() const {
    return {price_.warp_thousandths + price_.discard_warp_thousandths,
            1000 * most_visits_behind +
                quads_per_warp * (std::uint64_t{price_.visit_thousandths} + price_.discard_thousandths)};
  }

  /// Whether a warp may be launched in a cycle.
  bool is_free(Cycle now) const { return warps_.is_free(now) && visits_.is_free(now + most_visits_behind); }
  /// The first from one on in which it may.
  Cycle free_from(Cycle cycle) const {
    const Cycle visits = visits_.free_from(cycle + most_visits_behind) - most_visits_behind;
    return std::max(warps_.free_from(cycle), visits);
  }
  /// Launches one in such a cycle. `did(kind, thousandths, from, until)` is told what is busy with it.
  template <class Did>
  void take(const Warp& warp, Cycle now, Did&& did) {
    const Price price = of(warp);
    did(SmWork::launches, price.warp, now, std::max(warps_.take(now, price.warp), now + 1));
    const Cycle from = visits_.free_from(now);
    if (price.visits > 0) did(SmWork::visits, price.visits, from, std::max(visits_.take(now, price.visits), from + 1));
  }

 private:
  /// Cycles: a few visits wait while warps go on. Assumed; only that it is more than a few warps' was seen.
  static constexpr Cycle most_visits_behind = 64;

  /// Of a program without attributes discarding costs nothing more: it was measured, where it reads alpha (passes).
  bool discards(const Warp& warp) const {
    const DrawState& state = context_.state(warp.quads[0].draw);  // all are of one state
    return reads_attributes(state.shader) && state.discards();
  }
  std::uint64_t of_warp(const Warp& warp) const {
    return price_.warp_thousandths + (discards(warp) ? price_.discard_warp_thousandths : 0);
  }
  /// Whether a quad's primitive has one further in front: pairs have front and back by turns.
  static bool came_before(const Warp& warp, unsigned index) {
    return std::any_of(warp.quads.begin(), warp.quads.begin() + index,
                       [&](const Quad& quad) { return primitive_order(quad) == primitive_order(warp.quads[index]); });
  }
  template <class Counts>
  std::uint64_t of_visits(const Warp& warp, Visit& last, Counts counts) const {
    unsigned visits = 0;
    for (unsigned i = 0; i < warp.count; ++i) {
      const std::uint32_t primitive = primitive_order(warp.quads[i]);
      if (!counts(last, primitive) || (primitive == last.primitive && warp.tile == last.tile)) continue;
      last = {warp.tile, primitive};
      if (warp.merge_pairs == 0 || !came_before(warp, i)) ++visits;
    }
    return visits * (std::uint64_t{price_.visit_thousandths} + (discards(warp) ? price_.discard_thousandths : 0));
  }

  const RenderContext& context_;
  const HandOverPrice price_;
  const bool is_on_ = price_.is_on();
  Visit last_;
  ThousandthsPort warps_;
  ThousandthsPort visits_;
};

}  // namespace vrpipe
