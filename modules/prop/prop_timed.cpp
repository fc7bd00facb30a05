#include <algorithm>
#include <utility>

#include "prop/reorder_buffer.h"

#include <vrpipe/kernel/rate.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/early_tests.h>
#include <vrpipe/pipeline/late_plan.h>
#include <vrpipe/pipeline/slots/prop.h>

namespace vrpipe {

namespace {

/// PROP at lt: as prop_unit.cpp, but bins and warps go in one piece. Of the warps whose turn has come the oldest of those
/// that are there goes when the way to CROP is free: they are kept until all that come before that are known, by one that
/// comes later, by the SMs, which ask when they need to know what is released, or by the clock.
/// Ports: in_bins, out_test, in_tested, out_survivors (BinItem), in_shaded, out_color (ShadedWarpItem),
/// out_release (WarpRelease), out_late, in_late (ShadedWarpItem; optional).
class TimedProp : public TimedUnit {
 public:
  TimedProp(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<PropBehaviour> behaviour,
            const RenderContext& context)
      : TimedUnit(name, domain, behaviour->time().kinds()),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        tests_(tests_before_shading(context)),
        plan_(context),
        out_test_(*this, "out_test"),
        out_survivors_(*this, "out_survivors"),
        out_release_(*this, "out_release"),
        out_color_(*this, "out_color"),
        out_late_(*this, "out_late"),
        in_tested_(*this, "in_tested",
                   [this](const BinItem& item, CycleInterval visible) {
                     return forward(PropWork::tested, item, visible, back_, out_survivors_);
                   }),
        in_bins_(*this, "in_bins",
                 [this](const BinItem& item, CycleInterval visible) {
                   return forward(PropWork::bins, item, visible, there_, tests_ ? out_test_ : out_survivors_);
                 }),
        in_late_(*this, "in_late",
                 [this](const ShadedWarpItem& item, CycleInterval visible) {
                   const Cycle taken = take_back(*item.warp, visible.first);
                   if (!is_leaving_) leave_beside_late();
                   return taken;
                 }),
        in_shaded_(*this, "in_shaded",
                   [this](const ShadedWarpItem& item, CycleInterval visible) {
                     return collect(*item.warp, visible.first);
                   }),
        order_(time_.order, context),
        there_{BatchLimit(time_.quads_per_cycle), {}},
        back_{BatchLimit(time_.quads_per_cycle), {}},
        color_(time_.color_rate.items),
        beats_a_cycle_(time_.of_colors().items_per_cycle),
        late_(time_.quads_per_cycle) {
    out_test_.set_pipeline(time_.of_bins());
    out_survivors_.set_pipeline(time_.of_bins());
    out_color_.set_pipeline(time_.of_colors());
    out_late_.set_pipeline(time_.of_late_tests());
    out_late_.set_optional();
    in_late_.set_optional();
    in_tested_.set_comes_ahead();
    in_shaded_.set_comes_ahead();
    in_late_.set_comes_ahead();
    if (!plan_.is_used()) out_release_.on_asked([this](Cycle until) { leave_until(until); });
  }

  bool idle() const override { return order_.empty() && on_late_way_ == 0; }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  /// A way through the unit, which bins take beat by beat.
  struct Passage {
    BatchLimit limit;
    BeatWidth width;
  };
  CycleInterval forward(unsigned work, const BinItem& item, CycleInterval visible, Passage& passage,
                        TimedOut<BinItem>& out) {
    const unsigned width = passage.width.of(item.quads, item.beats);
    const unsigned beats = std::max({item.beats, (item.quads + width - 1) / width, 1U});
    const Cycle free_from = std::max(out.last(), out.room_from());
    CycleInterval at;
    unsigned left = item.quads;
    for (unsigned beat = 0; beat < beats; ++beat) {
      const unsigned quads = std::min(width, left);
      left -= quads;
      at.last = passage.limit.take(std::max(quads, 1U), std::max(visible.of_part(beat, beats), free_from));
      if (beat == 0) at.first = at.last;
    }
    const CycleInterval taken = out.send(item, at, item.beats);
    passage.limit.hold(taken.last);
    did(work, item.quads, taken.last);
    return taken;
  }

