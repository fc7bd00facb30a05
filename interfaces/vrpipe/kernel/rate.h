#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// Items in a number of cycles, as a ratio in lowest terms: 48 bytes a cycle of items of 32 bytes are 3 in 2.
struct Rate {
  std::uint32_t items = 1;
  std::uint32_t cycles = 1;

  /// So many bytes a cycle of items of so many bytes; both at least 1.
  static constexpr Rate of_bytes(std::uint32_t bytes_per_cycle, std::uint32_t bytes_per_item) {
    const std::uint32_t common = std::gcd(bytes_per_cycle, bytes_per_item);
    return {bytes_per_cycle / common, bytes_per_item / common};
  }
  constexpr double per_cycle() const { return static_cast<double>(items) / static_cast<double>(cycles); }
  /// The most that go in a single cycle.
  constexpr std::uint32_t most_in_a_cycle() const { return (items + cycles - 1) / cycles; }
  friend constexpr bool operator==(Rate a, Rate b) { return a.items == b.items && a.cycles == b.cycles; }
};

/// Lets items through at a rate, cycle by cycle. Unused cycles are lost, fractions of an item are not.
class RateLimit {
 public:
  explicit RateLimit(Rate rate) : rate_(rate) {}
  /// Items that may go in this cycle; not before that of an earlier call.
  std::uint32_t allowance(Cycle now) {
    if (now >= next_) {
      // A cycle brings `items` tokens, and an item takes `cycles` of them.
      const std::uint64_t most = std::uint64_t{rate_.items} + rate_.cycles - 1;
      tokens_ = std::min(most, tokens_ + (now - next_ + 1) * rate_.items);
      next_ = now + 1;
    }
    return static_cast<std::uint32_t>(rate_.cycles == 1 ? tokens_ : tokens_ / rate_.cycles);
  }
  /// `count` items go: not more than the allowance of the cycle.
  void take(std::uint32_t count) { tokens_ -= std::uint64_t{count} * rate_.cycles; }
  /// No more go in this cycle: what is left of it is lost, but for a fraction of an item. Returns what is, in parts of which
  /// a cycle has `Rate::items`, and an item takes `Rate::cycles`.
  std::uint64_t lose_rest() {
    const std::uint64_t kept = std::min<std::uint64_t>(tokens_, rate_.cycles - 1);
    return std::exchange(tokens_, kept) - kept;
  }

 private:
  Rate rate_;
  std::uint64_t tokens_ = 0;
  Cycle next_ = 0;  ///< the first cycle that has brought nothing yet
};

/// Lets batches through whole, at so many items a cycle. In a cycle go the first batch and those that fit beside it; one
/// wider than a cycle takes several, and of the last only its share.
class BatchLimit {
 public:
  explicit BatchLimit(std::uint32_t items_per_cycle) : rate_(items_per_cycle), left_(items_per_cycle) {}
  /// Whether a batch of `items`, at least 1, may go in this cycle; not before that of an earlier call.
  bool allows(std::uint32_t items, Cycle now) {
    if (now > cycle_) {
      left_ = std::min(rate_, left_ + static_cast<std::int64_t>(std::min<Cycle>(now - cycle_, 1U << 16U)) * rate_);
      cycle_ = now;
      first_ = true;
    }
    return first_ ? left_ > 0 : left_ >= items;
  }
  /// The batch goes.
  void take(std::uint32_t items) {
    left_ -= items;
    first_ = false;
  }
  /// The same at `lt`: the first cycle from one on, and from those that are known, in which it may go.
  Cycle free_from(std::uint32_t items, Cycle at) {
    for (at = std::max(at, cycle_); !allows(items, at);) at = next(at);
    return at;
  }
  /// It goes then; returns the cycle.
  Cycle take(std::uint32_t items, Cycle earliest) {
    const Cycle at = free_from(items, earliest);
    take(items);
    return at;
  }
  /// Nothing goes before this cycle any more.
  void hold(Cycle cycle) {
    if (cycle > cycle_) allows(1, cycle);
  }
  /// The last cycle that was asked for.
  Cycle now() const { return cycle_; }
  /// Takes a whole cycle from one on, in which nothing begins; returns it.
  Cycle take_cycle(Cycle earliest) {
    const Cycle at = std::max(earliest, next_free());
    hold(at);
    left_ = std::min<std::int64_t>(left_, 0);
    first_ = false;
    return at;
  }
  /// The first cycle in which nothing has begun, and something may.
  Cycle next_free() const { return first_ && left_ > 0 ? cycle_ : next(cycle_); }
  /// The first cycle after `now` in which a batch may go.
  Cycle next(Cycle now) const { return left_ > 0 ? now + 1 : now + 1 + static_cast<Cycle>(-left_ / rate_); }

 private:
  std::int64_t rate_;
  std::int64_t left_;
  Cycle cycle_ = 0;
  bool first_ = true;  ///< of its cycle
};

/// A resource whose work is measured in thousandths of a cycle.
class ThousandthsPort {
 public:
  /// Whether more can begin in a cycle.
  bool is_free(Cycle now) const { return until_ < 1000 * (now + 1); }
  /// The first such cycle from one on.
  Cycle free_from(Cycle cycle) const { return std::max<Cycle>(cycle, until_ / 1000); }
  /// Begins in a cycle in which it is free; returns the cycle in which it is over.
  Cycle take(Cycle now, std::uint64_t thousandths) {
    until_ = std::max<std::uint64_t>(until_, 1000 * now) + thousandths;
    return (until_ + 999) / 1000;
  }

 private:
  std::uint64_t until_ = 0;
};

}  // namespace vrpipe
