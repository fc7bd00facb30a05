#include <vrpipe/timed.h>

#include <algorithm>
#include <map>

#include <vrpipe/error.h>
#include <vrpipe/registry.h>

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

TimedMemoryPort::TimedMemoryPort(PortOwner& owner, const std::string& name)
    : socket(name.c_str()), clock_(owner.clock) {
  socket.bind(*this);
  payload_.set_byte_enable_ptr(nullptr);
}

TimedMemoryPort::~TimedMemoryPort() = default;

Cycle TimedMemoryPort::request(tlm::tlm_command command, std::uint64_t address, unsigned bytes, Cycle at) {
  if (data_.empty()) prompt_ = prompt_memory_of(socket, *clock_.domain);  // from the second access on
  if (data_.size() < bytes) data_.resize(bytes);
  payload_.set_command(command);
  payload_.set_address(address);
  payload_.set_data_ptr(data_.data());
  payload_.set_data_length(bytes);
  payload_.set_streaming_width(bytes);
  payload_.set_dmi_allowed(false);
  payload_.set_response_status(tlm::TLM_INCOMPLETE_RESPONSE);
  const Cycle now = clock_.domain->now();
  at = std::max(at, now);
  auto delay = sc_core::sc_time::from_value((at - now) * clock_.domain->period().value());
  socket->b_transport(payload_, delay);
  check_response(socket, at, payload_);
  return now + std::max(at - now, clock_.domain->cycles_up(delay));
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
