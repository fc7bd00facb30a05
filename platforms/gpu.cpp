#include <vrpipe/platforms/gpu.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "back_end.h"

#include <fmt/format.h>

#include <vrpipe/checked_behaviours.h>
#include <vrpipe/error.h>
#include <vrpipe/random.h>
#include <vrpipe/timed.h>

namespace vrpipe {

namespace {

std::pair<std::string, std::string> split_port(const std::string& port) {
  const std::size_t dot = port.rfind('.');
  if (dot == std::string::npos) {
    throw UserError("cannot connect", port, "a port is named UNIT.PORT", "name the unit as well");
  }
  return {port.substr(0, dot), port.substr(dot + 1)};
}

}  // namespace

Gpu::Gpu(const Configuration& configuration, ColorSurface& surface)
    : configuration_(configuration),
      surface_(surface),
      clock_(std::make_unique<ClockDomain>("clock", static_cast<std::uint64_t>(
                                                        std::llround(1e6 / configuration.platform().frequency_mhz)))),
      l2_(std::make_unique<FixedLatencyMemory>("l2", *clock_, configuration.l2().latency_cycles,
                                               configuration.l2().bytes_per_cycle, configuration.platform().gpcs)) {
  wire();
  check_ports();
}

Gpu::~Gpu() = default;

void Gpu::wire() {
  const Platform& platform = configuration_.platform();
  call_with_fault([&] { platform.wire(*this); },
                  [&](const char* text) {
                    throw SimulationFault("platform " + platform.name, 0,
                                          std::string("its wiring throws ") +
                                              (text != nullptr ? text : "an exception of unknown type"));
                  });
}

unsigned Gpu::gpcs() const { return configuration_.platform().gpcs; }

Unit& Gpu::add_unit(const std::string& name, const std::string& slot, const RenderState& state) {
  std::unique_ptr<Behaviour> behaviour = configuration_.make(slot, state.gpc);
  follow_clock(*behaviour, *clock_);
  if (auto* const crop = dynamic_cast<CropBehaviour*>(behaviour.get())) crop->attach(surface_);
  if (auto* const zrop = dynamic_cast<ZropBehaviour*>(behaviour.get());
      zrop != nullptr && state.termination == Termination::strict && state.early_termination) {
    foresights_.push_back(std::make_unique<BinForesight>(configuration_, state.gpc));
    zrop->foresee(*foresights_.back());
  }
  std::string module = name;
  std::replace(module.begin(), module.end(), '.', '_');
  const Fidelity fidelity = configuration_.request().fidelity;
  if (fidelity == Fidelity::cycle) {
    units_.push_back(unit_maker(slot)(module, *clock_, std::move(behaviour), state, gpcs()));
  } else {
    const Transport transport = fidelity == Fidelity::lt ? Transport::blocking : Transport::non_blocking;
    units_.push_back(timed_unit_maker(slot)(module, *clock_, std::move(behaviour), state, gpcs(), transport));
  }
  names_.push_back(name);
  return *units_.back();
}

Unit& Gpu::add_front_end(const std::string& slot) { return add_unit(slot, slot, configuration_.state_of(0)); }

Unit& Gpu::add(unsigned gpc, const std::string& slot) {
  return add_unit("gpc" + std::to_string(gpc) + "." + slot, slot, configuration_.state_of(gpc));
}

Unit& Gpu::unit(const std::string& name) {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) {
    throw UserError("unknown unit '" + name + "'", "platform " + configuration_.platform().name,
                    "it was not added to the GPU", "did you mean " + nearest_name(name, names_) + "?");
  }
  return *units_[static_cast<std::size_t>(found - names_.begin())];
}

void Gpu::connect(const std::string& out, const std::string& in, unsigned depth, unsigned latency) {
  const auto [from, out_port] = split_port(out);
  const auto [to, in_port] = split_port(in);
  unit(from).out(out_port).connect(unit(to).in(in_port), depth, latency);
}

