#include "l2/clocked_l2.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {

std::vector<WorkKind> kinds_of(const SectoredL2::Sizes& sizes) { return {{"banks", 0, 1.0 / sizes.banks, false}}; }

}  // namespace

/// A port of the crossbar.
class ClockedL2::Port final : public ClockedTarget {
 public:
  Port(unsigned index, ClockedL2& l2, unsigned bytes_per_cycle)
      : ClockedTarget("port_" + std::to_string(index), *l2.clock.domain),
        l2_(l2),
        index_(index),
        bytes_per_cycle_(bytes_per_cycle),
        free_(l2.sizes_.port_requests),
        responses_(bytes_per_cycle) {}

  /// Lets in what there is room for now, and what arrived before this cycle into the queues of the banks. Returns when it can
  /// let the next in.
  Cycle let_in(Cycle now) {
    if (held_back_ != nobody) let_in_held_back();
    for (; !arrived_.empty(); arrived_.pop()) {
      if (arrived_.front().at >= now) return arrived_.front().at + 1;
      l2_.queue(arrived_.front().request);
    }
    return never;
  }

  /// Whether the way in has room for another request in this cycle.
  bool can_send(Cycle now) const { return sent_ < (now + 1) * bytes_per_cycle_; }
  /// A bank takes one.
  void send(std::uint32_t bytes, Cycle now) {
    sent_ = std::max(sent_, now * bytes_per_cycle_) + bytes;
    bytes_in_ += bytes;
    // Seen from the units' next cycle on, so that it does not matter who ticks first.
    give_back();
    freed_in_ = l2_.clock.domain->now();
    ++freed_;
    if (held_back_ != nobody) l2_.clock.domain->wake(l2_.clock.unit, l2_.crossing_.cycle_of(now + 1));
  }
  /// When so many bytes that are there in a cycle have gone out.
  Cycle leave(Cycle from, std::uint32_t bytes, Cycle now) {
    bytes_out_ += bytes;
    return responses_.take(from, bytes, now);
  }
  std::uint64_t bytes_per_cycle() const { return bytes_per_cycle_; }
  /// Before a cycle.
  std::uint64_t bytes_in(Cycle end) const {
    const std::uint64_t at_end = end * bytes_per_cycle_;
    return bytes_in_ - std::min(bytes_in_, sent_ - std::min(sent_, at_end));
  }
  std::uint64_t bytes_out(Cycle end) const { return bytes_out_ - std::min(bytes_out_, responses_.reserved_from(end)); }

  using ClockedTarget::respond;

 private:
  struct Arrival {
    Cycle at;
    std::uint32_t request;
  };

  void give_back() {
    if (freed_in_ >= l2_.clock.domain->now()) return;
    free_ += std::exchange(freed_, 0);
  }
  [[gnu::always_inline]] void admit(std::uint32_t request) {
    --free_;
    const Request& admitted = l2_.requests_[request];
    l2_.cache_.prefetch(admitted.access.address);
    arrived_.push_in_order({admitted.arrival, request}, &Arrival::at);
    const Cycle next = l2_.clock.domain->now() + 1;
    l2_.clock.domain->wake(l2_.clock.unit, std::max(l2_.crossing_.cycle_of(admitted.arrival + 1), next));
  }
  [[gnu::noinline]] void let_in_held_back() {
    give_back();
    if (free_ == 0) return;
    admit(std::exchange(held_back_, nobody));
    end_request();
  }
  bool take(const MemoryRequest& request, const Asker& asker, Cycle arrival) override {
    const std::uint32_t made = l2_.make_request();
    Request& taken = l2_.requests_[made];
    taken = Request();
    // One by one: all at once they would wait for the stores that have just made them.
    taken.access.address = l2_.behaviour_->looked_up_at(request);
    taken.access.bytes = request.bytes;
    taken.access.command = request.command;
    taken.access.origin = request.origin;
    taken.asker = asker;
    taken.arrival = l2_.crossing_.edge_of(arrival);
    taken.port = index_;
    give_back();
    if (free_ > 0) {
      admit(made);
      return true;
    }
    held_back_ = made;
    if (freed_ > 0) l2_.clock.domain->wake(l2_.clock.unit, l2_.clock.domain->now() + 1);
    return false;
  }

