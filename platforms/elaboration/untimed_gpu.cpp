#include "elaboration/untimed_gpu.h"

#include <algorithm>

#include "elaboration/elaborate.h"

namespace vrpipe {

UntimedGpu::UntimedGpu(const Configuration& configuration, Framebuffer& framebuffer) : configuration_(configuration) {
  const Netlist& netlist = configuration.netlist();
  check_needs(configuration);
  for (const Instance& instance : netlist.instances()) {
    if (Netlist::is_memory(instance)) continue;
    std::unique_ptr<Behaviour> behaviour = configuration.make(instance);
    behaviour->use_surfaces(framebuffer);
    units_.push_back(
        {&instance, untimed_unit_maker(instance.slot)(instance.path, std::move(behaviour),
                                                      configuration.context_of(instance.gpc), netlist.gpcs())});
  }
  connect_units(netlist, configuration.request().observers.get(),
                [&](const std::string& path) -> Component* { return unit(path); });
  for (const Placed& placed : units_) check_ports(*placed.unit, placed.instance->path, configuration.platform().name);
  add_memories();
  for (unsigned gpc = 0; gpc < netlist.gpcs(); ++gpc) {
    UntimedUnit* const qru = of_slot("qru", gpc);
    UntimedUnit* const crop = of_slot("crop", gpc);
    if (qru != nullptr && crop != nullptr) qru->prefetch_for(*crop);
  }
}

void UntimedGpu::add_memories() {
  const Netlist& netlist = configuration_.netlist();
  for (const std::string& path : netlist.used_memories()) {
    const Instance* const instance = netlist.find(path);
    if (instance == nullptr) continue;  // of another make: it has sockets alone
    auto made = configuration_.make_as<MemoryBehaviour>(*instance);
    check_below(netlist, path, *made, configuration_.platform().name);
    if (made->follows_accesses()) memories_.push_back({instance, std::move(made)});
  }
  for (const MemoryLink& link : netlist.memory_links()) {
    MemoryBehaviour* const below = memory(link.to);
    if (below == nullptr) continue;
    if (MemoryBehaviour* const above = memory(link.from)) above->set_below(*below);
    UntimedUnit* const user = unit(link.from);
    if (UntimedMemoryPort* const port = user != nullptr ? user->memory_port() : nullptr) port->connect(*below);
  }
}

UntimedUnit* UntimedGpu::unit(const std::string& path) const {
  for (const Placed& placed : units_) {
    if (placed.instance->path == path) return placed.unit.get();
  }
  return nullptr;
}

MemoryBehaviour* UntimedGpu::memory(const std::string& path) const {
  for (const PlacedMemory& placed : memories_) {
    if (placed.instance->path == path) return placed.memory.get();
  }
  return nullptr;
}

UntimedUnit* UntimedGpu::of_slot(const std::string& slot, unsigned gpc) const {
  for (const Placed& placed : units_) {
    const Instance& instance = *placed.instance;
    if (instance.slot == slot && (instance.gpc == gpc || instance.in_front_end)) return placed.unit.get();
  }
  return nullptr;
}

void UntimedGpu::run(std::atomic<float>* progress, const std::function<void()>& passed) {
  const auto splats = static_cast<float>(std::max<std::uint32_t>(configuration_.frame().splats(), 1));
  for (const Placed& placed : units_) {
    for (std::uint64_t pieces = 1; placed.unit->run_piece(); ++pieces) {
      if (passed) passed();
      if (progress != nullptr && pieces % 128 == 0) {
        *progress = std::min(1.0F, static_cast<float>(pieces * splats_per_vertex_warp) / splats);
      }
    }
  }
  if (progress != nullptr) *progress = 1;
}

}  // namespace vrpipe
