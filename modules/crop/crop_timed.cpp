#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "crop/sector_group.h"

#include <vrpipe/memory/line_returns.h>
#include <vrpipe/model/timed_cache_port.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>
#include <vrpipe/pipeline/slots/crop.h>

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
      : TimedUnit(name, domain, CropWork::kinds(behaviour->timing())),
        context_(context),
        out_(*this, "out_terminations"),
        out_done_(*this, "out_done"),
        in_(*this, "in_color",
            [this](const ShadedWarpItem& item, CycleInterval visible) { return take(*item.warp, visible); }),
        behaviour_(std::move(behaviour)),
        barriers_(context),
        hazard_gate_(context, "crop.blend_hazard"),
        timing_(behaviour_->timing()),
        // A hazard is one of quads.
        at_once_(timing_.forwards ? quads_looked_up_at_once(timing_) : 1),
        memory_(*this, "memory", timing_.mshrs,
                at_once_ == 1 ? 1 : std::min(timing_.line_bytes / timing_.sector_bytes, timing_.mshrs),
                timing_.sector_bytes, dynamic_cast<CropBehaviour&>(behaviour_->unit()).cache_statistics,
                {MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}),
        look_ups_(timing_.blend_rate.most_in_a_cycle()),
        queue_(timing_.input_quads),
        blending_(static_cast<unsigned>(CropWork::parts_of_a_cycle(timing_))),
        price_(timing_.blend_rate.cycles * timing_.moves_in_a_cycle()),
        move_price_(timing_.blend_rate.items * timing_.parts_of_a_move()),
        in_pairs_(timing_.pairs_in_sector && timing_.blend_rate.most_in_a_cycle() > 1),
        pairs_one_by_one_(in_pairs_ && at_once_ == 1),
        group_(timing_.blend_rate.most_in_a_cycle(), CropWork::parts_of_a_cycle(timing_)),
        lines_(std::max(timing_.cache_bytes / timing_.line_bytes, 1U)),
        ready_(lines_.size()),
        unpaid_(lines_.size()) {
    out_.set_pipeline(timing_.latency_cycles - 1, ColorBeat::in_a_cycle(timing_.blend_rate));
    out_done_.set_pipeline(timing_.latency_cycles - 1);
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
    if (timing_.fetches_ahead || timing_.line_return_cycles > 0) {
      returns_.emplace(surface->address(0), surface->size_bytes(), timing_.line_bytes, timing_.line_return_cycles);
      used_before_.resize(lines_.size());
    }
  }

  CycleInterval take(const ShadedWarp& warp, CycleInterval visible) {
    CycleInterval left = visible;
    if (warp.mark == Mark::end_of_frame) {
      settle_unpaired();
      end_ = !any_blended_ ? visible.first : last_blend_ + timing_.latency_cycles;
    } else if (warp.mark != Mark::none) {
      behaviour_->pass(warp.mark);
      if (barriers_.is_barrier(warp.mark))
        out_done_.send({warp.mark}, any_blended_ ? std::max(visible.first, last_blend_) : visible.first);
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
    for (unsigned line = 0; line < cache_.count && !timing_.fetches_ahead; ++line) {
      if (cache_.lines[line].replaced) at = std::max(at, lines_[cache_.lines[line].line]);
    }
    CycleInterval looked_up = look_ups_.take(at, quads);
    looked_up.last = std::max(looked_up.last, visible.last);
    Cycle there = looked_up.first + 1;
    for (unsigned line = 0; line < cache_.count; ++line) {
      const CropBehaviour::LineAccess& access = cache_.lines[line];
      if (access.written_back != 0) write_back(access, looked_up.last);
      if (returns_ && access.replaced) come_back(access);
      if (access.filled != 0) there = std::max(there, fill(access, looked_up.last));
      if (returns_) there = std::max(there, ready_[access.line]);
    }
    look_ups_.hold(looked_up.last);
    if (const unsigned moved = memory_.take_moved(); moved > 0 && timing_.line_cycles == 0)
      moves_.push({looked_up.last, moved});

    charge(UnitState::starved, looked_up.first + 1);
    if (out_.last() > there) {
      charge(UnitState::memory, there);
      charge(UnitState::blocked, out_.last());
      there = out_.last();
    }
    const Cycle hazard = timing_.forwards || !hazard_gate_.enter() || !context_.state(warp.draw[from]).blend
                             ? 0
                             : hazard_until(warp.tile, warp.position[from]);
    const CycleInterval blended = joins_last(from, std::max(there, hazard))
                                      ? join_last(warp, from)
                                      : blend_in_turn(warp, from, to, there, hazard);
    charge(UnitState::memory, blended.first);
    charge(UnitState::busy, blended.last + 1);
    queue_.take(quads, blended.last);
    last_blend_ = blended.last;
    any_blended_ = true;
    quads_last(blended.last + timing_.latency_cycles, to - from, [&](unsigned i) { return warp.draw[from + i]; });
    did(CropWork::blend, quads, blended.first, blended.last + 1);
    if (!timing_.forwards) recent_.push({warp.tile, warp.position[from], blended.last});
    blend(warp, from, to, blended);
    return looked_up;
  }

  /// Takes the time of quads that can be blended from a cycle on, but for a hazard.
  CycleInterval blend_in_turn(const ShadedWarp& warp, unsigned from, unsigned to, Cycle there, Cycle hazard) {
    const unsigned quads = to - from;
    // Moving a sector takes time from blending, from when it moves.
    for (; !moves_.empty() && moves_.front().at <= std::max({there, hazard, blending_.next()}); moves_.pop()) {
      // Beside a blend of several cycles the cache is idle.
      if (const unsigned cost = moves_.front().moved * move_price_; idle_cache_ >= cost) {
        idle_cache_ -= cost;
        continue;
      }
      blending_.take(moves_.front().at, moves_.front().moved * move_price_);
      did(CropWork::sectors, moves_.front().moved, moves_.front().at);
    }
    there = std::max(there, blending_.next());
    if (hazard > there) {
      const std::uint64_t wasted = (hazard - there) * CropWork::parts_of_a_cycle(timing_) - blending_.taken_of(there);
      did(CropWork::forwarding, wasted, there, hazard);
      there = hazard;
    }
    const auto price = static_cast<unsigned>(price_of(warp, from, to));
    const CycleInterval blended = blending_.take(there, price);
    if (timing_.column_cycles > 0) idle_cache_ = price > quads * price_ ? price - quads * price_ : 0;
    settle_unpaired();
    if (price > quads * price_) unpaired_ = {price - quads * price_, blended};
    return blended;
  }
  bool joins_last(unsigned index, Cycle there) const {
    return pairs_one_by_one_ && any_blended_ && there <= last_blend_ && group_.takes(place_of(index));
  }
  /// The last quads have paid for the rest of a cycle.
  CycleInterval join_last(const ShadedWarp& warp, unsigned index) {
    const auto price = static_cast<unsigned>(group_.join(own_price(warp, index)));
    unpaired_.parts = unpaired_.parts + price - price_;
    return price == 0 ? CycleInterval{last_blend_, last_blend_} : blending_.take(last_blend_, price);
  }
  SectorGroup::Place place_of(unsigned index) const {
    return {cache_.lines[cache_.line_of[index]].address, cache_.sectors_of[index]};
  }
  /// Nothing goes with the last quads any more.
  void settle_unpaired() {
    if (unpaired_.parts > 0) did(CropWork::unpaired, unpaired_.parts, unpaired_.at.first, unpaired_.at.last + 1);
    unpaired_.parts = 0;
  }

  void write_back(const CropBehaviour::LineAccess& access, Cycle looked_up) {
    // Where tags run ahead, quads may still be blended into what the line held.
    const Cycle at = timing_.fetches_ahead ? std::max(looked_up, lines_[access.line]) : looked_up;
    memory_.write_back(access, at);
    if (timing_.line_cycles > 0) moves_.push({at, 1});
  }
  /// Returns when the sectors are there. Those that are fetched before what the line held is written back are fetched again.
  Cycle fill(const CropBehaviour::LineAccess& access, Cycle& at) {
    if (access.replaced) unpaid_[access.line] = true;
    Cycle there = memory_.fill(access, at);
    if (!timing_.fetches_ahead) return there;
    Cycle before = used_before_[access.line];
    if (before <= at) return there;
    fetched_again_ += static_cast<unsigned>(__builtin_popcount(access.filled));
    there = std::max(there, memory_.fill(access, before));
    ready_[access.line] = std::max(ready_[access.line], there);
    return there;
  }
  /// A line is there for another, which may have been before.
  void come_back(const CropBehaviour::LineAccess& access) {
    // What replaces colours does not read them.
    ready_[access.line] = access.filled != 0 ? returns_->from(access.address) : 0;
    used_before_[access.line] = returns_->last_use(access.address);
  }

  /// Of quads, in parts of a cycle.
  std::uint64_t price_of(const ShadedWarp& warp, unsigned from, unsigned to) {
    if (!in_pairs_ && timing_.column_cycles == 0) return std::uint64_t{to - from} * price_;
    std::uint64_t price = 0;
    for (unsigned i = from; i < to; ++i) {
      const unsigned own = own_price(warp, i);
      const bool joins = i > from && group_.takes(place_of(i));
      price += !in_pairs_ ? own : joins ? group_.join(own) : group_.begin(place_of(i), own);
    }
    return price;
  }
  unsigned own_price(const ShadedWarp& warp, unsigned index) const {
    if (timing_.column_cycles == 0 || !context_.state(warp.draw[index]).blend) return price_;
    const auto column = timing_.column_cycles * static_cast<unsigned>(CropWork::parts_of_a_cycle(timing_));
    return std::max(price_, columns_of(warp.live[index]) * column);
  }

  void blend(const ShadedWarp& warp, unsigned from, unsigned to, CycleInterval at) {
    monitor_->blended(warp, from, to, at.last);
    CropBehaviour::Outcomes outcomes;
    behaviour_->blend_quads(warp, from, to, outcomes);
    std::array<std::uint32_t, quads_per_warp> dirty{};  // by line
    unsigned terminated = 0;
    for (unsigned i = from; i < to; ++i) {
      const CropBehaviour::Outcome outcome = outcomes[i];
      dirty[cache_.line_of[i]] |= outcome.changed || timing_.writes_unchanged ? cache_.sectors_of[i] : 0U;
      terminated |= outcome.terminated;
      // A line is paid for with the quad for which it was fetched.
      if (timing_.line_cycles > 0 && std::exchange(unpaid_[cache_.lines[cache_.line_of[i]].line], false) &&
          (outcome.changed || timing_.writes_unchanged))
        moves_.push({at.last, 1});
    }
    if (terminated != 0) signal(warp, from, to, outcomes, at);
    for (unsigned i = 0; i < cache_.count; ++i) {
      const std::uint32_t line = cache_.lines[i].line;
      lines_[line] = at.last;
      if (returns_) returns_->used(cache_.lines[i].address, at.last);
      if (dirty[i] == 0) continue;
      behaviour_->make_dirty(line, dirty[i]);
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

  /// The cycle in which a quad of the same position has left the blending pipeline.
  [[gnu::noinline]] Cycle hazard_until(TileId tile, std::uint8_t position) {
    while (!recent_.empty() && recent_.front().at + timing_.latency_cycles <= last_blend_) recent_.pop();
    Cycle until = 0;
    for (std::size_t i = 0; i < recent_.size(); ++i) {
      const Recent& blend = recent_[i];
      if (blend.tile == tile && blend.position == position) until = blend.at + timing_.latency_cycles;
    }
    return until;
  }

  struct Move {
    Cycle at = 0;
    unsigned moved = 0;
  };
  struct Recent {
    TileId tile;
    std::uint8_t position = 0;
    Cycle at = 0;
  };

  const RenderContext& context_;
  TimedOut<TerminationBeat> out_;
  TimedOut<BlendsDone> out_done_;
  TimedIn<ShadedWarpItem> in_;
  std::unique_ptr<CropBehaviour> behaviour_;
  const BarrierPlan barriers_;
  EffectGate hazard_gate_;
  const CropBehaviour::TimingParameters timing_;
  const unsigned at_once_;  ///< quads looked up before the first of them is blended
  TimedCachePort memory_;
  std::unique_ptr<BlendOrderMonitor> monitor_;
  CropBehaviour::CacheLookUp cache_;
  ThroughputPort look_ups_;
  SlotPool queue_;               ///< quads between look-up and blending
  ThroughputPort blending_;      ///< in parts of a cycle that both a quad and a sector are whole numbers of
  const unsigned price_;         ///< of blending a quad, in these
  const unsigned move_price_;    ///< of moving a sector, or a line
  unsigned idle_cache_ = 0;      ///< parts of the last blend of several cycles, in which nothing moves
  const bool in_pairs_;          ///< several quads go in a cycle only if they share a sector
  const bool pairs_one_by_one_;  ///< and are blended one by one
  SectorGroup group_;            ///< the last of these
  struct {
    unsigned parts = 0;
    CycleInterval at;
  } unpaired_;                          ///< of the last quads' price, beyond their rate
  Ring<Move> moves_;                    ///< of sectors or lines, that blending has not given its time to yet
  std::vector<Cycle> lines_;            ///< of the cache: the last blend of a quad that needed it
  std::vector<Cycle> ready_;            ///< of the cache: when one that came back can be used
  std::vector<char> unpaid_;            ///< of the cache: fetched, and nothing blended into it
  std::optional<LineReturns> returns_;  ///< where lines that come back wait
  std::vector<Cycle> used_before_;      ///< by line of the cache: the last use of what it holds before it came back
  Ring<Recent> recent_;                 ///< blends in the pipeline, without forwarding
  Cycle last_blend_ = 0;
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
