#include "l2/annotated_l2.h"

#include <algorithm>

namespace vrpipe {

/// A port of the crossbar.
class AnnotatedL2::Port final : public tlm::tlm_fw_transport_if<>, public EarlyCompletionMemory {
 public:
  Port(unsigned index, AnnotatedL2& l2, unsigned bytes_per_cycle)
      : socket(("port_" + std::to_string(index)).c_str()),
        l2_(l2),
        index_(index),
        requests_(bytes_per_cycle),
        responses_(bytes_per_cycle) {
    socket.bind(*this);
  }
  tlm::tlm_target_socket<32, tlm::tlm_base_protocol_types, 1, sc_core::SC_ZERO_OR_MORE_BOUND> socket;

  std::uint64_t bytes_per_cycle() const { return requests_.bytes_per_cycle(); }
  /// Whether requests wait longer than so many cycles, on average.
  bool waits(Cycle cycles) const { return waited_ > lines_ * cycles; }
  std::uint64_t bytes_in(Cycle end) const { return bytes_in_ - std::min(bytes_in_, requests_.reserved_from(end)); }
  std::uint64_t bytes_out(Cycle end) const { return bytes_out_ - std::min(bytes_out_, responses_.reserved_from(end)); }

 private:
  Cycle serve(const MemoryRequest& request, Cycle arrival) override {
    const SectoredL2& l2 = *l2_.behaviour_;
    l2_.behaviour_->count(request);
    const Cycle now = l2_.now();
    arrival = l2_.crossing_.edge_of(arrival);
    Cycle complete = 0;
    l2.for_each_part(request, [&](const MemoryRequest& part) {
      complete = std::max(complete, serve_in_line(part, arrival, now));
    });
    return l2_.crossing_.cycle_of(l2_.sizes_.latency_cycles + complete);
  }
  Cycle serve_in_line(const MemoryRequest& request, Cycle arrival, Cycle now) {
    const SectoredL2& l2 = *l2_.behaviour_;
    const std::uint32_t in = l2.request_bytes(request);
    const std::uint32_t out = l2.response_bytes(request);
    bytes_in_ += in;
    bytes_out_ += out;
    // A request goes to its bank while its last bytes come in.
    const Cycle from = std::max(arrival, requests_.take(arrival, in, now) - 1);
    ++lines_;
    waited_ += from - arrival;
    const Served served = l2.passes(request) ? l2_.pass(request, index_, from) : l2_.look_up(request, index_, from);
    return std::max(responses_.take(served.from, out, now), served.there);
  }
  const ClockDomain& clock() const override { return *l2_.clock.domain; }

  // The delay that comes in says how far ahead of the clock the access is.
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    Cycle arrival = clock().now() + clock().whole_cycles(delay);
    if (const auto* const extension = payload.get_extension<MemoryRequestExtension>())
      arrival -= extension->late_cycles;
    const Cycle taken = serve(request_of(payload), arrival) - arrival;
    delay += sc_core::sc_time::from_value(taken * clock().period().value());
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
  }
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    if (phase == tlm::BEGIN_REQ) b_transport(payload, delay);
    return tlm::TLM_COMPLETED;
  }
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  AnnotatedL2& l2_;
  const unsigned index_;
  BandwidthReservation requests_;
  BandwidthReservation responses_;
  std::uint64_t lines_ = 0, waited_ = 0;
  std::uint64_t bytes_in_ = 0;
  std::uint64_t bytes_out_ = 0;
};

