#include <vrpipe/platforms/netlist.h>

#include <algorithm>
#include <cctype>
#include <set>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

constexpr const char* out_prefix = "out_";

/// The number behind `gpc` at the beginning of a path; false for none.
bool gpc_of(const std::string& path, unsigned& gpc) {
  if (path.compare(0, 3, "gpc") != 0) return false;
  std::size_t end = 3;
  while (end < path.size() && std::isdigit(static_cast<unsigned char>(path[end])) != 0) ++end;
  if (end == 3 || end > 9 || end == path.size() || path[end] != '.') return false;
  gpc = static_cast<unsigned>(std::stoul(path.substr(3, end - 3)));
  return true;
}

[[noreturn]] void refuse(const std::string& what, const std::string& where, const std::string& why,
                         const std::string& remedy) {
  throw UserError(what, where, why, remedy);
}

}  // namespace

LinkParameters::LinkParameters(std::uint32_t items, std::uint32_t cycles)
    : depth(*this, "depth", items, 1, 65536, "items", source::open, "that the receiver's queue holds"),
      latency_cycles(*this, "latency_cycles", cycles, 1, 100000, "cycles", "a register between units",
                     "from push to visibility"),
      items_per_cycle(*this, "items_per_cycle", 0, 0, 65536, "items", "no limit but the units' own",
                      "that the link passes in a cycle; 0: as many as its ends move") {}

std::pair<std::string, std::string> split_port(const std::string& port) {
  const std::size_t dot = port.rfind('.');
  if (dot == std::string::npos) refuse("cannot connect", port, "a port is named UNIT.PORT", "name the unit as well");
  return {port.substr(0, dot), port.substr(dot + 1)};
}

std::string without_gpc(const std::string& path) {
  unsigned gpc = 0;
  std::string rest = gpc_of(path, gpc) ? path.substr(path.find('.') + 1) : path;
  const std::size_t index = rest.find_last_not_of("0123456789");
  if (index != std::string::npos && index + 1 < rest.size() && rest[index] == '_') rest.resize(index);
  return rest;
}

bool names_path(const std::string& name, const std::string& path) { return name == path || name == without_gpc(path); }

std::string Link::name() const {
  auto [path, port] = split_port(from);
  if (port.compare(0, 4, out_prefix) == 0) port.erase(0, 4);
  return path + "." + port;
}

void Netlist::add(const std::string& path, const std::string& slot, const std::string& implementation) {
  check_is_new(path);
  Instance added{path, slot.empty() ? path.substr(path.rfind('.') + 1) : slot, implementation};
  added.in_front_end = !gpc_of(path, added.gpc);
  if (added.gpc >= gpcs_) {
    refuse("cannot add " + path, path, "the platform has " + std::to_string(gpcs_) + " GPCs", "raise its `gpcs`");
  }
  const Registry& registry = Registry::instance();
  if (registry.has_slot(added.slot) && registry.slot(added.slot).is_outside_pipeline) {
    refuse("cannot add " + path, path, "slot " + added.slot + " is of units that have no ports", "leave it out");
  }
  instances_.push_back(std::move(added));
}

void Netlist::connect(const std::string& from, const std::string& to, unsigned depth, unsigned latency) {
  static_cast<void>(instance(split_port(from).first));
  static_cast<void>(instance(split_port(to).first));
  const bool taken =
      std::any_of(links_.begin(), links_.end(), [&](const Link& link) { return link.from == from || link.to == to; });
  if (taken) refuse("cannot connect", from + " to " + to, "a port is connected already", "connect each port once");
  stubs_.erase(std::remove_if(stubs_.begin(), stubs_.end(),
                              [&](const auto& port) { return port == from || port == to; }),
               stubs_.end());
  links_.push_back({from, to, std::make_shared<LinkParameters>(depth, latency)});
}

void Netlist::add_memory(const std::string& path, MemoryMaker make) {
  check_is_new(path);
  foreign_memories_.push_back({path, std::move(make)});
}

void Netlist::connect_memory(const std::string& from, const std::string& memory) {
  static_cast<void>(instance(from));
  check_memory(memory);
  for (std::string above = memory; !above.empty();) {
    if (above == from) refuse("cannot connect", from + " to " + memory, "it would lie below itself", "connect another");
    const auto next = std::find_if(memory_links_.begin(), memory_links_.end(),
                                   [&](const MemoryLink& link) { return link.from == above; });
    above = next == memory_links_.end() ? std::string() : next->to;
  }
  disconnect_memory(from);
  memory_links_.push_back({from, memory});
}

void Netlist::insert_memory(const std::string& from, const std::string& memory) {
  const auto bound = std::find_if(memory_links_.begin(), memory_links_.end(),
                                  [&](const MemoryLink& link) { return link.from == from; });
  if (bound == memory_links_.end()) {
    refuse("cannot insert " + memory, from, "its memory port is bound to nothing", "use connect_memory");
  }
  const std::string below = bound->to;
  connect_memory(memory, below);
  connect_memory(from, memory);
}

void Netlist::disconnect_memory(const std::string& from) {
  memory_links_.erase(std::remove_if(memory_links_.begin(), memory_links_.end(),
                                     [&](const MemoryLink& link) { return link.from == from; }),
                      memory_links_.end());
}

void Netlist::replace_memory(const std::string& path, MemoryMaker make) {
  check_memory(path);
  disconnect_memory(path);
  instances_.erase(std::remove_if(instances_.begin(), instances_.end(),
                                  [&](const Instance& instance) { return instance.path == path; }),
                   instances_.end());
  foreign_memories_.erase(std::remove_if(foreign_memories_.begin(), foreign_memories_.end(),
                                         [&](const ForeignInstance& foreign) { return foreign.path == path; }),
                          foreign_memories_.end());
  foreign_memories_.push_back({path, std::move(make)});
}

