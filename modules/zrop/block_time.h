#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// How much of the time of the z-cache's port goes to blocks alone (block_price.h). They are paid for beside the quads of
/// the tests, the longer of the two counts, and what a block leaves of its last cycle is shared with what begins there: so
/// this is known of a cycle once something begins in a later one.
class BlockTime {
 public:
  using Told = std::function<void(std::uint64_t thousandths, Cycle from, Cycle until)>;
  /// @param told  what blocks took
  BlockTime(std::uint32_t quads_per_cycle, Told told)
      : told_(std::move(told)), thousandth_(quads_per_cycle), cycle_(1000 * thousandth_) {}

  /// Nothing begins before a cycle any more: what blocks took up to there is told.
  void settle(Cycle now) {
    const std::uint64_t end = now == never ? never : now * cycle_;
    const std::uint64_t until = std::min(blocks_, end);
    // Cycles that are theirs in whole, in one piece: so that it can be told how much of it is before any cycle.
    for (std::uint64_t from = std::max(settled_, others_); from < until;) {
      const std::uint64_t rest_of_cycle = cycle_ - from % cycle_;
      const std::uint64_t whole_cycles = from % cycle_ == 0 ? (until - from) / cycle_ * cycle_ : 0;
      const std::uint64_t piece = whole_cycles > 0 ? whole_cycles : std::min(rest_of_cycle, until - from);
      unsaid_ += piece;
      told_(unsaid_ / thousandth_, from / cycle_, (from + piece + cycle_ - 1) / cycle_);
      unsaid_ %= thousandth_;
      from += piece;
    }
    settled_ = std::max(settled_, now == never ? until : end);
  }
  /// What begins in a cycle: quads, whose blocks take so much, if they have a price; and what takes a whole cycle.
  [[gnu::noinline]] void test(Cycle now, unsigned quads, std::uint64_t thousandths) {
    settle(now);
    take(blocks_, now, thousandths * thousandth_);
    take(others_, now, std::uint64_t{1000} * quads);
  }
  [[gnu::noinline]] void take_cycle(Cycle now) {
    settle(now);
    take(others_, now, cycle_);
  }

 private:
  void take(std::uint64_t& until, Cycle now, std::uint64_t parts) const {
    until = std::max(until, now * cycle_) + parts;
  }

  const Told told_;
  // In such parts that both a thousandth of a cycle and one of a cycle's quads are whole numbers of them:
  const std::uint64_t thousandth_;
  const std::uint64_t cycle_;
  std::uint64_t blocks_ = 0;  ///< until when they take the port
  std::uint64_t others_ = 0;  ///< and quads, updates and sectors
  std::uint64_t settled_ = 0;
  std::uint64_t unsaid_ = 0;  ///< less than a thousandth
};

}  // namespace vrpipe