AnnotatedL2::AnnotatedL2(const sc_core::sc_module_name& name, ClockDomain& domain,
                         std::unique_ptr<SectoredL2> behaviour, const std::vector<unsigned>& ports)
    : sc_module(name),
      PortOwner({&domain, 0}),
      behaviour_(std::move(behaviour)),
      crossing_(domain, behaviour_->clock().period_ps()),
      sizes_(behaviour_->sizes()),
      takes_turns_(ports.size() > 1 && !sizes_.oldest_first),
      cache_(behaviour_->cache()),
      memory_(*this, "below"),
      banks_(sizes_.banks, Bank(sizes_, ports.size())),
      fills_(std::size_t{cache_.organization().lines()} * cache_.organization().sectors_of_a_line()),
      counted_fills_(behaviour_->statistics()) {
  for (const unsigned bytes : ports) {
    ports_.push_back(std::make_unique<Port>(static_cast<unsigned>(ports_.size()), *this, bytes));
  }
}

AnnotatedL2::~AnnotatedL2() = default;

tlm::tlm_base_target_socket_b<32>& AnnotatedL2::target(unsigned index) { return ports_.at(index)->socket; }

bool AnnotatedL2::awaits(const Fill* fills, std::uint32_t sectors, Cycle at) {
  for (std::uint32_t left = sectors; left != 0; left &= left - 1) {
    if (fills[__builtin_ctz(left)].there > at) return true;
  }
  return false;
}

Cycle AnnotatedL2::write(const MemoryRequest& access, Bank& bank, Cycle at) {
  const Cycle done = access_below(access, at);
  quickest_write_ = std::min(quickest_write_, done - at);
  bank.write_backs.take(at, at + (done - at - quickest_write_), now());
  return done;
}

std::uint64_t AnnotatedL2::write_back(const LineAccess& done, Bank& bank, Cycle at) {
  std::uint64_t moved = 0;
  behaviour_->for_each_run(done.old_address, done.written_back, tlm::TLM_WRITE_COMMAND, behaviour_->origin(done.line),
                           [&](const MemoryRequest& written, const SectorRun&) {
                             write(written, bank, at);
                             moved += written.bytes;
                           });
  return moved;
}

AnnotatedL2::Served AnnotatedL2::pass(const MemoryRequest& access, unsigned port, Cycle arrival) {
  Bank& bank = banks_[behaviour_->bank_of(access.address)];
  const Cycle begin = bank.write_backs.free_from(arrival);
  const Cycle done = write(behaviour_->below_as(access), bank, begin + 1);
  const std::uint32_t cycles = behaviour_->bank_cycles(access.bytes);
  const Cycle from = std::max(done, occupy(bank, port, arrival, begin, cycles) - cycles);
  return {from, from + cycles};
}

AnnotatedL2::Wait AnnotatedL2::fetch(const MemoryRequest& access, const LineAccess& done, Bank& bank, Cycle arrival) {
  const std::size_t sectors_of_a_line = cache_.organization().sectors_of_a_line();
  Fill* const fills = &fills_[done.line * sectors_of_a_line];
  // 0 before the first fill: till then `fills` are of what the line held before.
  std::uint64_t& last_there = cache_.note(done.line);
  Wait wait{arrival, 0, access.bytes};
  if (done.replaced) wait.begin = bank.write_backs.free_from(wait.begin);
  const bool waits = done.filled != 0 || (last_there > arrival && awaits(fills, done.sectors, arrival));
  if (waits) wait.begin = bank.mshrs.free_from(wait.begin);
  const Cycle asks = wait.begin + 1;
  if (done.replaced) {
    wait.moved += write_back(done, bank, asks);
    behaviour_->allocated(done.line, access.origin, done.spared);
  }
  if (done.filled != 0 && last_there == 0) std::fill_n(fills, sectors_of_a_line, Fill());
  behaviour_->for_each_run(done.address, done.filled, tlm::TLM_READ_COMMAND, access.origin,
                           [&](const MemoryRequest& read, const SectorRun& run) {
                             const Cycle there = access_below(read, asks);
                             std::fill_n(fills + run.first, run.count, Fill{asks, there});
                             counted_fills_.ask(run.count, asks, there);
                             ++reads_;
                             read_cycles_ += there - asks;
                             quickest_read_ = std::min(quickest_read_, std::max<Cycle>(there - asks, 1));
                             last_there = std::max(last_there, there);
                             wait.moved += read.bytes;
                           });
  wait.all_there = wait.begin;
  for (std::uint32_t left = done.sectors; waits && left != 0; left &= left - 1) {
    Fill& fill = fills[__builtin_ctz(left)];
    if (fill.there == 0) continue;
    // Who ran ahead of time has asked, but this access would have been the first: it takes as long from here.
    if (asks < fill.asked) fill = {asks, asks + (fill.there - fill.asked)};
    wait.all_there = std::max(wait.all_there, fill.there);
  }
  if (waits) bank.mshrs.take(wait.begin, wait.all_there, now());
  return wait;
}

