#pragma once

#include <algorithm>
#include <array>
#include <queue>
#include <vector>

#include <vrpipe/accounting.h>
#include <vrpipe/units.h>

namespace vrpipe {

/// Shaded warps that wait to leave PROP. A warp's turn comes when the one before it, of the draw or of its screen tile,
/// has left; of those whose turn has come the oldest goes first, which keeps a tile's quads together in the colour cache.
class WarpOrder {
 public:
  struct Waiting {
    const ShadedWarp* warp;
    std::uint32_t sequence;  ///< of the warp
    Cycle from;              ///< the first cycle in which it can leave, for shells that know it ahead
  };

  WarpOrder(PropBehaviour::Order order, const RenderState& state)
      : by_draw_(order == PropBehaviour::Order::draw),
        tiles_x_((state.draw->width + screen_tile_pixels - 1) / screen_tile_pixels) {
    const std::uint32_t tiles_y = (state.draw->height + screen_tile_pixels - 1) / screen_tile_pixels;
    next_of_line_.assign(by_draw_ ? 1 : std::size_t{tiles_x_} * tiles_y, 0);
  }

  void arrive(const ShadedWarp& warp, Cycle from = 0) {
    const Waiting waiting{&warp, warp.sequence, from};
    const Turn turn = turn_of(warp);
    if (turn.number == next_of(turn.line)) {
      in_turn_.push(waiting);
    } else {
      bucket_of(turn.line, turn.number).push_back({turn, waiting});
      ++early_;
    }
  }

  bool has_next() const { return !in_turn_.empty(); }
  Waiting take() {
    const Waiting next = in_turn_.top();
    in_turn_.pop();
    return next;
  }
  /// A warp that was taken has left: the one that follows it may be among those that came early.
  void leave(const ShadedWarp& warp, Cycle at = 0) {
    const std::uint32_t line = turn_of(warp).line;
    const std::uint32_t number = ++next_of(line);
    ++left_;
    if (early_ == 0) return;
    std::vector<Early>& bucket = bucket_of(line, number);
    for (Early& early : bucket) {
      if (early.turn.line != line || early.turn.number != number) continue;
      in_turn_.push({early.waiting.warp, early.waiting.sequence, std::max(early.waiting.from, at)});
      early = bucket.back();
      bucket.pop_back();
      --early_;
      return;
    }
  }

  bool empty() const { return in_turn_.empty() && early_ == 0; }
  bool has_early() const { return early_ > 0; }
  /// Warps that have left since the draw began.
  std::uint32_t left() const { return left_; }
  void restart() {
    left_ = 0;
    std::fill(next_of_line_.begin(), next_of_line_.end(), 0);
  }

 private:
  /// A warp leaves when the warps of smaller number in its line have left: a line for the draw, or for each screen tile.
  struct Turn {
    std::uint32_t line;
    std::uint32_t number;
  };
  struct Early {
    Turn turn;
    Waiting waiting;
  };
  struct LaterFirst {
    bool operator()(const Waiting& a, const Waiting& b) const { return a.sequence > b.sequence; }
  };

  Turn turn_of(const ShadedWarp& warp) const {
    if (by_draw_) return {0, warp.sequence};
    return {warp.tile.y * tiles_x_ + warp.tile.x, warp.tile_sequence};
  }
  std::uint32_t& next_of(std::uint32_t line) { return next_of_line_[line]; }
  /// Early warps are kept apart, so that finding the next one is quick.
  std::vector<Early>& bucket_of(std::uint32_t line, std::uint32_t number) {
    return early_by_bucket_[(line + 31 * number) % early_by_bucket_.size()];
  }

  const bool by_draw_;
  const std::uint32_t tiles_x_;
  std::vector<std::uint32_t> next_of_line_;
  std::uint32_t left_ = 0;
  std::array<std::vector<Early>, 256> early_by_bucket_;
  std::size_t early_ = 0;
  std::priority_queue<Waiting, std::vector<Waiting>, LaterFirst> in_turn_;
};

}  // namespace vrpipe