  Cycle collect(const ShadedWarp& warp, Cycle visible) {
    if (!plan_.is_used()) leave_until(visible + 1);
    if (warp.mark != Mark::none) {
      order_.arrive_mark(warp, visible + 1);
    } else {
      order_.arrive(warp, visible + 1);
    }
    if (plan_.is_used()) {
      leave_beside_late();
    } else if (warp.mark != Mark::none) {
      leave_until(never);  // it comes behind all before it
    } else if (!std::exchange(is_awake_, true)) {
      clock.domain->wake(clock.unit, next_tick(now()));
    }
    return visible;
  }
  Cycle tick(Cycle now) override {
    leave_until(now);
    is_awake_ = order_.has_next();
    return is_awake_ ? next_tick(now) : never;
  }
  Cycle next_tick(Cycle now) const { return std::max(way_is_free_from(), now) + 1; }

  /// Lets those warps leave whose turn has come and whose way is free before a cycle.
  void leave_until(Cycle until) {
    do {
      while (order_.has_next() && way_is_free_before(until)) leave(order_.take());
    } while (pass_mark());
  }
  /// As way_is_free_from() < until, of which the first term tells most often.
  bool way_is_free_before(Cycle until) const {
    return color_.next() < until && out_color_.last() < until && out_color_.room_from() < until &&
           out_release_.room_from() < until;
  }
  /// For another warp, which begins to leave once its release has room.
  Cycle way_is_free_from() const {
    return std::max({color_.next(), out_color_.last(), out_color_.room_from(), out_release_.room_from()});
  }

  bool pass_mark() {
    const ReorderBuffer::Waiting* const mark = order_.next_mark();
    if (mark == nullptr) return false;
    const ReorderBuffer::Waiting next = *mark;
    order_.leave_mark();
    hand_on_mark(*next.warp, next.from);
    return true;
  }
  Cycle hand_on_mark(const ShadedWarp& mark, Cycle from) {
    const Cycle at = color_.take(from, time_.color_rate.items).first;
    const WarpRelease release{mark.slot};
    out_color_.send({&mark}, at);
    out_release_.send(release, at);
    return at;
  }

  void leave(const ReorderBuffer::Waiting& next) {
    color_.hold(out_release_.room_from());
    const WarpRelease release{next.warp->slot};
    const Cycle left = hand_on(*next.warp, next.from);
    order_.leave(next.turn, left);
    out_release_.send(release, left);
  }
  /// Hands a warp to CROP; returns when it has left.
  Cycle hand_on(const ShadedWarp& warp, Cycle from) {
    color_.hold(out_color_.last());
    charge(UnitState::blocked, out_color_.last());
    Cycle left = 0;
    if (warp.count > 0) {
      // Quads of one cycle go together, also those of several warps, as many as a beat holds.
      const auto before =
          static_cast<unsigned>(color_.taken_of(std::max(from, color_.next())) / time_.color_rate.cycles);
      const bool joins = beats_a_cycle_ == 1 ? before > 0 : before % ColorBeat::capacity > 0;
      if (before == 0) {
        charge(UnitState::starved, from);
        charge(UnitState::blocked, out_color_.room_from());
        color_.hold(out_color_.room_from());
      }
      const CycleInterval at = color_.take(from, warp.count * time_.color_rate.cycles);
      charge(UnitState::starved, at.first);
      charge(UnitState::busy, at.last + 1);
      did(PropWork::color, warp.count, at.first, at.last + 1);
      const unsigned beats = beats_a_cycle_ == 1
                                 ? static_cast<unsigned>(at.last - at.first) + 1
                                 : (before % ColorBeat::capacity + warp.count - 1) / ColorBeat::capacity + 1;
      left = out_color_.send({&warp}, at, std::min<unsigned>(warp.count, beats - (joins ? 1 : 0)), joins).last;
      charge(UnitState::blocked, left);
      color_.postpone(left);
    } else {
      // A warp without survivors takes the cycle in which it is passed over, or what quads before it have left of that.
      left = std::max(from, color_.next());
      if (color_.taken_of(left) == 0) did(PropWork::empty_warps, time_.color_rate.items, left);
      color_.hold(left + 1);
      warp.release();
    }
    return left;
  }