  ClockedL2& l2_;
  const std::uint32_t index_;
  const std::uint64_t bytes_per_cycle_;
  std::uint32_t free_;  ///< places for requests
  std::uint32_t freed_ = 0;
  Cycle freed_in_ = 0;                ///< of the units
  std::uint32_t held_back_ = nobody;  ///< the request that has not ended yet
  Ring<Arrival> arrived_;
  std::uint64_t sent_ = 0;  ///< to the banks; the way in is taken up to this byte, bytes_per_cycle_ for each cycle
  std::uint64_t bytes_in_ = 0;
  BandwidthReservation responses_;
  std::uint64_t bytes_out_ = 0;
};

ClockedL2::ClockedL2(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<SectoredL2> behaviour,
                     const std::vector<unsigned>& ports)
    : sc_module(name),
      PortOwner({&domain, domain.attach(*this)}),
      behaviour_(std::move(behaviour)),
      crossing_(domain, behaviour_->clock().period_ps()),
      sizes_(behaviour_->sizes()),
      cache_(behaviour_->cache()),
      occupancy_(domain.frame_end(), kinds_of(sizes_)),
      memory_(*this, "below", std::numeric_limits<unsigned>::max()),
      banks_(sizes_.banks),
      queues_(sizes_.banks * ports.size()),
      waiting_(cache_.organization().lines(), nobody) {
  for (const unsigned bytes : ports) {
    ports_.push_back(std::make_unique<Port>(static_cast<unsigned>(ports_.size()), *this, bytes));
  }
}

ClockedL2::~ClockedL2() = default;

tlm::tlm_base_target_socket_b<32>& ClockedL2::target(unsigned index) { return ports_.at(index)->socket; }

inline void ClockedL2::queue(std::uint32_t request) {
  const MemoryRequest& access = requests_[request].access;
  behaviour_->count(access);
  if (!behaviour_->is_in_one_line(access)) return queue_by_line(request);
  queue_at_bank(request);
}

inline void ClockedL2::queue_at_bank(std::uint32_t request) {
  const std::uint32_t bank = behaviour_->bank_of(requests_[request].access.address);
  queue_of(bank, requests_[request].port).push(request, requests_);
  ++banks_[bank].queued;
  banks_with_requests_ |= std::uint64_t{1} << bank;
}

void ClockedL2::queue_by_line(std::uint32_t request) {
  const MemoryRequest access = requests_[request].access;
  behaviour_->for_each_line(access.address, access.bytes, [&](std::uint64_t address, std::uint32_t bytes) {
    const std::uint32_t part = make_request();
    requests_[part] = requests_[request];
    requests_[part].access = {address, bytes, access.command, access.origin};
    requests_[part].whole = request;
    ++requests_[request].parts;
    queue_at_bank(part);
  });
}

Cycle ClockedL2::tick(Cycle cycle) {
  const Cycle now = crossing_.over_by(cycle);
  if (crossing_.cycle_of(now) != cycle) return crossing_.cycle_of(now + 1);
  // A cycle of the units that has an edge may begin after it, and so what comes from below then.
  if (const Cycle after = crossing_.after(now); memory_.next_completion() < after) finish_fills(now, after);
  Cycle next = never;
  for (const auto& port : ports_) next = std::min(next, port->let_in(now));
  if (banks_with_requests_ != 0) next = std::min(next, take_requests(now));
  if (!(reads_.empty() && writes_.empty())) next = std::min(next, ask_below());
  if (next != never) next = crossing_.cycle_of(std::max(next, now + 1));
  return std::max(std::min(next, memory_.next_completion()), cycle + 1);
}

