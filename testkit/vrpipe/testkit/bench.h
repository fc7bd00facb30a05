#pragma once

#include <algorithm>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <systemc>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/checked_behaviours.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/behaviour.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/testkit/sink.h>
#include <vrpipe/testkit/source.h>

namespace vrpipe::testkit {

/// A testbench around one unit, at `cycle` or another fidelity with time: sources and sinks by port name, the rest stubbed.
///
///     Draw draw;
///     draw.width = draw.height = 64;
///     RenderContext context;
///     context.frame = Frame::of(draw);
///
///     Bench bench("qru", "pairing", context, {{"quads_per_cycle", "4"}});   // a plugin's: load_plugin("my.so") first
///     Source<QuadBeat>& quads = bench.source<QuadBeat>("in_quads");
///     Sink<Warp>& warps = bench.sink<Warp>("out_warps");
///     quads.add(beat);                  // as soon as there is room
///     quads.add(later_beat, 100);       // not before cycle 100
///     warps.close(0, 50);               // takes nothing in cycles 0 to 49
///     bench.stall_randomly(seed, 64);   // every port pretends that nothing moves in a quarter of the cycles
///     bench.run();
///     for (const auto& record : warps.records()) { record.cycle; record.item; }
///
/// Bench(Fidelity::lt, "qru", ...) makes the unit's timing model of `lt` instead, and sources and sinks that speak its
/// protocol; all else is written once. Where a batch moves in one piece there, the item is another (batch.h):
/// `source<BinItem>` for `source<QuadBeat>`.
///
/// Each Bench has a SystemC context of its own, so that a program can have one after another (not two at a time).
class Bench {
 public:
  using Settings = std::vector<std::pair<std::string, std::string>>;  ///< parameter and value, as for --set

  /// A bench without a unit, for sources and sinks connected to one another or to modules of your own.
  explicit Bench(std::uint64_t period_ps = 1000) : Bench(Fidelity::cycle, period_ps) {}
  /// Throws UserError for a fidelity without time.
  explicit Bench(Fidelity fidelity, std::uint64_t period_ps = 1000) : fidelity_(fidelity) {
    if (fidelity != Fidelity::lt && fidelity != Fidelity::cycle) {
      throw UserError("no testbench", std::string("fidelity ") + name_of(fidelity), "units have no ports there",
                      "choose lt or cycle");
    }
    fresh_simulation();
    clock_ = std::make_unique<ClockDomain>("clock", period_ps);
  }

