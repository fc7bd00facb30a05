#include <algorithm>
#include <optional>
#include <utility>

#include "crop/lines_ahead.h"
#include "crop/sector_group.h"

#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/cache_port.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>
#include <vrpipe/pipeline/quad_sectors.h>
#include <vrpipe/pipeline/slots/crop.h>

namespace vrpipe {

namespace {

/// CROP at cycle fidelity. A quad looks up the colour cache when it arrives and starts the fills that it needs, then
/// waits in order; blending takes place at the head. Moving a sector, or a line, takes cycles from blending.
/// Ports: in_color (ColorBeat), out_terminations (TerminationBeat), out_done (BlendsDone; optional), memory (TLM-2.0 base
/// protocol).
class CropUnit : public Unit {
 public:
  CropUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<CropBehaviour> behaviour,
           const RenderContext& context)
      : Unit(name, domain, CropWork::kinds(behaviour->timing())),
        context_(context),
        in_(*this, "in_color"),
        out_(*this, "out_terminations"),
        out_done_(*this, "out_done"),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        signals_(context.frame->terminates_early()),
        replaces_(context.frame->replaces_color()),
        barriers_(context),
        hazard_gate_(context, "crop.blend_hazard"),
        cache_order_gate_(context, "crop.cache_order"),
        price_(std::int64_t{timing_.blend_rate.cycles} * timing_.moves_in_a_cycle()),
        move_price_(std::int64_t{timing_.blend_rate.items} * timing_.parts_of_a_move()),
        income_(static_cast<std::int64_t>(CropWork::parts_of_a_cycle(timing_))),
        most_in_a_cycle_(timing_.blend_rate.most_in_a_cycle()),
        pairs_(timing_.pairs_in_sector && most_in_a_cycle_ > 1),
        group_(most_in_a_cycle_, CropWork::parts_of_a_cycle(timing_)),
        port_(*this, "memory", timing_.mshrs,
              {MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}) {
    out_.set_pipeline(timing_.latency_cycles - 1, ColorBeat::in_a_cycle(timing_.blend_rate));
    out_done_.set_pipeline(timing_.latency_cycles - 1);
    out_done_.set_optional();
  }

  bool idle() const override { return in_.empty() && queue_.empty() && marks_.empty() && done_.empty(); }
  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &port_.socket(); }
  MemoryBytes memory_bytes() const override { return port_.moved(); }
  bool ends_frame() const override { return true; }
  Cycle end_of_frame() const override { return end_; }

 private:
  static constexpr std::size_t quads_ahead = 8;
  struct Entry {
    ColorQuad quad;
    SectoredCache::Line line = SectoredCache::no_line;  ///< or its stay (LinesAhead)
    std::uint32_t sectors = 0;                          ///< of the line, a bit each
    std::uint32_t place = 0;                            ///< in the surface's grid
  };

  void end_of_elaboration() override {
    surface_ = behaviour_->surface();
    if (surface_ == nullptr) throw SimulationFault(this->name(), 0, "no colour surface is attached");
    line_shift_ = static_cast<unsigned>(__builtin_ctz(timing_.line_bytes));
    timing_.check_cache(surface_->format());
    CacheOrganization organization = timing_.cache();
    if (!cache_order_gate_.is_active()) organization.replacement = Replacement::random;  // which keeps no order
    port_.make_cache(organization, dynamic_cast<CropBehaviour&>(behaviour_->unit()).cache_statistics);
    if (!cache_order_gate_.is_active()) port_.cache().before_eviction([this] { cache_order_gate_.enter(); });
    sectors_of_quads_ = sectors_of_quads(timing_.cache(), 4 * bytes_per_pixel(surface_->format()));
    sectors_of_a_quad_ = static_cast<unsigned>(__builtin_popcount(sectors_of_quads_.front().sectors));
    monitor_.emplace(surface_->width(), surface_->height());
    if (timing_.fetches_ahead || timing_.line_return_cycles > 0) {
      returns_.emplace(surface_->address(0), surface_->size_bytes(), timing_.line_bytes, timing_.line_return_cycles);
      came_back_.resize(organization.lines());
    }
    if (timing_.fetches_ahead) {
      ahead_.emplace(port_, dynamic_cast<CropBehaviour&>(behaviour_->unit()).cache_statistics, *returns_,
                     timing_.mshrs);
    }
    unpaid_.resize(organization.lines());
  }

