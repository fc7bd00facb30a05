#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <vrpipe/arithmetic/divisor.h>
#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// A resource that moves a number of bytes per cycle, reserved by accesses that need not come in the order of time: at
/// `lt` one unit runs ahead of the clock, and another then asks for an earlier cycle. An access takes the first bytes
/// that are free from its arrival on, in as many pieces as that needs, so reservations for later cycles do not delay
/// it. In the order of arrival this is a queue: an access begins when those before it are done. Exact: fractions of a
/// cycle are kept as bytes.
///
/// What is reserved is kept by cycle, from the first that anybody can ask for up to the last run of reservations without a gap
/// (compare the history lists of Graphite and Sniper, which keep a fixed number), but for what is `most_cycles` ahead of that: it
/// is free again for others once something still later is reserved.
class BandwidthReservation {
 public:
  /// Few ask for cycles further back from the present: what has waited for its time (timed_memory_port.h). They find what
  /// lies further back taken.
  static constexpr Cycle remembered_cycles = 64;
  static constexpr Cycle most_cycles = Cycle{1} << 22U;

  /// @param bytes_per_cycle not 0
  explicit BandwidthReservation(unsigned bytes_per_cycle)
      : per_cycle_(bytes_per_cycle), used_(bytes_per_cycle == 1 ? 0 : kept_cycles()) {}

  unsigned bytes_per_cycle() const { return static_cast<unsigned>(per_cycle_.value()); }

  /// Reserves for an access that arrives in a cycle. `present` is the cycle of the clock, and never decreases. Returns
  /// the first cycle at whose beginning all of its bytes have moved.
  [[gnu::always_inline]] Cycle take(Cycle arrival, unsigned bytes, Cycle present) {
    if (arrival < no_gap_from_) return take_gaps(arrival, bytes, present);
    const std::uint64_t begin = arrival * per_cycle_.value();
    if (begin > end_) begin_run(arrival, present);
    end_ += bytes;
    return arrival + per_cycle_.quotient_up(end_ - begin);
  }

  /// Bytes reserved from the beginning of a cycle on; one that is forgotten counts as all reserved.
  std::uint64_t reserved_from(Cycle cycle) const;
  /// And before the beginning of another.
  std::uint64_t reserved_between(Cycle from, Cycle to) const;
  /// Cycles for which there is room, for tests.
  std::size_t kept_cycles() const { return 64 * (last_word_ + 1); }

 private:
  /// All before the cycle that is not reserved yet is a gap.
  [[gnu::noinline]] void begin_run(Cycle arrival, Cycle present);
  [[gnu::noinline]] Cycle take_gaps(Cycle arrival, unsigned bytes, Cycle present);
  [[gnu::noinline]] void make_room(Cycle until, Cycle present);
  void forget_before(Cycle cycle);
  void fill(Cycle from, Cycle to);
  Cycle kept_until() const { return kept_from_ + kept_cycles(); }
  static Cycle oldest(Cycle present) { return present - (present < remembered_cycles ? present : remembered_cycles); }
  /// Of 64 cycles.
  struct Word {
    std::uint64_t full = 0;     ///< a bit each
    std::uint64_t partial = 0;  ///< of these `used_` says how much
  };
  Word& word_of(Cycle cycle) { return words_[cycle / 64 & last_word_]; }
  const Word& word_of(Cycle cycle) const { return words_[cycle / 64 & last_word_]; }
  std::uint32_t& used(Cycle cycle) { return used_[cycle & (64 * last_word_ + 63)]; }
  std::uint32_t used(Cycle cycle) const { return used_[cycle & (64 * last_word_ + 63)]; }

  Divisor per_cycle_;
  std::uint64_t end_ = 0;  ///< in bytes from the start of time: of the furthest reservation
  Cycle run_begin_ = 0;    ///< of the reservations up to it that leave no gap
  Cycle no_gap_from_ = 0;  ///< from here to the furthest reservation nothing is free; at most `run_begin_`
  Cycle kept_from_ = 0;    ///< cycles from here to `run_begin_` are kept, `most_cycles` at most; a multiple of 64
  // Rings, by cycle. Beyond `run_begin_` words are 0.
  std::vector<Word> words_ = std::vector<Word>(16);
  std::size_t last_word_ = 15;       ///< of the ring, whose size is a power of two
  std::vector<std::uint32_t> used_;  ///< bytes; none where a cycle has one, so that it is full or free
};

}  // namespace vrpipe
