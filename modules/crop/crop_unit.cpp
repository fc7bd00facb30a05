#include <algorithm>
#include <optional>
#include <utility>

#include "crop/crop_time.h"
#include "crop/in_shader.h"
#include "crop/lines_ahead.h"

#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/cache_port.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>

namespace vrpipe {

namespace {

/// CROP at cycle fidelity. A quad looks up the colour cache when it arrives and starts the fills that it needs, then
/// waits in order; blending takes place at the head, when there is time for it (CropTime).
/// Ports: in_color (ColorBeat), in_reads (PortReads; optional), out_terminations (TerminationBeat), out_done (BlendsDone; optional), memory (TLM-2.0 base
/// protocol).
/// `Plain`: a run without hazards, lines that return or go ahead, prices of lines, pairs and columns, colours that are
/// replaced, and draws that are told apart.
template <bool Plain>
class CropUnit : public Unit {
 public:
  CropUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<CropBehaviour> behaviour,
           const RenderContext& context)
      : Unit(name, domain, behaviour->time().kinds()),
        context_(context),
        in_(*this, "in_color"),
        in_reads_(*this, "in_reads"),
        out_(*this, "out_terminations"),
        out_done_(*this, "out_done"),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        signals_(context.frame->terminates_early()),
        replaces_(context.frame->replaces_color()),
        barriers_(context),
        hazard_gate_(context, "crop.blend_hazard"),
        cache_order_gate_(context, "crop.cache_order"),
        port_(*this, "memory", time_.mshrs, {MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}) {
    out_.set_pipeline(time_.of_terminations());
    out_done_.set_pipeline(time_.of_barriers());
    out_done_.set_optional();
    in_reads_.set_optional();
    in_reads_.set_comes_ahead();
  }

  bool idle() const override {
    return in_.empty() && in_reads_.empty() && queue_.empty() && marks_.empty() && done_.empty();
  }
  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &port_.socket(); }
  MemoryBytes memory_bytes() const override { return port_.moved(); }
  bool ends_frame() const override { return true; }
  Cycle end_of_frame() const override { return end_; }

 private:
  struct Entry {
    ColorQuad quad;
    SectoredCache::Line line = SectoredCache::no_line;  ///< or its stay (LinesAhead)
    std::uint32_t sectors = 0;                          ///< of the line, a bit each
    std::uint32_t place = 0;                            ///< in the surface's grid
    // Where tags run ahead; in one word, since more would make an entry a quarter longer.
    std::uint32_t visit : 31;
    std::uint32_t takes_place : 1;
  };

  void end_of_elaboration() override {
    surface_ = behaviour_->surface();
    if (surface_ == nullptr) throw SimulationFault(this->name(), 0, "no colour surface is attached");
    line_shift_ = static_cast<unsigned>(__builtin_ctz(time_.cache.line_bytes));
    CacheOrganization organization = time_.cache;
    if (!cache_order_gate_.is_active()) organization.replacement = Replacement::random;  // which keeps no order
    SectoredCacheStatistics& statistics = dynamic_cast<CropBehaviour&>(behaviour_->unit()).cache_statistics;
    port_.make_cache(organization, statistics);
    if (!cache_order_gate_.is_active()) port_.cache().before_eviction([this] { cache_order_gate_.enter(); });
    sectors_of_a_quad_ = time_.sectors_of_a_quad();
    monitor_.emplace(surface_->width(), surface_->height());
    go_to({});
    if (Plain) return;
    if (time_.fetches_ahead()) ahead_.emplace(port_, statistics, fetched_again_, *surface_, time_.mshrs);
  }