  /// Takes a quad from the link into the queue; false when it has to wait.
  bool look_up(const ColorQuad& quad) {
    const unsigned position = quad.position();
    const std::size_t tile = surface_->grid().place(quad.warp->tile, 0);
    const auto [line_of_tile, sectors] = sectors_of_quads_[position];
    const std::uint64_t address = surface_->address(tile) + (std::uint64_t{line_of_tile} << line_shift_);
    if (ahead_) return look_up_ahead(quad, address, sectors, tile + position);
    SectoredCache::Line line =
        wanted_.line == SectoredCache::no_line ? port_.pin_held(address, sectors) : SectoredCache::no_line;
    std::uint32_t asked_for = 0;
    if (line == SectoredCache::no_line) {
      if (replaces_) wanted_.reads = blends(quad);
      line = fill(address, sectors, asked_for);
      if (line == SectoredCache::no_line) return false;
    }
    if (const std::uint32_t on_their_way = port_.awaited(line, sectors) & ~asked_for; on_their_way != 0) {
      hits_on_their_way_ += static_cast<unsigned>(__builtin_popcount(on_their_way));
    }
    queue(quad, line, sectors, tile + position);
    return true;
  }
  [[gnu::always_inline]] void queue(const ColorQuad& quad, std::uint32_t line, std::uint32_t sectors,
                                    std::size_t place) {
    // In place: a temporary of narrow stores would be waited for when it is copied.
    Entry& entry = queue_.push();
    entry.quad = quad;
    entry.line = line;
    entry.sectors = sectors;
    entry.place = static_cast<std::uint32_t>(place);
  }
  [[gnu::noinline]] bool look_up_ahead(const ColorQuad& quad, std::uint64_t address, std::uint32_t sectors,
                                       std::size_t place) {
    const LinesAhead::Stay stay = ahead_->look_up(address, sectors, blends(quad));
    if (stay == LinesAhead::no_stay) return false;
    pay_for_stays();
    queue(quad, stay, sectors, place);
    return true;
  }
  bool blends(const ColorQuad& quad) const { return !replaces_ || context_.state(quad.warp->draw[quad.index]).blend; }
  void pay_for_stays() {
    const LinesAhead::Moves moves = ahead_->take_moves();
    const unsigned moved = timing_.line_cycles == 0 ? moves.sectors : moves.lines;
    if (moved > 0) pay(moved);
    fetched_again_ += ahead_->take_fetched_again();
  }
  /// Gives what moves its time of the blender, unless the cache is idle beside a blend of several cycles.
  void pay(unsigned moved) {
    if (idle_cache_ >= moved * move_price_) {
      idle_cache_ -= moved * move_price_;
      return;
    }
    tokens_ -= moved * move_price_;
    did(CropWork::sectors, moved, now());
  }

  /// Goes on with the look-up of the quad at the link; `no_line` while it has to wait.
  [[gnu::noinline]] SectoredCache::Line fill(std::uint64_t address, std::uint32_t sectors, std::uint32_t& asked_for) {
    wanted_.address = address;
    wanted_.sectors = sectors;
    const bool had_line = wanted_.line != SectoredCache::no_line;
    const bool done = port_.look_up(wanted_, now(), [this](unsigned moved) {
      if (timing_.line_cycles == 0) pay(moved);
    });
    if (timing_.line_cycles > 0) {
      if (const unsigned lines = port_.take_lines_moved().written_back; lines > 0) pay(lines);
    }
    // It has just been pinned, by nobody else if it is new.
    if (!had_line && wanted_.line != SectoredCache::no_line && port_.cache().present(wanted_.line) == 0) {
      unpaid_[wanted_.line] = wanted_.reads;
      if (returns_) came_back_[wanted_.line] = wanted_.reads && returns_->from(wanted_.address) != 0;
    }
    if (!done) return SectoredCache::no_line;
    asked_for = std::exchange(wanted_.asked_for, 0);
    return std::exchange(wanted_.line, SectoredCache::no_line);
  }

  bool accept() {
    bool moved = false;
    auto budget = static_cast<unsigned>(std::min<std::size_t>(most_in_a_cycle_, timing_.input_quads - queue_.size()));
    while (budget > 0 && in_.ready()) {
      const ColorBeat& beat = in_.front();
      if (beat.mark != Mark::none) {
        queue_mark(beat.mark);
        in_.pop();
        moved = true;
        continue;
      }
      for (; at_ < beat.count && budget > 0; ++at_, --budget) {
        if (!look_up(beat.quads[at_])) return moved;
        moved = true;
      }
      if (at_ == beat.count) {
        port_.cache().accessed(at_, at_ * sectors_of_a_quad_);
        in_.pop();
        at_ = 0;
      }
    }
    return moved;
  }