[[gnu::always_inline]] inline void ClockedL2::occupy(std::uint32_t bank, std::uint32_t cycles, Cycle now) {
  const Cycle from = std::max(banks_[bank].free_at, now);
  banks_[bank].free_at = from + cycles;
  occupancy_.add(0, cycles, crossing_.cycle_of(from), crossing_.cycle_of(from + cycles));
}

[[gnu::always_inline]] inline void ClockedL2::respond(std::uint32_t request, std::uint32_t cycles, Cycle from,
                                                      Cycle now) {
  const Request& done = requests_[request];
  behaviour_->served(done.access);
  Port& port = *ports_[done.port];
  const Cycle left = port.leave(from, behaviour_->response_bytes(done.access), now);
  const Cycle at = sizes_.latency_cycles + std::max(left, from + cycles);
  free_requests_.push_back(request);
  if (done.whole != nobody) return respond_in_part(done.whole, at);
  port.respond(done.asker, crossing_.cycle_of(at), clock.domain->now());
}

void ClockedL2::respond(std::uint32_t request, Cycle from, Cycle now) {
  respond(request, behaviour_->bank_cycles(requests_[request].access.bytes), from, now);
}

void ClockedL2::finish_fills(Cycle now, Cycle after) {
  std::uint32_t tag = 0;
  while (memory_.next_completion() < after && memory_.next_completed(tag)) {
    const Below done = asked_[tag];
    free_tags_.push_back(tag);
    if (is_write(done.access)) {
      if (done.request != nobody) respond(done.request, now, now);
      continue;
    }
    cache_.finish_fill(done.line, done.sectors);
    behaviour_->statistics().see_fill(done.sectors, now - done.since);
    occupy(done.bank, behaviour_->bank_cycles(done.access.bytes), now);
    cache_.unpin(done.line);
    banks_[done.bank].stuck = false;
    std::uint32_t* link = &waiting_[done.line];
    while (*link != nobody) {
      const std::uint32_t waiter = *link;
      Request& request = requests_[waiter];
      request.waits_for &= ~done.sectors;
      if (request.waits_for != 0) {
        link = &request.next;
        continue;
      }
      *link = request.next;
      --banks_[done.bank].mshrs;
      cache_.unpin(done.line);
      respond(waiter, now, now);
      link = &waiting_[done.line];  // the requests may have moved
    }
  }
}

[[gnu::always_inline]] inline void ClockedL2::hit(std::uint32_t index, std::uint32_t request, SectoredCache::Line line,
                                                  std::uint32_t sectors, Cycle now) {
  const MemoryRequest& access = requests_[request].access;
  const bool writes = is_write(access);
  cache_.touch(line);
  if (writes) cache_.make_dirty(line, sectors);
  cache_.looked_up(line, behaviour_->first_of(access), access.bytes, writes);
  const auto needed = static_cast<unsigned>(__builtin_popcount(sectors));
  behaviour_->looked_up(access, needed, 0);
  cache_.hit(needed);
  const std::uint32_t cycles = behaviour_->bank_cycles(access.bytes);
  occupy(index, cycles, now);
  respond(request, cycles, now - 1, now);
}

inline std::uint32_t ClockedL2::choose(std::uint32_t index, Cycle now) const {
  const Queue* const queues = &queues_[index * ports_.size()];
  const auto ports = static_cast<std::uint32_t>(ports_.size());
  std::uint32_t chosen = nobody;
  std::uint32_t port = banks_[index].turn;
  for (std::uint32_t left = ports; left > 0; --left, port = port + 1 == ports ? 0 : port + 1) {
    if (queues[port].first == nobody || !ports_[port]->can_send(now)) continue;
    if (!sizes_.oldest_first) return port;
    if (chosen == nobody || requests_[queues[port].first].arrival < requests_[queues[chosen].first].arrival)
      chosen = port;
  }
  return chosen;
}