  bool is_late(const ShadedWarp& warp) const { return warp.count > 0 && plan_.is_late(warp.draw[0]); }
  /// In a frame with late tests: either way.
  [[gnu::noinline]] void leave_beside_late() {
    is_leaving_ = true;
    while (leave_one_beside_late()) continue;
    is_leaving_ = false;
  }
  bool leave_one_beside_late() {
    const bool is_mark = !order_.has_next();
    const ReorderBuffer::Waiting* const next = is_mark ? order_.next_mark() : &order_.next();
    if (next == nullptr) return false;
    const bool goes_late = is_mark ? plan_.waits_at(next->warp->mark) : is_late(*next->warp);
    if (!goes_late) return leave_behind_late(is_mark);
    send_late(is_mark ? *next : order_.take(), is_mark);
    return true;
  }
  void send_late(const ReorderBuffer::Waiting next, bool is_mark) {
    const unsigned quads = next.warp->count;
    late_.hold(passed_over_);
    const Cycle at = late_.take(std::max({next.from, out_late_.room_from(), out_late_.last()}), std::max(quads, 1U));
    if (is_mark) {
      order_.leave_mark();
    } else {
      did(PropWork::late, quads, at, at + (quads + time_.quads_per_cycle - 1) / time_.quads_per_cycle);
      order_.leave(next.turn, at);
    }
    ++on_late_way_;
    late_.hold(out_late_.send({next.warp}, at).first);
  }
  /// What is not tested late goes on when nothing is on that way, but for warps without quads, which are only released.
  bool leave_behind_late(bool is_mark) {
    if (!is_mark && order_.next().warp->count == 0 && order_.next().from <= back_until_) {
      pass_over(order_.take());
      return true;
    }
    if (on_late_way_ > 0) return false;
    if (is_mark) return pass_mark();
    leave(order_.take());
    return true;
  }
  /// One a cycle. What is on the late way in its time has taken the ways to CROP and SM already, for when it is back: it does
  /// not wait for that.
  void pass_over(const ReorderBuffer::Waiting& empty) {
    passed_over_ = std::max({empty.from, passed_over_ + 1, out_late_.last()});
    if (passed_over_ >= color_.next() && color_.taken_of(passed_over_) == 0)
      did(PropWork::empty_warps, time_.color_rate.items, passed_over_);
    const WarpRelease release{empty.warp->slot};
    empty.warp->release();
    order_.leave(empty.turn, passed_over_);
    out_release_.send_beside(release, passed_over_);
  }
  /// What has been tested late, or has come around.
  Cycle take_back(const ShadedWarp& warp, Cycle visible) {
    --on_late_way_;
    if (warp.mark != Mark::none) return hand_on_mark(warp, visible);
    const WarpRelease release{warp.slot};
    back_until_ = hand_on(warp, visible);
    out_release_.send(release, back_until_);
    return back_until_;
  }

  std::unique_ptr<PropBehaviour> behaviour_;
  const PropTime time_;
  const bool tests_;
  const LatePlan plan_;
  TimedOut<BinItem> out_test_;
  TimedOut<BinItem> out_survivors_;
  TimedOut<WarpRelease> out_release_;
  TimedOut<ShadedWarpItem> out_color_;
  TimedOut<ShadedWarpItem> out_late_;
  TimedIn<BinItem> in_tested_;
  TimedIn<BinItem> in_bins_;
  TimedIn<ShadedWarpItem> in_late_;
  TimedIn<ShadedWarpItem> in_shaded_;
  ReorderBuffer order_;
  bool is_awake_ = false;
  Passage there_;         ///< to the tests, or past them
  Passage back_;          ///< from the tests
  ThroughputPort color_;  ///< in parts of a cycle and of a quad: a cycle passes `color_rate.items`
  const unsigned beats_a_cycle_;
  // In a frame with late tests:
  IssuePort late_;
  Cycle passed_over_ = 0;     ///< the last warp without quads
  Cycle back_until_ = 0;      ///< the last that has been tested late has left
  unsigned on_late_way_ = 0;  ///< warps and marks that were sent to be tested late and are not back
  bool is_leaving_ = false;   ///< while what is in turn is sent, when it may come back at once
};

[[maybe_unused]] const bool prop_timed_registered = [] {
  register_timed_unit_maker("prop", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderContext& context, unsigned) {
    return std::make_unique<TimedProp>(name.c_str(), domain, behaviour_as<PropBehaviour>(std::move(behaviour)),
                                       context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