  /// Whether a quad of the same position is still in the blending pipeline.
  bool hazard(std::uint32_t place, Cycle now) {
    while (!recent_.empty() && recent_.front().second + timing_.latency_cycles <= now) recent_.pop_front();
    return std::any_of(recent_.begin(), recent_.end(), [&](const auto& blend) { return blend.first == place; });
  }

  /// For the host: what blending a quad will touch was last touched long ago. Inlined, since GCC drops calls of
  /// functions that do nothing but prefetch.
  [[gnu::always_inline]] void prefetch(const Entry& entry) const {
    __builtin_prefetch(&surface_->quad(entry.place), 1);
    __builtin_prefetch(&entry.quad.color());
    __builtin_prefetch(&entry.quad.warp->first_primitive[entry.quad.index]);
    monitor_->prefetch(entry.place);
  }

  /// Blends from the head of the queue; why it stopped is in `stop_`.
  bool blend(Cycle now) {
    // What sectors took from blending is paid back first; unused cycles are lost, fractions of a quad are not.
    if (now > refilled_) {
      tokens_ += static_cast<std::int64_t>(now - refilled_) * income_;
      const std::int64_t lost = tokens_ - (income_ + (pairs_ ? income_ : price_) - 1);
      if (lost > 0) {
        tokens_ -= lost;
        if (stop_ == UnitState::latency) did(CropWork::forwarding, static_cast<std::uint64_t>(lost), refilled_, now);
      }
      refilled_ = now;
    }
    TerminationBeat beat;
    stop_ = UnitState::starved;
    ready_at_ = never;
    unsigned budget = most_in_a_cycle_;
    for (; budget > 0 && !queue_.empty(); --budget) {
      if (!marks_.empty()) pass_marks(now);
      const Entry& entry = queue_.front();
      // In the same cycle a beat that is full may go before this one.
      if (signals_ && out_.credits() < (beat.count == TerminationBeat::capacity ? 2U : 1U)) {
        stop_ = UnitState::blocked;
        break;
      }
      if (is_awaited(entry, now)) {
        stop_ = UnitState::memory;
        break;
      }
      const bool joins = pairs_ && joins_last(entry, most_in_a_cycle_ - budget);
      const std::int64_t price = !pairs_ ? price_ : joins ? price_of_next() : income_;
      if (tokens_ < price) {
        stop_ = UnitState::busy;  // with the quads before it, or with moving sectors
        if (pairs_) last_waits_ = budget < most_in_a_cycle_ || last_waits_;
        break;
      }
      if (!timing_.forwards && hazard_gate_.enter() && blends(entry.quad)) {
        if (hazard(entry.place, now)) {
          stop_ = UnitState::latency;
          break;
        }
        recent_.emplace_back(entry.place, now);
      }
      const ColorQuad& quad = entry.quad;
      monitor_->blended(entry.place, *quad.warp, quad.index, now);
      const CropBehaviour::Outcome outcome = behaviour_->blend_quad(entry.place, *quad.warp, quad.index);
      if (outcome.terminated != 0) {
        if (beat.count == TerminationBeat::capacity) {
          out_.push(beat);
          beat.count = 0;
        }
        beat.signals[beat.count++] = {quad.warp->tile, static_cast<std::uint8_t>(quad.position()), outcome.terminated,
                                      context_.draw(quad.warp->draw[quad.index]).epoch};
      }
      if (tells_draws()) draw_lasts(quad.warp->draw[quad.index], now + timing_.latency_cycles);
      if (quad.is_last()) quad.warp->release();
      const bool changed = outcome.changed || timing_.writes_unchanged;
      if (pairs_) goes(entry, joins);
      tokens_ -= price;
      unpaired_ += price - price_;
      if (timing_.column_cycles > 0 && blends(quad)) unpaired_ += pay_for_columns(quad.live());
      if (!ahead_) {
        if (changed) port_.cache().make_dirty(entry.line, entry.sectors);
        port_.cache().unpin(entry.line);
        if (returns_) use(entry, now);
        if (timing_.line_cycles > 0 && unpaid_[entry.line]) pay_for_fetch(entry.line, changed);
      } else {
        ahead_->blended(entry.line, entry.sectors, changed, now);
        pay_for_stays();
      }
      queue_.pop();
      if (!marks_.empty()) --marks_.front().quads;
      if (queue_.size() > quads_ahead) prefetch(queue_[quads_ahead]);
    }
    if (beat.count > 0) out_.push(beat);
    const unsigned blended = most_in_a_cycle_ - budget;
    if (blended == 0) return false;
    frame_lasts(now + timing_.latency_cycles);
    did(CropWork::blend, blended, now);
    if (!pairs_) settle_unpaired(now);
    last_blend_ = now;
    any_blended_ = true;
    return true;
  }

