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
  const Cycle until = std::min(cycle, kept_from_ + kept_cycles());
  for (Cycle word = kept_from_; word < until; word += 64) word_of(word) = {};
  kept_from_ = cycle;
}

void BandwidthReservation::make_room(Cycle until, Cycle present) {
  if (!is_by_cycle() && used_.empty()) used_.resize(kept_cycles());
  if (until <= kept_from_ + kept_cycles()) return;
  const Cycle first = oldest(present) / 64 * 64;
  if (first > kept_from_) forget_before(first);
  std::size_t words = words_.size();
  while (until > kept_from_ + 64 * words) words *= 2;
  // So that it is not looked at again each time.
  if (2 * (until - kept_from_) > 64 * words) words *= 2;
  if (words == words_.size()) return;
  std::vector<Word> more(words);
  std::vector<std::uint32_t> used_bytes(used_.empty() ? 0 : 64 * words);
  for (Cycle word = kept_from_; word < kept_from_ + kept_cycles(); word += 64) {
    more[word / 64 & (words - 1)] = word_of(word);
    if (!used_.empty()) std::copy_n(&used(word), 64, &used_bytes[word & (64 * words - 1)]);
  }
  words_ = std::move(more);
  used_ = std::move(used_bytes);
}

void BandwidthReservation::fill(Cycle from, Cycle to) {
  for (Cycle cycle = from; cycle < to; cycle = next_word(cycle)) {
    word_of(cycle).full |= bits(cycle, std::min(to, next_word(cycle)));
  }
}

void BandwidthReservation::begin_run(Cycle arrival, Cycle present) {
  make_room(arrival, present);
  const Cycle whole = end_ / per_cycle_.value();
  fill(std::max(run_begin_, kept_from_), whole);
  const auto rest = static_cast<std::uint32_t>(end_ - whole * per_cycle_.value());
  if (rest > 0 && whole >= kept_from_) {
    used(whole) = rest;
    word_of(whole).partial |= bits(whole, whole + 1);
  }
  run_begin_ = no_gap_from_ = arrival;
  end_ = arrival * per_cycle_.value();
}

Cycle BandwidthReservation::next_with_gap(Cycle cycle) const {
  for (; cycle < run_begin_; cycle = next_word(cycle)) {
    const std::uint64_t free = ~word_of(cycle).full & bits(cycle, next_word(cycle));
    if (free != 0) return std::min(run_begin_, cycle / 64 * 64 + static_cast<unsigned>(__builtin_ctzll(free)));
  }
  return run_begin_;
}

Cycle BandwidthReservation::take_gaps(Cycle arrival, unsigned bytes, Cycle present) {
  std::uint64_t left = bytes;
  for (Cycle cycle = std::max({arrival, oldest(present), kept_from_});; ++cycle) {
    const Cycle open = next_with_gap(cycle);
    if (open == run_begin_) {
      no_gap_from_ = std::min(cycle, run_begin_);
      break;
    }
    cycle = open;
    Word& word = word_of(cycle);
    if (is_by_cycle()) {
      // As many as follow one another.
      const Cycle until = std::min({run_begin_, next_word(cycle), cycle + left});
      const std::uint64_t taken = word.full & bits(cycle, until);
      const Cycle end = taken == 0 ? until : cycle / 64 * 64 + static_cast<unsigned>(__builtin_ctzll(taken));
      word.full |= bits(cycle, end);
      left -= end - cycle;
      cycle = end - 1;
    } else {
      const std::uint64_t bit = bits(cycle, cycle + 1);
      const std::uint32_t before = (word.partial & bit) != 0 ? used(cycle) : 0;
      const auto after = static_cast<std::uint32_t>(std::min<std::uint64_t>(before + left, per_cycle_.value()));
      left -= after - before;
      const bool is_full = after == per_cycle_.value();
      (is_full ? word.full : word.partial) |= bit;
      if (!is_full) used(cycle) = after;
    }
    if (left == 0) return cycle + 1;
  }
  end_ += left;
  return arrival + per_cycle_.quotient_up(end_ - arrival * per_cycle_.value());
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
