#include <algorithm>

#include "prop/warp_order.h"

#include <vrpipe/timed.h>

namespace vrpipe {

namespace {

/// PROP at lt and at. Ports as in prop_unit.cpp.
class TimedProp : public TimedUnit {
 public:
  TimedProp(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<PropBehaviour> behaviour,
            const RenderState& state, Transport transport)
      : TimedUnit(name, domain, transport),
        behaviour_(std::move(behaviour)),
        cost_(behaviour_->cost()),
        tests_(state.early_termination),
        out_test_(*this, "out_test"),
        out_survivors_(*this, "out_survivors"),
        out_release_(*this, "out_release"),
        out_color_(*this, "out_color"),
        in_bins_(*this, "in_bins",
                 [this](const QuadBeat& beat, Cycle visible) {
                   return forward(beat, visible, there_, tests_ ? out_test_ : out_survivors_);
                 },
                 {tests_ ? &out_test_ : &out_survivors_}),
        in_tested_(*this, "in_tested",
                   [this](const QuadBeat& beat, Cycle visible) {
                     return forward(beat, visible, back_, out_survivors_);
                   },
                   {&out_survivors_}),
        in_shaded_(*this, "in_shaded",
                   [this](const ShadedWarpItem& item, Cycle visible) { return collect(*item.warp, visible); }),
        order_(cost_.order, state),
        there_(cost_.quads_per_cycle),
        back_(cost_.quads_per_cycle),
        color_(cost_.color_quads_per_cycle) {
    out_test_.set_pipeline(cost_.latency_cycles - 1, 1);
    out_survivors_.set_pipeline(cost_.latency_cycles - 1, 1);
    out_color_.set_pipeline(cost_.latency_cycles - 1, 1);
  }

  bool idle() const override { return TimedUnit::idle() && order_.empty() && end_ == nullptr; }
  std::uint64_t work() const override { return color_quads_; }
  double peak_rate() const override { return cost_.color_quads_per_cycle; }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Cycle forward(const QuadBeat& beat, Cycle visible, Lane& lane, TimedOut<QuadBeat>& out) {
    const Cycle at = lane.take(std::max(visible, out.last()), std::max<unsigned>(beat.count, 1));
    const Cycle taken = out.send(beat, at);
    lane.hold(taken);
    return taken;
  }

  Cycle collect(const ShadedWarp& warp, Cycle visible) {
    if (warp.end_of_draw) {
      end_ = &warp;
      end_from_ = visible + 1;
    } else {
      order_.arrive(warp, visible + 1);
    }
    advance();
    return visible;
  }

  void advance() override {
    while (order_.has_next() && !out_color_.blocked() && !out_release_.blocked()) {
      const WarpOrder::Waiting next = order_.take();
      leave(*next.warp, next.from);
    }
    if (end_ == nullptr || end_->sequence != order_.left() || out_color_.blocked() || out_release_.blocked()) return;
    ColorBeat beat;
    beat.end_of_draw = true;
    const Cycle at = color_.take(end_from_);
    out_color_.send(beat, at);
    out_release_.send({end_->slot}, at);
    --end_->holders;
    end_ = nullptr;
    order_.restart();
  }

  /// Hands a warp to CROP, a cycle's quads at a time.
  void leave(const ShadedWarp& warp, Cycle from) {
    Cycle at = std::max(from, out_color_.last());
    ColorBeat beat;
    Cycle beat_at = 0;
    charge(UnitState::starved, at);
    for (unsigned i = 0; i < warp.count; ++i) {
      at = color_.take(at);
      if (beat.count > 0 && at != beat_at) {
        send(beat, beat_at);
        at = std::max(at, out_color_.last());
      }
      beat_at = at;
      ++warp.holders;
      beat.quads[beat.count++] = {&warp, warp.tile, warp.position[i], warp.live[i], static_cast<std::uint8_t>(i)};
    }
    if (warp.count > 0) {
      send(beat, beat_at);
    } else {
      // A warp without survivors takes the cycle in which it is passed over.
      beat_at = color_.take(at);
      color_.hold(beat_at + 1);
    }
    const Cycle left = std::max(beat_at, out_color_.last());
    charge(UnitState::busy, left + 1);
    order_.leave(warp, left);
    out_release_.send({warp.slot}, left);
    --warp.holders;
  }

  void send(ColorBeat& beat, Cycle at) {
    color_quads_ += beat.count;
    const Cycle taken = out_color_.send(beat, at);
    charge(UnitState::blocked, taken);
    color_.hold(taken);
    beat.count = 0;
  }

  std::unique_ptr<PropBehaviour> behaviour_;
  const PropBehaviour::Cost cost_;
  const bool tests_;
  TimedOut<QuadBeat> out_test_;
  TimedOut<QuadBeat> out_survivors_;
  TimedOut<WarpRelease> out_release_;
  TimedOut<ColorBeat> out_color_;
  TimedIn<QuadBeat> in_bins_;
  TimedIn<QuadBeat> in_tested_;
  TimedIn<ShadedWarpItem> in_shaded_;
  WarpOrder order_;
  Lane there_;  ///< to the tests, or past them
  Lane back_;   ///< from the tests
  Lane color_;
  const ShadedWarp* end_ = nullptr;
  Cycle end_from_ = 0;
  std::uint64_t color_quads_ = 0;
};

[[maybe_unused]] const bool registered = [] {
  register_timed_unit_maker("prop", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderState& state, unsigned,
                                       Transport transport) {
    return std::make_unique<TimedProp>(name.c_str(), domain, behaviour_as<PropBehaviour>(std::move(behaviour)), state,
                                       transport);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
