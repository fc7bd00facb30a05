// A slot of one's own as a plugin, and a platform that has a unit of it: it counts the quads on their way from RASTER to
// TC. `vrpipe run --plugin tally_slot.so --platform tallied`.
#include <vrpipe/model/timed.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/simulation.h>

VRPIPE_PLUGIN

namespace {

using namespace vrpipe;

/// What the slot's units do, without time.
class TallyBehaviour : public Behaviour {
 public:
  virtual void pass(const QuadBeat& beat) = 0;
  virtual Throughput timing() const = 0;  ///< items: beats
};

/// And one of them.
class QuadTally : public TallyBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer beats_per_cycle{
        *this, "beats_per_cycle", 4, 1, 64, "beats", "as many as RASTER makes fine tiles", "passed in a cycle"};
  };
  QuadTally(const Parameters& parameters, const RenderContext&) : timing_{parameters.beats_per_cycle, 1} {}
  void pass(const QuadBeat& beat) override {
    quads += beat.count;
    single_quads += beat.count == 1 ? 1U : 0U;
  }
  Throughput timing() const override { return timing_; }

  Counter quads{*this, "quads", "quads", "that passed"};
  Counter single_quads{*this, "single_quads", "quads", "that came alone"};

 private:
  const Throughput timing_;
};

std::vector<WorkKind> kinds(const Throughput& timing) { return {{"beats", 0, 1.0 / timing.items_per_cycle, true}}; }

/// At `functional` and `bound`.
class UntimedTally : public UntimedUnit {
 public:
  UntimedTally(const std::string& name, std::unique_ptr<TallyBehaviour> behaviour)
      : UntimedUnit(name, kinds(behaviour->timing())),
        out_(*this, "out_quads"),
        in_(input<QuadBeat>("in_quads",
                            [this](const QuadBeat& beat) {
                              behaviour_->pass(beat);
                              did(0, 1);
                              out_.send(beat);
                            })),
        behaviour_(std::move(behaviour)) {}
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  UntimedOut<QuadBeat> out_;
  std::unique_ptr<UntimedIn<QuadBeat>> in_;
  std::unique_ptr<TallyBehaviour> behaviour_;
};

/// At `lt`: an item is given with the cycle in which it becomes visible; the handler returns when it leaves.
class TimedTally : public TimedUnit {
 public:
  TimedTally(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<TallyBehaviour> behaviour)
      : TimedUnit(name, domain, kinds(behaviour->timing())),
        out_(*this, "out_quads"),
        in_(*this, "in_quads",
            [this](const QuadBeat& beat, CycleInterval visible) { return pass(beat, visible.first); }),
        behaviour_(std::move(behaviour)),
        lane_(behaviour_->timing().items_per_cycle) {}
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Cycle pass(const QuadBeat& beat, Cycle visible) {
    lane_.hold(out_.last());
    const Cycle at = lane_.take(visible);
    behaviour_->pass(beat);
    did(0, 1, at);
    charge(UnitState::starved, at);
    const Cycle taken = out_.send(beat, at).first;
    charge(UnitState::blocked, taken);
    charge(UnitState::busy, taken + 1);
    return taken;
  }

  TimedOut<QuadBeat> out_;
  TimedIn<QuadBeat> in_;
  std::unique_ptr<TallyBehaviour> behaviour_;
  IssuePort lane_;
};

/// At `cycle`: what the unit can do in one cycle.
class TallyUnit : public Unit {
 public:
  TallyUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<TallyBehaviour> behaviour)
      : Unit(name, domain, kinds(behaviour->timing())),
        in_(*this, "in_quads"),
        out_(*this, "out_quads"),
        behaviour_(std::move(behaviour)),
        beats_per_cycle_(behaviour_->timing().items_per_cycle) {}
  bool idle() const override { return in_.empty(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Cycle tick(Cycle now) override {
    unsigned passed = 0;
    while (passed < beats_per_cycle_ && in_.ready() && out_.credits() > 0) {
      behaviour_->pass(in_.front());
      out_.push(in_.front());
      in_.pop();
      ++passed;
    }
    if (passed > 0) did(0, passed, now);
    if (passed > 0) {
      enter(UnitState::busy, now);
      return now + 1;
    }
    enter(in_.ready() ? UnitState::blocked : UnitState::starved, now);
    return in_.ready() ? never : in_.next_ready();
  }

  StreamIn<QuadBeat> in_;
  StreamOut<QuadBeat> out_;
  std::unique_ptr<TallyBehaviour> behaviour_;
  const unsigned beats_per_cycle_;
};

Platform tallied() {
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.name = "tallied";
  platform.description = "agx-orin-ideal-memory with a tally between RASTER and TC";
  platform.wire = [wire = platform.wire](Netlist& netlist) {
    wire(netlist);
    netlist.insert("gpc0.raster.out_quads", "gpc0.tally", "tally", "in_quads", "out_quads");
  };
  return platform;
}

// The slot stands behind RASTER, of rank 40, in lists; its default unit is quad-tally.
const SlotRegistrar slot{{"tally", 45, "quad-tally"}};
const Registrar<QuadTally, TallyBehaviour> unit("tally", "quad-tally", "counts the quads that pass");
[[maybe_unused]] const bool registered = [] {
  register_untimed_unit_maker("tally", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                          const RenderContext&, unsigned) {
    return std::make_unique<UntimedTally>(name, behaviour_as<TallyBehaviour>(std::move(behaviour)));
  });
  register_timed_unit_maker("tally", [](const std::string& name, ClockDomain& domain,
                                        std::unique_ptr<Behaviour> behaviour, const RenderContext&, unsigned) {
    return std::make_unique<TimedTally>(name.c_str(), domain, behaviour_as<TallyBehaviour>(std::move(behaviour)));
  });
  register_unit_maker("tally", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                  const RenderContext&, unsigned) {
    return std::make_unique<TallyUnit>(name.c_str(), domain, behaviour_as<TallyBehaviour>(std::move(behaviour)));
  });
  add_platform(tallied());
  return true;
}();

}  // namespace