  /// Takes a quad from the link into the queue; false when it has to wait.
  bool look_up(const ColorQuad& quad) {
    if (quad.warp->tile != tile_) go_to(quad.warp->tile);
    const unsigned position = quad.position();
    const auto [line_of_tile, sectors] = time_.sectors_of_quads()[position];
    const std::uint64_t address = tile_address_ + (std::uint64_t{line_of_tile} << line_shift_);
    if (!Plain && ahead_) return look_up_ahead(quad, address, sectors, tile_place_ + position);
    SectoredCache::Line line =
        wanted_.line == SectoredCache::no_line ? port_.pin_held(address, sectors) : SectoredCache::no_line;
    std::uint32_t asked_for = 0;
    if (line == SectoredCache::no_line) {
      wanted_.reads = blends(quad);
      if (!port_is_open()) return false;
      line = fill(address, sectors, asked_for);
      if (line == SectoredCache::no_line) return false;
      if (!Plain && asked_for != 0) ask(quad, tile_place_ + position);
    }
    if (const std::uint32_t on_their_way = port_.awaited(line, sectors) & ~asked_for; on_their_way != 0) {
      hits_on_their_way_ += static_cast<unsigned>(__builtin_popcount(on_their_way));
    }
    queue(quad, line, sectors, tile_place_ + position);
    return true;
  }
  void go_to(TileId tile) {
    tile_ = tile;
    tile_place_ = surface_->grid().place(tile, 0);
    tile_address_ = surface_->address(tile_place_);
  }
  /// For the host: what blending a quad will touch was last touched long ago. Inlined, since GCC drops calls of
  /// functions that do nothing but prefetch.
  [[gnu::always_inline]] void prefetch(std::size_t place) const {
    __builtin_prefetch(&surface_->quad(place), 1);
    monitor_->prefetch(place);
  }
  [[gnu::always_inline]] Entry& queue(const ColorQuad& quad, std::uint32_t line, std::uint32_t sectors,
                                      std::size_t place) {
    // In place: a temporary of narrow stores would be waited for when it is copied.
    Entry& entry = queue_.push();
    prefetch(place);
    entry.quad = quad;
    entry.line = line;
    entry.sectors = sectors;
    entry.place = static_cast<std::uint32_t>(place);
    return entry;
  }
  [[gnu::noinline]] bool look_up_ahead(const ColorQuad& quad, std::uint64_t address, std::uint32_t sectors,
                                       std::size_t place) {
    if (ahead_->is_stopped() || !port_is_open()) return false;
    bool fills = false;
    const LinesAhead::Stay stay = ahead_->look_up(address, sectors, blends(quad), fills);
    if (stay == LinesAhead::no_stay) return false;
    pay(ahead_->take_moves());
    if (fills) ask(quad, place);
    Entry& entry = queue(quad, stay, sectors, place);
    entry.visit = visits_.of(tile_place_, quad.warp->first_primitive[quad.index]) & 0x7FFFFFFFU;
    entry.takes_place = time_.takes_place(address, sectors) ? 1U : 0U;
    ahead_places_ += entry.takes_place;
    return true;
  }
  /// Quads in the queue, in their order.
  [[gnu::noinline]] bool look_again() {
    bool any = false;
    for (unsigned budget = time_.most_in_a_cycle;
         budget > 0 && looked_twice_ < queue_.size() && places_ < time_.input_quads; --budget) {
      const Entry& next = queue_[looked_twice_];
      if (!ahead_->look_again(next.line, next.sectors, next.visit)) break;
      pay(ahead_->take_moves());
      ++looked_twice_;
      ahead_places_ -= next.takes_place;
      places_ += next.takes_place;
      any = true;
    }
    return any;
  }
  /// Places of the queue for what arrives.
  std::size_t room() const {
    return Plain || !ahead_ ? time_.input_quads - queue_.size() : time_.fetch_ahead_quads - ahead_places_;
  }
  bool blends(const ColorQuad& quad) const {
    return Plain || !replaces_ || context_.state(quad.warp->draw[quad.index]).blend;
  }
  /// Gives what moves its time of the blender, or of the port.
  void pay(const CropTime::Moves& moves) {
    if (!Plain && time_.port.is_on()) return send(moves.flits);
    if (moves.sectors > 0 && time_.move(moves.sectors, now())) did(CropWork::sectors, moves.sectors, now());
  }
  bool port_is_open() const { return Plain || time_.port.open_from(now()) == now(); }
  void ask(const ColorQuad& quad, std::size_t place) {
    if (!time_.port.is_on()) return;
    send(time_.flits_of_read(place - quad.position(), quad.warp->first_primitive[quad.index],
                             time_.sectors_of_quads()[quad.position()].line));
  }
  /// ZROP's go first.
  [[gnu::noinline]] void take_reads() {
    for (; in_reads_.ready() && port_is_open(); in_reads_.pop()) {
      const unsigned flits = in_reads_.front().flits;
      send(flits);
      if (!time_.port.is_on()) continue;
      time_.rest(flits, now());
      did(CropWork::reads, flits, now());
    }
  }
  [[gnu::noinline]] void send(unsigned flits) {
    if (flits == 0 || !time_.port.is_on()) return;
    const auto [from, until] = time_.port.take(flits, now());
    did(CropWork::flits, flits, from, until);
  }

  /// Goes on with the look-up of the quad at the link; `no_line` while it has to wait.
  [[gnu::noinline]] SectoredCache::Line fill(std::uint64_t address, std::uint32_t sectors, std::uint32_t& asked_for) {
    wanted_.address = address;
    wanted_.sectors = sectors;
    const bool done = port_.look_up(wanted_, now(), [this](unsigned moved) { pay({moved, 0}); });
    if (!Plain) {
      const CachePort::LinesMoved moved = port_.take_lines_moved();
      if (time_.port.is_on()) send(CropTime::flits_of_writes(moved.written_back, moved.sectors_written_back));
    }
    if (!done) return SectoredCache::no_line;
    asked_for = std::exchange(wanted_.asked_for, 0);
    return std::exchange(wanted_.line, SectoredCache::no_line);
  }