  /// @param context  copied. @param gpcs  that a front-end unit serves.
  /// Throws UserError for an unknown slot, implementation, parameter or value.
  Bench(const std::string& slot, const std::string& implementation, const RenderContext& context,
        const Settings& settings = {}, unsigned gpcs = 1)
      : Bench(Fidelity::cycle, slot, implementation, context, settings, gpcs) {}
  Bench(Fidelity fidelity, const std::string& slot, const std::string& implementation, const RenderContext& context,
        const Settings& settings = {}, unsigned gpcs = 1)
      : Bench(fidelity) {
    context_ = context;
    const Implementation& found = Registry::instance().find(slot, implementation);
    const std::unique_ptr<ParameterSet> parameters = found.make_parameters();
    for (const auto& [name, value] : settings) parameters->set(slot, name, value);
    std::unique_ptr<Behaviour> behaviour = found.make_behaviour(*parameters, context_);
    // Clearing surfaces takes longer than most tests of units that have none.
    if (slot == "crop" || slot == "sm" || slot == "zrop") framebuffer_ = Framebuffer(*context.frame, context.format);
    behaviour->use_surfaces(framebuffer_);
    behaviour->unit().set_draws(context.frame->draws().size());
    follow_clock(*behaviour, *clock_);
    unit_ = clocked() ? unit_maker(slot)(slot, *clock_, std::move(behaviour), context_, gpcs)
                      : timed_unit_maker(slot)(slot, *clock_, std::move(behaviour), context_, gpcs);
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  Fidelity fidelity() const { return fidelity_; }
  ClockDomain& clock() { return *clock_; }
  Unit& unit() { return *unit_; }
  /// The unit's behaviour as the class that it is, for its counters: behaviour<PairingQru>(). Of a plugin's class, link
  /// the plugin (vrpipe_add_plugin makes a library that can be linked and loaded); it is registered then without
  /// load_plugin.
  template <class Type>
  Type& behaviour() {
    return dynamic_cast<Type&>(unit_->behaviour().unit());
  }
  /// What a CROP blends into, and shaders read; of one pixel in the benches of units that do neither.
  ColorSurface& surface() { return framebuffer_.color; }

  /// A source connected to an input of the unit, or, without a port's name, to nothing yet.
  template <class Item>
  Source<Item>& source(const std::string& port = "", unsigned depth = 4, unsigned latency = 1) {
    const char* const name = sc_core::sc_gen_unique_name("source");
    Source<Item>& made = clocked()
                             ? static_cast<Source<Item>&>(keep(std::make_unique<ClockedSource<Item>>(name, *clock_)))
                             : keep(std::make_unique<TimedSource<Item>>(name, *clock_));
    if (!port.empty()) made.out().connect(unit_->in(port), depth, latency);
    return made;
  }

  /// A sink connected to an output of the unit, or to nothing yet.
  template <class Item>
  Sink<Item>& sink(const std::string& port = "", unsigned depth = 4, unsigned latency = 1) {
    const char* const name = sc_core::sc_gen_unique_name("sink");
    Sink<Item>& made = clocked() ? static_cast<Sink<Item>&>(keep(std::make_unique<ClockedSink<Item>>(name, *clock_)))
                                 : keep(std::make_unique<TimedSink<Item>>(name, *clock_));
    if (!port.empty()) unit_->out(port).connect(made.in(), depth, latency);
    return made;
  }

  /// Binds the unit's memory port to a memory of your own; without it, a FixedLatencyMemory is made, for a port that may
  /// stay unconnected only once `set_memory` is called.
  void bind_memory(tlm::tlm_base_target_socket_b<32>& memory) {
    unit_->memory_socket()->bind(memory);
    memory_bound_ = true;
  }
  /// Time and bytes per cycle of the memory that is made.
  void set_memory(unsigned latency_cycles, unsigned bytes_per_cycle) {
    memory_latency_ = latency_cycles;
    memory_bytes_per_cycle_ = bytes_per_cycle;
    memory_wanted_ = true;
  }

  /// Every port stalls at random in `per_256` of 256 cycles, each differently.
  void stall_randomly(std::uint64_t seed, unsigned per_256) {
    stall_seed_ = seed;
    stall_per_256_ = per_256;
  }
  /// Ticks unit, sources and sinks in a random order, which changes nothing at `cycle`.
  void shuffle_ticks(std::uint64_t seed) { tick_seed_ = seed; }

  /// Runs until nothing moves any more; once. Modules of your own may move an item again within 10,000 cycles; timers
  /// that never end, as of a memory's refresh, are not waited for. Returns the last cycle in which something was asked to
  /// move; at `lt` the clock need not come as far as the items. Throws SimulationFault when that takes more than
  /// `limit` cycles, or a memory does not answer.
  Cycle run(Cycle limit = 10'000'000) {
    prepare();
    std::uint64_t edges = 0;
    do {
      if (clock_->now() > limit) throw SimulationFault("bench", clock_->now(), "it does not come to rest");
      edges = clock_->edges();
      clock_->run(sc_core::sc_time::from_value(clock_->period().value() * 10000));
      clock_->check_answers();
    } while (sc_core::sc_pending_activity() && !(clock_->at_rest() && clock_->edges() == edges));
    return clock_->now();
  }

 private:
  bool clocked() const { return fidelity_ == Fidelity::cycle; }

  template <class Owner>
  Owner& keep(std::unique_ptr<Owner> made) {
    Owner& kept = *made;
    owners_.push_back(&kept);
    modules_.push_back(std::move(made));
    return kept;
  }

  void prepare() {
    std::vector<PortOwner*> owners = owners_;
    if (unit_) owners.insert(owners.begin(), unit_.get());
    std::uint64_t seed = stall_seed_;
    for (PortOwner* owner : owners) {
      for (InPort* port : owner->in_ports) {
        if (!port->connected()) port->stub();
        port->stall_randomly(mix(++seed), stall_per_256_);
        port->open();
      }
      for (OutPort* port : owner->out_ports) {
        if (!port->connected()) port->stub();
        port->stall_randomly(mix(++seed), stall_per_256_);
      }
    }
    const bool needs_memory = unit_ && unit_->memory_socket() != nullptr && !memory_bound_ &&
                              (memory_wanted_ || !unit_->memory_is_optional());
    if (needs_memory) {
      memory_ = std::make_unique<FixedLatencyMemory>("memory", *clock_, memory_latency_, memory_bytes_per_cycle_, 1);
      bind_memory(memory_->port(0));
    }
    if (tick_seed_ != 0) {
      std::vector<unsigned> order(owners.size());
      std::iota(order.begin(), order.end(), 0U);
      for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[mix(tick_seed_ + i) % i]);
      clock_->set_tick_order(order);
    }
  }

  const Fidelity fidelity_;
  std::unique_ptr<ClockDomain> clock_;
  RenderContext context_;
  Framebuffer framebuffer_;
  std::unique_ptr<FixedLatencyMemory> memory_;
  std::unique_ptr<Unit> unit_;
  std::vector<std::unique_ptr<sc_core::sc_module>> modules_;
  std::vector<PortOwner*> owners_;
  unsigned memory_latency_ = 146;
  unsigned memory_bytes_per_cycle_ = 128;
  bool memory_bound_ = false;
  bool memory_wanted_ = false;
  std::uint64_t stall_seed_ = 0;
  unsigned stall_per_256_ = 0;
  std::uint64_t tick_seed_ = 0;
};

}  // namespace vrpipe::testkit
