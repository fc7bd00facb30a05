#include <vrpipe/memory/place_reservation.h>

namespace vrpipe {

Cycle PlaceReservation::make_room(Cycle until, Cycle present) {
  const Cycle oldest = present - std::min(present, remembered_cycles);
  if (oldest > begin_) {
    const std::size_t first = begin_ & (held_.size() - 1);
    const std::size_t count = std::min<std::size_t>(oldest - begin_, held_.size());
    const std::size_t straight = std::min(count, held_.size() - first);
    std::fill_n(held_.begin() + static_cast<std::ptrdiff_t>(first), straight, std::uint16_t{0});
    std::fill_n(held_.begin(), count - straight, std::uint16_t{0});
    begin_ = oldest;
  }
  until = std::min(until, begin_ + most_cycles);
  std::size_t size = held_.size();
  while (until > begin_ + size) size *= 2;
  if (size == held_.size()) return until;
  std::vector<std::uint16_t> larger(size);
  for (Cycle cycle = begin_; cycle < begin_ + held_.size(); ++cycle) {
    larger[cycle & (size - 1)] = held_[cycle & (held_.size() - 1)];
  }
  held_ = std::move(larger);
  return until;
}

}  // namespace vrpipe
