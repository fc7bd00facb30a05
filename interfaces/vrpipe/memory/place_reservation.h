#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// Places that are held for a time each, as miss registers are, reserved by who need not come in the order of time: at
/// `lt` one unit runs ahead of the clock, and another then asks for an earlier cycle. Counts who holds one in each cycle,
/// so that what is reserved for later cycles delays nobody, unless he stays until then: then he is let in all the same.
/// In the order of time no more places are ever held than there are. No more than 65535 hold one at a time.
class PlaceReservation {
 public:
  /// Further ahead of the furthest cycle that was forgotten nothing is reserved.
  static constexpr Cycle most_cycles = Cycle{1} << 16U;
  /// How far back from the present a cycle may be asked for: further, all places are free.
  static constexpr Cycle remembered_cycles = 64;

  /// @param places  1 to 65535
  explicit PlaceReservation(std::uint32_t places) : places_(places) {}

  /// The first cycle from `at` on in which a place is free.
  Cycle free_from(Cycle at) const {
    while (at - begin_ < held_.size() && held_[at & (held_.size() - 1)] >= places_) ++at;
    return at;
  }
  /// Holds one in the cycles from `from` up to but not including `until`. `present` is the cycle of the clock, and never
  /// decreases.
  void take(Cycle from, Cycle until, Cycle present) {
    if (until > begin_ + held_.size()) until = make_room(until, present);
    from = std::max(from, begin_);
    if (from >= until) return;
    const std::size_t first = from & (held_.size() - 1);
    const std::size_t count = until - from;
    const std::size_t straight = std::min(count, held_.size() - first);
    for (std::size_t i = 0; i < straight; ++i) ++held_[first + i];
    for (std::size_t i = 0; i < count - straight; ++i) ++held_[i];
  }

 private:
  /// Returns up to where there is room.
  [[gnu::noinline]] Cycle make_room(Cycle until, Cycle present);

  std::uint32_t places_;
  Cycle begin_ = 0;                                                   ///< cycles before it are forgotten
  std::vector<std::uint16_t> held_ = std::vector<std::uint16_t>(64);  ///< in each cycle from then on, a ring
};

}  // namespace vrpipe
