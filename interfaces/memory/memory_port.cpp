#include <vrpipe/memory/memory_port.h>

#include <stdexcept>

#include "memory/sector_fills.h"

#include <vrpipe/component/error.h>

namespace vrpipe {

void fault_of_alignment(const sc_core::sc_object& port, Cycle now, std::uint64_t address, unsigned bytes) {
  throw SimulationFault(port.name(), now,
                        "an access of " + std::to_string(bytes) + " bytes at " + std::to_string(address) +
                            " is not naturally aligned");
}

void fault_of_response(const sc_core::sc_object& port, Cycle now, const tlm::tlm_generic_payload& access) {
  throw SimulationFault(port.name(), now, "the memory answered " + access.get_response_string());
}

namespace {

/// What a socket is bound to, if it works in the cycles of this clock; null otherwise.
ClockedMemory* memory_of_clock(tlm::tlm_initiator_socket<32>& socket, const ClockDomain& clock) {
  auto* const memory = dynamic_cast<ClockedMemory*>(socket.operator->());
  return memory != nullptr && &memory->clock() == &clock.global() ? memory : nullptr;
}

}  // namespace

EarlyCompletionMemory* early_completion_memory_of(tlm::tlm_initiator_socket<32>& socket, const ClockDomain& clock) {
  if (clock.passes_sockets()) return nullptr;
  auto* const memory = dynamic_cast<EarlyCompletionMemory*>(memory_of_clock(socket, clock));
  return memory != nullptr && memory->completes_early() ? memory : nullptr;
}

ClockedTarget* clocked_target_of(tlm::tlm_initiator_socket<32>& socket, const ClockDomain& clock) {
  if (clock.passes_sockets()) return nullptr;
  return dynamic_cast<ClockedTarget*>(memory_of_clock(socket, clock));
}

bool meets_own_time(tlm::tlm_initiator_socket<32>& socket, const ClockDomain& clock) {
  const ClockedMemory* const memory = memory_of_clock(socket, clock);
  return memory == nullptr || memory->has_own_time();
}

MemoryPort::MemoryPort(PortOwner& owner, const std::string& name, unsigned in_flight, MemoryOrigin origin)
    : socket(name.c_str()), clock_(owner.clock), origin_(origin), most_in_flight_(in_flight) {
  socket.bind(*this);
  clock_.domain->attach(*this);
}

MemoryPort::~MemoryPort() = default;

MemoryPort::Access* MemoryPort::unused_access() {
  if (free_accesses_.empty()) {
    Access& made = accesses_.emplace_back();
    made.set_mm(this);
    made.set_byte_enable_ptr(nullptr);
    made.set_dmi_allowed(false);
    made.extension = new MemoryRequestExtension;
    made.set_extension(made.extension);
    free_accesses_.push_back(&made);
  }
  Access* const access = free_accesses_.back();
  free_accesses_.pop_back();
  access->acquire();
  return access;
}

inline void MemoryPort::answer(Access& access, const sc_core::sc_time& delay) {
  check_response(socket, clock_.domain->now(), access);
  access.pending = false;
  clock_.domain->answered();
  complete(clock_.domain->edge_after(delay), access.tag);
}

void MemoryPort::send(const MemoryRequest& request, std::uint32_t tag) {
  if (next_access_ == nullptr) {
    next_access_ = unused_access();
    // From the second access on:
    memory_ = early_completion_memory_of(socket, *clock_.domain);
    target_ = clocked_target_of(socket, *clock_.domain);
  }
  Access& access = *next_access_;
  if (access.data.size() < request.bytes) access.data.resize(request.bytes);
  access.set_data_ptr(access.data.data());
  access.set_data_length(request.bytes);
  access.set_streaming_width(request.bytes);
  access.pending = true;
  access.since = clock_.domain->now();
  clock_.domain->await_answer();
  access.tag = tag;
  access.extension->origin = request.origin;
  access.set_command(request.command);
  access.set_address(request.address);
  access.set_response_status(tlm::TLM_INCOMPLETE_RESPONSE);

  tlm::tlm_phase phase = tlm::BEGIN_REQ;
  // Of a local clock the present is ahead of the kernel's: it is told as if the call were annotated with it.
  const sc_core::sc_time lead = sc_core::sc_time::from_value(clock_.domain->lead() * clock_.domain->period().value());
  sc_core::sc_time delay = lead;
  requesting_ = &access;  // until the memory says otherwise, perhaps from within the call
  requesting_until_ = never;
  const tlm::tlm_sync_enum status = socket->nb_transport_fw(access, phase, delay);
  if (status != tlm::TLM_ACCEPTED) requesting_ = nullptr;
  if (requesting_ == nullptr) requesting_until_ = 0;  // it ended from within the call
  if (status == tlm::TLM_COMPLETED || (status == tlm::TLM_UPDATED && phase == tlm::BEGIN_RESP)) {
    answer(access, delay - lead);
    if (status == tlm::TLM_UPDATED) {
      phase = tlm::END_RESP;
      socket->nb_transport_fw(access, phase, delay);
    }
    if (access.get_ref_count() == 1) {  // ours alone: it serves again
      access.reset();
      return;
    }
    access.release();
  }
  next_access_ = unused_access();
}

tlm::tlm_sync_enum MemoryPort::nb_transport_bw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                               sc_core::sc_time& delay) {
  auto& access = static_cast<Access&>(payload);
  if (phase != tlm::END_REQ && phase != tlm::BEGIN_RESP) return tlm::TLM_ACCEPTED;  // ignorable ones of the memory's
  if (requesting_ == &access) {                                                     // BEGIN_RESP implies END_REQ
    requesting_ = nullptr;
    end_request();
  }
  if (phase == tlm::END_REQ) return tlm::TLM_ACCEPTED;
  // The memory's own process has called: through the kernel what is thrown would come out as a report of the kernel's.
  try {
    if (!access.pending) throw SimulationFault(socket.name(), clock_.domain->now(), "a second response to a request");
    answer(access, delay);
  } catch (...) {
    clock_.domain->fail(std::current_exception());
    return tlm::TLM_COMPLETED;
  }
  // As legal as TLM_COMPLETED; but there are memories that wait for END_RESP after that.
  phase = tlm::END_RESP;
  access.release();
  return tlm::TLM_UPDATED;
}

