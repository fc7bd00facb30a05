#include <vrpipe/platforms/gpu.h>

#include <algorithm>
#include <numeric>

#include "elaboration/elaborate.h"
#include "elaboration/hierarchy.h"
#include "elaboration/run_ahead.h"

#include <fmt/format.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/model/border.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/checked_behaviours.h>
#include <vrpipe/pipeline/slots/memory.h>
#include <vrpipe/pipeline/slots/zrop.h>
#include <vrpipe/platforms/foreign_memory.h>

namespace vrpipe {

namespace {

[[noreturn]] void refuse_memory(const std::string& where, const std::string& why, const std::string& remedy) {
  throw UserError("cannot connect memory", where, why, remedy);
}

const EffectRegistrar kernel_time{{"clock",
                                   "kernel_time",
                                   "",
                                   EffectKind::timing,
                                   "the kernel's time keeps step with the clock, cycle by cycle",
                                   "there is no time; else unless a memory port is bound to what has time of its own",
                                   "an activation of the kernel in each cycle, instead of one in up to 64",
                                   "at the start, at a memory port that is bound to what has time of its own",
                                   {},
                                   [](const EffectQuestion& asked) {
                                     if (!asked.has_time)
                                       return EffectDecision::omit("there is no time at this fidelity");
                                     return EffectDecision::watch("ports that are bound to what has time of its own");
                                   }}};
const EffectRegistrar sockets_effect{
    {"link",
     "sockets",
     "",
     EffectKind::timing,
     "items and accesses pass TLM-2.0 sockets, where they can be looked at from outside",
     "nobody observes a link, or there is no time: then links are calls",
     "calls through sockets and payloads, instead of calls of the other end",
     "at elaboration, where a link is observed",
     {},
     [](const EffectQuestion& asked) {
       if (!asked.has_time) return EffectDecision::omit("links are calls at this fidelity");
       if (asked.observed_links == 0) return EffectDecision::omit("nobody observes a link");
       return EffectDecision::keep(
           fmt::format("{} link{} observed", asked.observed_links, asked.observed_links == 1 ? " is" : "s are"));
     }}};

const EffectRegistrar back_pressure{
    {"link",
     "back_pressure",
     "",
     EffectKind::timing,
     "queues of a limited depth, and credits for their places",
     "a queue that never fills is as fast as one without limit: credits are counted for nothing else, and cost little",
     "credits",
     "",
     {},
     nullptr}};

}  // namespace

Gpu::Gpu(const Configuration& configuration, Framebuffer& framebuffer)
    : configuration_(configuration),
      clock_(std::make_unique<ClockDomain>("clock", configuration.context_of(0).clock_ps)),
      hierarchy_(std::make_unique<Hierarchy>(configuration.netlist())),
      kernel_time_gate_(configuration.context_of(0), "clock.kernel_time") {
  clock_->ask_about_own_time([this] { return kernel_time_gate_.enter(); });
  if (const std::size_t draws = configuration.frame().draws().size(); draws > 1) clock_->frame_end().tell_draws(draws);
  EffectGate sockets(configuration.context_of(0), "link.sockets");
  if (configuration.request().effects.elaborates_all_of("link.sockets")) clock_->set_passes_sockets();
  const Netlist& netlist = configuration.netlist();
  const RunRequest& request = configuration.request();
  check_needs(configuration);
  for (const Instance& instance : netlist.instances()) {
    const bool runs_ahead = instance.slot == "zrop" && request.termination == Termination::strict &&
                            configuration.frame().terminates_early();
    if (runs_ahead) ahead_[instance.gpc] = std::make_unique<RunAhead>(configuration, instance.gpc, framebuffer.color);
  }
  for (const Instance& instance : netlist.instances()) {
    if (!Netlist::is_memory(instance)) add(instance, framebuffer);
  }
  Observers* observers = request.observers.get();
  const bool observes_links =
      observers != nullptr && std::any_of(netlist.links().begin(), netlist.links().end(),
                                          [&](const Link& link) { return observers->observes_link(link.name()); });
  connect_units(
      netlist, observes_links && sockets.enter() ? observers : nullptr,
      [&](const std::string& path) { return find(path); },
      [&](const Link& link, Component& sender, OutPort& out, Component& receiver, InPort& in,
          const LinkOptions& options) {
        Border* const from = border_of(split_port(link.from).first);
        Border* const to = border_of(split_port(link.to).first);
        if (from == nullptr && to == nullptr) return out.connect(in, options);
        connect_across_borders({from, sender, out, to, receiver, in}, options);
      });
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

Border* Gpu::border_of(const std::string& path) const {
  const auto found = borders_.find(path);
  return found == borders_.end() ? nullptr : found->second.get();
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
    if (ahead != ahead_.end() && slot == "zrop" && configuration_.frame().tests_late()) {
      behaviour = ahead->second->repeat_late_tests(std::move(behaviour));
    }
  }
  behaviour->use_surfaces(framebuffer);
  if (auto* const zrop = dynamic_cast<ZropBehaviour*>(behaviour.get()); zrop != nullptr && ahead != ahead_.end()) {
    zrop->follow(*ahead->second);
  }
  const unsigned gpcs = configuration_.netlist().gpcs();
  const bool is_at_cycle = configuration_.is_at_cycle(instance);
  const UnitMaker& make = is_at_cycle ? unit_maker(slot) : timed_unit_maker(slot);
  const Hierarchy::Place place = hierarchy_->place_of(instance.path);
  ClockDomain* clock = clock_.get();
  if (is_at_cycle && configuration_.request().fidelity != Fidelity::cycle) {
    std::unique_ptr<Border>& border = borders_[instance.path];
    border = std::make_unique<Border>((place.name + "_clock").c_str(), *clock_);
    clock = border.get();
  }
  follow_clock(*counting, *clock);
  std::unique_ptr<Unit> unit = make(place.name, *clock, std::move(behaviour), context, gpcs);
  if (Observers* const observers = configuration_.request().observers.get()) {
    if (StateObserver* const states = observers->of_unit(instance.path)) unit->observe_states(*states);
  }
  units_.push_back({&instance, std::move(unit), counting});
}

void Gpu::add_memories() {
  const Netlist& netlist = configuration_.netlist();
  struct Made {
    std::string path;
    std::vector<std::string> bound;
    TargetSockets sockets;
  };
  std::vector<Made> made;
  // Of what a memory that nobody uses would be bound to, nothing is needed either.
  const std::vector<std::string> used = netlist.used_memories();
  const auto bound_to = [&](const std::string& path) {
    std::vector<std::string> bound = netlist.bound_to(path);
    const auto is_unused = [&](const std::string& from) {
      const Instance* const above = netlist.find(from);
      return above != nullptr && Netlist::is_memory(*above) && std::find(used.begin(), used.end(), from) == used.end();
    };
    bound.erase(std::remove_if(bound.begin(), bound.end(), is_unused), bound.end());
    return bound;
  };
  for (const std::string& path : used) {
    std::vector<std::string> bound = bound_to(path);
    const Instance* const instance = netlist.find(path);
    std::vector<unsigned> ports;
    for (const std::string& from : bound) ports.push_back(memory_bytes_per_cycle(from));
    made.push_back({path, std::move(bound), {}});
    if (instance != nullptr) {
      made.back().sockets = make_memory(*instance, ports);
      continue;
    }
    for (const ForeignInstance& foreign : netlist.foreign_memories()) {
      if (foreign.path == path) made.back().sockets = make_foreign(foreign, static_cast<unsigned>(ports.size()));
    }
  }
  for (const Made& each : made) bind_memory(each.path, each.bound, each.sockets);
}

unsigned Gpu::memory_bytes_per_cycle(const std::string& path) const {
  if (const Unit* const unit = find(path)) return unit->memory_bytes_per_cycle();
  unsigned sum = 0;
  for (const std::string& above : configuration_.netlist().bound_to(path)) {
    const unsigned bytes = memory_bytes_per_cycle(above);
    if (bytes == 0) return 0;
    sum += bytes;
  }
  return sum;
}

Gpu::TargetSockets Gpu::make_memory(const Instance& instance, const std::vector<unsigned>& ports) {
  const std::vector<MemoryLink>& links = configuration_.netlist().memory_links();
  const bool has_below =
      std::any_of(links.begin(), links.end(), [&](const MemoryLink& link) { return link.from == instance.path; });
  const MemoryPlace place{ports, has_below, configuration_.request().fidelity == Fidelity::cycle};
  auto behaviour = configuration_.make_as<MemoryBehaviour>(instance);
  check_below(configuration_.netlist(), instance.path, *behaviour, configuration_.platform().name);
  const Hierarchy::Place in = hierarchy_->place_of(instance.path);
  memories_.push_back({&instance, memory_unit_maker(instance.slot)(in.name, *clock_, std::move(behaviour), place)});
  TargetSockets sockets;
  for (unsigned index = 0; index < ports.size(); ++index) sockets.push_back(&memories_.back().memory->target(index));
  return sockets;
}

Gpu::TargetSockets Gpu::make_foreign(const ForeignInstance& foreign, unsigned ports) {
  const Hierarchy::Place place = hierarchy_->place_of(foreign.path);
  ForeignMemory made = foreign.make(place.name, ports);
  if (made.module == nullptr) refuse_memory(foreign.path, "nothing was made", "return a module and its sockets");
  foreign_memories_.push_back({&foreign, std::move(made.module)});
  TargetSockets sockets = std::move(made.sockets);
  if (sockets.size() == 1) sockets.resize(ports, sockets.front());
  return sockets;
}

void Gpu::bind_memory(const std::string& path, const std::vector<std::string>& bound, const TargetSockets& sockets) {
  if (sockets.size() < bound.size()) {
    refuse_memory(path, fmt::format("{} units are connected to {} sockets", bound.size(), sockets.size()),
                  "give one for each, or one that takes many");
  }
  for (std::size_t index = 0; index < bound.size(); ++index) {
    tlm::tlm_initiator_socket<32>* socket = nullptr;
    if (Unit* const unit = find(bound[index])) {
      socket = unit->memory_socket();
    } else {
      for (const PlacedMemory& above : memories_) {
        if (above.instance->path == bound[index]) socket = above.memory->below();
      }
    }
    if (socket == nullptr) refuse_memory(bound[index], "it has no memory port", "leave it out");
    socket->bind(*sockets[index]);
  }
}

void Gpu::check() const {
  const std::string& platform = configuration_.platform().name;
  const std::vector<MemoryLink>& links = configuration_.netlist().memory_links();
  for (const Placed& placed : units_) {
    const std::string& path = placed.instance->path;
    check_ports(*placed.unit, path, platform);
    const bool has_memory =
        std::any_of(links.begin(), links.end(), [&](const MemoryLink& link) { return link.from == path; });
    if (placed.unit->memory_socket() == nullptr || placed.unit->memory_is_optional() || has_memory) continue;
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
  for (const Placed& placed : units_) {
    // Of its own, so that a unit's stalls are the same whichever others are there.
    std::uint64_t seed = request.stall_seed;
    for (const char letter : placed.instance->path) seed = mix(seed ^ static_cast<unsigned char>(letter));
    for (InPort* port : placed.unit->in_ports) {
      port->stall_randomly(mix(++seed), request.stall_per_256);
      port->open();
    }
    for (OutPort* port : placed.unit->out_ports) port->stall_randomly(mix(++seed), request.stall_per_256);
  }
  for (const auto& [path, border] : borders_) border->open();
  if (request.tick_order_seed != 0) {
    std::vector<unsigned> order(clock_->attached());
    std::iota(order.begin(), order.end(), 0U);
    for (std::size_t i = order.size(); i > 1; --i) {
      std::swap(order[i - 1], order[mix(request.tick_order_seed + i) % i]);
    }
    clock_->set_tick_order(order);
  }

  if (request.stop_at > 0) clock_->stop_at(request.stop_at);
  clock_->set_cycles_per_activation(configuration_.request().effects.elaborates_all_of("clock.kernel_time") ? 1 : 64);

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

  // A draw without quads ends when its end has passed through.
  const Cycle last_quad = clock_->frame_end().so_far();
  stopped_ = clock_->stopped() && !frame_is_over();
  if (stopped_) return close(std::max<Cycle>(request.stop_at, last_quad), progress);

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
  return close(last_quad > 0 ? last_quad : passed, progress);
}

Cycle Gpu::close(Cycle end, std::atomic<float>* progress) {
  for (const Placed& placed : units_) placed.unit->close_account(end);
  for (const PlacedMemory& placed : memories_) placed.memory->close(end);
  if (progress != nullptr) *progress = 1;
  return end;
}

}  // namespace vrpipe
