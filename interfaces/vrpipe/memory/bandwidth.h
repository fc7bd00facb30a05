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
/// Only idle stretches before the furthest reservation are kept, at most one for each access; those that nobody can ask
/// for any more are forgotten (compare the history lists of Graphite and Sniper, which keep a fixed number).
class BandwidthReservation {
 public:
  /// Few ask for cycles further back from the present: what has waited for its time (timed_memory_port.h). They find what
  /// lies further back taken.
  static constexpr Cycle remembered_cycles = 64;

  /// @param bytes_per_cycle not 0
  explicit BandwidthReservation(unsigned bytes_per_cycle) : per_cycle_(bytes_per_cycle) {}

  unsigned bytes_per_cycle() const { return static_cast<unsigned>(per_cycle_.value()); }

  /// Reserves for an access that arrives in a cycle. `present` is the cycle of the clock, and never decreases. Returns
  /// the first cycle at whose beginning all of its bytes have moved.
  Cycle take(Cycle arrival, unsigned bytes, Cycle present) {
    const std::uint64_t begin = arrival * per_cycle_.value();
    if (begin < last_gap_end_) return take_gaps(arrival, bytes, present);
    if (begin > end_) add_gap(begin, present);
    end_ += bytes;
    return arrival + per_cycle_.quotient_up(end_ - begin);
  }

  /// Bytes reserved from the beginning of a cycle on; one that is forgotten counts as all reserved.
  std::uint64_t reserved_from(Cycle cycle) const;
  /// Idle stretches that are kept, for tests.
  std::size_t gaps() const { return tail_ - head_; }

 private:
  /// Free bytes, counted from the start of time, `bytes_per_cycle` for each cycle.
  struct Gap {
    std::uint64_t begin, end;
  };
  Gap& gap(std::size_t index) { return gaps_[(head_ + index) & mask_]; }
  const Gap& gap(std::size_t index) const { return gaps_[(head_ + index) & mask_]; }
  /// All bytes up to `begin` that are not reserved yet become a gap.
  void add_gap(std::uint64_t begin, Cycle present) {
    if (tail_ - head_ > mask_) make_room(present);
    gaps_[tail_++ & mask_] = {end_, begin};
    last_gap_end_ = end_ = begin;
  }
  [[gnu::noinline]] Cycle take_gaps(Cycle arrival, unsigned bytes, Cycle present);
  [[gnu::noinline]] void make_room(Cycle present);
  std::uint64_t forget(Cycle present);
  std::size_t first_gap_after(std::uint64_t byte) const;
  void insert(std::size_t index, const Gap& gap);
  void erase(std::size_t index);

  Divisor per_cycle_;
  std::uint64_t end_ = 0;                        ///< of the furthest reservation
  std::uint64_t last_gap_end_ = 0;               ///< what arrives later finds no gap; 0 for none
  std::vector<Gap> gaps_ = std::vector<Gap>(8);  ///< a ring, by position; none is empty
  std::size_t mask_ = 7;
  std::size_t head_ = 0;
  std::size_t tail_ = 0;
};

}  // namespace vrpipe