void MemoryPort::free(tlm::tlm_generic_payload* payload) {
  payload->reset();  // of extensions that others have left
  free_accesses_.push_back(static_cast<Access*>(payload));
}

bool MemoryPort::meets_own_time() { return vrpipe::meets_own_time(socket, *clock_.domain); }

OutsidePort::Unanswered MemoryPort::oldest_unanswered() const {
  Unanswered oldest;
  for (const Access& access : accesses_) {
    if (!access.pending || access.since >= oldest.since) continue;
    oldest = {access.since, socket.name(),
              std::string(access.is_write() ? "the write" : "the read") + " of " +
                  std::to_string(access.get_data_length()) + " bytes at address " +
                  std::to_string(access.get_address()) + " in cycle " + std::to_string(access.since)};
  }
  return oldest;
}

class FixedLatencyMemory::MemoryTarget final : public tlm::tlm_fw_transport_if<>,
                                               public EarlyCompletionMemory,
                                               public ClockedFills::Port {
 public:
  MemoryTarget(unsigned index, FixedLatencyMemory& memory, unsigned bytes_per_cycle)
      : socket(("port_" + std::to_string(index)).c_str()), memory_(memory), index_(index), bandwidth_(bytes_per_cycle) {
    socket.bind(*this);
    if (memory_.clocked_ != nullptr) memory_.clocked_->attach(*this);
  }
  tlm::tlm_target_socket<32, tlm::tlm_base_protocol_types, 1, sc_core::SC_ZERO_OR_MORE_BOUND> socket;

  unsigned bytes_per_cycle() const { return bandwidth_.bytes_per_cycle(); }
  std::uint64_t bytes_before(Cycle end) const {
    return end == never ? bytes_ : bytes_ - std::min(bytes_, bandwidth_.reserved_from(memory_.crossing_.over_by(end)));
  }

 private:
  [[gnu::always_inline]] Cycle serve(const MemoryRequest& request, Cycle arrival) override {
    if (memory_.annotated_ != nullptr) arrival = memory_.annotated_->filled(request, arrival);
    memory_.traffic_.count(request);
    bytes_ += request.bytes;
    const ClockCrossing& own = memory_.crossing_;
    const Cycle latency = memory_.latency_.of(request);
    if (own.is_same()) return latency + bandwidth_.take(arrival, request.bytes, clock().now());
    const Cycle moved = bandwidth_.take(own.edge_of(arrival), request.bytes, own.edge_of(clock().now()));
    return own.cycle_of(latency + moved);
  }
  const ClockDomain& clock() const override { return memory_.domain_; }
  bool completes_early() const override { return memory_.clocked_ == nullptr; }

  // The delay that comes in says how far ahead of the clock the access is.
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    if (!completes_early()) {
      throw SimulationFault(socket.name(), clock().now(),
                            "b_transport at cycle, where it may wait for the memory below");
    }
    Cycle arrival = clock().now() + clock().whole_cycles(delay);
    if (const auto* const extension = payload.get_extension<MemoryRequestExtension>())
      arrival -= extension->late_cycles;
    const Cycle taken = serve(request_of(payload), arrival) - arrival;
    delay += sc_core::sc_time::from_value(taken * clock().period().value());
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
  }
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    if (!completes_early()) return take(payload, phase, delay);
    if (phase == tlm::BEGIN_REQ) b_transport(payload, delay);
    return tlm::TLM_COMPLETED;
  }
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  // With a memory below, at `cycle`.
  tlm::tlm_sync_enum take(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase, const sc_core::sc_time& delay) {
    if (phase == tlm::BEGIN_REQ) {
      memory_.clocked_->arrive(index_, payload, delay);
      phase = tlm::END_REQ;
      return tlm::TLM_UPDATED;
    }
    if (phase != tlm::END_RESP) return tlm::TLM_ACCEPTED;  // ignorable ones of the initiator's
    responding_ = false;
    memory_.clocked_->wake();
    return tlm::TLM_COMPLETED;
  }
  void filled(tlm::tlm_generic_payload& payload, Cycle from) override {
    responses_.push({&payload, serve(request_of(payload), from)});
  }
  void respond() override {
    while (!responses_.empty() && !responding_) {
      const Response response = responses_.front();
      responses_.pop();
      const Cycle ahead = std::max(response.at, clock().now() + 1) - clock().now();
      auto delay = sc_core::sc_time::from_value(ahead * clock().period().value());
      tlm::tlm_phase phase = tlm::BEGIN_RESP;
      response.payload->set_response_status(tlm::TLM_OK_RESPONSE);
      responding_ = true;  // until the initiator says otherwise, perhaps from within the call
      if (socket->nb_transport_bw(*response.payload, phase, delay) != tlm::TLM_ACCEPTED) responding_ = false;
      response.payload->release();
    }
  }

  struct Response {
    tlm::tlm_generic_payload* payload;
    Cycle at;
  };
  FixedLatencyMemory& memory_;
  const unsigned index_;
  BandwidthReservation bandwidth_;
  std::uint64_t bytes_ = 0;
  Ring<Response> responses_;  ///< not sent yet
  bool responding_ = false;   ///< BEGIN_RESP without END_RESP yet
};

