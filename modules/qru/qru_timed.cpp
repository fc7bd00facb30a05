#include "qru/warp_numbering.h"

#include <vrpipe/timed.h>

namespace vrpipe {

namespace {

/// QRU at lt and at. Ports as in qru_unit.cpp.
class TimedQru : public TimedUnit {
 public:
  TimedQru(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<QruBehaviour> behaviour,
           const RenderState& state, Transport transport)
      : TimedUnit(name, domain, transport),
        out_(*this, "out_warps"),
        in_(*this, "in_quads", [this](const QuadBeat& beat, Cycle visible) { return examine(beat, visible); }, {&out_}),
        behaviour_(std::move(behaviour)),
        cost_(behaviour_->cost()),
        numbering_(state),
        budget_(cost_.items_per_cycle) {
    out_.set_pipeline(cost_.latency_cycles - 1, 1);
  }

  std::uint64_t work() const override { return examined_; }
  double peak_rate() const override { return cost_.items_per_cycle; }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  void go_to(Cycle cycle) {
    if (cycle <= cycle_) return;
    cycle_ = cycle;
    budget_ = cost_.items_per_cycle;
  }

  /// A launch ends the cycle.
  void launch(const Warp& warp) {
    const Cycle taken = out_.send(warp, cycle_);
    charge(UnitState::blocked, taken);
    charge(UnitState::busy, taken + 1);
    go_to(taken + 1);
  }

  Cycle examine(const QuadBeat& beat, Cycle visible) {
    go_to(std::max(visible, out_.last() + 1));
    charge(UnitState::starved, cycle_);
    Warp warp;
    if (beat.end_of_draw) {
      warp.end_of_draw = true;
      numbering_.number_end(warp);
      launch(warp);
      return out_.last();
    }
    Cycle left = cycle_;
    for (unsigned from = 0; from < beat.count;) {
      if (budget_ == 0) go_to(cycle_ + 1);
      left = cycle_;
      QuadBeat part = beat;
      part.count = static_cast<std::uint8_t>(std::min<unsigned>(beat.count, from + budget_));
      bool launched = false;
      const unsigned examined = behaviour_->examine(part, from, warp, launched);
      from += examined;
      examined_ += examined;
      budget_ -= examined;
      if (!launched) continue;
      numbering_.number(warp);
      launch(warp);
    }
    charge(UnitState::busy, left + 1);
    if (!beat.last_of_bin) return left;
    while (behaviour_->finish_bin(warp)) {
      numbering_.number(warp);
      launch(warp);
    }
    return cycle_;
  }

  TimedOut<Warp> out_;
  TimedIn<QuadBeat> in_;
  std::unique_ptr<QruBehaviour> behaviour_;
  const Throughput cost_;
  WarpNumbering numbering_;
  Cycle cycle_ = 0;
  unsigned budget_;  ///< quads that can still be examined in the cycle
  std::uint64_t examined_ = 0;
};

[[maybe_unused]] const bool registered = [] {
  register_timed_unit_maker("qru", [](const std::string& name, ClockDomain& domain,
                                      std::unique_ptr<Behaviour> behaviour, const RenderState& state, unsigned,
                                      Transport transport) {
    return std::make_unique<TimedQru>(name.c_str(), domain, behaviour_as<QruBehaviour>(std::move(behaviour)), state,
                                      transport);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
