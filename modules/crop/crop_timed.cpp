#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "crop/crop_time.h"

#include <vrpipe/memory/line_returns.h>
#include <vrpipe/model/timed_cache_port.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>

namespace vrpipe {

namespace {

/// CROP at lt: as crop_unit.cpp, but a warp is taken in one piece: its quads look up the colour cache, and are
/// blended once the sectors of all are there. Neighbouring sectors are filled in one access. Without forwarding, or where
/// the cache is small, its quads go one by one.
/// Ports: in_color (ShadedWarpItem), out_terminations (TerminationBeat), out_done (BlendsDone; optional), memory (TLM-2.0
/// base protocol).
class TimedCrop : public TimedUnit {
 public:
  TimedCrop(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<CropBehaviour> behaviour,
            const RenderContext& context)
      : TimedUnit(name, domain, behaviour->time().kinds()),
        context_(context),
        out_(*this, "out_terminations"),
        out_done_(*this, "out_done"),
        in_(*this, "in_color",
            [this](const ShadedWarpItem& item, CycleInterval visible) { return take(*item.warp, visible); }),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        barriers_(context),
        hazard_gate_(context, "crop.blend_hazard"),
        // A hazard is one of quads.
        at_once_(time_.forwards ? time_.looked_up_at_once() : 1),
        memory_(*this, "memory", time_.mshrs,
                at_once_ == 1 ? 1 : std::min(time_.cache.sectors_of_a_line(), time_.mshrs), time_.cache.sector_bytes,
                dynamic_cast<CropBehaviour&>(behaviour_->unit()).cache_statistics,
                {MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}),
        look_ups_(time_.most_in_a_cycle),
        queue_(time_.input_quads),
        stays_(time_.cache.lines()) {
    out_.set_pipeline(time_.latency_cycles - 1, ColorBeat::in_a_cycle(time_.blend_rate));
    out_done_.set_pipeline(time_.latency_cycles - 1);
    out_done_.set_optional();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &memory_.socket(); }
  MemoryBytes memory_bytes() const override { return memory_.moved(); }
  bool ends_frame() const override { return true; }
  Cycle end_of_frame() const override { return end_; }

 private:
  void end_of_elaboration() override {
    const ColorSurface* const surface = behaviour_->surface();
    if (surface == nullptr) throw SimulationFault(this->name(), 0, "no colour surface is attached");
    monitor_ = std::make_unique<BlendOrderMonitor>(surface->width(), surface->height());
    if (time_.lines_return())
      returns_.emplace(surface->address(0), surface->size_bytes(), time_.cache.line_bytes, time_.line_return_cycles);
  }

  CycleInterval take(const ShadedWarp& warp, CycleInterval visible) {
    CycleInterval left = visible;
    if (warp.mark == Mark::end_of_frame) {
      tell_unpaired(time_.take_unpaired(true), time_.last_blend());
      end_ = any_blended_ ? time_.last_blend() + time_.latency_cycles : visible.first;
    } else if (warp.mark != Mark::none) {
      behaviour_->pass(warp.mark);
      if (barriers_.is_barrier(warp.mark)) out_done_.send({warp.mark}, std::max(visible.first, time_.last_blend()));
    } else if (at_once_ >= warp.count) {
      left = pass(warp, 0, warp.count, visible);
    } else {
      left.first = never;
      for (unsigned i = 0; i < warp.count; ++i) {
        const CycleInterval at = pass(warp, i, i + 1, visible.of_part(i, warp.count));
        left.first = std::min(left.first, at.first);
        left.last = at.last;
      }
    }
    warp.release();
    return left;
  }