FixedLatencyMemory::FixedLatencyMemory(const sc_core::sc_module_name& name, ClockDomain& domain, MemoryLatency latency,
                                       unsigned bytes_per_cycle, unsigned ports, MemoryBelow below)
    : FixedLatencyMemory(name, domain, latency, std::vector<unsigned>(ports, bytes_per_cycle), below) {}

FixedLatencyMemory::FixedLatencyMemory(const sc_core::sc_module_name& name, ClockDomain& domain, MemoryLatency latency,
                                       const std::vector<unsigned>& bytes_per_cycle, MemoryBelow below,
                                       std::uint64_t period_ps)
    : sc_module(name), domain_(domain), crossing_(domain, period_ps), latency_(latency), traffic_(*this) {
  if (below == MemoryBelow::annotated) annotated_ = std::make_unique<AnnotatedFills>(domain, cache_);
  if (below == MemoryBelow::clocked) clocked_ = std::make_unique<ClockedFills>(domain, cache_);
  for (const unsigned bytes : bytes_per_cycle) {
    ports_.push_back(std::make_unique<MemoryTarget>(static_cast<unsigned>(ports_.size()), *this, bytes));
  }
}

FixedLatencyMemory::~FixedLatencyMemory() = default;

tlm::tlm_initiator_socket<32>& FixedLatencyMemory::below() {
  if (annotated_ != nullptr) return annotated_->socket();
  if (clocked_ != nullptr) return clocked_->socket();
  throw std::logic_error(std::string(name()) + " was made without a memory below");
}

tlm::tlm_base_target_socket_b<32>& FixedLatencyMemory::port(unsigned index) { return ports_.at(index)->socket; }

std::uint64_t FixedLatencyMemory::bytes(Cycle end) const {
  std::uint64_t sum = 0;
  for (const auto& port : ports_) sum += port->bytes_before(end);
  return sum;
}

double FixedLatencyMemory::peak_rate() const {
  double sum = 0;
  for (const auto& port : ports_) sum += port->bytes_per_cycle();
  return sum / crossing_.ratio();
}

std::unique_ptr<FixedLatencyMemory> stub_unbound(tlm::tlm_initiator_socket<32>& socket, ClockDomain& domain) {
  if (socket.bind_count() > 0) return nullptr;
  auto stub = std::make_unique<FixedLatencyMemory>("no_memory", domain, 1, 1, 1);
  socket.bind(stub->port(0));
  return stub;
}

}  // namespace vrpipe