  bool accept() {
    bool moved = false;
    auto budget = static_cast<unsigned>(std::min<std::size_t>(time_.most_in_a_cycle, room()));
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

  /// Blends from the head of the queue; why it stopped is in `stop_`.
  bool blend(Cycle now) {
    const std::int64_t lost = time_.open(now);
    if (!Plain && lost > 0 && stop_ == UnitState::latency)
      did(CropWork::forwarding, static_cast<std::uint64_t>(lost), opened_, now);
    opened_ = now;
    TerminationBeat beat;
    stop_ = UnitState::starved;
    const bool marked = !marks_.empty();
    unsigned budget = time_.most_in_a_cycle;
    std::int64_t left = Plain ? time_.parts_left(now) : 0;
    for (; budget > 0 && !queue_.empty(); --budget) {
      if (marked) pass_marks(now);
      const Entry& entry = queue_.front();
      // In the same cycle a beat that is full may go before this one.
      if (signals_ && out_.credits() < (beat.count == TerminationBeat::capacity ? 2U : 1U)) {
        stop_ = UnitState::blocked;
        break;
      }
      if (is_awaited(entry) || !port_is_open()) {
        stop_ = UnitState::memory;
        break;
      }
      const CropTime::Quad priced = Plain ? CropTime::Quad{} : priced_quad(entry);
      const CropTime::Price price = Plain ? time_.price() : time_.price_of(priced, std::min(waits_from_, now));
      if (Plain ? price.parts > left : !time_.is_free(price, now)) {
        stop_ = UnitState::busy;  // with the quads before it, or with moving sectors
        waits_from_ = std::min(waits_from_, now);
        break;
      }
      if (!Plain && !time_.forwards && hazard_gate_.enter() && priced.blends &&
          time_.hazard_until(entry.place, priced.live, now) > now) {
        stop_ = UnitState::latency;
        break;
      }
      const ColorQuad& quad = entry.quad;
      if (quad.index == 0) blend_warp(*quad.warp, now);
      const CropBehaviour::Outcome outcome = outcomes_[quad.index];
      if (outcome.terminated != 0) {
        if (beat.count == TerminationBeat::capacity) {
          out_.push(beat);
          beat.count = 0;
        }
        beat.signals[beat.count++] = {quad.warp->tile, static_cast<std::uint8_t>(quad.position()), outcome.terminated,
                                      context_.draw(quad.warp->draw[quad.index]).epoch};
      }
      if (!Plain && tells_draws()) draw_lasts(quad.warp->draw[quad.index], now + time_.latency_cycles);
      if (quad.is_last()) quad.warp->release();
      if (Plain) {
        left -= price.parts;
      } else {
        time_.blend(priced, price, now);
        waits_from_ = never;
      }
      leave(entry, outcome.changed || time_.writes_unchanged);
      queue_.pop();
      if (marked && !marks_.empty()) --marks_.front().quads;
    }
    if (beat.count > 0) out_.push(beat);
    const unsigned blended = time_.most_in_a_cycle - budget;
    if (blended == 0) return false;
    if (Plain) time_.blend(blended, now);
    any_blended_ = true;
    frame_lasts(now + time_.latency_cycles);
    did(CropWork::blend, blended, now);
    if (!Plain) tell_unpaired(time_.take_unpaired());
    return true;
  }
  /// What is stored nobody sees but the quads behind, so that those of a warp are blended when the first one's turn comes.
  void blend_warp(const ShadedWarp& warp, Cycle now) {
    monitor_->blended(warp, 0, warp.count, now);
    behaviour_->blend_quads(warp, 0, warp.count, outcomes_);
  }
  [[gnu::noinline]] CropTime::Quad priced_quad(const Entry& entry) const {
    // A line may have become another tile's since.
    return {std::uint64_t{entry.place / positions_per_tile} << 32U | entry.line, entry.sectors, entry.place,
            entry.quad.live(), blends(entry.quad)};
  }
  void tell_unpaired(std::int64_t parts) {
    if (parts > 0) did(CropWork::unpaired, static_cast<std::uint64_t>(parts), now());
  }

  /// Whether the sectors of a quad whose turn it is are not there.
  bool is_awaited(const Entry& entry) const {
    if (Plain || !ahead_) return port_.awaited(entry.line, entry.sectors) != 0;
    return looked_twice_ == 0 || ahead_->is_awaited(entry.line, entry.sectors);
  }
  /// A quad has been blended into its line.
  void leave(const Entry& entry, bool changed) {
    if (!Plain && ahead_) {
      ahead_->blended(entry.line, entry.sectors, changed, entry.visit);
      --looked_twice_;
      places_ -= entry.takes_place;
      return pay(ahead_->take_moves());
    }
    if (changed) port_.cache().make_dirty(entry.line, entry.sectors);
    port_.cache().unpin(entry.line);
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
        tell_unpaired(time_.take_unpaired(true));
        end_ = any_blended_ ? time_.last_blend() + time_.latency_cycles : now;
      }
    }
    return passed;
  }
  [[gnu::noinline]] void send_done() {
    for (; !done_.empty() && out_done_.credits() > 0; done_.pop()) out_done_.push(done_.front());
  }

  Cycle tick(Cycle now) override {
    if (Plain || !ahead_) {
      port_.finish_fills(now);
    } else {
      ahead_->advance();
    }
    if (!in_reads_.empty()) take_reads();
    const bool blended = blend(now);
    bool accepted = accept();
    if (!Plain && ahead_) accepted |= look_again();
    const bool marked = !marks_.empty() && pass_marks(now);
    if (!done_.empty()) send_done();
    enter(blended ? UnitState::busy : !queue_.empty() ? stop_ : UnitState::starved, now);
    const bool waits_for_time = !queue_.empty() && (stop_ == UnitState::latency || stop_ == UnitState::busy);
    if (blended || accepted || marked || waits_for_time) return now + 1;
    // A quad at the link that could not be looked up waits for a completion or for the queue to move.
    Cycle next = port_.next_completion();
    if (const Cycle open = Plain ? now : time_.port.open_from(now); open > now) next = std::min(next, open);
    for (const Cycle at : {in_.next_ready(), in_reads_.next_ready()}) {
      if (at > now) next = std::min(next, at);
    }
    return next;
  }

  const RenderContext& context_;
  StreamIn<ColorBeat> in_;
  StreamIn<PortReads> in_reads_;
  StreamOut<TerminationBeat> out_;
  StreamOut<BlendsDone> out_done_;
  std::unique_ptr<CropBehaviour> behaviour_;
  CropTime time_;
  const bool signals_;
  const bool replaces_;  ///< colours, in any draw that does not blend
  const BarrierPlan barriers_;
  EffectGate hazard_gate_;
  EffectGate cache_order_gate_;
  CachePort port_;
  const ColorSurface* surface_ = nullptr;
  std::optional<BlendOrderMonitor> monitor_;
  unsigned line_shift_ = 0;   ///< log2 of the bytes of a line
  Ring<Entry> queue_;         ///< looked up and waiting to be blended
  unsigned at_ = 0;           ///< quads taken of the beat at the link
  CachePort::LookUp wanted_;  ///< of the quad at the link
  TileId tile_;               ///< of the last quad that was looked up
  std::size_t tile_place_ = 0;
  std::uint64_t tile_address_ = 0;
  // Where tags run ahead of data:
  std::optional<LinesAhead> ahead_;
  std::size_t looked_twice_ = 0;                 ///< quads at the front of the queue
  std::uint32_t ahead_places_ = 0, places_ = 0;  ///< taken between the two looks, and behind them
  VisitCounter visits_;
  CropBehaviour::Outcomes outcomes_;  ///< of the warp whose quads' turn it is
  Cycle waits_from_ = never;          ///< the quad whose turn it is has waited for nothing but the blender
  Cycle opened_ = 0;                  ///< the blender, last
  UnitState stop_ = UnitState::starved;
  struct QueuedMark {
    Mark mark = Mark::none;
    std::size_t quads = 0;  ///< of the queue, behind the mark before it and in front of it
  };
  Ring<QueuedMark> marks_;
  Ring<BlendsDone> done_;  ///< and not sent yet
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
  register_unit_maker("crop",
                      [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                         const RenderContext& context, unsigned) -> std::unique_ptr<Unit> {
                        if (blends_in_shader(*behaviour))
                          return make_in_shader_unit(name, domain, std::move(behaviour), context);
                        auto crop = behaviour_as<CropBehaviour>(std::move(behaviour));
                        const Frame& frame = *context.frame;
                        const bool is_plain =
                            crop->time().is_plain() && !frame.replaces_color() && !domain.frame_end().tells_draws();
                        if (is_plain)
                          return std::make_unique<CropUnit<true>>(name.c_str(), domain, std::move(crop), context);
                        return std::make_unique<CropUnit<false>>(name.c_str(), domain, std::move(crop), context);
                      });
  return true;
}();

}  // namespace

}  // namespace vrpipe
