#include "dram/annotated_channel.h"

#include <algorithm>
#include <utility>

namespace vrpipe {

namespace {

/// Parts of a cycle in which the bus, and activates, are reserved.
constexpr unsigned bus_parts = 16;
constexpr std::uint64_t no_row = ~std::uint64_t{0};  ///< and no burst

Cycle beyond(Cycle cycles, Cycle hidden) { return bus_parts * (cycles - std::min(cycles, hidden)); }

}  // namespace

AnnotatedChannel::AnnotatedChannel(const DramTiming& timing, DramStatistics& statistics, EffectGate refresh)
    : timing_(timing),
      statistics_(statistics),
      refresh_gate_(std::move(refresh)),
      refreshes_(timing.refresh && !refresh_gate_.is_silenced()),
      refresh_cycles_(refreshes_ ? timing.rp_all + timing.rfc : 0),
      read_row_cycle_(std::max(timing.rc, timing.ras + timing.rp + timing.activate - 1)),
      write_row_cycle_(std::max(read_row_cycle_, timing.activate - 1 + timing.rcd + timing.cwl + timing.dqss +
                                                     timing.burst + timing.wr + timing.rp)),
      activate_overhead_(beyond(timing.activate + 1, timing.burst)),
      turn_overhead_(bus_parts * (timing.rtw + timing.dqss + timing.wtr + timing.cl) /
                     (timing.write_high - timing.write_low)),
      drain_overhead_(beyond(timing.rp + timing.rcd, timing.cl + timing.burst + timing.rtw - timing.cwl)),
      return_overhead_(beyond(timing.wr + timing.rp + timing.rcd, timing.wtr)),
      bus_(bus_parts),
      activates_(bus_parts),
      groups_(timing.groups, BandwidthReservation(1)),
      banks_(timing.banks, Bank(1)),
      read_places_(timing.read_queue),
      write_places_(timing.write_queue),
      queued_(timing.write_low, no_row),
      queued_places_(timing.write_low),
      batch_(timing.write_high - timing.write_low) {}

Cycle AnnotatedChannel::working(Cycle cycle) const {
  const std::uint64_t refreshes = refreshes_before(cycle);
  if (refreshes == 0) return cycle;
  return cycle - (refreshes - 1) * refresh_cycles_ - std::min(cycle - refreshes * timing_.refi, refresh_cycles_);
}

Cycle AnnotatedChannel::real(Cycle working) const {
  if (!refreshes_ || working < timing_.refi) return working;
  const Cycle between = timing_.refi - refresh_cycles_;
  const Cycle rest = working - timing_.refi;
  return (rest / between + 1) * timing_.refi + refresh_cycles_ + rest % between;
}

AnnotatedChannel::Row& AnnotatedChannel::open_row(Bank& bank, std::uint64_t number, Cycle now, Cycle present,
                                                  std::uint64_t refreshes, bool writes) {
  Rows& rows = writes ? bank.written : bank.read;
  const std::uint64_t sequence = writes ? writes_ : reads_;
  Row& newest = rows.rows[rows.newest];
  for (Row& row : rows.rows) {
    if (row.row != number || row.refreshes != refreshes) continue;
    // Writes are served a drain at a time; reads in the order in which they come, but for those that still wait.
    const bool is_near = writes ? sequence - row.sequence <= batch_
                                : &row == &newest || (row.last > now && sequence - row.sequence <= timing_.read_queue);
    if (!is_near) continue;
    ++statistics_.row_hits;
    row.sequence = sequence;
    // Beyond those that fit into the time that a row is open anyway, bursts take the bank's.
    const Cycle in_time = (timing_.ras - timing_.rcd) / timing_.ccd;
    if (++bank.hits <= in_time) return row;
    const auto cycles = static_cast<unsigned>(timing_.ccd);
    row.ready = std::max(row.ready, bank.time.take(std::max(now, row.ready), cycles, present) - cycles);
    return row;
  }
  ++statistics_.activates;
  const bool is_open = newest.refreshes == refreshes && newest.row != no_row;
  const bool conflicts = is_open && !timing_.closes_rows;
  if (is_open) ++statistics_.precharges;
  ++(conflicts ? statistics_.row_conflicts : statistics_.row_misses);
  const auto row_cycle = static_cast<unsigned>(writes ? write_row_cycle_ : read_row_cycle_);
  const Cycle free = bank.time.take(now + (conflicts ? timing_.rp : 0), row_cycle, present) - row_cycle;
  const auto apart = static_cast<unsigned>(std::max(bus_parts * timing_.rrd, bus_parts * timing_.faw / 4));
  const Cycle activated = activates_.take(free, apart, present) - (apart + bus_parts - 1) / bus_parts;
  bank.hits = 0;
  rows.newest = (rows.newest + 1) % rows_kept;
  Row& opened = rows.rows[rows.newest];
  opened = {number, now, activated + timing_.activate - 1 + timing_.rcd, 0, sequence, refreshes};
  return opened;
}

Cycle AnnotatedChannel::move(const DramAddress& place, Row& row, Cycle now, Cycle latency, Cycle present,
                             Cycle overhead) {
  // Who opened the row may have run ahead of time: then it would have taken as long from here.
  Cycle column = now >= row.asked ? std::max(now, row.ready) : now + (row.ready - row.asked);
  if (timing_.groups > 1 || timing_.ccd_l > timing_.burst) {
    const auto apart = static_cast<unsigned>(timing_.ccd_l);
    column = groups_[place.bank & (timing_.groups - 1)].take(column, apart, present) - apart;
  }
  const auto taken = static_cast<unsigned>(bus_parts * timing_.burst + overhead);
  const Cycle there = bus_.take(column + latency, taken, present);
  row.last = std::max(row.last, there);
  if (data_ != nullptr) {
    const Cycle end = real(there);
    data_->add(end - timing_.burst, end);
  }
  return there;
}

Cycle AnnotatedChannel::read(const DramAddress& place, Cycle now, Cycle present) {
  if (is_queued(number_of(place))) {
    ++statistics_.reads_forwarded;
    statistics_.read_cycles.see(1);
    return now + 1;
  }
  ++statistics_.reads;
  ++reads_;
  reads_ago_ = 0;
  const Cycle from = working(now);
  present = working(present);
  const Cycle queued = read_places_.room(from);
  const std::uint64_t activates = statistics_.activates.value();
  Bank& bank = banks_[place.bank];
  bank.is_read = true;
  Row& row = open_row(bank, place.row, queued, present, refreshes_before(now), false);
  Cycle overhead = 0;
  if (statistics_.activates.value() > activates) {
    overhead = activate_overhead_;
    if (reads_return_ > 0 && --reads_return_ == 0) overhead += return_overhead_;
  } else {
    reads_return_ = 0;
  }
  const Cycle done = move(place, row, queued, timing_.cl, present, overhead);
  read_places_.push(from, done - timing_.cl - timing_.burst);
  const Cycle there = real(done);
  statistics_.read_cycles.see(there - now);
  return there;
}

Cycle AnnotatedChannel::write(const DramAddress& queued_now, Cycle now, Cycle present) {
  std::uint64_t burst = number_of(queued_now);
  if (is_queued(burst)) {
    ++statistics_.writes_merged;
    return now;
  }
  DramAddress place = queued_now;
  if (!queued_.empty()) {
    // It stays, and the oldest of those that stayed is written.
    std::swap(place, queued_places_[next_queued_]);
    std::swap(burst, queued_[next_queued_]);
    next_queued_ = next_queued_ + 1 < queued_.size() ? next_queued_ + 1 : 0;
    if (burst == no_row) return now;
  }
  ++statistics_.writes;
  ++writes_;
  const Cycle from = working(now);
  present = working(present);
  Bank& bank = banks_[place.bank];
  bank.is_written = true;
  const std::uint64_t activates = statistics_.activates.value();
  Row& row = open_row(bank, place.row, from, present, refreshes_before(now), true);
  const bool opens = statistics_.activates.value() > activates;
  Cycle overhead = opens ? activate_overhead_ : 0;
  if (reads_ago_ < 2 * batch_) {
    ++reads_ago_;
    overhead += turn_overhead_;
    if (opens && !drain_opens_) overhead += drain_overhead_;
    drain_opens_ = drain_opens_ || opens;
  }
  const Cycle done = move(place, row, from, timing_.cwl, present, overhead);
  if (++written_ >= batch_) drain();
  const Cycle queued = write_places_.room(from);
  write_places_.push(from, done - timing_.cwl - timing_.burst);
  return queued > from ? real(queued) : now;
}

void AnnotatedChannel::drain() {
  written_ = 0;
  drain_opens_ = false;
  reads_return_ = 2;
  for (Bank& bank : banks_) {
    // Of reads and writes in a bank each closes the rows of the other.
    if (bank.is_written) bank.read.rows[bank.read.newest].row = no_row;
    if (bank.is_read) {
      for (Row& row : bank.written.rows) row.row = no_row;
    }
    bank.is_read = bank.is_written = false;
  }
}

void AnnotatedChannel::close(Cycle end) {
  statistics_.channel_cycles += end;
  const std::uint64_t refreshes = refreshes_before(end);
  if (refreshes > 0) refresh_gate_.enter();
  statistics_.refreshes += refreshes;
}

}  // namespace vrpipe
