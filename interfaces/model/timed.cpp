#include <vrpipe/model/timed.h>

#include <algorithm>
#include <map>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

std::map<std::string, TimedUnitMaker>& makers() {
  static std::map<std::string, TimedUnitMaker> all;
  return all;
}

}  // namespace

bool TimedUnit::idle() const {
  return std::all_of(in_ports.begin(), in_ports.end(), [](const InPort* port) { return port->empty(); }) &&
         std::none_of(outputs_.begin(), outputs_.end(), [](const TimedOutput* out) { return !out->clear(); });
}

void TimedUnit::close_account(Cycle end) {
  enter(UnitState::starved, charged_);
  Unit::close_account(end);
}

Cycle TimedUnit::tick(Cycle now) {
  const Cycle until = now + activation_cycles;
  Cycle next = never;
  bool served = true;
  while (served) {
    served = false;
    for (TimedInput* input : inputs_) {
      if (input->front() <= until) served = input->serve(until) || served;
    }
    next = advance(until);
  }
  for (const TimedInput* input : inputs_) {
    if (input->front() < next && input->may_serve()) next = input->front();
  }
  return activation_for(next, now);
}

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

void register_timed_unit_maker(const std::string& slot, TimedUnitMaker maker) {
  if (makers().emplace(slot, std::move(maker)).second) return Registry::instance().count_registration();
  Registry::instance().add_problem(
      {"slot " + slot + " has a module for lt and at already", "write a behaviour for the slot instead"});
}

const TimedUnitMaker& timed_unit_maker(const std::string& slot) {
  const auto found = makers().find(slot);
  if (found == makers().end()) throw SimulationFault("registry", 0, "slot " + slot + " has no module for lt and at");
  return found->second;
}

}  // namespace vrpipe
