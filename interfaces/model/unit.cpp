#include <vrpipe/model/unit.h>

#include <algorithm>
#include <map>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

template <class Port>
Port& port_named(const std::vector<Port*>& ports, const std::string& unit, const std::string& name) {
  std::vector<std::string> names;
  for (Port* port : ports) {
    if (port->name() == name) return *port;
    names.push_back(port->name());
  }
  throw UserError("unknown port '" + name + "'", "unit " + unit, "the unit has no such port",
                  names.empty() ? "it has none in this direction" : suggestion(name, names));
}

std::map<std::string, UnitMaker>& clocked_makers() {
  static std::map<std::string, UnitMaker> all;
  return all;
}

}  // namespace

Unit::Unit(const sc_core::sc_module_name& name, ClockDomain& domain, std::vector<WorkKind> work)
    : sc_module(name),
      Component({&domain, domain.attach(*this)}),
      occupancy_(domain.frame_end(), std::move(work)),
      account_(domain.frame_end()),
      tells_draws_(domain.frame_end().tells_draws()) {
  if (occupancy_.kinds() > most_work_kinds) refuse_work_kind(this->name(), most_work_kinds);
}

void Unit::close_account(Cycle end) {
  account_.close(end);
  for (auto kind = static_cast<unsigned>(occupancy_.kinds()); kind < most_work_kinds; ++kind) {
    if (occupancy_.items(kind) > 0) refuse_work_kind(name(), kind);
  }
}

InPort& Component::in(const std::string& name) { return port_named(in_ports, label(), name); }
OutPort& Component::out(const std::string& name) { return port_named(out_ports, label(), name); }
bool Component::has_out(const std::string& name) const {
  return std::any_of(out_ports.begin(), out_ports.end(), [&](const OutPort* port) { return port->name() == name; });
}

void register_unit_maker(const std::string& slot, UnitMaker maker) {
  if (clocked_makers().emplace(slot, std::move(maker)).second) return Registry::instance().count_registration();
  Registry::instance().add_problem(
      {"slot " + slot + " has a module for cycle already", "write a behaviour for the slot instead"});
}

const UnitMaker& unit_maker(const std::string& slot) {
  const auto found = clocked_makers().find(slot);
  if (found == clocked_makers().end()) throw SimulationFault("registry", 0, "slot " + slot + " has no module");
  return found->second;
}

}  // namespace vrpipe
