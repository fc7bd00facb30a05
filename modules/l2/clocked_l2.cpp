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
class ClockedL2::Port final : public tlm::tlm_fw_transport_if<>, public ClockedMemory {
 public:
  Port(unsigned index, ClockedL2& l2, unsigned bytes_per_cycle)
      : socket(("port_" + std::to_string(index)).c_str()),
        l2_(l2),
        index_(index),
        bytes_per_cycle_(bytes_per_cycle),
        free_(l2.sizes_.port_requests),
        responses_(bytes_per_cycle) {
    socket.bind(*this);
  }
  tlm::tlm_target_socket<32, tlm::tlm_base_protocol_types, 1, sc_core::SC_ZERO_OR_MORE_BOUND> socket;

  /// Lets in what there is room for now, and what arrived before this cycle into the queues of the banks.
  void let_in(Cycle now) {
    give_back();
    if (held_back_ != nullptr && free_ > 0) {
      tlm::tlm_generic_payload& payload = *std::exchange(held_back_, nullptr);
      admit(payload, held_back_arrival_);
      tlm::tlm_phase phase = tlm::END_REQ;
      sc_core::sc_time delay = sc_core::SC_ZERO_TIME;
      socket->nb_transport_bw(payload, phase, delay);
    }
    for (; !arrived_.empty() && arrived_.front().at < now; arrived_.pop()) l2_.queue(arrived_.front().request);
  }
  /// When it can let something in.
  Cycle next(Cycle now) const {
    if (held_back_ != nullptr && freed_ > 0) return now + 1;
    return arrived_.empty() ? never : arrived_.front().at + 1;
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

  void respond(tlm::tlm_generic_payload& payload, Cycle at) {
    answered_.push({&payload, l2_.crossing_.cycle_of(at)});
    send_responses();
  }

 private:
  struct Arrival {
    Cycle at;
    std::uint32_t request;
  };
  struct Response {
    tlm::tlm_generic_payload* payload;
    Cycle at;  ///< of the units
  };

  void give_back() {
    if (freed_in_ >= l2_.clock.domain->now()) return;
    free_ += std::exchange(freed_, 0);
  }
  void admit(tlm::tlm_generic_payload& payload, Cycle arrival) {
    --free_;
    const std::uint32_t request = l2_.make_request();
    Request& made = l2_.requests_[request];
    made.payload = &payload;
    made.access = l2_.behaviour_->looked_up_as(request_of(payload));
    made.arrival = arrival;
    made.port = index_;
    l2_.cache_.prefetch(made.access.address);
    arrived_.push_in_order({arrival, request}, &Arrival::at);
    const Cycle next = l2_.clock.domain->now() + 1;
    l2_.clock.domain->wake(l2_.clock.unit, std::max(l2_.crossing_.cycle_of(arrival + 1), next));
  }
  void send_responses() {
    const Cycle now = l2_.clock.domain->now();
    while (!answered_.empty() && !responding_) {
      const Response response = answered_.front();
      answered_.pop();
      const Cycle ahead = std::max(response.at, now + 1) - now;
      auto delay = sc_core::sc_time::from_value(ahead * l2_.clock.domain->period().value());
      tlm::tlm_phase phase = tlm::BEGIN_RESP;
      response.payload->set_response_status(tlm::TLM_OK_RESPONSE);
      responding_ = true;  // until the initiator says otherwise, perhaps from within the call
      if (socket->nb_transport_bw(*response.payload, phase, delay) != tlm::TLM_ACCEPTED) responding_ = false;
      response.payload->release();
    }
  }

  const ClockDomain& clock() const override { return *l2_.clock.domain; }

  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    if (phase == tlm::BEGIN_REQ) {
      const Cycle now = l2_.clock.domain->now();
      const Cycle arrival = l2_.crossing_.edge_of(now + l2_.clock.domain->whole_cycles(delay));
      payload.acquire();
      give_back();
      if (free_ == 0) {
        held_back_ = &payload;
        held_back_arrival_ = arrival;
        if (freed_ > 0) l2_.clock.domain->wake(l2_.clock.unit, now + 1);
        return tlm::TLM_ACCEPTED;
      }
      admit(payload, arrival);
      phase = tlm::END_REQ;
      return tlm::TLM_UPDATED;
    }
    if (phase != tlm::END_RESP) return tlm::TLM_ACCEPTED;  // ignorable ones of the initiator's
    responding_ = false;
    send_responses();
    return tlm::TLM_COMPLETED;
  }
  void b_transport(tlm::tlm_generic_payload&, sc_core::sc_time&) override {
    throw SimulationFault(socket.name(), l2_.clock.domain->now(),
                          "b_transport at cycle, where it may wait for the memory below");
  }
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  ClockedL2& l2_;
  const std::uint32_t index_;
  const std::uint64_t bytes_per_cycle_;
  std::uint32_t free_;  ///< places for requests
  std::uint32_t freed_ = 0;
  Cycle freed_in_ = 0;                             ///< of the units
  tlm::tlm_generic_payload* held_back_ = nullptr;  ///< BEGIN_REQ without END_REQ yet
  Cycle held_back_arrival_ = 0;
  Ring<Arrival> arrived_;
  std::uint64_t sent_ = 0;  ///< to the banks; the way in is taken up to this byte, bytes_per_cycle_ for each cycle
  std::uint64_t bytes_in_ = 0;
  BandwidthReservation responses_;
  std::uint64_t bytes_out_ = 0;
  Ring<Response> answered_;  ///< not sent yet
  bool responding_ = false;  ///< BEGIN_RESP without END_RESP yet
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

std::uint32_t ClockedL2::make_request() {
  if (free_requests_.empty()) {
    free_requests_.push_back(static_cast<std::uint32_t>(requests_.size()));
    requests_.emplace_back();
  }
  const std::uint32_t made = free_requests_.back();
  free_requests_.pop_back();
  requests_[made] = {};
  return made;
}

void ClockedL2::queue(std::uint32_t request) {
  const MemoryRequest access = requests_[request].access;
  behaviour_->count(access);
  cache_.prefetch_line(access.address);
  const auto add = [&](std::uint32_t part) {
    const std::uint32_t bank = behaviour_->bank_of(requests_[part].access.address);
    queue_of(bank, requests_[part].port).push(part);
    ++banks_[bank].queued;
    banks_with_requests_ |= std::uint64_t{1} << bank;
  };
  if (behaviour_->is_in_one_line(access)) return add(request);
  behaviour_->for_each_line(access, [&](std::uint64_t address, std::uint32_t bytes) {
    const std::uint32_t part = make_request();
    Request& made = requests_[part];
    made.access = {address, bytes, access.command, access.origin};
    made.arrival = requests_[request].arrival;
    made.port = requests_[request].port;
    made.whole = request;
    ++requests_[request].parts;
    add(part);
  });
}

Cycle ClockedL2::tick(Cycle cycle) {
  const Cycle now = crossing_.over_by(cycle);
  if (crossing_.cycle_of(now) != cycle) return crossing_.cycle_of(now + 1);
  finish_fills(now);
  for (const auto& port : ports_) port->let_in(now);
  take_requests(now);
  ask_below();
  Cycle next = never;
  for (const auto& port : ports_) next = std::min(next, port->next(now));
  for (std::uint64_t left = banks_with_requests_; left != 0; left &= left - 1) {
    const Bank& bank = banks_[static_cast<unsigned>(__builtin_ctzll(left))];
    if (!bank.stuck) next = std::min(next, std::max(bank.free_at, now + 1));
  }
  if (!(reads_.empty() && writes_.empty()) && memory_.available()) next = now + 1;
  if (next != never) next = crossing_.cycle_of(std::max(next, now + 1));
  return std::max(std::min(next, memory_.next_completion()), cycle + 1);
}

void ClockedL2::occupy(std::uint32_t bank, std::uint64_t bytes, Cycle now) {
  const std::uint32_t cycles = behaviour_->bank_cycles(bytes);
  const Cycle from = std::max(banks_[bank].free_at, now);
  banks_[bank].free_at = from + cycles;
  occupancy_.add(0, cycles, crossing_.cycle_of(from), crossing_.cycle_of(from + cycles));
  behaviour_->count_bank(bank, bytes);
}

void ClockedL2::finish_fills(Cycle now) {
  // A cycle of the units that has an edge may begin after it, and so what comes from below then.
  const Cycle after = crossing_.after(now);
  std::uint32_t tag = 0;
  while (memory_.next_completion() < after && memory_.next_completed(tag)) {
    const Below done = asked_[tag];
    free_tags_.push_back(tag);
    if (done.access.command == tlm::TLM_WRITE_COMMAND) {
      if (done.request != nobody) respond(done.request, now);
      continue;
    }
    for (std::uint32_t left = done.sectors; left != 0; left &= left - 1) {
      behaviour_->statistics().fill_cycles.see(now - done.since);
      cache_.finish_fill(done.line, static_cast<unsigned>(__builtin_ctz(left)));
    }
    occupy(done.bank, done.access.bytes, now);
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
      respond(waiter, now);
      link = &waiting_[done.line];  // the requests may have moved
    }
  }
}

