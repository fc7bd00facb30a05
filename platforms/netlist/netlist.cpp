#include <vrpipe/platforms/netlist.h>

#include <algorithm>
#include <cctype>

#include <vrpipe/component/error.h>

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
  if (find(path) != nullptr) refuse("cannot add " + path, path, "the platform has it already", "choose another path");
  Instance added{path, slot.empty() ? path.substr(path.rfind('.') + 1) : slot, implementation};
  added.in_front_end = !gpc_of(path, added.gpc);
  if (added.gpc >= gpcs_) {
    refuse("cannot add " + path, path, "the platform has " + std::to_string(gpcs_) + " GPCs", "raise its `gpcs`");
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
  for (const MemoryInstance& memory : memories_) {
    if (memory.path == path) refuse("cannot add " + path, path, "the platform has it already", "choose another path");
  }
  memories_.push_back({path, std::move(make), {}});
}

void Netlist::connect_memory(const std::string& unit, const std::string& memory) {
  MemoryInstance& target = this->memory(memory);
  const bool is_l2 = std::any_of(memories_.begin(), memories_.end(),
                                 [&](const auto& each) { return each.path == unit && !each.make; });
  if (!is_l2) static_cast<void>(instance(unit));
  if (is_l2 && !target.make) {
    refuse("cannot connect", unit + " to " + memory, "below the L2 lies a memory of another make",
           "add it with add_memory and what makes it");
  }
  disconnect_memory(unit);  // it may be moved
  target.units.push_back(unit);
}

void Netlist::disconnect_memory(const std::string& unit) {
  for (MemoryInstance& memory : memories_) {
    memory.units.erase(std::remove(memory.units.begin(), memory.units.end(), unit), memory.units.end());
  }
}

void Netlist::replace_memory(const std::string& path, MemoryMaker make) {
  memory(path).make = std::move(make);
  disconnect_memory(path);
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
  instances_.erase(
      std::find_if(instances_.begin(), instances_.end(), [&](const Instance& i) { return i.path == path; }));
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
         paths.empty() ? "add it first" : "did you mean " + nearest_name(path, paths) + "?");
}

MemoryInstance& Netlist::memory(const std::string& path) {
  std::vector<std::string> paths;
  for (MemoryInstance& memory : memories_) {
    if (memory.path == path) return memory;
    paths.push_back(memory.path);
  }
  refuse("unknown memory '" + path + "'", "platform", "it was not added",
         paths.empty() ? "add it with add_memory" : "did you mean " + nearest_name(path, paths) + "?");
}

std::vector<Link>::iterator Netlist::link_at(const std::string& port) {
  std::vector<std::string> ports;
  for (auto link = links_.begin(); link != links_.end(); ++link) {
    if (link->from == port) return link;
    ports.push_back(link->from);
  }
  refuse("unknown link '" + port + "'", "platform", "no link begins there",
         ports.empty() ? "connect it first" : "did you mean " + nearest_name(port, ports) + "?");
}

}  // namespace vrpipe