void Gpu::connect_to_l2(const std::string& name) {
  tlm::tlm_initiator_socket<32>* const socket = unit(name).memory_socket();
  if (socket == nullptr) throw UserError("cannot connect", name, "the unit has no memory port", "leave it out");
  socket->bind(l2_->port(l2_ports_++));
}

void Gpu::check_ports() const {
  const auto check = [&](const auto& ports, const std::string& unit) {
    for (const auto* port : ports) {
      if (port->connected()) continue;
      throw UserError("incomplete platform " + configuration_.platform().name, unit + "." + port->name(),
                      "the port is not connected", "connect or stub it");
    }
  };
  for (std::size_t i = 0; i < units_.size(); ++i) {
    check(units_[i]->in_ports, names_[i]);
    check(units_[i]->out_ports, names_[i]);
  }
}

Cycle Gpu::run(std::atomic<float>* progress) {
  const RunRequest& request = configuration_.request();
  std::uint64_t seed = request.stall_seed;
  for (const auto& unit : units_) {
    for (InPort* port : unit->in_ports) {
      port->stall_randomly(mix(++seed), request.stall_per_256);
      port->open();
    }
    for (OutPort* port : unit->out_ports) port->stall_randomly(mix(++seed), request.stall_per_256);
  }
  if (request.tick_order_seed != 0) {
    std::vector<unsigned> order(units_.size());
    std::iota(order.begin(), order.end(), 0U);
    for (std::size_t i = order.size(); i > 1; --i) {
      std::swap(order[i - 1], order[mix(request.tick_order_seed + i) % i]);
    }
    clock_->set_tick_order(order);
  }

  // Unless a memory of another make has time of its own, the kernel's need not advance in every cycle.
  const auto memory_ports =
      std::count_if(units_.begin(), units_.end(), [](const auto& unit) { return unit->memory_socket() != nullptr; });
  if (static_cast<unsigned>(memory_ports) == l2_ports_) clock_->set_cycles_per_activation(64);

  // In slices, so that progress shows; the clock is quiet once nothing is left to do.
  const sc_core::sc_time slice = sc_core::sc_time::from_value(clock_->period().value() * 50000);
  const auto splats = static_cast<float>(std::max<std::size_t>(configuration_.state_of(0).draw->splats.size(), 1));
  const auto issued = [&] {
    std::uint64_t warps = 0;
    for (const OutPort* port : units_.front()->out_ports) warps += port->transferred();
    return static_cast<float>(warps * splats_per_vertex_warp);
  };
  do {
    clock_->run(slice);
    if (progress != nullptr) {
      *progress = std::min(1.0F, issued() / splats);
    }
  } while (sc_core::sc_pending_activity());

  Cycle passed = 0;
  bool ended = true;
  for (const auto& unit : units_) {
    if (dynamic_cast<CropBehaviour*>(&unit->behaviour()) == nullptr) continue;
    if (unit->end_of_draw() == never) {
      ended = false;
    } else {
      passed = std::max(passed, unit->end_of_draw());
    }
  }
  if (!ended) {
    std::string waiting;
    for (std::size_t i = 0; i < units_.size(); ++i) {
      if (units_[i]->idle()) continue;
      waiting += fmt::format("{}{} ({}", waiting.empty() ? "" : ", ", names_[i], name_of(units_[i]->account().state()));
      for (const InPort* port : units_[i]->in_ports) {
        if (!port->empty()) waiting += fmt::format(", items at {}", port->name());
      }
      waiting += ")";
    }
    throw SimulationFault("deadlock", clock_->now(), "units with work left that wait for each other: " + waiting);
  }
  // A draw without quads ends when its end has passed through.
  const Cycle last_quad = clock_->draw_end().so_far();
  const Cycle end = last_quad > 0 ? last_quad : passed;
  for (const auto& unit : units_) unit->close_account(end);
  if (progress != nullptr) *progress = 1;
  return end;
}

}  // namespace vrpipe