void ClockedL2::take_requests(Cycle now) {
  // No bank is always the first to use a port's way in.
  const auto first = static_cast<unsigned>(now % 64);
  const std::uint64_t behind = banks_with_requests_ >> first << first;
  for (std::uint64_t half : {behind, banks_with_requests_ ^ behind}) {
    for (; half != 0; half &= half - 1) {
      const auto index = static_cast<std::uint32_t>(__builtin_ctzll(half));
      Bank& bank = banks_[index];
      if (bank.stuck || bank.free_at > now || !take_one(index, now)) continue;
      if (--bank.queued == 0) banks_with_requests_ &= ~(std::uint64_t{1} << index);
    }
  }
}

bool ClockedL2::take_one(std::uint32_t index, Cycle now) {
  Bank& bank = banks_[index];
  Ring<std::uint32_t>* const queues = &queue_of(index, 0);
  const auto ports = static_cast<std::uint32_t>(ports_.size());
  std::uint32_t chosen = nobody;
  for (std::uint32_t i = 0; i < ports; ++i) {
    const std::uint32_t port = bank.turn + i < ports ? bank.turn + i : bank.turn + i - ports;
    if (queues[port].empty() || !ports_[port]->can_send(now)) continue;
    if (chosen == nobody || requests_[queues[port].front()].arrival < requests_[queues[chosen].front()].arrival) {
      chosen = port;
    }
    if (!sizes_.oldest_first) break;
  }
  if (chosen == nobody) return false;
  const std::uint32_t request = queues[chosen].front();
  const MemoryRequest& access = requests_[request].access;
  const bool passes = behaviour_->passes(access);
  const SectoredCache::Line line = passes ? SectoredCache::no_line : cache_.find(access.address);
  if (passes ? bank.write_backs == sizes_.write_backs : !can_go_on(index, access, line)) {
    bank.stuck = true;
    ++bank_stalls_;
    return false;
  }
  queues[chosen].pop();
  bank.turn = chosen + 1 == ports ? 0 : chosen + 1;
  ports_[chosen]->send(behaviour_->request_bytes(access), now);
  queue_cycles_.see(now - 1 - requests_[request].arrival);
  if (passes) {
    pass(index, request, now);
  } else {
    look_up(index, request, line, now);
  }
  return true;
}

