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
    Cycle from;  ///< the first cycle in which it can leave, for shells that know it ahead
  };

  WarpOrder(PropBehaviour::Order order, const RenderState& state)
      : by_draw_(order == PropBehaviour::Order::draw),
        tiles_x_((state.draw->width + screen_tile_pixels - 1) / screen_tile_pixels) {
    const std::uint32_t tiles_y = (state.draw->height + screen_tile_pixels - 1) / screen_tile_pixels;
    if (!by_draw_) next_of_tile_.assign(std::size_t{tiles_x_} * tiles_y, 0);
  }

  void arrive(const ShadedWarp& warp, Cycle from = 0) {
    if (is_next(warp)) {
      in_turn_.push({&warp, from});
    } else {
      bucket_of(warp).push_back({&warp, from});
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
    if (!by_draw_) ++next_of_tile(warp.tile);
    ++left_;
    if (early_ == 0) return;
    std::vector<Waiting>& bucket = by_draw_ ? early_by_bucket_[left_ % early_by_bucket_.size()] : bucket_of(warp);
    const auto next = std::find_if(bucket.begin(), bucket.end(), [this](const Waiting& w) { return is_next(*w.warp); });
    if (next == bucket.end()) return;
    in_turn_.push({next->warp, std::max(next->from, at)});
    *next = bucket.back();
    bucket.pop_back();
    --early_;
  }

  bool empty() const { return in_turn_.empty() && early_ == 0; }
  bool has_early() const { return early_ > 0; }
  /// Warps that have left since the draw began.
  std::uint32_t left() const { return left_; }
  void restart() {
    left_ = 0;
    std::fill(next_of_tile_.begin(), next_of_tile_.end(), 0);
  }

 private:
  struct LaterFirst {
    bool operator()(const Waiting& a, const Waiting& b) const { return a.warp->sequence > b.warp->sequence; }
  };

  std::uint32_t& next_of_tile(TileId tile) { return next_of_tile_[std::size_t{tile.y} * tiles_x_ + tile.x]; }
  bool is_next(const ShadedWarp& warp) {
    return by_draw_ ? warp.sequence == left_ : warp.tile_sequence == next_of_tile(warp.tile);
  }
  /// Early warps are kept apart by tile, or by launch order, so that finding the next one is quick.
  std::vector<Waiting>& bucket_of(const ShadedWarp& warp) {
    const std::size_t key = by_draw_ ? warp.sequence : warp.tile.y * 31U + warp.tile.x;
    return early_by_bucket_[key % early_by_bucket_.size()];
  }

  const bool by_draw_;
  const std::uint32_t tiles_x_;
  std::vector<std::uint32_t> next_of_tile_;
  std::uint32_t left_ = 0;
  std::array<std::vector<Waiting>, 256> early_by_bucket_;
  std::size_t early_ = 0;
  std::priority_queue<Waiting, std::vector<Waiting>, LaterFirst> in_turn_;
};

}  // namespace vrpipe
