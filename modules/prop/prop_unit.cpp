#include <algorithm>
#include <utility>

#include "prop/reorder_buffer.h"

#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/early_tests.h>
#include <vrpipe/pipeline/late_plan.h>
#include <vrpipe/pipeline/slots/prop.h>

namespace vrpipe {

namespace {

/// PROP at cycle fidelity. Ports: in_bins, out_test, in_tested, out_survivors (QuadBeat), in_shaded (ShadedWarpItem),
/// out_release (WarpRelease), out_color (ColorBeat), out_late, in_late (ShadedWarpItem; optional). Without any test enabled
/// bins bypass ZROP. Warps to be tested late go to ZROP in their turn and come back in this order; what is not, and marks that
/// nobody waits for, go on to CROP when none of these is on its way.
class PropUnit : public Unit {
 public:
  PropUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<PropBehaviour> behaviour,
           const RenderContext& context)
      : Unit(name, domain, behaviour->time().kinds()),
        in_bins_(*this, "in_bins"),
        out_test_(*this, "out_test"),
        in_tested_(*this, "in_tested"),
        out_survivors_(*this, "out_survivors"),
        in_shaded_(*this, "in_shaded"),
        out_release_(*this, "out_release"),
        out_color_(*this, "out_color"),
        out_late_(*this, "out_late"),
        in_late_(*this, "in_late"),
        plan_(context),
        tests_late_(plan_.is_used()),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        tests_(tests_before_shading(context)),
        there_{PropWork::bins, BatchLimit(time_.quads_per_cycle)},
        back_{PropWork::tested, BatchLimit(time_.quads_per_cycle)},
        order_(time_.order, context),
        color_limit_(time_.color_rate),
        late_limit_(time_.quads_per_cycle) {
    out_test_.set_pipeline(time_.of_bins());
    out_survivors_.set_pipeline(time_.of_bins());
    out_color_.set_pipeline(time_.of_colors());
    out_late_.set_pipeline(time_.of_late_tests());
    out_late_.set_optional();
    in_late_.set_optional();
    in_bins_.set_passes_to(tests_ ? out_test_ : out_survivors_, 0);
    if (tests_) in_tested_.set_passes_to(out_survivors_, 0);
    in_shaded_.set_comes_ahead();
    in_late_.set_comes_ahead();
  }

  bool idle() const override {
    return in_bins_.empty() && in_tested_.empty() && in_shaded_.empty() && current_.warp == nullptr && order_.empty() &&
           on_late_way_ == 0;
  }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  /// A way through the unit, `quads_per_cycle` wide.
  struct Passage {
    unsigned work;
    BatchLimit limit;
    Cycle free_at = 0;
  };

  /// Moves beats from one port to the next; a beat wider than the unit takes several cycles.
  bool forward(Passage& passage, StreamIn<QuadBeat>& from, StreamOut<QuadBeat>& to, Cycle now) {
    if (now < passage.free_at || !from.ready() || to.credits() == 0) return false;
    forward_beats(passage, from, to, now);
    return true;
  }
  // Out of line: in most cycles nothing can move.
  [[gnu::noinline]] void forward_beats(Passage& passage, StreamIn<QuadBeat>& from, StreamOut<QuadBeat>& to, Cycle now) {
    while (from.ready() && to.credits() > 0) {
      const QuadBeat& beat = from.front();
      const unsigned width = std::max<unsigned>(beat.count, 1);
      if (!passage.limit.allows(width, now)) break;
      to.push(beat);
      from.pop();
      passage.limit.take(width);
      did(passage.work, width, now);
    }
    passage.free_at = passage.limit.next(now);
  }

  bool collect() {
    bool moved = false;
    while (in_shaded_.ready()) {
      const ShadedWarp* const warp = in_shaded_.front().warp;
      in_shaded_.pop();
      moved = true;
      if (warp->mark != Mark::none) {
        order_.arrive_mark(*warp);
      } else {
        order_.arrive(*warp);
      }
    }
    return moved;
  }

