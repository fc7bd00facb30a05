#include "memory/sector_fills.h"

#include <algorithm>
#include <limits>

namespace vrpipe {

namespace {

constexpr unsigned fill_bytes = FixedLatencyMemory::sector_bytes;

/// Calls a function with each sector of a request.
template <class Function>
void for_each_sector(const MemoryRequest& request, Function&& function) {
  const std::uint64_t last = (request.address + request.bytes - 1) / fill_bytes;
  for (std::uint64_t sector = request.address / fill_bytes; sector <= last; ++sector) function(sector);
}

bool writes_whole_sectors(const MemoryRequest& request) { return is_write(request) && request.bytes >= fill_bytes; }

MemoryRequest read_of(std::uint64_t sector, const MemoryOrigin& origin) {
  return {sector * fill_bytes, fill_bytes, tlm::TLM_READ_COMMAND, origin};
}

}  // namespace

AnnotatedFills::AnnotatedFills(ClockDomain& domain, CompulsoryMissStatistics& statistics)
    : PortOwner({&domain, 0}), memory_(*this, "below"), statistics_(statistics) {}

Cycle AnnotatedFills::filled(const MemoryRequest& request, Cycle arrival) {
  const bool writes = writes_whole_sectors(request);
  const Cycle asks = arrival + 1;
  Cycle all_there = arrival;
  for_each_sector(request, [&](std::uint64_t index) {
    const auto [place, is_new] = sectors_.try_emplace(index);
    Sector& sector = place->second;
    statistics_.count(!is_new);
    if (writes) {
      sector = {};
      return;
    }
    if (is_new) {
      statistics_.bytes_filled += fill_bytes;
      sector = {asks, memory_.access(read_of(index, request.origin), asks)};
    } else if (asks < sector.asked) {
      // Who ran ahead of time has asked, but this access would have been the first: it takes as long from here.
      sector = {asks, asks + (sector.there - sector.asked)};
    }
    all_there = std::max(all_there, sector.there);
  });
  return all_there;
}

ClockedFills::ClockedFills(ClockDomain& domain, CompulsoryMissStatistics& statistics)
    : PortOwner({&domain, domain.attach(*this)}),
      memory_(*this, "below", std::numeric_limits<unsigned>::max()),
      statistics_(statistics) {}

void ClockedFills::arrive(unsigned port, tlm::tlm_generic_payload& payload, const sc_core::sc_time& delay) {
  // Also from outside an edge, by what has time of its own.
  const Cycle arrival = clock.domain->edge_after(sc_core::SC_ZERO_TIME) - 1 + clock.domain->whole_cycles(delay);
  payload.acquire();
  arrived_.emplace(std::pair{arrival, port}, &payload);
  clock.domain->wake(clock.unit, arrival + 1);
}

Cycle ClockedFills::tick(Cycle now) {
  finish_fills(now);
  while (!arrived_.empty() && arrived_.begin()->first.first < now) {
    const auto [from, payload] = *arrived_.begin();
    arrived_.erase(arrived_.begin());
    look_up(from.second, *payload, from.first);
  }
  fetch();
  for (Port* port : ports_) port->respond();
  return std::min(memory_.next_completion(), arrived_.empty() ? never : arrived_.begin()->first.first + 1);
}

void ClockedFills::finish_fills(Cycle now) {
  std::uint32_t tag = 0;
  while (memory_.next_completed(tag)) {
    const std::uint64_t sector = sector_of_tag_[tag];
    free_tags_.push_back(tag);
    there_.insert(sector);
    const auto found = on_their_way_.find(sector);
    for (const WaitingPlace place : found->second) {
      if (--place->fills > 0) continue;
      ports_[place->port]->filled(*place->payload, now);
      waiting_.erase(place);
    }
    on_their_way_.erase(found);
  }
}

void ClockedFills::look_up(unsigned port, tlm::tlm_generic_payload& payload, Cycle arrival) {
  const MemoryRequest request = request_of(payload);
  const bool writes = writes_whole_sectors(request);
  const WaitingPlace waiting = waiting_.insert(waiting_.end(), {port, &payload, 0});
  for_each_sector(request, [&](std::uint64_t sector) {
    const bool is_there = there_.count(sector) > 0;
    const bool is_on_its_way = on_their_way_.count(sector) > 0;
    statistics_.count(is_there || is_on_its_way);
    if (writes) there_.insert(sector);
    if (writes || is_there) return;
    if (!is_on_its_way) {
      statistics_.bytes_filled += fill_bytes;
      fetches_.push({sector, request.origin});
    }
    on_their_way_[sector].push_back(waiting);
    ++waiting->fills;
  });
  if (waiting->fills > 0) return;
  waiting_.erase(waiting);
  ports_[port]->filled(payload, arrival);
}

void ClockedFills::fetch() {
  while (!fetches_.empty() && memory_.available()) {
    const Fetch next = fetches_.front();
    fetches_.pop();
    if (free_tags_.empty()) {
      free_tags_.push_back(static_cast<std::uint32_t>(sector_of_tag_.size()));
      sector_of_tag_.emplace_back();
    }
    const std::uint32_t tag = free_tags_.back();
    free_tags_.pop_back();
    sector_of_tag_[tag] = next.sector;
    memory_.access(read_of(next.sector, next.origin), tag);
  }
}

}  // namespace vrpipe