  /// Looks quads of a warp up and blends them; returns the cycles of the look-ups.
  CycleInterval pass(const ShadedWarp& warp, unsigned from, unsigned to, CycleInterval visible) {
    const unsigned quads = to - from;
    const ColorSurface& surface = *behaviour_->surface();
    const std::size_t tile = surface.grid().place(warp.tile, 0);
    for (unsigned i = from; i < to; ++i) {
      const std::size_t place = tile + warp.position[i];
      __builtin_prefetch(&surface.quad(place), 1);
      __builtin_prefetch(&warp.color[i]);
      monitor_->prefetch(place);
    }
    behaviour_->look_up(warp, from, to, cache_);
    // Places in the queue, and lines that no queued quad needs.
    Cycle at = queue_.free_from(visible.first, quads);
    for (unsigned line = 0; line < cache_.count && !time_.fetches_ahead; ++line) {
      if (cache_.lines[line].replaced) at = std::max(at, stays_[cache_.lines[line].line].last_blend);
    }
    CycleInterval looked_up = look_ups_.take(at, quads);
    looked_up.last = std::max(looked_up.last, visible.last);
    Cycle there = looked_up.first + 1;
    for (unsigned line = 0; line < cache_.count; ++line)
      there = std::max(there, move(cache_.lines[line], looked_up.last));
    look_ups_.hold(looked_up.last);
    if (const unsigned moved = memory_.take_moved(); moved > 0) pay_later(looked_up.last, {moved, 0});

    charge(UnitState::starved, looked_up.first + 1);
    if (out_.last() > there) {
      charge(UnitState::memory, there);
      charge(UnitState::blocked, out_.last());
      there = out_.last();
    }
    const CycleInterval blended = blend_in_turn(warp, from, to, there);
    charge(UnitState::memory, blended.first);
    charge(UnitState::busy, blended.last + 1);
    queue_.take(quads, blended.last);
    any_blended_ = true;
    quads_last(blended.last + time_.latency_cycles, quads, [&](unsigned i) { return warp.draw[from + i]; });
    did(CropWork::blend, quads, blended.first, blended.last + 1);
    blend(warp, from, to, blended);
    return looked_up;
  }

  /// Takes the time of quads whose sectors are there from a cycle on.
  CycleInterval blend_in_turn(const ShadedWarp& warp, unsigned from, unsigned to, Cycle there) {
    // What moves takes time from blending, from when it does.
    for (; !moves_.empty() && moves_.front().at <= time_.free_from(time_.price(), there); moves_.pop()) {
      const Move& move = moves_.front();
      if (time_.move(move.paid, move.at)) did(CropWork::sectors, move.paid, move.at);
    }
    if (time_.quads_are_alike()) {
      const auto [first, last] = time_.blend_all(to - from, there);
      return {first, last};
    }
    CycleInterval blended = never;
    for (unsigned i = from; i < to; ++i) {
      const CropTime::Quad quad = priced_quad(warp, i);
      Cycle ready = there;
      if (!time_.forwards && hazard_gate_.enter() && quad.blends) ready = wait_for_hazard(quad.place, there);
      const CropTime::Price price = time_.price_of(quad, ready);
      blended.last = time_.free_from(price, ready);
      blended.first = std::min(blended.first, blended.last);
      time_.blend(quad, price, blended.last);
      tell_unpaired(time_.take_unpaired(), blended.last);
    }
    return blended;
  }
  CropTime::Quad priced_quad(const ShadedWarp& warp, unsigned index) const {
    return {cache_.lines[cache_.line_of[index]].address, cache_.sectors_of[index],
            static_cast<std::uint32_t>(behaviour_->surface()->grid().place(warp.tile, warp.position[index])),
            warp.live[index], context_.state(warp.draw[index]).blend};
  }
  [[gnu::noinline]] Cycle wait_for_hazard(std::uint32_t place, Cycle there) {
    const Cycle free = time_.free_from(time_.price(), there);
    const Cycle until = time_.hazard_until(place, time_.last_blend());
    if (until <= free) return there;
    time_.open(free);
    did(CropWork::forwarding, static_cast<std::uint64_t>(time_.open(until)), free, until);
    return until;
  }
  void tell_unpaired(std::int64_t parts, Cycle at) {
    if (parts > 0) did(CropWork::unpaired, static_cast<std::uint64_t>(parts), at);
  }
  void pay_later(Cycle at, const CropTime::Moves& moves) {
    if (const unsigned paid = time_.paid(moves); paid > 0) moves_.push({at, paid});
  }

  /// Moves what a look-up says of a line; returns when its sectors are there.
  Cycle move(const CropBehaviour::LineAccess& access, Cycle& at) {
    Stay& stay = stays_[access.line];
    if (access.written_back != 0) {
      // Where tags run ahead, quads may still be blended into what the line held.
      const Cycle from = time_.fetches_ahead ? std::max(at, stay.last_blend) : at;
      memory_.write_back(access, from);
      pay_later(from, {0, 1});
    }
    if (returns_ && access.replaced) {
      // It is there for another, which may have been before. What replaces colours does not read them.
      stay.ready = access.filled != 0 ? returns_->from(access.address) : 0;
      stay.used_before = returns_->last_use(access.address);
    }
    if (access.filled == 0) return stay.ready;
    stay.is_unpaid = stay.is_unpaid || access.replaced;
    Cycle there = memory_.fill(access, at);
    if (time_.fetches_ahead && stay.used_before > at) {
      // Fetched before what the line held is written back, and so again.
      fetched_again_ += static_cast<unsigned>(__builtin_popcount(access.filled));
      Cycle again = stay.used_before;
      there = std::max(there, memory_.fill(access, again));
      stay.ready = std::max(stay.ready, there);
    }
    return std::max(there, stay.ready);
  }

