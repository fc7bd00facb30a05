#include <vrpipe/memory/bandwidth.h>

#include <algorithm>

namespace vrpipe {

std::uint64_t BandwidthReservation::forget(Cycle present) {
  const std::uint64_t oldest = (present - std::min(present, remembered_cycles)) * per_cycle_.value();
  while (tail_ != head_ && gap(0).end <= oldest) ++head_;
  return oldest;
}

void BandwidthReservation::make_room(Cycle present) {
  forget(present);
  if (2 * gaps() <= gaps_.size()) return;
  std::vector<Gap> larger(2 * gaps_.size());
  const std::size_t count = gaps();
  for (std::size_t i = 0; i < count; ++i) larger[i] = gap(i);
  gaps_ = std::move(larger);
  mask_ = gaps_.size() - 1;
  head_ = 0;
  tail_ = count;
}

std::size_t BandwidthReservation::first_gap_after(std::uint64_t byte) const {
  std::size_t low = 0;
  std::size_t high = gaps();
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (gap(middle).end > byte) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

void BandwidthReservation::insert(std::size_t index, const Gap& inserted) {
  const std::size_t count = gaps();
  if (index < count / 2) {
    --head_;
    for (std::size_t i = 0; i < index; ++i) gap(i) = gap(i + 1);
  } else {
    ++tail_;
    for (std::size_t i = count; i > index; --i) gap(i) = gap(i - 1);
  }
  gap(index) = inserted;
}

void BandwidthReservation::erase(std::size_t index) {
  const std::size_t count = gaps();
  if (index < count / 2) {
    for (std::size_t i = index; i > 0; --i) gap(i) = gap(i - 1);
    ++head_;
  } else {
    for (std::size_t i = index + 1; i < count; ++i) gap(i - 1) = gap(i);
    --tail_;
  }
}

Cycle BandwidthReservation::take_gaps(Cycle arrival, unsigned bytes, Cycle present) {
  // One gap may be cut in two.
  if (tail_ - head_ > mask_) make_room(present);
  const std::uint64_t begin = std::max(arrival * per_cycle_.value(), forget(present));
  std::uint64_t left = bytes;
  std::uint64_t end = 0;
  for (std::size_t index = first_gap_after(begin); left > 0 && index < gaps();) {
    const Gap found = gap(index);
    const std::uint64_t from = std::max(found.begin, begin);
    end = std::min(found.end, from + left);
    left -= end - from;
    if (from == found.begin && end == found.end) {
      erase(index);
      continue;
    }
    if (from > found.begin && end < found.end) insert(index++, {found.begin, from});
    gap(index) = end < found.end ? Gap{end, found.end} : Gap{found.begin, from};
    ++index;
  }
  last_gap_end_ = gaps() == 0 ? 0 : gap(gaps() - 1).end;
  if (left > 0) end = end_ += left;
  return arrival + per_cycle_.quotient_up(end - arrival * per_cycle_.value());
}

std::uint64_t BandwidthReservation::reserved_from(Cycle cycle) const {
  const std::uint64_t begin = cycle * per_cycle_.value();
  if (begin >= end_) return 0;
  std::uint64_t reserved = end_ - begin;
  for (std::size_t index = first_gap_after(begin); index < gaps(); ++index) {
    reserved -= gap(index).end - std::max(gap(index).begin, begin);
  }
  return reserved;
}

}  // namespace vrpipe