bool ClockedL2::can_go_on(std::uint32_t index, const MemoryRequest& access, SectoredCache::Line line) const {
  if (line == SectoredCache::no_line) {
    const Bank& bank = banks_[index];
    return bank.mshrs < sizes_.mshrs && bank.write_backs < sizes_.write_backs && cache_.can_allocate(access.address);
  }
  return banks_[index].mshrs < sizes_.mshrs || (~cache_.present(line) & behaviour_->sectors_of(access)) == 0;
}

void ClockedL2::pass(std::uint32_t index, std::uint32_t request, Cycle now) {
  const MemoryRequest& access = requests_[request].access;
  writes_.push({behaviour_->below_as(access), index, SectoredCache::no_line, 0, now, request});
  ++banks_[index].write_backs;
  occupy(index, access.bytes, now);
}

void ClockedL2::look_up(std::uint32_t index, std::uint32_t request, SectoredCache::Line line, Cycle now) {
  Bank& bank = banks_[index];
  const MemoryRequest access = requests_[request].access;
  const bool writes = access.command == tlm::TLM_WRITE_COMMAND;
  const CacheOrganization& organization = cache_.organization();
  const auto first = static_cast<unsigned>(access.address & (organization.line_bytes - 1));
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
  for (std::uint32_t left = missing; left != 0; left &= left - 1) {
    cache_.start_fill(line, static_cast<unsigned>(__builtin_ctz(left)));
  }
  behaviour_->for_each_run(line_address, missing, tlm::TLM_READ_COMMAND, access.origin,
                           [&](const MemoryRequest& read, const SectorRun& run) {
                             reads_.push({read, index, line, sector_mask(run.first, run.count), now, nobody});
                             cache_.pin(line);
                           });
  cache_.looked_up(line, first, access.bytes, writes);
  const auto needed = static_cast<unsigned>(__builtin_popcount(sectors));
  behaviour_->looked_up(access, needed, cache_.missed());
  cache_.accessed(1, needed);
  occupy(index, moved, now);
  Request& taken = requests_[request];
  taken.waits_for = cache_.filling(line) & sectors;
  if (taken.waits_for == 0) {
    cache_.unpin(line);
    return respond(request, now - 1);
  }
  mshrs_used_.see(bank.mshrs++);
  std::uint32_t* last = &waiting_[line];
  while (*last != nobody) last = &requests_[*last].next;
  *last = request;
}

