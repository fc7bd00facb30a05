#include <vrpipe/model/unit.h>

namespace vrpipe {

namespace {

/// ZROP at cycle fidelity. One z-cache port: a cycle either applies updates, which go first, or tests.
/// Ports: in_quads, out_quads (QuadBeat), in_terminations (TerminationBeat).
class ZropUnit : public Unit {
 public:
  ZropUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<ZropBehaviour> behaviour)
      : Unit(name, domain, ZropWork::kinds(behaviour->timing())),
        in_(*this, "in_quads"),
        out_(*this, "out_quads"),
        in_terminations_(*this, "in_terminations"),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        limit_(timing_.quads_per_cycle) {
    out_.set_pipeline(timing_.latency_cycles - 1, timing_.quads_per_cycle);
  }

  bool idle() const override { return in_.empty() && in_terminations_.empty(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  bool update(Cycle now) {
    unsigned budget = timing_.updates_per_cycle;
    bool moved = false;
    while (budget > 0 && in_terminations_.ready()) {
      const TerminationBeat& beat = in_terminations_.front();
      while (budget > 0 && signal_ < beat.count) {
        behaviour_->update(beat.signals[signal_++]);
        --budget;
      }
      moved = true;
      if (signal_ < beat.count) break;
      in_terminations_.pop();
      signal_ = 0;
    }
    // Beside a beat that takes several cycles an update takes nothing of its own.
    if (moved && now >= tested_until_) did(ZropWork::updates, 1, now);
    return moved;
  }

  bool test(Cycle now) {
    bool moved = false;
    while (in_.ready() && out_.credits() > 0) {
      const unsigned width = std::max<unsigned>(in_.front().count, 1);
      if (!limit_.allows(width, now)) break;
      QuadBeat beat = in_.front();
      in_.pop();
      tested_until_ = now + (width + timing_.quads_per_cycle - 1) / timing_.quads_per_cycle;
      did(ZropWork::tests, beat.count, now, tested_until_);
      const unsigned tested = beat.count;
      if (beat.mark == Mark::none) {
        behaviour_->test(beat);
      } else {
        behaviour_->pass(beat.mark);
      }
      if (beat.count < tested) frame_lasts(now + timing_.latency_cycles);
      moved = true;
      // A beat without survivors goes no further, but for the mark that closes a bin.
      if (beat.count > 0 || beat.last_of_bin || beat.mark != Mark::none) out_.push(beat);
      limit_.take(width);
    }
    if (moved) free_at_ = limit_.next(now);
    return moved;
  }

  Cycle tick(Cycle now) override {
    if (update(now) || (now >= free_at_ && test(now))) {
      enter(UnitState::busy, now);
      return now + 1;
    }
    if (now < free_at_) {
      enter(UnitState::busy, now);
      return free_at_;
    }
    if (in_.ready()) {
      enter(UnitState::blocked, now);
      return in_terminations_.next_ready();
    }
    enter(UnitState::starved, now);
    return std::min(in_.next_ready(), in_terminations_.next_ready());
  }

  StreamIn<QuadBeat> in_;
  StreamOut<QuadBeat> out_;
  StreamIn<TerminationBeat> in_terminations_;
  std::unique_ptr<ZropBehaviour> behaviour_;
  const ZropBehaviour::TimingParameters timing_;
  unsigned signal_ = 0;
  BatchLimit limit_;
  Cycle tested_until_ = 0;  ///< the last beat, rounded up to whole cycles
  Cycle free_at_ = 0;       ///< after a beat wider than the unit
};

[[maybe_unused]] const bool registered = [] {
  register_unit_maker("zrop", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                 const RenderContext&, unsigned) {
    return std::make_unique<ZropUnit>(name.c_str(), domain, behaviour_as<ZropBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