  bool send_color(Cycle now) {
    waits_for_rate_ = false;
    if (current_.warp == nullptr && !has_next()) {
      return out_color_.credits() > 0 && pass_mark();
    }
    if (out_color_.credits() == 0) return false;
    ColorBeat beat;
    unsigned in_beat = 0;
    bool moved = false;
    unsigned sent = 0;
    const unsigned allowance = color_limit_.allowance(now);
    while (sent < allowance) {
      if (in_beat == ColorBeat::capacity) {
        push(beat, std::exchange(in_beat, 0));
        if (out_color_.credits() == 0) break;
      }
      if (current_.warp == nullptr) {
        if (!has_next()) break;
        if (out_release_.credits() == 0) break;
        current_ = tests_late_ ? take_next() : order_.take();
        index_ = 0;
      }
      const ShadedWarp& warp = *current_.warp;
      if (index_ < warp.count) {
        beat.quads[in_beat++] = {&warp, index_++};
        ++sent;
      }
      if (index_ == warp.count) {
        current_.warp = nullptr;
        if (!is_back_) order_.leave(current_.turn);
        out_release_.push({warp.slot});
        moved = true;
        // A warp without survivors takes the cycle in which it is passed over, but for the fraction that the next quad has of it.
        if (warp.count == 0) {
          warp.release();
          if (sent == 0) did(PropWork::empty_warps, color_limit_.lose_rest(), now);
          break;
        }
      }
    }
    waits_for_rate_ = allowance == 0 && (current_.warp != nullptr || has_next());
    if (sent > 0) {
      did(PropWork::color, sent, now);
      color_limit_.take(sent);
    }
    if (in_beat > 0) push(beat, in_beat);
    return sent > 0 || moved || (current_.warp == nullptr && pass_mark());
  }

  void push(ColorBeat& beat, unsigned count) {
    beat.count = static_cast<std::uint8_t>(count);
    out_color_.push(beat);
  }
  /// Whether there is a warp to hand to CROP.
  bool has_next() { return tests_late_ ? has_next_beside_late() : order_.has_next(); }
  [[gnu::noinline]] bool has_next_beside_late() const {
    if (next_is_empty()) return true;
    if (on_late_way_ > 0) return in_late_.ready() && in_late_.front().warp->mark == Mark::none;
    return order_.has_next() && !is_late(*order_.next().warp);
  }
  [[gnu::noinline]] ReorderBuffer::Waiting take_next() {
    is_back_ = on_late_way_ > 0 && !next_is_empty();
    if (!is_back_) return order_.take();
    ReorderBuffer::Waiting back;
    back.warp = in_late_.front().warp;
    in_late_.pop();
    --on_late_way_;
    return back;
  }
  /// One without quads is only released, whatever is on the late way.
  bool next_is_empty() const { return order_.has_next() && order_.next().warp->count == 0; }
  bool is_late(const ShadedWarp& warp) const { return warp.count > 0 && plan_.is_late(warp.draw[0]); }

  /// Sends warps to be tested late, and marks that wait for these.
  [[gnu::noinline]] bool send_late(Cycle now) {
    bool moved = false;
    for (; out_late_.credits() > 0; moved = true) {
      const bool is_mark = !order_.has_next();
      const ReorderBuffer::Waiting* const next = is_mark ? order_.next_mark() : &order_.next();
      if (next == nullptr || !(is_mark ? plan_.waits_at(next->warp->mark) : is_late(*next->warp))) break;
      const unsigned width = std::max<unsigned>(next->warp->count, 1);
      if (!late_limit_.allows(width, now)) {
        late_free_at_ = late_limit_.next(now);
        break;
      }
      late_limit_.take(width);
      out_late_.push({next->warp});
      ++on_late_way_;
      if (is_mark) {
        order_.leave_mark();
      } else {
        did(PropWork::late, width, now);
        order_.leave(order_.take().turn);
      }
    }
    return moved;
  }

