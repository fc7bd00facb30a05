#include <vrpipe/model/untimed.h>

#include <map>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

std::map<std::string, UntimedUnitMaker>& untimed_makers() {
  static std::map<std::string, UntimedUnitMaker> all;
  return all;
}

}  // namespace

void UntimedUnit::check_work() const {
  if (work_.empty()) return;
  for (auto kind = static_cast<unsigned>(work_.size()); kind < items_.size(); ++kind) {
    if (items_[kind] > 0) refuse_work_kind(name_, kind);
  }
}

void register_untimed_unit_maker(const std::string& slot, UntimedUnitMaker maker) {
  if (untimed_makers().emplace(slot, std::move(maker)).second) return Registry::instance().count_registration();
  Registry::instance().add_problem(
      {"slot " + slot + " has a unit without time already", "write a behaviour for the slot instead"});
}

const UntimedUnitMaker& untimed_unit_maker(const std::string& slot) {
  const auto found = untimed_makers().find(slot);
  if (found == untimed_makers().end())
    throw SimulationFault("registry", 0, "slot " + slot + " has no unit without time");
  return found->second;
}

}  // namespace vrpipe
