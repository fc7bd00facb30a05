#include <vrpipe/memory_port.h>

#include <vrpipe/error.h>

namespace vrpipe {

MemoryPort::MemoryPort(PortOwner& owner, const std::string& name, unsigned in_flight)
    : socket(name.c_str()), clock_(owner.clock), slots_(in_flight) {
  std::size_t ring = 1;
  while (ring < in_flight) ring *= 2;
  completions_.resize(ring);
  socket.bind(*this);
  free_.reserve(in_flight);
  for (unsigned slot = in_flight; slot-- > 0;) free_.push_back(slot);
  for (Slot& slot : slots_) {
    slot.ticket = static_cast<unsigned>(&slot - slots_.data());
    slot.set_mm(this);
    slot.set_byte_enable_ptr(nullptr);
    slot.set_dmi_allowed(false);
  }
}

MemoryPort::~MemoryPort() = default;

unsigned MemoryPort::issue(tlm::tlm_command command, std::uint64_t address, unsigned bytes) {
  if (bytes == 0 || (bytes & (bytes - 1)) != 0 || (address & (bytes - 1)) != 0) {
    throw SimulationFault(socket.name(), clock_.domain->now(),
                          "an access of " + std::to_string(bytes) + " bytes at " + std::to_string(address) +
                              " is not naturally aligned");
  }
  const unsigned ticket = free_.back();
  free_.pop_back();
  Slot& slot = slots_[ticket];
  if (slot.data.size() < bytes) slot.data.resize(bytes);
  slot.answered = false;
  slot.acquire();
  slot.set_command(command);
  slot.set_address(address);
  slot.set_data_ptr(slot.data.data());
  slot.set_data_length(bytes);
  slot.set_streaming_width(bytes);
  slot.set_response_status(tlm::TLM_INCOMPLETE_RESPONSE);
  (command == tlm::TLM_READ_COMMAND ? reads_ : writes_) += 1;

  tlm::tlm_phase phase = tlm::BEGIN_REQ;
  sc_core::sc_time delay = sc_core::SC_ZERO_TIME;
  requesting_ = &slot;  // until the memory says otherwise, perhaps from within the call
  const tlm::tlm_sync_enum status = socket->nb_transport_fw(slot, phase, delay);
  if (status == tlm::TLM_ACCEPTED) return ticket;
  requesting_ = nullptr;
  if (status == tlm::TLM_UPDATED && phase != tlm::BEGIN_RESP) return ticket;
  complete(slot, delay);
  if (status == tlm::TLM_UPDATED) {
    phase = tlm::END_RESP;
    socket->nb_transport_fw(slot, phase, delay);
  }
  return ticket;
}

void MemoryPort::complete(Slot& slot, const sc_core::sc_time& delay) {
  if (slot.is_response_error()) {
    throw SimulationFault(socket.name(), clock_.domain->now(), "the memory answered " + slot.get_response_string());
  }
  slot.answered = true;
  const Cycle at = clock_.domain->edge_after(delay);
  // Nearly always the last: memories answer in order. The ring holds an entry for every slot.
  std::size_t place = completions_head_ + completions_count_++;
  while (place != completions_head_ && completion(place - 1).at > at) {
    completion(place) = completion(place - 1);
    --place;
  }
  completion(place) = {at, slot.ticket};
  clock_.domain->wake(clock_.unit, at);
}

tlm::tlm_sync_enum MemoryPort::nb_transport_bw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                               sc_core::sc_time& delay) {
  auto& slot = static_cast<Slot&>(payload);
  if (requesting_ == &slot) requesting_ = nullptr;  // BEGIN_RESP implies END_REQ
  if (phase == tlm::END_REQ) {
    clock_.domain->wake(clock_.unit, clock_.domain->now() + 1);
    return tlm::TLM_ACCEPTED;
  }
  if (slot.answered) throw SimulationFault(socket.name(), clock_.domain->now(), "a second response to a request");
  complete(slot, delay);
  phase = tlm::END_RESP;
  return tlm::TLM_COMPLETED;
}

void MemoryPort::free(tlm::tlm_generic_payload* payload) {
  const bool none_free = free_.empty();
  free_.push_back(static_cast<Slot*>(payload)->ticket);
  if (none_free) clock_.domain->wake(clock_.unit, clock_.domain->now() + 1);
}

bool MemoryPort::next_completed(unsigned& ticket) {
  if (next_completion() > clock_.domain->now()) return false;
  ticket = completion(completions_head_).ticket;
  ++completions_head_;
  --completions_count_;
  slots_[ticket].release();
  return true;
}

class FixedLatencyMemory::MemoryTarget : private tlm::tlm_fw_transport_if<> {
 public:
  MemoryTarget(const std::string& name, const FixedLatencyMemory& memory) : socket(name.c_str()), memory_(memory) {
    socket.bind(*this);
  }
  tlm::tlm_target_socket<32> socket;
  std::uint64_t bytes = 0;

 private:
  void serve(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) {
    // The delay that comes in says how far ahead of the clock the access is.
    const Cycle ahead = delay.value() / memory_.domain_.period().value();
    const std::uint64_t arrival = (memory_.domain_.now() + ahead) * memory_.bytes_per_cycle_;
    const std::uint64_t start = free_at_ > arrival ? free_at_ : arrival;
    free_at_ = start + payload.get_data_length();
    bytes += payload.get_data_length();
    const std::uint64_t transfer = (free_at_ - arrival + memory_.bytes_per_cycle_ - 1) / memory_.bytes_per_cycle_;
    delay += sc_core::sc_time::from_value((memory_.latency_cycles_ + transfer) * memory_.domain_.period().value());
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
  }
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    if (phase == tlm::BEGIN_REQ) serve(payload, delay);
    return tlm::TLM_COMPLETED;
  }
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override { serve(payload, delay); }
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  const FixedLatencyMemory& memory_;
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

std::uint64_t FixedLatencyMemory::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& port : ports_) sum += port->bytes;
  return sum;
}

double FixedLatencyMemory::peak_rate() const {
  return static_cast<double>(bytes_per_cycle_) * static_cast<double>(ports_.size());
}

}  // namespace vrpipe
