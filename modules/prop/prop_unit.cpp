#include <algorithm>
#include <queue>

#include <vrpipe/unit.h>

namespace vrpipe {

namespace {

/// PROP at cycle fidelity. Ports: in_bins, out_test, in_tested, out_survivors (QuadBeat), in_shaded (ShadedWarpItem),
/// out_release (WarpRelease), out_color (ColorBeat). Without any test enabled bins bypass ZROP.
class PropUnit : public Unit {
 public:
  PropUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<PropBehaviour> behaviour,
           const RenderState& state)
      : Unit(name, domain),
        in_bins_(*this, "in_bins"),
        out_test_(*this, "out_test"),
        in_tested_(*this, "in_tested"),
        out_survivors_(*this, "out_survivors"),
        in_shaded_(*this, "in_shaded"),
        out_release_(*this, "out_release"),
        out_color_(*this, "out_color"),
        behaviour_(std::move(behaviour)),
        cost_(behaviour_->cost()),
        tests_(state.early_termination),
        tiles_x_((state.draw->width + screen_tile_pixels - 1) / screen_tile_pixels) {
    out_test_.set_pipeline(cost_.latency_cycles - 1, 1);
    out_survivors_.set_pipeline(cost_.latency_cycles - 1, 1);
    out_color_.set_pipeline(cost_.latency_cycles - 1, 1);
    if (cost_.order == PropBehaviour::Order::tile) {
      const std::uint32_t tiles_y = (state.draw->height + screen_tile_pixels - 1) / screen_tile_pixels;
      next_of_tile_.assign(std::size_t{tiles_x_} * tiles_y, 0);
    }
  }

  bool idle() const override {
    return in_bins_.empty() && in_tested_.empty() && in_shaded_.empty() && current_ == nullptr && early_ == 0 &&
           in_turn_.empty() && end_ == nullptr;
  }
  std::uint64_t work() const override { return color_quads_; }
  double peak_rate() const override { return cost_.color_quads_per_cycle; }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  struct LaterFirst {
    bool operator()(const ShadedWarp* a, const ShadedWarp* b) const { return a->sequence > b->sequence; }
  };

  std::uint32_t& next_of_tile(TileId tile) { return next_of_tile_[std::size_t{tile.y} * tiles_x_ + tile.x]; }

  bool is_next(const ShadedWarp& warp) {
    return cost_.order == PropBehaviour::Order::draw ? warp.sequence == next_sequence_
                                                     : warp.tile_sequence == next_of_tile(warp.tile);
  }

  /// A way through the unit, `quads_per_cycle` wide.
  struct Passage {
    Cycle free_at = 0;
  };

  /// Moves beats from one port to the next; a beat wider than the unit takes several cycles.
  bool forward(Passage& passage, StreamIn<QuadBeat>& from, StreamOut<QuadBeat>& to, Cycle now) {
    if (now < passage.free_at) return false;
    bool moved = false;
    unsigned budget = cost_.quads_per_cycle;
    while (from.ready() && to.credits() > 0) {
      const QuadBeat& beat = from.front();
      const unsigned width = std::max<unsigned>(beat.count, 1);
      if (width > budget && moved) break;
      to.push(beat);
      from.pop();
      moved = true;
      if (width >= budget) {
        passage.free_at = now + (width + cost_.quads_per_cycle - 1) / cost_.quads_per_cycle;
        break;
      }
      budget -= width;
    }
    return moved;
  }

  bool collect() {
    bool moved = false;
    while (in_shaded_.ready()) {
      const ShadedWarp* const warp = in_shaded_.front().warp;
      in_shaded_.pop();
      moved = true;
      if (warp->end_of_draw) {
        end_ = warp;
      } else if (is_next(*warp)) {
        in_turn_.push(warp);
      } else {
        early_by_bucket_[bucket_of(*warp)].push_back(warp);
        ++early_;
      }
    }
    return moved;
  }

  /// Early warps are kept apart by tile, or by launch order, so that finding the next one is quick.
  std::size_t bucket_of(const ShadedWarp& warp) const {
    return cost_.order == PropBehaviour::Order::draw ? warp.sequence % early_by_bucket_.size()
                                                     : (warp.tile.y * 31U + warp.tile.x) % early_by_bucket_.size();
  }

