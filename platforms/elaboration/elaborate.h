#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "elaboration/hierarchy.h"

#include <vrpipe/component/error.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/memory.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/observers.h>

namespace vrpipe {

/// Null for a unit without time, which is none.
inline sc_core::sc_module* module_of(Component& unit) { return dynamic_cast<sc_core::sc_module*>(&unit); }

/// Connects the units of a netlist, or of a part of it, and stubs what is to be. `find` gives the Component* of a path;
/// null for one that is not there, whose links are left out.
/// @param observers  null for none
/// @param connect    (link, sender, out, receiver, in, options) connects two ends
template <class Find, class Connect>
void connect_units(const Netlist& netlist, Observers* observers, Find&& find, Connect&& connect) {
  for (const Link& link : netlist.links()) {
    const auto [from, out] = split_port(link.from);
    const auto [to, in] = split_port(link.to);
    Component* const sender = find(from);
    Component* const receiver = find(to);
    if (sender == nullptr || receiver == nullptr) continue;
    LinkOptions options{link.parameters->depth, link.parameters->latency_cycles, link.parameters->items_per_cycle};
    if (observers != nullptr) options.observers = observers->of_link(link.name());
    const ModuleScope scope(module_of(*sender));
    connect(link, *sender, sender->out(out), *receiver, receiver->in(in), options);
  }
  for (const std::string& port : netlist.stubs()) {
    const auto [path, name] = split_port(port);
    Component* const unit = find(path);
    if (unit == nullptr) continue;
    const ModuleScope scope(module_of(*unit));
    if (unit->has_out(name)) {
      unit->out(name).stub();
    } else {
      unit->in(name).stub();
    }
  }
}

template <class Find>
void connect_units(const Netlist& netlist, Observers* observers, Find&& find) {
  connect_units(netlist, observers, find,
                [](const Link&, Component&, OutPort& out, Component&, InPort& in, const LinkOptions& options) {
                  out.connect(in, options);
                });
}

/// Throws UserError for a memory that cannot do without another one below, and has none.
inline void check_below(const Netlist& netlist, const std::string& path, const MemoryBehaviour& memory,
                        const std::string& platform) {
  const std::vector<MemoryLink>& links = netlist.memory_links();
  const auto is_from = [&](const MemoryLink& link) { return link.from == path; };
  if (!memory.needs_below() || std::any_of(links.begin(), links.end(), is_from)) return;
  throw UserError("incomplete platform " + platform, path,
                  "it fetches what it does not hold, and no memory is below it",
                  "add one and use connect_memory, or put a memory there that needs none");
}

/// Throws UserError for a frame that needs a port of a unit which is not connected.
inline void check_needs(const Configuration& configuration) {
  for (const Instance& instance : configuration.netlist().instances()) {
    for (const PortNeed& need : Registry::instance().slot(instance.slot).needs) {
      const std::string port = instance.path + "." + need.port;
      if (configuration.netlist().link_from(port) != nullptr || !need.is_needed(configuration.context_of(instance.gpc)))
        continue;
      throw UserError("platform " + configuration.platform().name + " cannot draw the frame", port, need.why,
                      need.remedy);
    }
  }
}

/// Stubs optional ports that are not connected. Throws UserError for another that is neither connected nor stubbed.
inline void check_ports(Component& unit, const std::string& path, const std::string& platform) {
  const ModuleScope scope(module_of(unit));
  const auto check = [&](const auto& ports) {
    for (auto* port : ports) {
      if (!port->connected() && port->is_optional()) port->stub();
      if (port->connected()) continue;
      throw UserError("incomplete platform " + platform, path + "." + port->name(), "the port is not connected",
                      "connect or stub it");
    }
  };
  check(unit.in_ports);
  check(unit.out_ports);
}

}  // namespace vrpipe
