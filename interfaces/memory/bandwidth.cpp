#include <vrpipe/memory/bandwidth.h>

#include <algorithm>

namespace vrpipe {

namespace {

/// Bits from one on, and below another, of a word: `to` is in it, or the first of the next.
std::uint64_t bits(Cycle from, Cycle to) {
  const std::uint64_t from_on = ~std::uint64_t{0} << (from % 64);
  return to % 64 == 0 ? from_on : from_on & ~(~std::uint64_t{0} << (to % 64));
}

Cycle next_word(Cycle cycle) { return (cycle / 64 + 1) * 64; }

}  // namespace

void BandwidthReservation::forget_before(Cycle cycle) {
  const Cycle until = std::min(cycle, kept_until());
  for (Cycle word = kept_from_; word < until; word += 64) word_of(word) = {};
  kept_from_ = cycle;
}

void BandwidthReservation::make_room(Cycle until, Cycle present) {
  const Cycle first = oldest(present) / 64 * 64;
  if (first > kept_from_) forget_before(first);
  std::size_t words = words_.size();
  // Twice what it takes, so that it is not looked at again each time.
  while (64 * words < most_cycles && 2 * (until - kept_from_) > 64 * words) words *= 2;
  if (words == words_.size()) return;
  std::vector<Word> more(words);
  std::vector<std::uint32_t> used_bytes(used_.empty() ? 0 : 64 * words);
  for (Cycle word = kept_from_; word < kept_until(); word += 64) {
    more[word / 64 & (words - 1)] = word_of(word);
    if (!used_.empty()) std::copy_n(&used(word), 64, &used_bytes[word & (64 * words - 1)]);
  }
  words_ = std::move(more);
  last_word_ = words - 1;
  used_ = std::move(used_bytes);
}

void BandwidthReservation::fill(Cycle from, Cycle to) {
  for (Cycle cycle = from; cycle < to; cycle = next_word(cycle)) {
    word_of(cycle).full |= bits(cycle, std::min(to, next_word(cycle)));
  }
}

void BandwidthReservation::begin_run(Cycle arrival, Cycle present) {
  if (arrival > kept_until()) make_room(arrival, present);
  const Cycle whole = per_cycle_.quotient(end_);
  fill(std::max(run_begin_, kept_from_), std::min(whole, kept_until()));
  const auto rest = static_cast<std::uint32_t>(end_ - whole * per_cycle_.value());
  if (rest > 0 && whole >= kept_from_ && whole < kept_until()) {
    used(whole) = rest;
    word_of(whole).partial |= bits(whole, whole + 1);
  }
  run_begin_ = no_gap_from_ = arrival;
  end_ = arrival * per_cycle_.value();
}

Cycle BandwidthReservation::take_gaps(Cycle arrival, unsigned bytes, Cycle present) {
  const std::uint64_t width = per_cycle_.value();
  std::uint64_t left = bytes;
  Cycle taken_until = std::max({arrival, oldest(present), kept_from_});
  const Cycle until = std::min(run_begin_, kept_until());
  for (Cycle cycle = taken_until; cycle < until; cycle = next_word(cycle)) {
    Word& word = word_of(cycle);
    std::uint64_t open = ~word.full & bits(cycle, std::min(until, next_word(cycle)));
    while (open != 0) {
      const auto first = static_cast<unsigned>(__builtin_ctzll(open));
      const std::uint64_t bit = std::uint64_t{1} << first;
      std::uint64_t count = 1;
      if (left >= width && (word.partial & bit) == 0) {
        // As many as are free and follow one another.
        const std::uint64_t beyond = ~(open & ~word.partial) & ~(bit - 1);
        const unsigned run = (beyond == 0 ? 64 : static_cast<unsigned>(__builtin_ctzll(beyond))) - first;
        count = std::min<std::uint64_t>(run, per_cycle_.quotient(left));
        word.full |= ~std::uint64_t{0} >> (64 - count) << first;
        left -= count * width;
      } else {
        const std::uint64_t all = left + ((word.partial & bit) != 0 ? used(cycle / 64 * 64 + first) : 0);
        const bool is_full = all >= width;
        (is_full ? word.full : word.partial) |= bit;
        if (!is_full) used(cycle / 64 * 64 + first) = static_cast<std::uint32_t>(all);
        left = is_full ? all - width : 0;
      }
      taken_until = cycle / 64 * 64 + first + count;
      if (left == 0) return taken_until;
      open &= ~word.full;
    }
  }
  if (until < run_begin_) return std::max(arrival, until) + per_cycle_.quotient_up(left);
  no_gap_from_ = std::min(taken_until, run_begin_);
  end_ += left;
  return arrival + per_cycle_.quotient_up(end_ - arrival * width);
}

std::uint64_t BandwidthReservation::reserved_from(Cycle cycle) const {
  return reserved_between(cycle, std::max(cycle, per_cycle_.quotient_up(end_)));
}

std::uint64_t BandwidthReservation::reserved_between(Cycle from, Cycle to) const {
  std::uint64_t reserved = 0;
  if (to > run_begin_) {
    const std::uint64_t begin = std::max(from, run_begin_) * per_cycle_.value();
    const std::uint64_t until = std::min(end_, to * per_cycle_.value());
    reserved += until > begin ? until - begin : 0;
    to = run_begin_;
  }
  if (from < kept_from_) {
    reserved += (std::min(to, kept_from_) - std::min(from, to)) * per_cycle_.value();
    from = kept_from_;
  }
  to = std::min(to, kept_until());
  for (Cycle cycle = from; cycle < to; cycle = next_word(cycle)) {
    const std::uint64_t asked = bits(cycle, std::min(to, next_word(cycle)));
    const Word& word = word_of(cycle);
    reserved += static_cast<unsigned>(__builtin_popcountll(word.full & asked)) * per_cycle_.value();
    for (std::uint64_t partial = word.partial & ~word.full & asked; partial != 0; partial &= partial - 1)
      reserved += used(cycle / 64 * 64 + static_cast<unsigned>(__builtin_ctzll(partial)));
  }
  return reserved;
}

}  // namespace vrpipe
