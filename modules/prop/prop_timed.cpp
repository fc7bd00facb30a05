#include <algorithm>
#include <deque>

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
        tiles_x_((state.draw->width + screen_tile_pixels - 1) / screen_tile_pixels),
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
        there_(cost_.quads_per_cycle),
        back_(cost_.quads_per_cycle),
        color_(cost_.color_quads_per_cycle) {
    out_test_.set_pipeline(cost_.latency_cycles - 1, 1);
    out_survivors_.set_pipeline(cost_.latency_cycles - 1, 1);
    out_color_.set_pipeline(cost_.latency_cycles - 1, 1);
    if (cost_.order == PropBehaviour::Order::tile) {
      const std::uint32_t tiles_y = (state.draw->height + screen_tile_pixels - 1) / screen_tile_pixels;
      next_of_tile_.assign(std::size_t{tiles_x_} * tiles_y, 0);
    }
  }

  bool idle() const override { return TimedUnit::idle() && early_.empty() && in_turn_.empty() && end_ == nullptr; }
  std::uint64_t work() const override { return color_quads_; }
  double peak_rate() const override { return cost_.color_quads_per_cycle; }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  struct Ready {
    const ShadedWarp* warp;
    Cycle from;  ///< the first cycle in which it can leave
  };

  Cycle forward(const QuadBeat& beat, Cycle visible, Lane& lane, TimedOut<QuadBeat>& out) {
    const Cycle at = lane.take(std::max(visible, out.last()), std::max<unsigned>(beat.count, 1));
    const Cycle taken = out.send(beat, at);
    lane.hold(taken);
    return taken;
  }

  std::uint32_t& next_of_tile(TileId tile) { return next_of_tile_[std::size_t{tile.y} * tiles_x_ + tile.x]; }

  bool is_next(const ShadedWarp& warp) {
    return cost_.order == PropBehaviour::Order::draw ? warp.sequence == next_sequence_
                                                     : warp.tile_sequence == next_of_tile(warp.tile);
  }

  Cycle collect(const ShadedWarp& warp, Cycle visible) {
    const Ready ready{&warp, visible + 1};
    if (warp.end_of_draw) {
      end_ = &warp;
      end_from_ = ready.from;
    } else if (is_next(warp)) {
      in_turn_.push_back(ready);
    } else {
      early_.push_back(ready);
    }
    advance();
    return visible;
  }

  void advance() override {
    while (!in_turn_.empty() && !out_color_.blocked() && !out_release_.blocked()) {
      const Ready ready = in_turn_.front();
      in_turn_.pop_front();
      leave(*ready.warp, ready.from);
    }
    if (end_ == nullptr || end_->sequence != next_sequence_ || out_color_.blocked() || out_release_.blocked()) return;
    ColorBeat beat;
    beat.end_of_draw = true;
    const Cycle at = color_.take(end_from_);
    out_color_.send(beat, at);
    out_release_.send({end_->slot}, at);
    --end_->holders;
    end_ = nullptr;
    next_sequence_ = 0;
    std::fill(next_of_tile_.begin(), next_of_tile_.end(), 0);
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
    promote(warp, left);
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

  /// After a warp has left: the one that follows it may be among those that came early.
  void promote(const ShadedWarp& warp, Cycle left) {
    if (cost_.order == PropBehaviour::Order::tile) ++next_of_tile(warp.tile);
    ++next_sequence_;
    const auto next = std::find_if(early_.begin(), early_.end(), [this](const Ready& r) { return is_next(*r.warp); });
    if (next == early_.end()) return;
    in_turn_.push_back({next->warp, std::max(next->from, left)});
    early_.erase(next);
  }

  std::unique_ptr<PropBehaviour> behaviour_;
  const PropBehaviour::Cost cost_;
  const bool tests_;
  const std::uint32_t tiles_x_;
  TimedOut<QuadBeat> out_test_;
  TimedOut<QuadBeat> out_survivors_;
  TimedOut<WarpRelease> out_release_;
  TimedOut<ColorBeat> out_color_;
  TimedIn<QuadBeat> in_bins_;
  TimedIn<QuadBeat> in_tested_;
  TimedIn<ShadedWarpItem> in_shaded_;
  Lane there_;  ///< to the tests, or past them
  Lane back_;   ///< from the tests
  Lane color_;
  std::vector<std::uint32_t> next_of_tile_;
  std::uint32_t next_sequence_ = 0;
  std::vector<Ready> early_;  ///< shaded before their turn
  std::deque<Ready> in_turn_;
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