[[gnu::always_inline]] inline bool ClockedL2::take_one(std::uint32_t index, Cycle now) {
  const std::uint32_t port = choose(index, now);
  if (port == nobody) return false;
  Bank& bank = banks_[index];
  Queue& queue = queue_of(index, port);
  const std::uint32_t request = queue.first;
  const MemoryRequest& access = requests_[request].access;
  const bool passes = behaviour_->passes(access);
  const SectoredCache::Line line = passes ? SectoredCache::no_line : cache_.find(access.address);
  const std::uint32_t sectors = behaviour_->sectors_of(access);
  const bool hits = line != SectoredCache::no_line && (sectors & ~cache_.settled(line)) == 0;
  if (!hits && !(passes ? bank.write_backs < sizes_.write_backs : can_go_on(index, access, line))) {
    bank.stuck = true;
    ++bank_stalls_;
    return false;
  }
  queue.pop(requests_);
  bank.turn = port + 1 == ports_.size() ? 0 : port + 1;
  ports_[port]->send(behaviour_->request_bytes(access), now);
  queue_cycles_.see(now - 1 - requests_[request].arrival);
  if (hits) {
    hit(index, request, line, sectors, now);
  } else if (passes) {
    pass(index, request, now);
  } else {
    look_up(index, request, line, now);
  }
  return true;
}

Cycle ClockedL2::take_requests(Cycle now) {
  Cycle next = never;
  std::uint32_t waits = nobody;
  const std::uint64_t behind = banks_with_requests_ >> first_bank_ << first_bank_;
  for (std::uint64_t half : {behind, banks_with_requests_ ^ behind}) {
    for (; half != 0; half &= half - 1) {
      const auto index = static_cast<std::uint32_t>(__builtin_ctzll(half));
      Bank& bank = banks_[index];
      if (bank.stuck) continue;
      if (bank.free_at <= now) {
        const bool took = take_one(index, now);
        if (bank.stuck) continue;
        if (took && --bank.queued == 0) {
          banks_with_requests_ &= ~(std::uint64_t{1} << index);
          continue;
        }
        if (!took && waits == nobody) waits = index;
      }
      next = std::min(next, bank.free_at);
    }
  }
  if (waits != nobody) first_bank_ = waits;
  return next;
}

bool ClockedL2::can_go_on(std::uint32_t index, const MemoryRequest& access, SectoredCache::Line line) const {
  const Bank& bank = banks_[index];
  if (line == SectoredCache::no_line)
    return bank.mshrs < sizes_.mshrs && bank.write_backs < sizes_.write_backs && cache_.can_allocate(access.address);
  return bank.mshrs < sizes_.mshrs || (~cache_.present(line) & behaviour_->sectors_of(access)) == 0;
}

void ClockedL2::pass(std::uint32_t index, std::uint32_t request, Cycle now) {
  const MemoryRequest& access = requests_[request].access;
  writes_.push({behaviour_->below_as(access), index, SectoredCache::no_line, 0, now, request});
  ++banks_[index].write_backs;
  occupy(index, behaviour_->bank_cycles(access.bytes), now);
}

