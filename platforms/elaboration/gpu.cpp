#include <vrpipe/platforms/gpu.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "elaboration/elaborate.h"
#include "elaboration/run_ahead.h"

#include <fmt/format.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/checked_behaviours.h>

namespace vrpipe {

namespace {

[[noreturn]] void refuse_memory(const std::string& where, const std::string& why, const std::string& remedy) {
  throw UserError("cannot connect memory", where, why, remedy);
}

}  // namespace

Gpu::Gpu(const Configuration& configuration, Framebuffer& framebuffer)
    : configuration_(configuration),
      clock_(std::make_unique<ClockDomain>("clock", static_cast<std::uint64_t>(
                                                        std::llround(1e6 / configuration.platform().frequency_mhz)))) {
  const Netlist& netlist = configuration.netlist();
  const RunRequest& request = configuration.request();
  for (const Instance& instance : netlist.instances()) {
    const bool runs_ahead = instance.slot == "zrop" && request.termination == Termination::strict &&
                            configuration.frame().terminates_early();
    if (runs_ahead) ahead_[instance.gpc] = std::make_unique<RunAhead>(configuration, instance.gpc, framebuffer.color);
  }
  for (const Instance& instance : netlist.instances()) add(instance, framebuffer);
  connect_units(netlist, request.observers.get(), [&](const std::string& path) { return find(path); });
  add_memories();
  check();
}

Gpu::~Gpu() = default;

Unit* Gpu::find(const std::string& path) const {
  for (const Placed& placed : units_) {
    if (placed.instance->path == path) return placed.unit.get();
  }
  return nullptr;
}

void Gpu::add(const Instance& instance, Framebuffer& framebuffer) {
  const std::string& slot = instance.slot;
  const RenderContext& context = configuration_.context_of(instance.gpc);
  const auto ahead = ahead_.find(instance.gpc);
  std::unique_ptr<Behaviour> behaviour;
  Behaviour* counting = nullptr;
  if (ahead != ahead_.end() && (slot == "sm" || slot == "crop")) {
    behaviour = ahead->second->make_repeating(slot);
    counting = &ahead->second->unit(slot);
  } else {
    behaviour = configuration_.make(instance);
    counting = behaviour.get();
  }
  follow_clock(*counting, *clock_);
  if (auto* const crop = dynamic_cast<CropBehaviour*>(behaviour.get())) crop->attach(framebuffer.color);
  if (auto* const zrop = dynamic_cast<ZropBehaviour*>(behaviour.get()); zrop != nullptr) {
    zrop->attach(framebuffer.depth_stencil);
    if (ahead != ahead_.end()) zrop->follow(*ahead->second);
  }
  std::string module = instance.path;
  std::replace(module.begin(), module.end(), '.', '_');
  const unsigned gpcs = configuration_.netlist().gpcs();
  const Fidelity fidelity = configuration_.request().fidelity;
  std::unique_ptr<Unit> unit;
  if (fidelity == Fidelity::cycle) {
    unit = unit_maker(slot)(module, *clock_, std::move(behaviour), context, gpcs);
  } else {
    const Transport transport = fidelity == Fidelity::lt ? Transport::blocking : Transport::non_blocking;
    unit = timed_unit_maker(slot)(module, *clock_, std::move(behaviour), context, gpcs, transport);
  }
  if (Observers* const observers = configuration_.request().observers.get()) {
    if (StateObserver* const states = observers->of_unit(instance.path)) unit->observe_states(*states);
  }
  units_.push_back({&instance, std::move(unit), counting});
}

void Gpu::add_memories() {
  const std::vector<MemoryInstance>& memories = configuration_.netlist().memories();
  std::vector<TargetSockets> sockets;
  for (const MemoryInstance& memory : memories) sockets.push_back(make_memory(memory));
  for (std::size_t i = 0; i < memories.size(); ++i) bind_memory(memories[i], sockets[i]);
}

Gpu::TargetSockets Gpu::make_memory(const MemoryInstance& memory) {
  const auto units = static_cast<unsigned>(memory.units.size());
  TargetSockets sockets;
  if (units == 0) return sockets;  // all were connected to something else
  if (memory.make) {
    ForeignMemory made = memory.make(memory.path, units);
    if (made.module == nullptr) refuse_memory(memory.path, "nothing was made", "return a module and its sockets");
    memories_.push_back({&memory, std::move(made.module)});
    sockets = std::move(made.sockets);
    if (sockets.size() == 1) sockets.resize(units, sockets.front());
  } else {
    make_l2(memory);
    for (unsigned index = 0; index < units; ++index) sockets.push_back(&l2_->port(index));
  }
  return sockets;
}

void Gpu::make_l2(const MemoryInstance& memory) {
  if (l2_ != nullptr) refuse_memory(memory.path, "the platform has an L2 already", "connect its units to that");
  MemoryBelow below = MemoryBelow::none;
  for (const MemoryInstance& other : configuration_.netlist().memories()) {
    if (std::find(other.units.begin(), other.units.end(), memory.path) == other.units.end()) continue;
    below = configuration_.request().fidelity == Fidelity::cycle ? MemoryBelow::clocked : MemoryBelow::annotated;
  }
  const L2Parameters& parameters = configuration_.l2();
  l2_ = std::make_unique<FixedLatencyMemory>(memory.path.c_str(), *clock_, parameters.latency_cycles,
                                             parameters.bytes_per_cycle, static_cast<unsigned>(memory.units.size()),
                                             below);
}

void Gpu::bind_memory(const MemoryInstance& memory, const TargetSockets& sockets) {
  const std::size_t units = memory.units.size();
  if (sockets.size() < units) {
    refuse_memory(memory.path, fmt::format("{} units are connected to {} sockets", units, sockets.size()),
                  "give one for each, or one that takes many");
  }
  for (std::size_t index = 0; index < units; ++index) {
    const std::string& path = memory.units[index];
    Unit* const unit = find(path);
    if (unit == nullptr && l2_ == nullptr) refuse_memory(path, "no unit is connected to it", "leave it out");
    tlm::tlm_initiator_socket<32>* const socket = unit != nullptr ? unit->memory_socket() : &l2_->below();
    if (socket == nullptr) refuse_memory(path, "the unit has no memory port", "leave it out");
    socket->bind(*sockets[index]);
  }
}

void Gpu::check() const {
  const std::string& platform = configuration_.platform().name;
  const std::vector<MemoryInstance>& memories = configuration_.netlist().memories();
  for (const Placed& placed : units_) {
    const std::string& path = placed.instance->path;
    check_ports(*placed.unit, path, platform);
    const bool has_memory = std::any_of(memories.begin(), memories.end(), [&](const MemoryInstance& memory) {
      return std::find(memory.units.begin(), memory.units.end(), path) != memory.units.end();
    });
    if (placed.unit->memory_socket() == nullptr || has_memory) continue;
    throw UserError("incomplete platform " + platform, path, "its memory port is not connected", "use connect_memory");
  }
}

bool Gpu::frame_is_over() const {
  return !clock_->awaits_answers() && std::all_of(units_.begin(), units_.end(), [](const Placed& placed) {
    return placed.unit->idle() && (!placed.unit->ends_frame() || placed.unit->end_of_frame() != never);
  });
}

Cycle Gpu::run(std::atomic<float>* progress) {
  const RunRequest& request = configuration_.request();
  std::uint64_t seed = request.stall_seed;
  for (const Placed& placed : units_) {
    for (InPort* port : placed.unit->in_ports) {
      port->stall_randomly(mix(++seed), request.stall_per_256);
      port->open();
    }
    for (OutPort* port : placed.unit->out_ports) port->stall_randomly(mix(++seed), request.stall_per_256);
  }
  if (request.tick_order_seed != 0) {
    std::vector<unsigned> order(clock_->attached());
    std::iota(order.begin(), order.end(), 0U);
    for (std::size_t i = order.size(); i > 1; --i) {
      std::swap(order[i - 1], order[mix(request.tick_order_seed + i) % i]);
    }
    clock_->set_tick_order(order);
  }

  clock_->set_cycles_per_activation(64);

  // In slices, so that progress shows.
  const sc_core::sc_time slice = sc_core::sc_time::from_value(clock_->period().value() * 50000);
  const auto splats = static_cast<float>(std::max<std::uint32_t>(configuration_.frame().splats(), 1));
  const auto issued = [&] {
    std::uint64_t warps = 0;
    for (const OutPort* port : units_.front().unit->out_ports) warps += port->transferred();
    return static_cast<float>(warps * splats_per_vertex_warp);
  };
  // A clock with a timer among its units is never at rest; what is still on its way when the last unit is done has long
  // arrived after a slice.
  bool over = false;
  while (!clock_->run_to_rest(slice)) {
    if (progress != nullptr) *progress = std::min(1.0F, issued() / splats);
    const bool was_over = over;
    over = frame_is_over();
    if (was_over && over) break;
  }

  Cycle passed = 0;
  bool any_end = false;
  bool ended = true;
  for (const Placed& placed : units_) {
    if (!placed.unit->ends_frame()) continue;
    any_end = true;
    if (placed.unit->end_of_frame() == never) {
      ended = false;
    } else {
      passed = std::max(passed, placed.unit->end_of_frame());
    }
  }
  // A platform whose pipeline ends elsewhere is done when all have come to rest.
  if (!any_end) {
    ended = std::all_of(units_.begin(), units_.end(), [](const Placed& each) { return each.unit->idle(); });
    passed = clock_->now() + 1;
  }
  if (!ended) {
    std::string waiting;
    for (const Placed& placed : units_) {
      const Unit& unit = *placed.unit;
      if (unit.idle()) continue;
      waiting +=
          fmt::format("{}{} ({}", waiting.empty() ? "" : ", ", placed.instance->path, name_of(unit.account().state()));
      for (const InPort* port : unit.in_ports) {
        if (!port->empty()) waiting += fmt::format(", items at {}", port->name());
      }
      waiting += ")";
    }
    throw SimulationFault("deadlock", clock_->now(), "units with work left that wait for each other: " + waiting);
  }
  // A draw without quads ends when its end has passed through.
  const Cycle last_quad = clock_->frame_end().so_far();
  const Cycle end = last_quad > 0 ? last_quad : passed;
  for (const Placed& placed : units_) placed.unit->close_account(end);
  if (progress != nullptr) *progress = 1;
  return end;
}

}  // namespace vrpipe