void ClockedL2::ask_below() {
  // What is written through goes first: who reads it asks for it later.
  const std::size_t many = behaviour_->writes_through() ? 0 : std::size_t{3} * sizes_.banks * sizes_.write_backs / 4;
  while (memory_.available() && !(reads_.empty() && writes_.empty())) {
    Ring<Below>& from = !reads_.empty() && writes_.size() < many ? reads_ : writes_.empty() ? reads_ : writes_;
    if (free_tags_.empty()) {
      free_tags_.push_back(static_cast<std::uint32_t>(asked_.size()));
      asked_.emplace_back();
    }
    const std::uint32_t tag = free_tags_.back();
    free_tags_.pop_back();
    const Below below = from.front();
    from.pop();
    asked_[tag] = below;
    if (below.access.command == tlm::TLM_WRITE_COMMAND) {
      --banks_[below.bank].write_backs;
      banks_[below.bank].stuck = false;
    }
    memory_.access(below.access, tag);
  }
}

void ClockedL2::respond(std::uint32_t request, Cycle from) {
  const Request& done = requests_[request];
  const Cycle now = crossing_.over_by(clock.domain->now());
  behaviour_->served(done.access);
  const Cycle left = ports_[done.port]->leave(from, behaviour_->response_bytes(done.access), now);
  answer(request, sizes_.latency_cycles + std::max(left, from + behaviour_->bank_cycles(done.access.bytes)));
}

void ClockedL2::answer(std::uint32_t request, Cycle at) {
  Request& done = requests_[request];
  free_requests_.push_back(request);
  if (done.whole == nobody) return ports_[done.port]->respond(*done.payload, at);
  Request& whole = requests_[done.whole];
  whole.answered = std::max(whole.answered, at);
  if (--whole.parts > 0) return;
  free_requests_.push_back(done.whole);
  ports_[whole.port]->respond(*whole.payload, whole.answered);
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
