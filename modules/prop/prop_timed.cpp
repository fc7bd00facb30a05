#include <algorithm>

#include "prop/reorder_buffer.h"

#include <vrpipe/model/timed.h>

namespace vrpipe {

namespace {

/// PROP at lt and at: as prop_unit.cpp, but bins and warps go in one piece. Of the warps whose turn has come the oldest
/// of those that are there goes when the way to CROP is free; at lt all are there in launch order.
/// Ports: in_bins, out_test, in_tested, out_survivors (BinItem), in_shaded, out_color (ShadedWarpItem),
/// out_release (WarpRelease).
class TimedProp : public TimedUnit {
 public:
  TimedProp(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<PropBehaviour> behaviour,
            const RenderContext& context, Transport transport)
      : TimedUnit(name, domain, PropWork::kinds(behaviour->timing()), transport),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        tests_(context.frame->needs_zrop()),
        out_test_(*this, "out_test"),
        out_survivors_(*this, "out_survivors"),
        out_release_(*this, "out_release"),
        out_color_(*this, "out_color"),
        in_tested_(*this, "in_tested",
                   [this](const BinItem& item, CycleInterval visible) {
                     return forward(PropWork::tested, item, visible, back_, out_survivors_);
                   },
                   {&out_survivors_}),
        in_bins_(*this, "in_bins",
                 [this](const BinItem& item, CycleInterval visible) {
                   return forward(PropWork::bins, item, visible, there_, tests_ ? out_test_ : out_survivors_);
                 },
                 {tests_ ? &out_test_ : &out_survivors_}),
        in_shaded_(*this, "in_shaded",
                   [this](const ShadedWarpItem& item, CycleInterval visible) {
                     return collect(*item.warp, visible.first);
                   }),
        order_(timing_.order, context),
        there_(timing_.quads_per_cycle),
        back_(timing_.quads_per_cycle),
        color_(timing_.color_rate.items) {
    out_test_.set_pipeline(timing_.latency_cycles - 1, 1);
    out_survivors_.set_pipeline(timing_.latency_cycles - 1, 1);
    out_color_.set_pipeline(timing_.latency_cycles - 1, 1);
  }

  bool idle() const override { return TimedUnit::idle() && order_.empty(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  CycleInterval forward(unsigned work, const BinItem& item, CycleInterval visible, BatchServer& passage,
                        TimedOut<BinItem>& out) {
    passage.hold(out.last());
    const CycleInterval at = passage.take(visible, item.quads);
    const CycleInterval taken = out.send(item, at, passage.cycles(item.quads));
    passage.hold(taken.last + 1);
    did(work, item.quads, taken.last);
    return taken;
  }

  Cycle collect(const ShadedWarp& warp, Cycle visible) {
    leave_until(visible);
    if (warp.mark != Mark::none) {
      order_.arrive_mark(warp, visible + 1);
    } else {
      order_.arrive(warp, visible + 1);
    }
    if (blocking()) leave_until(never);
    return visible;
  }

  Cycle advance(Cycle until) override {
    leave_until(until);
    return order_.has_next() && can_send() ? color_.next() : never;
  }

  bool can_send() const { return out_color_.clear() && out_release_.clear(); }

  /// Lets those warps leave whose time comes up to a cycle.
  void leave_until(Cycle until) {
    do {
      while (order_.has_next() && can_send()) {
        // A warp begins to leave once its release has room.
        const Cycle room = out_release_.room_from();
        if (room == never || std::max(room, color_.next()) > until) break;
        color_.hold(room);
        leave(order_.take());
      }
    } while (pass_mark());
  }

  bool pass_mark() {
    const ReorderBuffer::Waiting* const mark = order_.next_mark();
    if (mark == nullptr || !can_send()) return false;
    const Cycle at = color_.take(mark->from, timing_.color_rate.items).first;
    const ShadedWarp& warp = *mark->warp;
    const WarpRelease release{warp.slot};
    order_.leave_mark();
    out_color_.send({&warp}, at);
    out_release_.send(release, at);
    return true;
  }

  /// Hands a warp to CROP.
  void leave(const ReorderBuffer::Waiting& next) {
    const ShadedWarp& warp = *next.warp;
    const WarpRelease release{warp.slot};
    color_.hold(out_color_.last());
    charge(UnitState::blocked, out_color_.last());
    Cycle left = 0;
    if (warp.count > 0) {
      const CycleInterval at = color_.take(next.from, warp.count * timing_.color_rate.cycles);
      charge(UnitState::starved, at.first);
      charge(UnitState::busy, at.last + 1);
      did(PropWork::color, warp.count, at.first, at.last + 1);
      left = out_color_.send({&warp}, at, color_.cycles(warp.count * timing_.color_rate.cycles)).last;
      charge(UnitState::blocked, left);
      color_.hold(left);
    } else {
      // A warp without survivors takes the cycle in which it is passed over.
      left = color_.take(next.from, timing_.color_rate.items).last;
      did(PropWork::empty_warps, 1, left);
      warp.release();
    }
    order_.leave(next.turn, left);
    out_release_.send(release, left);
  }

  std::unique_ptr<PropBehaviour> behaviour_;
  const PropBehaviour::TimingParameters timing_;
  const bool tests_;
  TimedOut<BinItem> out_test_;
  TimedOut<BinItem> out_survivors_;
  TimedOut<WarpRelease> out_release_;
  TimedOut<ShadedWarpItem> out_color_;
  TimedIn<BinItem> in_tested_;
  TimedIn<BinItem> in_bins_;
  TimedIn<ShadedWarpItem> in_shaded_;
  ReorderBuffer order_;
  BatchServer there_;     ///< to the tests, or past them
  BatchServer back_;      ///< from the tests
  ThroughputPort color_;  ///< in parts of a cycle and of a quad: a cycle passes `color_rate.items`
};

[[maybe_unused]] const bool registered = [] {
  register_timed_unit_maker("prop", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderContext& context, unsigned,
                                       Transport transport) {
    return std::make_unique<TimedProp>(name.c_str(), domain, behaviour_as<PropBehaviour>(std::move(behaviour)), context,
                                       transport);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
