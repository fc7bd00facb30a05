#include <algorithm>

#include <vrpipe/model/timed.h>

namespace vrpipe {

namespace {

/// ZROP at lt and at. Updates go first, so that the cycle of one is known when it arrives; a test applies those of its
/// past. Ports: in_quads, out_quads (BinItem), in_terminations (TerminationBeat).
class TimedZrop : public TimedUnit {
 public:
  TimedZrop(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<ZropBehaviour> behaviour,
            Transport transport)
      : TimedUnit(name, domain, ZropWork::kinds(behaviour->timing()), transport),
        out_(*this, "out_quads"),
        in_terminations_(*this, "in_terminations",
                         [this](const TerminationBeat& beat, CycleInterval visible) {
                           return update(beat, visible.first);
                         }),
        in_(*this, "in_quads", [this](const BinItem& item, CycleInterval visible) { return test(item, visible); },
            {&out_}),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        at_once_(std::min(timing_.quads_per_cycle, QuadBeat::capacity)),
        tests_(timing_.quads_per_cycle),
        updates_(timing_.updates_per_cycle) {
    out_.set_pipeline(timing_.latency_cycles - 1, timing_.quads_per_cycle);
  }

  Behaviour& behaviour() override { return *behaviour_; }

  void close_account(Cycle end) override {
    while (!pending_.empty()) apply_update();
    TimedUnit::close_account(end);
  }

 private:
  struct Pending {
    TerminationSignal signal;
    Cycle at = 0;
  };

  Cycle update(const TerminationBeat& beat, Cycle visible) {
    Cycle at = visible;
    for (unsigned i = 0; i < beat.count; ++i) {
      at = updates_.take(visible);
      pending_.push({beat.signals[i], at});
    }
    return at;
  }

  CycleInterval test(const BinItem& incoming, CycleInterval visible) {
    BinItem item = incoming;
    tests_.hold(out_.last());
    charge(UnitState::blocked, out_.last());
    if (item.mark != Mark::none) {
      const Cycle at = tests_.take(visible.first);
      if (item.mark != Mark::end_of_frame) {
        while (!pending_.empty() && pending_.front().at <= at) apply_update();
      }
      behaviour_->pass(item.mark);
      const Cycle taken = out_.send(item, at).first;
      tests_.hold(taken);
      return {at, taken};
    }
    std::vector<Quad>& quads = item.storage->flush.quads;
    const unsigned total = item.quads;
    const unsigned parts = (total + at_once_ - 1) / at_once_;
    CycleInterval tested(never, 0);
    CycleInterval left(never, 0);
    unsigned beats_left = 0;
    QuadBeat beat;
    beat.tile = item.tile;
    item.quads = 0;
    for (unsigned part = 0; part < parts; ++part) {
      const unsigned from = part * at_once_;
      beat.count = static_cast<std::uint8_t>(std::min(total - from, at_once_));
      beat.last_of_bin = part + 1 == parts;
      std::copy_n(quads.begin() + from, beat.count, beat.quads.begin());
      const Cycle at = take(visible.of_part(part, parts), beat.count);
      const unsigned tested_quads = beat.count;
      port_free_at_ = at + (tested_quads + timing_.quads_per_cycle - 1) / timing_.quads_per_cycle;
      did(ZropWork::tests, tested_quads, at, port_free_at_);
      behaviour_->test(beat);
      if (beat.count < tested_quads) frame_lasts(at + timing_.latency_cycles);
      tested.first = std::min(tested.first, at);
      tested.last = at;
      // A part without survivors goes no further, but for the mark that closes the bin.
      if (beat.count == 0 && !beat.last_of_bin) continue;
      std::copy_n(beat.quads.begin(), beat.count, quads.begin() + item.quads);
      item.quads += beat.count;
      left.first = std::min(left.first, at);
      left.last = at;
      ++beats_left;
    }
    charge(UnitState::starved, tested.first);
    const CycleInterval taken = out_.send(item, left, beats_left);
    charge(UnitState::busy, tested.last + 1);
    charge(UnitState::blocked, taken.last);
    tests_.hold(taken.last);
    return {tested.first, std::max(tested.last, taken.last)};
  }

  /// The cycle in which so many quads are tested; applies the updates of its past.
  Cycle take(Cycle visible, unsigned quads) {
    Cycle at = tests_.take(visible, quads);
    while (!pending_.empty() && pending_.front().at <= at) {
      // One z-cache port: a cycle with updates tests nothing.
      if (pending_.front().at == at) at = tests_.take(at + 1, quads);
      apply_update();
    }
    return at;
  }

  /// The first of those pending. Beside a test, or other updates of its cycle, it takes nothing of its own.
  void apply_update() {
    const Cycle at = pending_.front().at;
    if (at >= port_free_at_) {
      did(ZropWork::updates, 1, at);
      port_free_at_ = at + 1;
    }
    behaviour_->update(pending_.front().signal);
    pending_.pop();
  }

  TimedOut<BinItem> out_;
  TimedIn<TerminationBeat> in_terminations_;
  TimedIn<BinItem> in_;
  std::unique_ptr<ZropBehaviour> behaviour_;
  const ZropBehaviour::TimingParameters timing_;
  const unsigned at_once_;
  IssuePort tests_;
  IssuePort updates_;
  Ring<Pending> pending_;   ///< updates not applied yet, by cycle
  Cycle port_free_at_ = 0;  ///< of the z-cache, after the last test or update
};

[[maybe_unused]] const bool registered = [] {
  register_timed_unit_maker("zrop", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderContext&, unsigned,
                                       Transport transport) {
    return std::make_unique<TimedZrop>(name.c_str(), domain, behaviour_as<ZropBehaviour>(std::move(behaviour)),
                                       transport);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