  /// Whether the sectors of a quad whose turn it is are not there.
  bool is_awaited(const Entry& entry, Cycle now) {
    if (!ahead_) {
      if (port_.awaited(entry.line, entry.sectors) != 0) return true;
      if (!returns_ || !came_back_[entry.line]) return false;
      const Cycle from = returns_->from(port_.cache().address(entry.line));
      if (now < from) ready_at_ = from;
      return now < from;
    }
    const LinesAhead::Wait wait = ahead_->waits(entry.line, entry.sectors, now);
    if (wait == LinesAhead::Wait::until) ready_at_ = ahead_->ready_at(entry.line);
    return wait != LinesAhead::Wait::none;
  }
  [[gnu::noinline]] void use(const Entry& entry, Cycle now) {
    came_back_[entry.line] = false;
    returns_->used(port_.cache().address(entry.line), now);
  }
  [[gnu::noinline]] void pay_for_fetch(SectoredCache::Line line, bool changed) {
    unpaid_[line] = false;
    if (changed) pay(1);
  }
  /// What the columns of two pixels of a quad that have live samples take beyond its price, which is paid once it is blended.
  [[gnu::noinline]] std::int64_t pay_for_columns(LaneMask live) {
    std::int64_t more = columns_of(live) * timing_.column_cycles * income_ - price_;
    if (more <= 0) return 0;
    if (pairs_) more = static_cast<std::int64_t>(group_.lengthen(static_cast<std::uint64_t>(more)));
    tokens_ -= more;
    idle_cache_ = more;
    return more;
  }
  /// Whether a quad goes with the last ones; `beside` have gone in this cycle. A line may have become another tile's since.
  static SectorGroup::Place place_of(const Entry& entry) {
    return {std::uint64_t{entry.place / positions_per_tile} << 32U | entry.line, entry.sectors};
  }
  [[gnu::noinline]] bool joins_last(const Entry& entry, unsigned beside) const {
    return (beside > 0 || last_waits_) && group_.takes(place_of(entry));
  }
  std::int64_t price_of_next() const {
    return static_cast<std::int64_t>(group_.price_of_next(static_cast<std::uint64_t>(price_)));
  }
  [[gnu::noinline]] void goes(const Entry& entry, bool joins) {
    const auto own = static_cast<std::uint64_t>(price_);
    if (!joins) settle_unpaired(now());
    joins ? group_.join(own) : group_.begin(place_of(entry), own);
    last_waits_ = false;
  }
  /// Nothing goes with the last quads any more.
  void settle_unpaired(Cycle now) {
    if (unpaired_ > 0) did(CropWork::unpaired, static_cast<std::uint64_t>(unpaired_), now);
    unpaired_ = 0;
  }

  /// Behind the quads in the queue.
  [[gnu::noinline]] void queue_mark(Mark mark) {
    std::size_t behind = queue_.size();
    for (std::size_t i = 0; i < marks_.size(); ++i) behind -= marks_[i].quads;
    marks_.push({mark, behind});
  }

  /// Those whose turn it is; true if there was one. Quads behind a mark fill their sectors meanwhile.
  [[gnu::noinline]] bool pass_marks(Cycle now) {
    bool passed = false;
    for (; !marks_.empty() && marks_.front().quads == 0; marks_.pop()) {
      passed = true;
      if (marks_.front().mark != Mark::end_of_frame) {
        behaviour_->pass(marks_.front().mark);
        if (barriers_.is_barrier(marks_.front().mark)) done_.push({marks_.front().mark});
      } else {
        settle_unpaired(now);
        end_ = !any_blended_ ? now : last_blend_ + timing_.latency_cycles;
      }
    }
    return passed;
  }
  [[gnu::noinline]] void send_done() {
    for (; !done_.empty() && out_done_.credits() > 0; done_.pop()) out_done_.push(done_.front());
  }

