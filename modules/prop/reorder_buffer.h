#pragma once

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "prop/prop.h"

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/pipeline/screen_tiling.h>

namespace vrpipe {

/// Shaded warps that wait to leave PROP. A warp's turn comes when the one before it, of the draw or of its screen tile,
/// has left; of those whose turn has come the oldest goes first, which keeps a tile's quads together in the colour cache.
/// A mark leaves between the warps that were launched before it and those after.
class ReorderBuffer {
 public:
  /// A warp leaves when the warps of smaller number in its line have left: a line for the draw, or for each screen tile.
  struct Turn {
    std::uint32_t line;
    std::uint32_t number;
  };
  struct Waiting {
    const ShadedWarp* warp = nullptr;
    std::uint32_t sequence = 0;  ///< of the warp
    Turn turn{};
    Cycle from = 0;  ///< the first cycle in which it can leave, for timing models that know it ahead
  };

  ReorderBuffer(PropTime::Order order, const RenderContext& context)
      : by_draw_(order == PropTime::Order::draw),
        grid_(context.frame->width(), context.frame->height()),
        next_of_line_(by_draw_ ? 1 : grid_.tiles()) {}

  [[gnu::always_inline]] void arrive(const ShadedWarp& warp, Cycle from = 0) {
    const Turn turn = turn_of(warp);
    const Waiting waiting{&warp, warp.sequence, turn, from};
    if (!marks_.empty() && warp.sequence >= marks_.front().warp->sequence) {
      behind_.push_back(waiting);
    } else if (turn.number == next_of_line_[turn.line]) {
      in_turn_.push(waiting);
    } else {
      early_.push(waiting);
    }
  }

  /// A mark, which comes before the warps that were launched after it.
  void arrive_mark(const ShadedWarp& mark, Cycle from = 0) { marks_.push({&mark, mark.sequence, {}, from}); }
  /// The mark whose turn it is; null if it is not a mark's.
  const Waiting* next_mark() const {
    return !marks_.empty() && marks_.front().sequence == left_ ? &marks_.front() : nullptr;
  }
  void leave_mark() {
    marks_.pop();
    for (const Waiting& waiting : std::exchange(behind_, {})) arrive(*waiting.warp, waiting.from);
  }

  bool has_next() const { return !in_turn_.empty(); }
  /// The oldest whose turn it is, if there is one.
  const Waiting& next() const { return in_turn_.oldest(); }
  Waiting take() { return in_turn_.take_oldest(); }
  /// The warp of a turn has left: the one that follows it may be among those that came early.
  [[gnu::always_inline]] void leave(Turn turn, Cycle at = 0) {
    next_of_line_[turn.line] = ++turn.number;
    ++left_;
    Waiting waiting;
    if (early_.take(turn, waiting)) {
      waiting.from = std::max(waiting.from, at);
      __builtin_prefetch(waiting.warp);  // it came long ago, and leaves soon
      in_turn_.push(waiting);
    }
  }

  bool empty() const { return in_turn_.empty() && early_.empty() && marks_.empty(); }
  bool has_early() const { return !early_.empty(); }

 private:
  /// By sequence, in a ring that holds all from the oldest to the newest: a window on the launch order.
  class Window {
   public:
    bool empty() const { return count_ == 0; }
    /// Inlined: an entry written field by field into an argument would be waited for when it is copied.
    [[gnu::always_inline]] void push(const Waiting& waiting) {
      oldest_ = count_ == 0 ? waiting.sequence : std::min(oldest_, waiting.sequence);
      newest_ = count_ == 0 ? waiting.sequence : std::max(newest_, waiting.sequence);
      if (newest_ - oldest_ >= ring_.size()) grow();
      put(waiting);
      ++count_;
    }
    const Waiting& oldest() const { return ring_[place_of_oldest()]; }
    Waiting take_oldest() {
      const std::size_t place = place_of_oldest();
      const Waiting& oldest = ring_[place];
      there_[place / 64] &= ~(std::uint64_t{1} << (place % 64));
      oldest_ = oldest.sequence + 1;
      --count_;
      return oldest;
    }

