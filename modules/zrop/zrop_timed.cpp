#include <deque>

#include <vrpipe/timed.h>

namespace vrpipe {

namespace {

/// ZROP at lt and at. Ports as in zrop_unit.cpp. Updates go first, so that the cycle of one is known when it arrives; a
/// test applies those of its past.
class TimedZrop : public TimedUnit {
 public:
  TimedZrop(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<ZropBehaviour> behaviour,
            Transport transport)
      : TimedUnit(name, domain, transport),
        out_(*this, "out_quads"),
        in_(*this, "in_quads", [this](const QuadBeat& beat, Cycle visible) { return test(beat, visible); }, {&out_}),
        in_terminations_(*this, "in_terminations",
                         [this](const TerminationBeat& beat, Cycle visible) { return update(beat, visible); }),
        behaviour_(std::move(behaviour)),
        cost_(behaviour_->cost()),
        tests_(cost_.quads_per_cycle),
        updates_(cost_.updates_per_cycle) {
    out_.set_pipeline(cost_.latency_cycles - 1, cost_.quads_per_cycle);
  }

  std::uint64_t work() const override { return tested_; }
  double peak_rate() const override { return cost_.quads_per_cycle; }
  Behaviour& behaviour() override { return *behaviour_; }

  void close_account(Cycle end) override {
    for (; !pending_.empty(); pending_.pop_front()) behaviour_->update(pending_.front().signal);
    TimedUnit::close_account(end);
  }

 private:
  struct Pending {
    TerminationSignal signal;
    Cycle at;
  };

  Cycle update(const TerminationBeat& beat, Cycle visible) {
    Cycle at = visible;
    for (unsigned i = 0; i < beat.count; ++i) {
      at = updates_.take(visible);
      pending_.push_back({beat.signals[i], at});
    }
    return at;
  }

  Cycle test(const QuadBeat& incoming, Cycle visible) {
    QuadBeat beat = incoming;
    const unsigned width = std::max<unsigned>(beat.count, 1);
    Cycle at = tests_.take(std::max(visible, out_.last()), width);
    while (!pending_.empty() && pending_.front().at <= at) {
      // One z-cache port: a cycle with updates tests nothing.
      if (pending_.front().at == at) at = tests_.take(at + 1, width);
      behaviour_->update(pending_.front().signal);
      pending_.pop_front();
    }
    charge(UnitState::starved, at);
    tested_ += beat.count;
    behaviour_->test(beat);
    // A beat without survivors goes no further, but for the mark that closes a bin.
    if (beat.count > 0 || beat.last_of_bin || beat.end_of_draw) {
      at = out_.send(beat, at);
      charge(UnitState::blocked, at);
      tests_.hold(at);
    }
    charge(UnitState::busy, at + 1);
    return at;
  }

  TimedOut<QuadBeat> out_;
  TimedIn<QuadBeat> in_;
  TimedIn<TerminationBeat> in_terminations_;
  std::unique_ptr<ZropBehaviour> behaviour_;
  const ZropBehaviour::Cost cost_;
  Lane tests_;
  Lane updates_;
  std::deque<Pending> pending_;  ///< updates not applied yet, by cycle
  std::uint64_t tested_ = 0;
};

[[maybe_unused]] const bool registered = [] {
  register_timed_unit_maker("zrop", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderState&, unsigned,
                                       Transport transport) {
    return std::make_unique<TimedZrop>(name.c_str(), domain, behaviour_as<ZropBehaviour>(std::move(behaviour)),
                                       transport);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