  Cycle tick(Cycle now) override {
    if (!ahead_) {
      port_.finish_fills(now);
    } else {
      ahead_->advance();
    }
    const bool blended = blend(now);
    const bool accepted = accept();
    const bool marked = !marks_.empty() && pass_marks(now);
    if (!done_.empty()) send_done();
    enter(blended ? UnitState::busy : !queue_.empty() ? stop_ : UnitState::starved, now);
    if (blended || accepted || marked ||
        (!queue_.empty() && stop_ != UnitState::blocked &&
         (stop_ == UnitState::latency || stop_ == UnitState::busy || tokens_ < price_))) {
      return now + 1;
    }
    // A quad at the link that could not be looked up waits for a completion or for the queue to move.
    Cycle next = std::min(port_.next_completion(), queue_.empty() ? never : ready_at_);
    if (in_.next_ready() > now) next = std::min(next, in_.next_ready());
    return next;
  }

  const RenderContext& context_;
  StreamIn<ColorBeat> in_;
  StreamOut<TerminationBeat> out_;
  StreamOut<BlendsDone> out_done_;
  std::unique_ptr<CropBehaviour> behaviour_;
  const CropBehaviour::TimingParameters timing_;
  const bool signals_;
  const bool replaces_;  ///< colours, in any draw that does not blend
  const BarrierPlan barriers_;
  EffectGate hazard_gate_;
  EffectGate cache_order_gate_;
  const std::int64_t price_;        ///< of blending a quad, in tokens
  const std::int64_t move_price_;   ///< of moving a sector, or a line
  const std::int64_t income_;       ///< of a cycle: what so many quads, or so many sectors, cost
  const unsigned most_in_a_cycle_;  ///< quads looked up or blended
  const bool pairs_;                ///< several go in a cycle only if they share a sector
  SectorGroup group_;               ///< the last of these
  CachePort port_;
  const ColorSurface* surface_ = nullptr;
  std::array<QuadSectors, positions_per_tile> sectors_of_quads_{};
  std::optional<BlendOrderMonitor> monitor_;
  unsigned line_shift_ = 0;   ///< log2 of the bytes of a line
  Ring<Entry> queue_;         ///< looked up and waiting to be blended
  unsigned at_ = 0;           ///< quads taken of the beat at the link
  CachePort::LookUp wanted_;  ///< of the quad at the link
  std::int64_t tokens_ = 0;
  Cycle refilled_ = 0;
  std::vector<bool> unpaid_;            ///< by line of the cache: nothing has been blended into it
  std::optional<LineReturns> returns_;  ///< where lines that come back wait
  std::vector<bool> came_back_;         ///< by line of the cache: was there before; not used since
  std::optional<LinesAhead> ahead_;     ///< where tags run ahead of data
  Cycle ready_at_ = never;              ///< of the quad whose turn it is, if that is known
  std::int64_t unpaired_ = 0;           ///< tokens of the last quads' price beyond their rate, not tallied yet
  std::int64_t idle_cache_ = 0;         ///< tokens of the last blend of several cycles, in which nothing moves
  bool last_waits_ = false;             ///< so that the next one goes in a later cycle than it might
  std::deque<std::pair<std::uint32_t, Cycle>> recent_;  ///< blends in the pipeline, without forwarding
  UnitState stop_ = UnitState::starved;
  struct QueuedMark {
    Mark mark = Mark::none;
    std::size_t quads = 0;  ///< of the queue, behind the mark before it and in front of it
  };
  Ring<QueuedMark> marks_;
  Ring<BlendsDone> done_;  ///< and not sent yet
  Cycle last_blend_ = 0;
  Cycle end_ = never;
  bool any_blended_ = false;
  unsigned sectors_of_a_quad_ = 0;
  StatisticSet more_cache_statistics_{*this, "cache"};
  Counter hits_on_their_way_{more_cache_statistics_, "sector_hits_on_their_way", "sectors",
                             "hit while they are still being filled, at cycle"};
  Counter fetched_again_{more_cache_statistics_, "sectors_fetched_again", "sectors",
                         "a second time, since their line came back before what it had held was written back"};
};

[[maybe_unused]] const bool crop_unit_registered = [] {
  register_unit_maker("crop", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                 const RenderContext& context, unsigned) {
    return std::make_unique<CropUnit>(name.c_str(), domain, behaviour_as<CropBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