   private:
    [[gnu::always_inline]] std::size_t place_of_oldest() const {
      const std::size_t from = oldest_ & (ring_.size() - 1);
      std::size_t word = from / 64;
      std::uint64_t there = there_[word] & (~std::uint64_t{0} << (from % 64));
      while (there == 0) {
        word = word + 1 == there_.size() ? 0 : word + 1;
        there = there_[word];
      }
      return 64 * word + static_cast<unsigned>(__builtin_ctzll(there));
    }
    void put(const Waiting& waiting) {
      const std::size_t place = waiting.sequence & (ring_.size() - 1);
      ring_[place] = waiting;
      there_[place / 64] |= std::uint64_t{1} << (place % 64);
    }
    void grow() {
      std::vector<Waiting> waiting;
      for (std::size_t place = 0; place < ring_.size(); ++place) {
        if ((there_[place / 64] >> (place % 64) & 1U) != 0) waiting.push_back(ring_[place]);
      }
      std::size_t size = ring_.size();
      while (newest_ - oldest_ >= size) size *= 2;
      ring_.assign(size, {});
      there_.assign(size / 64, 0);
      for (const Waiting& each : waiting) put(each);
    }

    std::uint32_t oldest_ = 0;  ///< no warp that is there is older
    std::uint32_t newest_ = 0;
    std::size_t count_ = 0;
    std::vector<Waiting> ring_ = std::vector<Waiting>(1024);
    std::vector<std::uint64_t> there_ = std::vector<std::uint64_t>(1024 / 64);  ///< a bit a place
  };

  /// Warps whose turn has not come, to be found by turn: chains from a table of hashes.
  class EarlyWarps {
   public:
    EarlyWarps() { first_.fill(none); }
    bool empty() const { return count_ == 0; }
    void push(const Waiting& waiting) {
      if (free_ == none) {
        free_ = static_cast<std::uint32_t>(entries_.size());
        entries_.push_back({none, waiting});
      }
      std::uint32_t& first = first_of(waiting.turn);
      Entry& entry = entries_[free_];
      const std::uint32_t next_free = entry.next;
      entry = {first, waiting};
      first = free_;
      free_ = next_free;
      ++count_;
    }
    bool take(Turn turn, Waiting& out) {
      for (std::uint32_t* at = &first_of(turn); *at != none; at = &entries_[*at].next) {
        Entry& entry = entries_[*at];
        if (entry.waiting.turn.line != turn.line || entry.waiting.turn.number != turn.number) continue;
        out = entry.waiting;
        const std::uint32_t taken = *at;
        *at = entry.next;
        entry.next = free_;
        free_ = taken;
        --count_;
        return true;
      }
      return false;
    }

   private:
    static constexpr std::uint32_t none = ~0U;
    struct Entry {
      std::uint32_t next;
      Waiting waiting;
    };
    std::uint32_t& first_of(Turn turn) { return first_[(turn.line + 31 * turn.number) % first_.size()]; }

    std::array<std::uint32_t, 1024> first_;
    std::vector<Entry> entries_;
    std::uint32_t free_ = none;  ///< chain of the unused ones
    std::size_t count_ = 0;
  };

  Turn turn_of(const ShadedWarp& warp) const {
    if (by_draw_) return {0, warp.sequence};
    return {static_cast<std::uint32_t>(grid_.index(warp.tile)), warp.tile_sequence};
  }

  const bool by_draw_;
  const ScreenTiling grid_;
  std::vector<std::uint32_t> next_of_line_;
  std::uint32_t left_ = 0;  ///< warps
  Window in_turn_;
  EarlyWarps early_;
  Ring<Waiting> marks_;
  std::vector<Waiting> behind_;  ///< the first of the marks
};

}  // namespace vrpipe
