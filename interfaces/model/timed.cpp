#include <vrpipe/model/timed.h>

#include <map>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

std::map<std::string, UnitMaker>& timed_makers() {
  static std::map<std::string, UnitMaker> all;
  return all;
}

}  // namespace

void TimedUnit::close_account(Cycle end) {
  enter(UnitState::starved, charged_);
  Unit::close_account(end);
}

void register_timed_unit_maker(const std::string& slot, UnitMaker maker) {
  if (timed_makers().emplace(slot, std::move(maker)).second) return Registry::instance().count_registration();
  Registry::instance().add_problem(
      {"slot " + slot + " has a module for lt already", "write a behaviour for the slot instead"});
}

bool has_timed_unit_maker(const std::string& slot) { return timed_makers().count(slot) > 0; }

const UnitMaker& timed_unit_maker(const std::string& slot) {
  const auto found = timed_makers().find(slot);
  if (found == timed_makers().end()) throw SimulationFault("registry", 0, "slot " + slot + " has no module for lt");
  return found->second;
}

}  // namespace vrpipe
