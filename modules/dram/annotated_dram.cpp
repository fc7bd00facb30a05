#include "dram/annotated_dram.h"

#include <algorithm>
#include <string>

namespace vrpipe {

class AnnotatedDram::Port final : public tlm::tlm_fw_transport_if<>, public EarlyCompletionMemory {
 public:
  Port(unsigned index, AnnotatedDram& dram) : socket(("port_" + std::to_string(index)).c_str()), dram_(dram) {
    socket.bind(*this);
  }
  tlm::tlm_target_socket<32, tlm::tlm_base_protocol_types, 1, sc_core::SC_ZERO_OR_MORE_BOUND> socket;

 private:
  Cycle serve(const MemoryRequest& request, Cycle arrival) override { return dram_.serve(request, arrival); }
  const ClockDomain& clock() const override { return dram_.domain_; }

  // The delay that comes in says how far ahead of the clock the access is.
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    Cycle arrival = clock().now() + clock().whole_cycles(delay);
    if (const auto* const extension = payload.get_extension<MemoryRequestExtension>())
      arrival -= extension->late_cycles;
    const MemoryRequest request = request_of(payload);
    check_alignment(socket, arrival, request.address, request.bytes);
    const Cycle taken = serve(request, arrival) - arrival;
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

  AnnotatedDram& dram_;
};

AnnotatedDram::AnnotatedDram(const sc_core::sc_module_name& name, ClockDomain& domain, Dram& behaviour, unsigned ports)
    : sc_module(name),
      domain_(domain),
      behaviour_(behaviour),
      settings_(behaviour.settings()),
      clock_(domain, settings_.tck_ps, settings_.controller_ps),
      data_(domain.frame_end(), clock_) {
  for (unsigned index = 0; index < settings_.channels; ++index)
    channels_.emplace_back(settings_.timing, statistics.channels, behaviour.refresh_gate()).tell(data_);
  for (unsigned index = 0; index < ports; ++index) ports_.push_back(std::make_unique<Port>(index, *this));
}

AnnotatedDram::~AnnotatedDram() = default;

tlm::tlm_base_target_socket_b<32>& AnnotatedDram::port(unsigned index) { return ports_.at(index)->socket; }

Cycle AnnotatedDram::serve(const MemoryRequest& request, Cycle arrival) {
  behaviour_.count(request);
  const bool writes = is_write(request);
  const Cycle now = clock_.edge_of(arrival + 1);
  const Cycle present = clock_.edge_of(domain_.now());
  Cycle done = 0;
  const unsigned bursts = settings_.bursts(request.bytes);
  for (unsigned burst = 0; burst < bursts; ++burst) {
    const DramAddress place = settings_.map.place_of(request.address + burst * settings_.burst_bytes);
    AnnotatedChannel& channel = channels_[place.channel];
    done = std::max(done, writes ? channel.write(place, now, present) : channel.read(place, now, present));
  }
  const Cycle answered = clock_.seen(done);
  if (!writes) statistics.read_latency.see(answered - arrival);
  return answered;
}

void AnnotatedDram::close(Cycle end) {
  for (AnnotatedChannel& channel : channels_) channel.close(clock_.edge_of(end));
  statistics.channels.data_cycles += data_.cycles(end);
}

}  // namespace vrpipe
