#include <algorithm>

#include "prop/reorder_buffer.h"

#include <vrpipe/model/unit.h>

namespace vrpipe {

namespace {

/// PROP at cycle fidelity. Ports: in_bins, out_test, in_tested, out_survivors (QuadBeat), in_shaded (ShadedWarpItem),
/// out_release (WarpRelease), out_color (ColorBeat). Without any test enabled bins bypass ZROP.
class PropUnit : public Unit {
 public:
  PropUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<PropBehaviour> behaviour,
           const RenderContext& context)
      : Unit(name, domain, PropWork::kinds(behaviour->timing())),
        in_bins_(*this, "in_bins"),
        out_test_(*this, "out_test"),
        in_tested_(*this, "in_tested"),
        out_survivors_(*this, "out_survivors"),
        in_shaded_(*this, "in_shaded"),
        out_release_(*this, "out_release"),
        out_color_(*this, "out_color"),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        tests_(context.frame->needs_zrop()),
        there_{PropWork::bins, BatchLimit(timing_.quads_per_cycle)},
        back_{PropWork::tested, BatchLimit(timing_.quads_per_cycle)},
        order_(timing_.order, context),
        color_limit_(timing_.color_rate) {
    out_test_.set_pipeline(timing_.latency_cycles - 1, 1);
    out_survivors_.set_pipeline(timing_.latency_cycles - 1, 1);
    out_color_.set_pipeline(timing_.latency_cycles - 1, ColorBeat::in_a_cycle(timing_.color_rate));
  }

  bool idle() const override {
    return in_bins_.empty() && in_tested_.empty() && in_shaded_.empty() && current_.warp == nullptr && order_.empty();
  }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  /// A way through the unit, `quads_per_cycle` wide.
  struct BatchServer {
    unsigned work;
    BatchLimit limit;
    Cycle free_at = 0;
  };

  /// Moves beats from one port to the next; a beat wider than the unit takes several cycles.
  bool forward(BatchServer& passage, StreamIn<QuadBeat>& from, StreamOut<QuadBeat>& to, Cycle now) {
    if (now < passage.free_at || !from.ready() || to.credits() == 0) return false;
    forward_beats(passage, from, to, now);
    return true;
  }
  // Out of line: in most cycles nothing can move.
  [[gnu::noinline]] void forward_beats(BatchServer& passage, StreamIn<QuadBeat>& from, StreamOut<QuadBeat>& to,
                                       Cycle now) {
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
    if (current_.warp == nullptr && !order_.has_next()) {
      return out_color_.credits() > 0 && pass_mark();
    }
    if (out_color_.credits() == 0) return false;
    ColorBeat beat;
    bool moved = false;
    unsigned sent = 0;
    const unsigned allowance = color_limit_.allowance(now);
    while (sent < allowance) {
      if (beat.count == ColorBeat::capacity) {
        out_color_.push(beat);
        beat.count = 0;
        if (out_color_.credits() == 0) break;
      }
      if (current_.warp == nullptr) {
        if (!order_.has_next()) break;
        if (out_release_.credits() == 0) break;
        current_ = order_.take();
        index_ = 0;
      }
      const ShadedWarp& warp = *current_.warp;
      if (index_ < warp.count) {
        beat.quads[beat.count++] = {&warp, index_++};
        ++sent;
      }
      if (index_ == warp.count) {
        current_.warp = nullptr;
        order_.leave(current_.turn);
        out_release_.push({warp.slot});
        moved = true;
        // A warp without survivors takes the cycle in which it is passed over.
        if (warp.count == 0) {
          warp.release();
          if (sent == 0) did(PropWork::empty_warps, 1, now);
          break;
        }
      }
    }
    waits_for_rate_ = allowance == 0 && (current_.warp != nullptr || order_.has_next());
    if (sent > 0) {
      did(PropWork::color, sent, now);
      color_limit_.take(sent);
    }
    if (beat.count > 0) out_color_.push(beat);
    return sent > 0 || moved || pass_mark();
  }

  bool pass_mark() {
    const ReorderBuffer::Waiting* const mark = order_.next_mark();
    if (mark == nullptr || out_release_.credits() == 0) return false;
    ColorBeat beat;
    beat.mark = mark->warp->mark;
    out_color_.push(beat);
    out_release_.push({mark->warp->slot});
    mark->warp->release();
    order_.leave_mark();
    return true;
  }

  Cycle tick(Cycle now) override {
    bool moved = send_color(now);
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
    const bool has_work = current_.warp != nullptr || order_.has_next() || in_bins_.ready() || in_tested_.ready();
    enter(has_work ? UnitState::blocked : order_.has_early() ? UnitState::latency : UnitState::starved, now);
    Cycle next = never;
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
  std::unique_ptr<PropBehaviour> behaviour_;
  const PropBehaviour::TimingParameters timing_;
  const bool tests_;
  BatchServer there_;  ///< to the tests, or past them
  BatchServer back_;   ///< from the tests
  ReorderBuffer order_;
  RateLimit color_limit_;
  ReorderBuffer::Waiting current_;  ///< being handed to CROP, from `index_` on; none without a warp
  std::uint32_t index_ = 0;
  bool waits_for_rate_ = false;  ///< of quads to CROP, below one a cycle
};

[[maybe_unused]] const bool registered = [] {
  register_unit_maker("prop", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                 const RenderContext& context, unsigned) {
    return std::make_unique<PropUnit>(name.c_str(), domain, behaviour_as<PropBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
