#include <vrpipe/memory/timed_memory_port.h>

#include <algorithm>

#include <vrpipe/component/error.h>

namespace vrpipe {

TimedMemoryPort::TimedMemoryPort(PortOwner& owner, const std::string& name, MemoryOrigin origin)
    : socket(name.c_str()), clock_(owner.clock), origin_(origin), extension_(new MemoryRequestExtension) {
  socket.bind(*this);
  payload_.set_extension(extension_);
  payload_.set_byte_enable_ptr(nullptr);
  clock_.domain->attach(*this);
}

TimedMemoryPort::~TimedMemoryPort() = default;

bool TimedMemoryPort::meets_own_time() { return vrpipe::meets_own_time(socket, *clock_.domain); }

Cycle TimedMemoryPort::send(const MemoryRequest& request, Cycle at) {
  if (data_.empty()) memory_ = early_completion_memory_of(socket, *clock_.domain);  // from the second access on
  if (data_.size() < request.bytes) data_.resize(request.bytes);
  payload_.set_command(request.command);
  payload_.set_address(request.address);
  payload_.set_data_ptr(data_.data());
  payload_.set_data_length(request.bytes);
  payload_.set_streaming_width(request.bytes);
  payload_.set_dmi_allowed(false);
  payload_.set_response_status(tlm::TLM_INCOMPLETE_RESPONSE);
  const Cycle now = clock_.domain->now();
  const Cycle late = now - std::min(at, now);
  extension_->origin = request.origin;
  extension_->late_cycles = late;
  auto delay = sc_core::sc_time::from_value((at + late - now) * clock_.domain->period().value());
  try {
    socket->b_transport(payload_, delay);
  } catch (const sc_core::sc_report& report) {
    throw SimulationFault(socket.name(), at,
                          std::string(
                              "in b_transport, which must not wait but annotate its time, the memory reports ") +
                              report.get_msg());
  }
  check_response(socket, at, payload_);
  return std::max(now + clock_.domain->cycles_up(delay) - late, at);
}

}  // namespace vrpipe