  void blend(const ShadedWarp& warp, unsigned from, unsigned to, CycleInterval at) {
    monitor_->blended(warp, from, to, at.last);
    CropBehaviour::Outcomes outcomes;
    behaviour_->blend_quads(warp, from, to, outcomes);
    std::array<std::uint32_t, quads_per_warp> dirty{};  // by line
    unsigned terminated = 0;
    for (unsigned i = from; i < to; ++i) {
      const bool changed = outcomes[i].changed || time_.writes_unchanged;
      dirty[cache_.line_of[i]] |= changed ? cache_.sectors_of[i] : 0U;
      terminated |= outcomes[i].terminated;
      // A line is paid for with the quad for which it was fetched.
      if (time_.pays_for_lines && std::exchange(stays_[cache_.lines[cache_.line_of[i]].line].is_unpaid, false) &&
          changed)
        pay_later(at.last, {0, 1});
    }
    if (terminated != 0) signal(warp, from, to, outcomes, at);
    for (unsigned i = 0; i < cache_.count; ++i) {
      const std::uint32_t line = cache_.lines[i].line;
      stays_[line].last_blend = at.last;
      if (returns_) returns_->used(cache_.lines[i].address, at.last);
      if (dirty[i] != 0) behaviour_->make_dirty(line, dirty[i]);
    }
  }

  void signal(const ShadedWarp& warp, unsigned from, unsigned to, const CropBehaviour::Outcomes& outcomes,
              CycleInterval at) {
    TerminationBeat beat;
    for (unsigned i = from; i < to; ++i) {
      if (outcomes[i].terminated == 0) continue;
      beat.signals[beat.count++] = {warp.tile, warp.position[i], outcomes[i].terminated,
                                    context_.draw(warp.draw[i]).epoch};
      if (beat.count < TerminationBeat::capacity) continue;
      out_.send(beat, at.of_part(i - from, to - from));
      beat.count = 0;
    }
    if (beat.count > 0) out_.send(beat, at.last);
  }

  struct Move {
    Cycle at = 0;
    unsigned paid = 0;
  };
  /// What a line of the cache holds.
  struct Stay {
    Cycle last_blend = 0;    ///< of a quad that needed it, or what it held before
    Cycle ready = 0;         ///< of one that came back: when it can be used
    Cycle used_before = 0;   ///< the last use of what it holds before it came back
    bool is_unpaid = false;  ///< fetched, and nothing blended into it
  };

  const RenderContext& context_;
  TimedOut<TerminationBeat> out_;
  TimedOut<BlendsDone> out_done_;
  TimedIn<ShadedWarpItem> in_;
  std::unique_ptr<CropBehaviour> behaviour_;
  CropTime time_;
  const BarrierPlan barriers_;
  EffectGate hazard_gate_;
  const unsigned at_once_;  ///< quads looked up before the first of them is blended
  TimedCachePort memory_;
  std::unique_ptr<BlendOrderMonitor> monitor_;
  CropBehaviour::CacheLookUp cache_;
  ThroughputPort look_ups_;
  SlotPool queue_;    ///< quads between look-up and blending
  Ring<Move> moves_;  ///< that the blender has not given its time to yet
  std::vector<Stay> stays_;
  std::optional<LineReturns> returns_;  ///< where lines that come back wait
  Cycle end_ = never;
  bool any_blended_ = false;
  StatisticSet more_cache_statistics_{*this, "cache"};
  Counter fetched_again_{more_cache_statistics_, "sectors_fetched_again", "sectors",
                         "a second time, since their line came back before what it had held was written back"};
};

[[maybe_unused]] const bool crop_timed_registered = [] {
  register_timed_unit_maker("crop", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderContext& context, unsigned) {
    return std::make_unique<TimedCrop>(name.c_str(), domain, behaviour_as<CropBehaviour>(std::move(behaviour)),
                                       context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