std::vector<std::string> Netlist::bound_to(const std::string& memory) const {
  std::vector<std::string> bound;
  for (const MemoryLink& link : memory_links_) {
    if (link.to == memory) bound.push_back(link.from);
  }
  return bound;
}

void Netlist::replace(const std::string& path, const std::string& implementation) {
  instance(path).implementation = implementation;
}

void Netlist::insert(const std::string& from, const std::string& path, const std::string& slot, const std::string& in,
                     const std::string& out, const std::string& implementation) {
  const auto link = link_at(from);
  const std::string to = link->to;
  const unsigned depth = link->parameters->depth;
  const unsigned latency = link->parameters->latency_cycles;
  add(path, slot, implementation);
  link->to = path + "." + in;
  connect(path + "." + out, to, depth, latency);
}

void Netlist::remove(const std::string& path) {
  static_cast<void>(instance(path));
  for (std::size_t i = links_.size(); i-- > 0;) {
    const bool sends = split_port(links_[i].from).first == path;
    const bool receives = split_port(links_[i].to).first == path;
    if (!sends && !receives) continue;
    if (!sends) stub(links_[i].from);
    if (!receives) stub(links_[i].to);
    links_.erase(links_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  const auto of_it = [&](const std::string& port) { return split_port(port).first == path; };
  stubs_.erase(std::remove_if(stubs_.begin(), stubs_.end(), of_it), stubs_.end());
  disconnect_memory(path);
  if (const std::vector<std::string> above = bound_to(path); !above.empty()) {
    refuse("cannot remove " + path, path, "the memory port of " + above.front() + " is bound to it",
           "connect that to another memory first, or use replace_memory");
  }
  instances_.erase(
      std::find_if(instances_.begin(), instances_.end(), [&](const Instance& i) { return i.path == path; }));
}

void Netlist::remove_memory(const std::string& path) {
  for (const std::string& above : bound_to(path)) disconnect_memory(above);
  remove(path);
}

void Netlist::disconnect(const std::string& from) {
  const auto link = link_at(from);
  stub(link->from);
  stub(link->to);
  links_.erase(link);
}

void Netlist::stub(const std::string& port) {
  static_cast<void>(instance(split_port(port).first));
  stubs_.push_back(port);
}

const Instance* Netlist::find(const std::string& path) const {
  for (const Instance& instance : instances_) {
    if (instance.path == path) return &instance;
  }
  return nullptr;
}

const Link* Netlist::link_from(const std::string& port) const {
  for (const Link& link : links_) {
    if (link.from == port) return &link;
  }
  return nullptr;
}

Instance& Netlist::instance(const std::string& path) {
  std::vector<std::string> paths;
  for (Instance& instance : instances_) {
    if (instance.path == path) return instance;
    paths.push_back(instance.path);
  }
  refuse("unknown unit '" + path + "'", "platform", "it was not added",
         paths.empty() ? "add it first" : suggestion(path, paths));
}

std::vector<std::string> Netlist::used_memories() const {
  std::set<std::string> used;
  for (const Instance& instance : instances_) {
    std::string from = is_memory(instance) ? std::string() : instance.path;
    while (!from.empty()) {
      const auto link = std::find_if(memory_links_.begin(), memory_links_.end(),
                                     [&](const MemoryLink& each) { return each.from == from; });
      from = link == memory_links_.end() ? std::string() : link->to;
      if (!from.empty()) used.insert(from);
    }
  }
  std::vector<std::string> paths;
  for (const Instance& instance : instances_) {
    if (used.count(instance.path) > 0) paths.push_back(instance.path);
  }
  for (const ForeignInstance& foreign : foreign_memories_) {
    if (used.count(foreign.path) > 0) paths.push_back(foreign.path);
  }
  return paths;
}

bool Netlist::has_foreign(const std::string& path) const {
  return std::any_of(foreign_memories_.begin(), foreign_memories_.end(),
                     [&](const ForeignInstance& foreign) { return foreign.path == path; });
}

bool Netlist::is_memory(const Instance& instance) {
  const Registry& registry = Registry::instance();
  return registry.has_slot(instance.slot) && registry.slot(instance.slot).is_memory;
}

void Netlist::check_memory(const std::string& path) const {
  if (has_foreign(path)) return;
  std::vector<std::string> paths;
  for (const ForeignInstance& foreign : foreign_memories_) paths.push_back(foreign.path);
  for (const Instance& instance : instances_) {
    if (!is_memory(instance)) continue;
    if (instance.path == path) return;
    paths.push_back(instance.path);
  }
  refuse("unknown memory '" + path + "'", "platform", "it was not added",
         paths.empty() ? "add it first" : suggestion(path, paths));
}

void Netlist::check_is_new(const std::string& path) const {
  if (find(path) == nullptr && !has_foreign(path)) return;
  refuse("cannot add " + path, path, "the platform has it already", "choose another path");
}

std::vector<Link>::iterator Netlist::link_at(const std::string& port) {
  std::vector<std::string> ports;
  for (auto link = links_.begin(); link != links_.end(); ++link) {
    if (link->from == port) return link;
    ports.push_back(link->from);
  }
  refuse("unknown link '" + port + "'", "platform", "no link begins there",
         ports.empty() ? "connect it first" : suggestion(port, ports));
}

}  // namespace vrpipe