  /// After a warp has left: the one that follows it may be among those that came early.
  void promote(const ShadedWarp& left) {
    if (cost_.order == PropBehaviour::Order::tile) ++next_of_tile(left.tile);
    ++next_sequence_;
    if (early_ == 0) return;
    std::vector<const ShadedWarp*>& bucket =
        early_by_bucket_[cost_.order == PropBehaviour::Order::draw ? next_sequence_ % early_by_bucket_.size()
                                                                   : bucket_of(left)];
    for (std::size_t i = 0; i < bucket.size(); ++i) {
      if (!is_next(*bucket[i])) continue;
      in_turn_.push(bucket[i]);
      bucket[i] = bucket.back();
      bucket.pop_back();
      --early_;
      break;
    }
  }

  bool send_color() {
    if (out_color_.credits() == 0) return false;
    ColorBeat beat;
    bool moved = false;
    while (beat.count < cost_.color_quads_per_cycle) {
      if (current_ == nullptr) {
        if (in_turn_.empty()) break;
        if (out_release_.credits() == 0) break;
        current_ = in_turn_.top();
        in_turn_.pop();
        index_ = 0;
      }
      if (index_ < current_->count) {
        ++current_->holders;
        beat.quads[beat.count++] = {current_, current_->tile, current_->position[index_], current_->live[index_],
                                    index_};
        ++index_;
      }
      if (index_ == current_->count) {
        const ShadedWarp* const left = current_;
        current_ = nullptr;
        promote(*left);
        out_release_.push({left->slot});
        --left->holders;
        moved = true;
        // A warp without survivors takes the cycle in which it is passed over.
        if (left->count == 0) break;
      }
    }
    if (beat.count > 0) {
      color_quads_ += beat.count;
      out_color_.push(beat);
      return true;
    }
    if (!moved && end_ != nullptr && end_->sequence == next_sequence_ && out_release_.credits() > 0) {
      beat.end_of_draw = true;
      out_color_.push(beat);
      out_release_.push({end_->slot});
      --end_->holders;
      end_ = nullptr;
      next_sequence_ = 0;
      std::fill(next_of_tile_.begin(), next_of_tile_.end(), 0);
      return true;
    }
    return moved;
  }

  Cycle tick(Cycle now) override {
    bool moved = send_color();
    moved = collect() || moved;
    if (tests_) {
      moved = forward(back_, in_tested_, out_survivors_, now) || moved;
      moved = forward(there_, in_bins_, out_test_, now) || moved;
    } else {
      moved = forward(there_, in_bins_, out_survivors_, now) || moved;
    }
    if (moved) {
      enter(UnitState::busy, now);
      return now + 1;
    }
    const bool has_work = current_ != nullptr || !in_turn_.empty() || in_bins_.ready() || in_tested_.ready();
    enter(has_work ? UnitState::blocked : early_ == 0 ? UnitState::starved : UnitState::latency, now);
    Cycle next = std::min({there_.free_at > now ? there_.free_at : never, back_.free_at > now ? back_.free_at : never,
                           out_color_.retry(), out_release_.retry(), out_test_.retry(), out_survivors_.retry()});
    for (const Cycle ready : {in_bins_.next_ready(), in_tested_.next_ready(), in_shaded_.next_ready()}) {
      if (ready > now) next = std::min(next, ready);
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
  const PropBehaviour::Cost cost_;
  const bool tests_;
  const std::uint32_t tiles_x_;
  Passage there_;  ///< to the tests, or past them
  Passage back_;   ///< from the tests
  std::vector<std::uint32_t> next_of_tile_;
  std::uint32_t next_sequence_ = 0;
  std::array<std::vector<const ShadedWarp*>, 256> early_by_bucket_;  ///< shaded before their turn
  std::size_t early_ = 0;
  /// Whose turn has come; the oldest leaves first, which keeps a tile's quads together in the colour cache.
  std::priority_queue<const ShadedWarp*, std::vector<const ShadedWarp*>, LaterFirst> in_turn_;
  const ShadedWarp* current_ = nullptr;    ///< being handed to CROP, from `index_` on
  std::uint8_t index_ = 0;
  const ShadedWarp* end_ = nullptr;
  std::uint64_t color_quads_ = 0;
};

[[maybe_unused]] const bool registered = [] {
  register_unit_maker("prop", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                 const RenderState& state, unsigned) {
    return std::make_unique<PropUnit>(name.c_str(), domain, behaviour_as<PropBehaviour>(std::move(behaviour)), state);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