AnnotatedL2::Served AnnotatedL2::look_up(const MemoryRequest& access, unsigned port, Cycle arrival) {
  const std::uint32_t cycles = behaviour_->bank_cycles(access.bytes);
  std::uint32_t sectors = 0;
  const SectoredCache::Line line = behaviour_->hit(access, sectors);
  if (line == SectoredCache::no_line) return wait(access, behaviour_->look_up(access), port, arrival, cycles);
  if (cache_.note(line) > arrival) {
    LineAccess hit;
    hit.line = line;
    hit.sectors = sectors;
    return wait(access, hit, port, arrival, cycles);
  }
  const Cycle done = occupy(banks_[behaviour_->bank_of_line(line)], port, arrival, arrival, cycles);
  return {done - cycles, done};
}

AnnotatedL2::Served AnnotatedL2::wait(const MemoryRequest& access, const LineAccess& done, unsigned port, Cycle arrival,
                                      std::uint32_t cycles) {
  Bank& bank = banks_[behaviour_->bank_of_line(done.line)];
  const Wait wait = fetch(access, done, bank, arrival);
  const std::uint32_t moving = behaviour_->bank_cycles(wait.moved);
  const Cycle from = std::max(wait.all_there, occupy(bank, port, arrival, wait.begin, moving) - moving);
  return {from, from + cycles};
}

MemoryUnit::Order AnnotatedL2::order(Cycle end, bool is_bottleneck) const {
  const auto waits = [this](Cycle cycles) {
    return std::any_of(ports_.begin(), ports_.end(), [cycles](const auto& port) { return port->waits(cycles); });
  };
  if (is_bottleneck) return waits(1) ? Order::matters : Order::does_not_matter;
  // Fetches, of which so many are under way on average.
  const auto are_under_way = [&](std::uint64_t fetches) { return read_cycles_ > fetches * crossing_.over_by(end); };
  if (are_under_way(40)) return Order::matters;
  constexpr std::uint64_t long_fetch = 8;  // in quickest ones
  const bool are_long = reads_ > 0 && read_cycles_ > long_fetch * reads_ * quickest_read_;
  return (are_long && are_under_way(10)) || waits(sizes_.latency_cycles / 2) ? Order::is_hidden_by_units
                                                                             : Order::does_not_matter;
}

std::vector<OccupancyPart> AnnotatedL2::parts(Cycle end) const {
  end = crossing_.over_by(end);
  const double ratio = crossing_.ratio();
  std::uint64_t in = 0;
  std::uint64_t out = 0;
  double width = 0;
  for (const auto& port : ports_) {
    width += static_cast<double>(port->bytes_per_cycle());
    in += port->bytes_in(end);
    out += port->bytes_out(end);
  }
  std::uint64_t cycles = 0;
  for (const Bank& bank : banks_) cycles += bank.cycles - std::min(bank.cycles, bank.time.reserved_from(end));
  return {{"responses", 1, static_cast<double>(out) / width * ratio, true},
          {"requests", 2, static_cast<double>(in) / width * ratio, false},
          {"banks", 0, static_cast<double>(cycles) / sizes_.banks * ratio, false}};
}

}  // namespace vrpipe
