#include "dram/annotated_channel.h"

#include <algorithm>

namespace vrpipe {

namespace {

/// Parts of a cycle in which the bus, and activates, are reserved.
constexpr unsigned parts = 16;

}  // namespace

AnnotatedChannel::AnnotatedChannel(const DramTiming& timing, DramStatistics& statistics)
    : timing_(timing),
      statistics_(statistics),
      refresh_cycles_(timing.refresh ? timing.rp_all + timing.rfc : 0),
      bus_(parts),
      activates_(parts),
      groups_(timing.groups, BandwidthReservation(1)),
      banks_(timing.banks, Bank(1)),
      batch_(timing.write_high - timing.write_low) {}

Cycle AnnotatedChannel::working(Cycle cycle) const {
  const std::uint64_t refreshes = refreshes_before(cycle);
  if (refreshes == 0) return cycle;
  return cycle - (refreshes - 1) * refresh_cycles_ - std::min(cycle - refreshes * timing_.refi, refresh_cycles_);
}

Cycle AnnotatedChannel::real(Cycle working) const {
  if (!timing_.refresh || working < timing_.refi) return working;
  const Cycle between = timing_.refi - refresh_cycles_;
  const Cycle rest = working - timing_.refi;
  return (rest / between + 1) * timing_.refi + refresh_cycles_ + rest % between;
}

Cycle AnnotatedChannel::open_row(Bank& bank, const DramAddress& place, Cycle now, Cycle present,
                                 std::uint64_t refreshes, unsigned queue) {
  Row& newest = bank.rows[bank.newest];
  const bool is_open = newest.refreshes == refreshes && newest.row != ~std::uint64_t{0};
  for (Row& row : bank.rows) {
    if (row.row != place.row || row.refreshes != refreshes) continue;
    const bool waits = row.last > now && sequence_ - row.sequence <= queue;
    if (&row != &newest && !waits) continue;
    ++statistics_.row_hits;
    row.sequence = sequence_;
    // Hits beyond those that fit into the time that a row is open anyway.
    const Cycle in_time = (timing_.ras - timing_.rcd) / timing_.ccd;
    if (++bank.hits <= in_time) return now;
    const auto cycles = static_cast<unsigned>(timing_.ccd);
    return std::max(now, bank.time.take(now, cycles, present) - cycles);
  }
  ++statistics_.activates;
  const bool conflicts = is_open && !timing_.closes_rows;
  if (is_open) ++statistics_.precharges;
  ++(conflicts ? statistics_.row_conflicts : statistics_.row_misses);
  const auto row_cycle = static_cast<unsigned>(std::max(timing_.rc, timing_.ras + timing_.rp + timing_.activate - 1));
  const Cycle free = bank.time.take(now + (conflicts ? timing_.rp : 0), row_cycle, present) - row_cycle;
  const auto apart = static_cast<unsigned>(std::max(parts * timing_.rrd, parts * timing_.faw / 4));
  const Cycle activated = activates_.take(free, apart, present) - (apart + parts - 1) / parts;
  bank.newest = (bank.newest + 1) % rows_kept;
  bank.hits = 0;
  Row& opened = bank.rows[bank.newest];
  opened = {place.row, 0, sequence_, refreshes};
  return activated + timing_.activate - 1 + timing_.rcd;
}

Cycle AnnotatedChannel::move(Bank& bank, const DramAddress& place, Cycle column, Cycle latency, Cycle present,
                             Cycle overhead) {
  statistics_.data_cycles += timing_.burst;
  if (timing_.groups > 1 || timing_.ccd_l > timing_.burst) {
    const auto apart = static_cast<unsigned>(timing_.ccd_l);
    column = groups_[place.bank & (timing_.groups - 1)].take(column, apart, present) - apart;
  }
  const auto taken = static_cast<unsigned>(parts * timing_.burst + overhead);
  const Cycle there = bus_.take(column + latency, taken, present);
  for (Row& row : bank.rows) {
    if (row.row == place.row) row.last = std::max(row.last, there);
  }
  return there;
}

Cycle AnnotatedChannel::read(const DramAddress& place, Cycle now, Cycle present) {
  ++statistics_.reads;
  ++sequence_;
  reads_ago_ = 0;
  const Cycle from = working(now);
  present = working(present);
  Bank& bank = banks_[place.bank];
  const Cycle column = open_row(bank, place, from, present, refreshes_before(now), timing_.read_queue);
  const Cycle there = real(move(bank, place, column, timing_.cl, present, 0));
  statistics_.read_cycles.see(there - now);
  return there;
}

Cycle AnnotatedChannel::write(const DramAddress& place, Cycle now, Cycle present) {
  ++statistics_.writes;
  ++sequence_;
  const Cycle from = working(now);
  present = working(present);
  Bank& bank = banks_[place.bank];
  bank.is_written = true;
  const Cycle column = open_row(bank, place, from, present, refreshes_before(now), timing_.write_queue);
  Cycle overhead = 0;
  if (reads_ago_ < 2 * batch_) {
    ++reads_ago_;
    overhead = parts * (timing_.rtw + timing_.dqss + timing_.wtr + timing_.cl + timing_.rcd) / batch_;
  }
  const Cycle there = move(bank, place, column, timing_.cwl, present, overhead);
  if (++written_ >= batch_) drain();
  const Cycle queued = timing_.write_queue * timing_.burst;
  return real(std::max(from, there - std::min(there, queued)));
}

void AnnotatedChannel::drain() {
  written_ = 0;
  for (Bank& bank : banks_) {
    if (bank.is_written && reads_ago_ < 2 * batch_) bank.rows[bank.newest].row = ~std::uint64_t{0};
    bank.is_written = false;
  }
}

void AnnotatedChannel::close(Cycle end) {
  statistics_.channel_cycles += end;
  statistics_.refreshes += refreshes_before(end);
}

}  // namespace vrpipe
