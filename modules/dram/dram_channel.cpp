#include "dram/dram_channel.h"

#include <algorithm>

namespace vrpipe {

using Kind = DramCommand::Kind;

DramChannel::Queue::Queue(unsigned capacity) : entries(capacity) {
  for (std::size_t i = 0; i < capacity; ++i) entries[i].next = static_cast<std::uint16_t>(i + 1);
}

DramChannel::DramChannel(const DramTiming& timing, DramStatistics& statistics, EffectGate refresh)
    : timing_(timing),
      statistics_(statistics),
      reads_(timing.read_queue),
      writes_(timing.write_queue),
      next_refresh_(timing.refresh && !refresh.is_silenced() ? timing.refi : never),
      refresh_gate_(std::move(refresh)) {}

std::uint16_t DramChannel::take_place(Queue& queue, const DramAddress& place, Cycle now) {
  const std::uint16_t index = queue.free;
  Entry& entry = queue.entries[index];
  queue.free = entry.next;
  ++queue.count;
  entry.row = place.row;
  entry.sequence = sequence_++;
  entry.arrived = now;
  entry.column = place.column;
  entry.follower = none;
  entry.bank = static_cast<std::uint8_t>(place.bank);
  entry.cause = Cause::hit;
  return index;
}

void DramChannel::append(Queue& queue, std::uint16_t index) {
  Entry& entry = queue.entries[index];
  List& list = queue.of_bank[entry.bank];
  entry.next = none;
  entry.previous = list.last;
  (list.last == none ? list.first : queue.entries[list.last].next) = index;
  list.last = index;
  ++queue.linked;
  queue.banks |= 1U << entry.bank;
  const Bank& bank = banks_[entry.bank];
  if (list.hit == none && bank.open && bank.row == entry.row) list.hit = index;
  update(queue, entry.bank);
}

void DramChannel::remove(Queue& queue, std::uint16_t index) {
  Entry& entry = queue.entries[index];
  List& list = queue.of_bank[entry.bank];
  (entry.previous == none ? list.first : queue.entries[entry.previous].next) = entry.next;
  (entry.next == none ? list.last : queue.entries[entry.next].previous) = entry.previous;
  if (list.first == none) queue.banks &= ~(1U << entry.bank);
  if (list.hit == index) find_hit(queue, entry.bank, entry.next);
  update(queue, entry.bank);
  --queue.linked;
  --queue.count;
  entry.next = queue.free;
  queue.free = index;
}

void DramChannel::find_hit(Queue& queue, unsigned bank, std::uint16_t from) {
  while (from != none && queue.entries[from].row != banks_[bank].row) from = queue.entries[from].next;
  queue.of_bank[bank].hit = from;
}

std::uint16_t DramChannel::find(const Queue& queue, std::uint16_t from, const DramAddress& place) const {
  while (from != none && (queue.entries[from].row != place.row || queue.entries[from].column != place.column))
    from = queue.entries[from].next;
  return from;
}

void DramChannel::read(const DramAddress& place, std::uint32_t tag, Cycle now) {
  statistics_.reads_queued.see(reads_.count);
  const bool is_queued = find(writes_, writes_.of_bank[place.bank].first, place) != none ||
                         find(writes_, held_[place.bank].first, place) != none;
  if (is_queued) {
    ++statistics_.reads_forwarded;
    statistics_.read_cycles.see(1);
    completions_.push_in_order({now + 1, tag}, &Completion::at);
    return;
  }
  now_ = now;
  const std::uint16_t index = take_place(reads_, place, now);
  reads_.entries[index].tag = tag;
  append(reads_, index);
  choose_again(reads_, place.bank);
}

void DramChannel::write(const DramAddress& place, Cycle now) {
  statistics_.writes_queued.see(writes_.count);
  List& held = held_[place.bank];
  if (find(writes_, writes_.of_bank[place.bank].first, place) != none || find(writes_, held.first, place) != none) {
    ++statistics_.writes_merged;
    return;
  }
  now_ = now;
  const std::uint16_t index = take_place(writes_, place, now);
  // Of several older reads the youngest is served last.
  std::uint16_t older = none;
  for (std::uint16_t read = reads_.of_bank[place.bank].first; (read = find(reads_, read, place)) != none;
       read = reads_.entries[read].next)
    older = read;
  if (older == none) {
    append(writes_, index);
  } else {
    reads_.entries[older].follower = index;
    Entry& entry = writes_.entries[index];
    entry.next = none;
    entry.previous = held.last;
    (held.last == none ? held.first : writes_.entries[held.last].next) = index;
    held.last = index;
  }
  choose_again(writes_, place.bank);
}

void DramChannel::choose_mode() {
  const bool reads_wait = reads_.linked > 0;
  if (draining_) {
    const bool has_had_its_turn = reads_wait && drained_ >= timing_.write_queue;
    if (writes_.linked > timing_.write_low && !has_had_its_turn) return;
    draining_ = false;
    read_ = 0;
    statistics_.drain_cycles += now_ - drains_since_;
    return;
  }
  // After a drain, reads have as long a turn as it had at least.
  const bool reads_had_theirs = !reads_wait || drained_ == 0 || read_ >= timing_.write_high - timing_.write_low;
  const unsigned from = reads_wait ? timing_.write_high : timing_.write_low + 1;
  if (writes_.linked < from || !reads_had_theirs) return;
  draining_ = true;
  drained_ = 0;
  drains_since_ = now_;
}

namespace {

// Turns of what can be given in the same cycle: ranks, then age.
constexpr unsigned rank_shift = 62;
constexpr unsigned bank_bits = 5;
constexpr std::uint64_t for_the_aged = 0;
constexpr std::uint64_t for_a_hit = std::uint64_t{1} << rank_shift;
constexpr std::uint64_t for_another_row = std::uint64_t{2} << rank_shift;

constexpr std::uint64_t turn_of(std::uint64_t rank, std::uint64_t sequence, unsigned bank) {
  return rank | sequence << bank_bits | bank;
}
constexpr unsigned bank_of_turn(std::uint64_t turn) { return turn & ((1U << bank_bits) - 1); }

}  // namespace

void DramChannel::update(Queue& queue, unsigned bank) {
  const List& list = queue.of_bank[bank];
  if (list.first == none) return;
  const Bank& state = banks_[bank];
  const unsigned group = group_of(bank);
  queue.ages_at = std::min(queue.ages_at, queue.entries[list.first].arrived + timing_.age_cap + 1);
  if (state.open && list.hit != none) {
    queue.turn[bank] = turn_of(for_a_hit, queue.entries[list.hit].sequence, bank);
    queue.ready[bank] = state.next_column;
    queue.limit[bank] = static_cast<std::uint8_t>(limit_of_data + group);
    return;
  }
  queue.turn[bank] = turn_of(for_another_row, queue.entries[list.first].sequence, bank);
  queue.ready[bank] = state.open ? state.next_precharge : state.next_activate;
  queue.limit[bank] = static_cast<std::uint8_t>(state.open ? 0 : limit_of_activate + group);
}

DramChannel::Limits DramChannel::limits_of(Cycle from) const {
  Limits limits;
  limits[0] = from;
  const auto& bus = draining_ ? next_write_ : next_read_;
  const Cycle activate = std::max(from, activated_[oldest_activate_]);
  for (unsigned group = 0; group < timing_.groups; ++group) {
    limits[limit_of_data + group] = std::max(from, bus[group]);
    limits[limit_of_activate + group] = std::max(activate, next_activate_[group]);
  }
  return limits;
}

// In two passes of minima: branches on what is random would be mispredicted.
DramChannel::Candidate DramChannel::choose_of(const Queue& queue, std::uint32_t banks, const Limits& limits) const {
  std::array<Cycle, most_banks> cycles;
  Candidate best;
  for (std::uint32_t left = banks; left != 0; left &= left - 1) {
    const auto bank = static_cast<unsigned>(__builtin_ctz(left));
    cycles[bank] = std::max(queue.ready[bank], limits[queue.limit[bank]]);
    best.at = std::min(best.at, cycles[bank]);
  }
  for (std::uint32_t left = banks; left != 0; left &= left - 1) {
    const auto bank = static_cast<unsigned>(__builtin_ctz(left));
    const std::uint64_t others = cycles[bank] == best.at ? 0 : ~std::uint64_t{0};
    best.turn = std::min(best.turn, queue.turn[bank] | others);
  }
  return best;
}

// Bursts come in the order of their sequence, so the oldest has waited for the longest time.
std::uint16_t DramChannel::aged(Queue& queue) const {
  if (now_ < queue.ages_at) return none;
  std::uint16_t oldest = none;
  for (std::uint32_t banks = queue.banks; banks != 0; banks &= banks - 1) {
    const std::uint16_t first = queue.of_bank[static_cast<unsigned>(__builtin_ctz(banks))].first;
    if (oldest == none || queue.entries[first].sequence < queue.entries[oldest].sequence) oldest = first;
  }
  queue.ages_at = oldest == none ? never : queue.entries[oldest].arrived + timing_.age_cap + 1;
  return now_ < queue.ages_at ? none : oldest;
}

// The channel has advanced to its cycle, so that nothing that was not chosen could be given before what was.
void DramChannel::choose_again(Queue& queue, unsigned bank) {
  const bool drained = draining_;
  choose_mode();
  Queue& served = draining_ ? writes_ : reads_;
  if (!chosen_ || !is_best_ || draining_ != drained || now_ >= served.ages_at) {
    chosen_ = false;
    return;
  }
  if (&queue != &served || queue.of_bank[bank].first == none) return;
  if (best_.at != never && bank == bank_of_turn(best_.turn)) {
    chosen_ = false;
    return;
  }
  const Cycle from = std::max(now_, command_bus_);
  const Candidate candidate{std::max({from, queue.ready[bank], limit_of(queue.limit[bank])}), queue.turn[bank]};
  if (!candidate.goes_before(best_)) return;
  best_ = candidate;
  take(queue, candidate);
  if (next_.at < next_refresh_) return;
  is_best_ = false;
  choose_refresh();
}

Cycle DramChannel::limit_of(unsigned limit) const {
  if (limit >= limit_of_activate)
    return std::max(next_activate_[limit - limit_of_activate], activated_[oldest_activate_]);
  if (limit >= limit_of_data) return (draining_ ? next_write_ : next_read_)[limit - limit_of_data];
  return 0;
}

void DramChannel::choose() {
  chosen_ = true;
  Queue& queue = draining_ ? writes_ : reads_;
  const Cycle from = std::max(now_, command_bus_);
  const Limits limits = limits_of(from);
  const std::uint16_t waited_too_long = aged(queue);
  if (waited_too_long != none) {
    choose_for(queue, waited_too_long, limits);
  } else {
    best_ = choose_of(queue, queue.banks, limits);
    take(queue, best_);
  }
  is_best_ = waited_too_long == none && !timing_.closes_rows && next_.at < next_refresh_;
  if (timing_.closes_rows) choose_to_close(from);
  if (next_.at >= next_refresh_) choose_refresh();
}

void DramChannel::take(const Queue& queue, const Candidate& candidate) {
  next_.at = candidate.at;
  serves_ = none;
  if (candidate.at == never) return;
  next_.bank = bank_of_turn(candidate.turn);
  const List& list = queue.of_bank[next_.bank];
  const Bank& bank = banks_[next_.bank];
  const bool hits = bank.open && list.hit != none;
  serves_ = hits ? list.hit : list.first;
  next_.kind = !hits ? (bank.open ? Kind::precharge : Kind::activate) : draining_ ? Kind::write : Kind::read;
}

// The bank of who has waited too long serves nobody else.
void DramChannel::choose_for(const Queue& queue, std::uint16_t aged, const Limits& limits) {
  const Entry& entry = queue.entries[aged];
  const Bank& bank = banks_[entry.bank];
  const unsigned group = group_of(entry.bank);
  const bool hits = bank.open && entry.row == bank.row;
  const Cycle ready = hits ? bank.next_column : bank.open ? bank.next_precharge : bank.next_activate;
  const Cycle limit = limits[hits ? limit_of_data + group : bank.open ? 0 : limit_of_activate + group];
  const Candidate of_aged{std::max(ready, limit), turn_of(hits ? for_a_hit : for_the_aged, entry.sequence, entry.bank)};
  const Candidate of_others = choose_of(queue, queue.banks & ~(1U << entry.bank), limits);
  if (of_others.goes_before(of_aged)) return take(queue, of_others);
  next_.at = of_aged.at;
  next_.bank = entry.bank;
  next_.kind = !hits ? (bank.open ? Kind::precharge : Kind::activate) : draining_ ? Kind::write : Kind::read;
  serves_ = aged;
}

// What somebody waits for goes before it.
void DramChannel::choose_to_close(Cycle from) {
  for (std::uint32_t banks = open_banks_; banks != 0; banks &= banks - 1) {
    const auto bank = static_cast<unsigned>(__builtin_ctz(banks));
    if (reads_.of_bank[bank].hit != none || writes_.of_bank[bank].hit != none) continue;
    const Cycle at = std::max(from, banks_[bank].next_precharge);
    if (at >= next_.at) continue;
    next_.at = at;
    next_.bank = bank;
    next_.kind = Kind::precharge;
    serves_ = none;
  }
}

void DramChannel::choose_refresh() {
  serves_ = none;
  next_.bank = 0;
  next_.at = std::max(next_refresh_, command_bus_);
  if (open_banks_ == 0) {
    next_.kind = Kind::refresh;
    next_.at = std::max(next_.at, all_precharged_);
    return;
  }
  next_.kind = Kind::precharge_all;
  for (std::uint32_t banks = open_banks_; banks != 0; banks &= banks - 1)
    next_.at = std::max(next_.at, banks_[static_cast<unsigned>(__builtin_ctz(banks))].next_precharge);
}

void DramChannel::issue() {
  const Cycle at = next_.at;
  chosen_ = false;
  now_ = std::max(now_, at);
  command_bus_ = at + (next_.kind == Kind::activate ? timing_.activate : 1);
  switch (next_.kind) {
    case Kind::activate: activate(at); break;
    case Kind::read:
    case Kind::write: move_data(at); break;
    case Kind::precharge:
      ++statistics_.precharges;
      banks_[next_.bank].conflict = serves_ != none;
      open_banks_ &= ~(1U << next_.bank);
      close_bank(banks_[next_.bank], at, timing_.rp);
      update(next_.bank);
      break;
    case Kind::precharge_all:
      ++statistics_.precharges;
      for (Bank& bank : banks_) {
        bank.conflict = false;
        close_bank(bank, at, timing_.rp_all);
      }
      open_banks_ = 0;
      for (unsigned bank = 0; bank < timing_.banks; ++bank) update(bank);
      break;
    case Kind::refresh: refresh(at); break;
  }
  if (observer_ != nullptr) observer_->issued(next_);
}

void DramChannel::activate(Cycle at) {
  ++statistics_.activates;
  Queue& queue = draining_ ? writes_ : reads_;
  Entry& entry = queue.entries[serves_];
  Bank& bank = banks_[next_.bank];
  entry.cause = bank.conflict ? Cause::conflict : Cause::miss;
  bank.open = true;
  bank.conflict = false;
  bank.row = next_.row = entry.row;
  open_banks_ |= 1U << next_.bank;
  const Cycle last = at + timing_.activate - 1;
  bank.next_column = last + timing_.rcd;
  bank.next_precharge = last + timing_.ras;
  bank.next_activate = at + timing_.rc;
  const unsigned group = group_of(next_.bank);
  for (unsigned other = 0; other < timing_.groups; ++other)
    next_activate_[other] = std::max(next_activate_[other], at + (other == group ? timing_.rrd_l : timing_.rrd));
  activated_[oldest_activate_] = at + timing_.faw;
  oldest_activate_ = (oldest_activate_ + 1) & 3U;
  find_hit(reads_, next_.bank, reads_.of_bank[next_.bank].first);
  find_hit(writes_, next_.bank, writes_.of_bank[next_.bank].first);
  update(next_.bank);
}

void DramChannel::move_data(Cycle at) {
  Queue& queue = draining_ ? writes_ : reads_;
  const Entry entry = queue.entries[serves_];
  Bank& bank = banks_[entry.bank];
  next_.row = entry.row;
  next_.column = entry.column;
  const unsigned group = group_of(entry.bank);
  auto& same = draining_ ? next_write_ : next_read_;
  auto& turned = draining_ ? next_read_ : next_write_;
  const Cycle written = at + timing_.cwl + timing_.dqss + timing_.burst;  // the last of its data, at the latest
  for (unsigned other = 0; other < timing_.groups; ++other) {
    same[other] = std::max(same[other], at + (other == group ? timing_.ccd_l : timing_.ccd));
    const Cycle turn = draining_ ? written + (other == group ? timing_.wtr_l : timing_.wtr)
                                 : at + timing_.cl + timing_.burst + timing_.rtw - timing_.cwl;
    turned[other] = std::max(turned[other], turn);
  }
  bank.next_precharge = std::max(bank.next_precharge, draining_ ? written + timing_.wr : at + timing_.rtp);
  ++(entry.cause == Cause::hit    ? statistics_.row_hits
     : entry.cause == Cause::miss ? statistics_.row_misses
                                  : statistics_.row_conflicts);
  if (data_ != nullptr) {
    const Cycle begin = at + (draining_ ? timing_.cwl : timing_.cl);
    data_->add(begin, begin + timing_.burst);
  }
  remove(queue, serves_);
  update(draining_ ? reads_ : writes_, entry.bank);
  if (draining_) {
    ++statistics_.writes;
    ++drained_;
  } else {
    ++statistics_.reads;
    ++read_;
    const Cycle done = at + timing_.cl + timing_.burst;
    statistics_.read_cycles.see(done - entry.arrived);
    completions_.push_in_order({done, entry.tag}, &Completion::at);
    if (entry.follower != none) {
      Entry& write = writes_.entries[entry.follower];
      List& held = held_[entry.bank];
      (write.previous == none ? held.first : writes_.entries[write.previous].next) = write.next;
      (write.next == none ? held.last : writes_.entries[write.next].previous) = write.previous;
      append(writes_, entry.follower);
    }
  }
  choose_mode();
}

void DramChannel::close_bank(Bank& bank, Cycle at, Cycle distance) {
  bank.open = false;
  bank.next_activate = std::max(bank.next_activate, at + distance);
  all_precharged_ = std::max(all_precharged_, at + distance);
}

void DramChannel::refresh(Cycle at) {
  refresh_gate_.enter();
  ++statistics_.refreshes;
  next_refresh_ += timing_.refi;
  for (unsigned bank = 0; bank < timing_.banks; ++bank) {
    banks_[bank].next_activate = at + timing_.rfc;
    update(bank);
  }
}

void DramChannel::close(Cycle end) {
  statistics_.channel_cycles += end;
  if (draining_) statistics_.drain_cycles += end - std::min(end, drains_since_);
}

}  // namespace vrpipe
