#include <vrpipe/model/timed.h>

#include <algorithm>
#include <map>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

std::map<std::string, TimedUnitMaker>& timed_makers() {
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

void register_timed_unit_maker(const std::string& slot, TimedUnitMaker maker) {
  if (timed_makers().emplace(slot, std::move(maker)).second) return Registry::instance().count_registration();
  Registry::instance().add_problem(
      {"slot " + slot + " has a module for lt and at already", "write a behaviour for the slot instead"});
}

const TimedUnitMaker& timed_unit_maker(const std::string& slot) {
  const auto found = timed_makers().find(slot);
  if (found == timed_makers().end())
    throw SimulationFault("registry", 0, "slot " + slot + " has no module for lt and at");
  return found->second;
}

}  // namespace vrpipe