  [[gnu::noinline]] bool has_late_work() const { return in_late_.ready() || (order_.has_next() && on_late_way_ == 0); }
  [[gnu::noinline]] Cycle next_late(Cycle now) const {
    Cycle next = never;
    for (const Cycle at : {late_free_at_, in_late_.next_ready()}) {
      if (at > now) next = std::min(next, at);
    }
    return next;
  }

  bool pass_mark() {
    if (on_late_way_ > 0) return pass_mark_back();
    const ReorderBuffer::Waiting* const mark = order_.next_mark();
    if (mark == nullptr || out_release_.credits() == 0) return false;
    // It goes the late way.
    if (tests_late_ && plan_.waits_at(mark->warp->mark)) return false;
    hand_on_mark(*mark->warp);
    order_.leave_mark();
    return true;
  }
  /// One that has come around.
  [[gnu::noinline]] bool pass_mark_back() {
    if (!in_late_.ready() || in_late_.front().warp->mark == Mark::none || out_release_.credits() == 0) return false;
    hand_on_mark(*in_late_.front().warp);
    in_late_.pop();
    --on_late_way_;
    return true;
  }
  void hand_on_mark(const ShadedWarp& mark) {
    ColorBeat beat;
    beat.mark = mark.mark;
    out_color_.push(beat);
    out_release_.push({mark.slot});
    mark.release();
  }

  Cycle tick(Cycle now) override {
    bool moved = send_color(now);
    if (tests_late_) moved = send_late(now) || moved;
    moved = collect() || moved;
    if (tests_) {
      moved = forward(back_, in_tested_, out_survivors_, now) || moved;
      moved = forward(there_, in_bins_, out_test_, now) || moved;
    } else {
      moved = forward(there_, in_bins_, out_survivors_, now) || moved;
    }
    if (moved || waits_for_rate_) {
      enter(UnitState::busy, now);
      return now + 1;
    }
    const bool has_work = current_.warp != nullptr || order_.has_next() || in_bins_.ready() || in_tested_.ready() ||
                          (tests_late_ && has_late_work());
    const bool waits = order_.has_early() || on_late_way_ > 0;
    enter(has_work ? UnitState::blocked : waits ? UnitState::latency : UnitState::starved, now);
    Cycle next = tests_late_ ? next_late(now) : never;
    for (const Cycle at :
         {there_.free_at, back_.free_at, in_bins_.next_ready(), in_tested_.next_ready(), in_shaded_.next_ready()}) {
      if (at > now) next = std::min(next, at);
    }
    return next;
  }

  StreamIn<QuadBeat> in_bins_;
  StreamOut<QuadBeat> out_test_;
  StreamIn<QuadBeat> in_tested_;
  StreamOut<QuadBeat> out_survivors_;
  StreamIn<ShadedWarpItem> in_shaded_;
  StreamOut<WarpRelease> out_release_;
  StreamOut<ColorBeat> out_color_;
  StreamOut<ShadedWarpItem> out_late_;
  StreamIn<ShadedWarpItem> in_late_;
  const LatePlan plan_;
  const bool tests_late_;  ///< any draw
  std::unique_ptr<PropBehaviour> behaviour_;
  const PropTime time_;
  const bool tests_;
  Passage there_;  ///< to the tests, or past them
  Passage back_;   ///< from the tests
  ReorderBuffer order_;
  RateLimit color_limit_;
  ReorderBuffer::Waiting current_;  ///< being handed to CROP, from `index_` on; none without a warp
  std::uint32_t index_ = 0;
  bool waits_for_rate_ = false;  ///< of quads to CROP, below one a cycle
  // In a frame with late tests:
  BatchLimit late_limit_;
  Cycle late_free_at_ = 0;
  unsigned on_late_way_ = 0;  ///< warps and marks that were sent to be tested late and have not left for CROP
  bool is_back_ = false;      ///< `current_` comes from there
};

[[maybe_unused]] const bool prop_unit_registered = [] {
  register_unit_maker("prop", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                 const RenderContext& context, unsigned) {
    return std::make_unique<PropUnit>(name.c_str(), domain, behaviour_as<PropBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
