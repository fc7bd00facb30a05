#include <vrpipe/memory_port.h>

#include <vrpipe/error.h>

namespace vrpipe {

void fault_of_alignment(const sc_core::sc_object& port, Cycle now, std::uint64_t address, unsigned bytes) {
  throw SimulationFault(port.name(), now,
                        "an access of " + std::to_string(bytes) + " bytes at " + std::to_string(address) +
                            " is not naturally aligned");
}

void fault_of_response(const sc_core::sc_object& port, Cycle now, const tlm::tlm_generic_payload& access) {
  throw SimulationFault(port.name(), now, "the memory answered " + access.get_response_string());
}

PromptMemory* prompt_memory_of(tlm::tlm_initiator_socket<32>& socket, const ClockDomain& clock) {
  auto* const memory = dynamic_cast<PromptMemory*>(socket.operator->());
  return memory != nullptr && &memory->clock() == &clock ? memory : nullptr;
}

MemoryPort::MemoryPort(PortOwner& owner, const std::string& name, unsigned in_flight)
    : socket(name.c_str()), clock_(owner.clock), most_in_flight_(in_flight) {
  socket.bind(*this);
}

MemoryPort::~MemoryPort() = default;

MemoryPort::Access* MemoryPort::unused_access() {
  if (free_accesses_.empty()) {
    Access& made = accesses_.emplace_back();
    made.set_mm(this);
    made.set_byte_enable_ptr(nullptr);
    made.set_dmi_allowed(false);
    free_accesses_.push_back(&made);
  }
  Access* const access = free_accesses_.back();
  free_accesses_.pop_back();
  access->acquire();
  return access;
}

inline void MemoryPort::answer(Access& access, const sc_core::sc_time& delay) {
  check_response(socket, clock_.domain->now(), access);
  access.answered = true;
  complete(clock_.domain->edge_after(delay), access.tag);
}

void MemoryPort::request(tlm::tlm_command command, std::uint64_t address, unsigned bytes, std::uint32_t tag) {
  if (next_access_ == nullptr) {
    next_access_ = unused_access();
    prompt_ = prompt_memory_of(socket, *clock_.domain);  // from the second access on
  }
  Access& access = *next_access_;
  if (access.data.size() < bytes) access.data.resize(bytes);
  access.set_data_ptr(access.data.data());
  access.set_data_length(bytes);
  access.set_streaming_width(bytes);
  access.answered = false;
  access.tag = tag;
  access.set_command(command);
  access.set_address(address);
  access.set_response_status(tlm::TLM_INCOMPLETE_RESPONSE);

  tlm::tlm_phase phase = tlm::BEGIN_REQ;
  sc_core::sc_time delay = sc_core::SC_ZERO_TIME;
  requesting_ = &access;  // until the memory says otherwise, perhaps from within the call
  const tlm::tlm_sync_enum status = socket->nb_transport_fw(access, phase, delay);
  if (status != tlm::TLM_ACCEPTED) requesting_ = nullptr;
  if (status == tlm::TLM_COMPLETED || (status == tlm::TLM_UPDATED && phase == tlm::BEGIN_RESP)) {
    answer(access, delay);
    if (status == tlm::TLM_UPDATED) {
      phase = tlm::END_RESP;
      socket->nb_transport_fw(access, phase, delay);
    }
    if (access.get_ref_count() == 1) return;  // ours alone: it serves again
    access.release();
  }
  next_access_ = unused_access();
}

tlm::tlm_sync_enum MemoryPort::nb_transport_bw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                               sc_core::sc_time& delay) {
  auto& access = static_cast<Access&>(payload);
  if (requesting_ == &access) requesting_ = nullptr;  // BEGIN_RESP implies END_REQ
  if (phase == tlm::END_REQ) {
    clock_.domain->wake(clock_.unit, clock_.domain->now() + 1);
    return tlm::TLM_ACCEPTED;
  }
  if (access.answered) throw SimulationFault(socket.name(), clock_.domain->now(), "a second response to a request");
  answer(access, delay);
  phase = tlm::END_RESP;
  access.release();
  return tlm::TLM_COMPLETED;
}

void MemoryPort::free(tlm::tlm_generic_payload* payload) { free_accesses_.push_back(static_cast<Access*>(payload)); }

class FixedLatencyMemory::MemoryTarget final : public tlm::tlm_fw_transport_if<>, public PromptMemory {
 public:
  MemoryTarget(const std::string& name, const FixedLatencyMemory& memory) : socket(name.c_str()), memory_(memory) {
    socket.bind(*this);
  }
  tlm::tlm_target_socket<32> socket;

  std::uint64_t bytes_before(Cycle end) const {
    // What is not done by then is still queued up.
    const std::uint64_t done = end == never ? free_at_ : end * memory_.bytes_per_cycle_.value();
    return bytes_ - std::min(bytes_, free_at_ - std::min(free_at_, done));
  }

 private:
  Cycle serve(Cycle arrival, unsigned length) override {
    const std::uint64_t arrival_byte = arrival * memory_.bytes_per_cycle_.value();
    free_at_ = std::max(free_at_, arrival_byte) + length;
    bytes_ += length;
    return arrival + memory_.latency_cycles_ + memory_.bytes_per_cycle_.quotient_up(free_at_ - arrival_byte);
  }
  const ClockDomain& clock() const override { return memory_.domain_; }

  // The delay that comes in says how far ahead of the clock the access is.
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    const Cycle arrival = clock().now() + clock().whole_cycles(delay);
    const Cycle taken = serve(arrival, payload.get_data_length()) - arrival;
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

  const FixedLatencyMemory& memory_;
  std::uint64_t bytes_ = 0;
  std::uint64_t free_at_ = 0;  // in bytes since the start, so that fractions of a cycle are kept
};

FixedLatencyMemory::FixedLatencyMemory(const sc_core::sc_module_name& name, const ClockDomain& domain,
                                       unsigned latency_cycles, unsigned bytes_per_cycle, unsigned ports)
    : sc_module(name), domain_(domain), latency_cycles_(latency_cycles), bytes_per_cycle_(bytes_per_cycle) {
  for (unsigned index = 0; index < ports; ++index) {
    ports_.push_back(std::make_unique<MemoryTarget>("port_" + std::to_string(index), *this));
  }
}

FixedLatencyMemory::~FixedLatencyMemory() = default;

tlm::tlm_target_socket<32>& FixedLatencyMemory::port(unsigned index) { return ports_.at(index)->socket; }

std::uint64_t FixedLatencyMemory::bytes(Cycle end) const {
  std::uint64_t sum = 0;
  for (const auto& port : ports_) sum += port->bytes_before(end);
  return sum;
}

double FixedLatencyMemory::peak_rate() const {
  return static_cast<double>(bytes_per_cycle_.value()) * static_cast<double>(ports_.size());
}

}  // namespace vrpipe