void ClockedL2::look_up(std::uint32_t index, std::uint32_t request, SectoredCache::Line line, Cycle now) {
  Bank& bank = banks_[index];
  const MemoryRequest access = requests_[request].access;
  const bool writes = is_write(access);
  const std::uint32_t first = behaviour_->first_of(access);
  const std::uint64_t line_address = access.address - first;
  const std::uint32_t sectors = behaviour_->sectors_of(access);
  std::uint64_t moved = access.bytes;
  if (line == SectoredCache::no_line) {
    SectoredCache::Evicted evicted;
    line = cache_.allocate(access.address, evicted);
    behaviour_->for_each_run(evicted.address, evicted.dirty, tlm::TLM_WRITE_COMMAND, behaviour_->origin(line),
                             [&](const MemoryRequest& write, const SectorRun&) {
                               writes_.push({write, index, line, 0, now, nobody});
                               ++bank.write_backs;
                               moved += write.bytes;
                             });
    behaviour_->allocated(line, access.origin, evicted.spared);
  }
  cache_.pin(line);
  const std::uint32_t missing =
      writes ? cache_.write(line, first, access.bytes) : cache_.read(line, first, access.bytes);
  cache_.start_fill(line, missing);
  behaviour_->for_each_run(line_address, missing, tlm::TLM_READ_COMMAND, access.origin,
                           [&](const MemoryRequest& read, const SectorRun& run) {
                             reads_.push({read, index, line, sector_mask(run.first, run.count), now, nobody});
                             cache_.pin(line);
                           });
  cache_.looked_up(line, first, access.bytes, writes);
  const auto needed = static_cast<unsigned>(__builtin_popcount(sectors));
  behaviour_->looked_up(access, needed, cache_.missed());
  cache_.accessed(1, needed);
  occupy(index, behaviour_->bank_cycles(moved), now);
  Request& taken = requests_[request];
  taken.waits_for = cache_.filling(line) & sectors;
  if (taken.waits_for == 0) {
    cache_.unpin(line);
    return respond(request, now - 1, now);
  }
  mshrs_used_.see(bank.mshrs++);
  std::uint32_t* last = &waiting_[line];
  while (*last != nobody) last = &requests_[*last].next;
  *last = request;
}

Cycle ClockedL2::ask_below() {
  Cycle next = never;
  // Of what is written through who reads it asks later.
  const bool in_order = behaviour_->writes_through();
  const std::size_t many = std::size_t{3} * sizes_.banks * sizes_.write_backs / 4;
  while (memory_.available() && !(reads_.empty() && writes_.empty())) {
    const bool reads =
        !reads_.empty() &&
        (writes_.empty() || (in_order ? reads_.front().since < writes_.front().since : writes_.size() < many));
    Ring<Below>& from = reads ? reads_ : writes_;
    if (free_tags_.empty()) {
      free_tags_.push_back(static_cast<std::uint32_t>(asked_.size()));
      asked_.emplace_back();
    }
    const std::uint32_t tag = free_tags_.back();
    free_tags_.pop_back();
    const Below below = from.front();
    from.pop();
    asked_[tag] = below;
    if (is_write(below.access)) {
      Bank& bank = banks_[below.bank];
      --bank.write_backs;
      bank.stuck = false;
      if (bank.queued > 0) next = std::min(next, bank.free_at);
    }
    memory_.access(below.access, tag);
  }
  return next;
}
void ClockedL2::respond_in_part(std::uint32_t request, Cycle at) {
  Request& whole = requests_[request];
  whole.answered = std::max(whole.answered, at);
  if (--whole.parts > 0) return;
  free_requests_.push_back(request);
  ports_[whole.port]->respond(whole.asker, crossing_.cycle_of(whole.answered), clock.domain->now());
}

std::vector<OccupancyPart> ClockedL2::parts(Cycle end) const {
  std::uint64_t in = 0;
  std::uint64_t out = 0;
  double width = 0;
  for (const auto& port : ports_) {
    width += static_cast<double>(port->bytes_per_cycle());
    in += port->bytes_in(crossing_.over_by(end));
    out += port->bytes_out(crossing_.over_by(end));
  }
  std::vector<OccupancyPart> parts = {{"responses", 1, static_cast<double>(out) / width, true},
                                      {"requests", 2, static_cast<double>(in) / width, false}};
  for (const OccupancyPart& banks : occupancy_.parts(end)) parts.push_back(banks);
  for (OccupancyPart& part : parts) part.cycles *= crossing_.ratio();
  return parts;
}

}  // namespace vrpipe
