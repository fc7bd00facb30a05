#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "crop/crop_time.h"
#include "crop/in_shader.h"
#include "crop/timed_flit_port.h"

#include <vrpipe/memory/line_visits.h>
#include <vrpipe/model/timed_cache_port.h>
#include <vrpipe/model/timed_pins.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>

namespace vrpipe {

namespace {

/// CROP at lt: as crop_unit.cpp, but a warp is taken in one piece: its quads look up the colour cache, and are
/// blended once the sectors of all are there. Neighbouring sectors are filled in one access. Without forwarding, or where
/// the cache is small, its quads go one by one.
/// Ports: in_color (ShadedWarpItem), in_reads (PortReads; optional), out_terminations (TerminationBeat), out_done (BlendsDone; optional), memory (TLM-2.0
/// base protocol).
/// `Plain`: a run of quads that are alike, without a port, and with lines that neither go ahead nor are pinned.
template <bool Plain>
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
        in_reads_(*this, "in_reads",
                  [this](const PortReads& reads, CycleInterval visible) -> CycleInterval {
                    // What CROP has reserved for later would be behind them.
                    send(reads.flits, visible.first);
                    if (time_.port.is_on()) reads_.push_in_order({visible.first, reads.flits}, &Sent::at);
                    return visible;
                  }),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        sent_before_(time_.port),
        barriers_(context),
        hazard_gate_(context, "crop.blend_hazard"),
        // A hazard is one of quads, as is what waits for a line that comes back.
        at_once_(time_.forwards && !time_.fetches_ahead() ? time_.looked_up_at_once() : 1),
        memory_(*this, "memory", time_.mshrs,
                at_once_ == 1 ? 1 : std::min(time_.cache.sectors_of_a_line(), time_.mshrs), time_.cache.sector_bytes,
                dynamic_cast<CropBehaviour&>(behaviour_->unit()).cache_statistics,
                {MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}),
        look_ups_(time_.most_in_a_cycle),
        second_looks_(time_.most_in_a_cycle),
        ahead_(std::max(time_.fetch_ahead_quads, 1U)),
        queue_(time_.input_quads),
        last_blend_of_(time_.cache.lines()) {
    out_.set_pipeline(time_.of_terminations());
    out_done_.set_pipeline(time_.of_barriers());
    out_done_.set_optional();
    in_reads_.set_optional();
    in_reads_.set_comes_ahead();
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
    tags_ = behaviour_->cache();
    pins_lines_ = tags_ != nullptr && TimedPins::are_needed(time_.cache.replacement) && !time_.fetches_ahead();
    if (time_.fetches_ahead()) uses_.resize(surface->size_bytes() / time_.cache.line_bytes + 1);
  }

  CycleInterval take(const ShadedWarp& warp, CycleInterval visible) {
    CycleInterval left = visible;
    if (warp.mark == Mark::end_of_frame) {
      tell_unpaired(time_.take_unpaired(true), time_.last_blend());
      end_ = any_blended_ ? time_.last_blend() + time_.latency_cycles : visible.first;
    } else if (warp.mark != Mark::none) {
      behaviour_->pass(warp.mark);
      if (barriers_.is_barrier(warp.mark)) out_done_.send({warp.mark}, std::max(visible.first, time_.last_blend()));
    } else if (at_once_ >= warp.count && out_.room_from() <= visible.first) {
      left = pass(warp, 0, warp.count, visible);
    } else {
      left = pass_one_by_one(warp, visible);
    }
    warp.release();
    return left;
  }
  [[gnu::noinline]] CycleInterval pass_one_by_one(const ShadedWarp& warp, CycleInterval visible) {
    CycleInterval left = never;
    for (unsigned i = 0; i < warp.count; ++i) {
      const CycleInterval at = pass(warp, i, i + 1, visible.of_part(i, warp.count));
      left.first = std::min(left.first, at.first);
      left.last = at.last;
    }
    return left;
  }

  /// Looks quads of a warp up and blends them; returns the cycles of the look-ups.
  [[gnu::always_inline]] CycleInterval pass(const ShadedWarp& warp, unsigned from, unsigned to, CycleInterval visible) {
    const unsigned quads = to - from;
    const ColorSurface& surface = *behaviour_->surface();
    const std::size_t tile = surface.grid().place(warp.tile, 0);
    const QuadColor* const stored = &surface.quad(tile);
    for (unsigned i = from; i < to; ++i) __builtin_prefetch(&stored[warp.position[i]], 1);
    monitor_->prefetch_tile(tile);
    // Places in the queue, and lines that no queued quad needs.
    SlotPool& queue = fetches_ahead() ? ahead_ : queue_;
    const unsigned places = fetches_ahead() ? places_of(warp, from, tile) : quads;
    Cycle at = places > 0 ? queue.free_from(visible.first, 1) : visible.first;
    const Cycle has_places = places > 0 ? queue.free_from(std::max(at, visible.last), places) : visible.last;
    if (pins_lines()) {
      const std::uint64_t address = address_of(tile, sectors_of(warp, from));
      at = pins_.line_free_from(*tags_, address, port_open_from(std::max(at, look_ups_.next())));
    }
    behaviour_->look_up(warp, from, to, cache_);
    for (unsigned i = 0; i < cache_.count && !fetches_ahead(); ++i) {
      if (cache_.lines[i].replaced) at = std::max(at, last_blend_of_[cache_.lines[i].line]);
    }
    CycleInterval looked_up = look_ups_.take(fetches_ahead() ? first_look_from(at) : port_open_from(at), quads);
    looked_up.last = std::max(looked_up.last, has_places);
    Cycle there = looked_up.first + 1;
    Cycle asked = looked_up.first;
    for (unsigned i = 0; i < cache_.count; ++i) {
      if (!cache_.lines[i].moves()) continue;
      asked = std::max(asked, looked_up.of_part(cache_.first_quad[i] - from, quads));
      there = std::max(there, move(cache_.lines[i], asked));
    }
    looked_up.last = std::max(looked_up.last, asked);
    look_ups_.hold(looked_up.last);
    if (has_port()) {
      send(time_.flits_of_reads(warp, from, to, cache_, *behaviour_->surface()), looked_up.last);
      there = std::max(there, time_.port.open_from(there));
    } else if (const unsigned moved = memory_.take_moved(); moved > 0) {
      // Beside a quad of several cycles a sector may take nothing, so that each counts from its own time.
      quads_are_alike() ? moves_.push({looked_up.last, moved}) : move_for_quads(warp, from, to, looked_up, moved);
    }

    if (fetches_ahead()) there = std::max(there, look_again(warp, from, tile, looked_up.last, places));

    charge(UnitState::starved, looked_up.first + 1);
    if (const Cycle room = std::max(out_.last(), out_.room_from()); room > there && !joins_signals(there)) {
      charge(UnitState::memory, there);
      charge(UnitState::blocked, room);
      there = room;
    }
    const CycleInterval blended = blend_in_turn(warp, from, to, there);
    charge(UnitState::memory, blended.first);
    charge(UnitState::busy, blended.last + 1);
    if (places > 0) queue_.take(places, blended);
    if (pins_lines()) pins_.pin(*tags_, cache_.line_of[sectors_of(warp, from).line], blended.last);
    any_blended_ = true;
    quads_last(blended.last + time_.latency_cycles, quads, [&](unsigned i) { return warp.draw[from + i]; });
    did(CropWork::blend, quads, blended.first, blended.last + 1);
    blend(warp, from, to, tile, blended);
    return looked_up;
  }

  bool fetches_ahead() const { return !Plain && time_.fetches_ahead(); }
  bool has_port() const { return !Plain && time_.port.is_on(); }
  bool pins_lines() const { return !Plain && pins_lines_; }
  bool quads_are_alike() const { return Plain || time_.quads_are_alike(); }
  /// Whether a quad is blended in the cycle of the last that signalled, from one on, so that its signal would go with it.
  bool joins_signals(Cycle there) const {
    return signalled_ < TerminationBeat::capacity && time_.free_from(time_.price(), there) == signalled_at_;
  }
  /// Of so many sectors that move for quads each moves when its quad is looked up, those written back first.
  [[gnu::noinline]] void move_for_quads(const ShadedWarp& warp, unsigned from, unsigned to, CycleInterval looked_up,
                                        unsigned moved) {
    for (unsigned i = from; i < to; ++i) {
      const auto& [line, sectors] = sectors_of(warp, i);
      const auto end = cache_.lines.begin() + cache_.count;
      const auto access =
          std::find_if(cache_.lines.begin(), end,
                       [&, in_cache = cache_.line_of[line]](const LineAccess& of) { return of.line == in_cache; });
      if (access == end) continue;
      const Cycle at = looked_up.of_part(i - from, to - from);
      const auto written_back = static_cast<unsigned>(__builtin_popcount(std::exchange(access->written_back, 0)));
      const auto filled = static_cast<unsigned>(__builtin_popcount(access->filled & sectors));
      access->filled &= ~sectors;
      if (written_back > 0) moves_.push({at, written_back});
      for (unsigned sector = 0; sector < filled; ++sector) moves_.push({at, 1});
      moved -= written_back + filled;
    }
    if (moved > 0) moves_.push({looked_up.last, moved});  // for second looks before these
  }
  /// Takes the time of quads whose sectors are there from a cycle on.
  [[gnu::always_inline]] CycleInterval blend_in_turn(const ShadedWarp& warp, unsigned from, unsigned to, Cycle there) {
    // What moves takes time from blending, from when it does, and what ZROP reads.
    for (; has_port() && !reads_.empty() && reads_.front().at <= time_.free_from(time_.price(), there); reads_.pop()) {
      const Sent& read = reads_.front();
      time_.rest(read.flits, read.at);
      did(CropWork::reads, read.flits, read.at);
    }
    for (; !moves_.empty() && moves_.front().at <= time_.free_from(time_.price(), there); moves_.pop()) {
      const Move& move = moves_.front();
      if (time_.move(move.sectors, move.at)) did(CropWork::sectors, move.sectors, move.at);
    }
    if (quads_are_alike()) {
      const auto [first, last] = time_.blend_all(to - from, there);
      return {first, last};
    }
    CycleInterval blended = never;
    for (unsigned i = from; i < to; ++i) {
      const CropTime::Quad quad = priced_quad(warp, i);
      Cycle ready = there;
      if (!time_.forwards && hazard_gate_.enter() && quad.blends) ready = wait_for_hazard(quad, there);
      const CropTime::Price price = time_.price_of(quad, ready);
      blended.last = time_.free_from(price, ready);
      blended.first = std::min(blended.first, blended.last);
      time_.blend(quad, price, blended.last);
      tell_unpaired(time_.take_unpaired(), blended.last);
    }
    return blended;
  }
  const QuadSectors& sectors_of(const ShadedWarp& warp, unsigned index) const {
    return time_.sectors_of_quads()[warp.position[index]];
  }
  CropTime::Quad priced_quad(const ShadedWarp& warp, unsigned index) const {
    const QuadSectors& sectors = sectors_of(warp, index);
    const std::size_t tile = behaviour_->surface()->grid().place(warp.tile, 0);
    return {address_of(tile, sectors), sectors.sectors, tile + warp.position[index], warp.live[index],
            context_.state(warp.draw[index]).blend};
  }
  /// Of a line of a tile, by the tile's place in the surface.
  std::uint64_t address_of(std::size_t tile, const QuadSectors& line) const {
    return behaviour_->surface()->address(tile) + std::uint64_t{line.line} * time_.cache.line_bytes;
  }
  [[gnu::noinline]] Cycle wait_for_hazard(const CropTime::Quad& quad, Cycle there) {
    const Cycle free = time_.free_from(time_.price(), there);
    const Cycle until = time_.hazard_until(quad.place, quad.live, time_.last_blend());
    if (until <= free) return there;
    time_.idle_until(free);
    did(CropWork::forwarding, static_cast<std::uint64_t>(time_.open(until)), free, until);
    return until;
  }
  void tell_unpaired(std::int64_t parts, Cycle at) {
    if (parts > 0) did(CropWork::unpaired, static_cast<std::uint64_t>(parts), at);
  }
  /// From when on the port takes more, by what was sent before: lines are written back when quads are blended, which is long
  /// after the look-ups of those behind them. What ZROP reads for quads that come later is known late.
  Cycle port_open_from(Cycle at) {
    while (has_port()) {
      for (; !sent_.empty() && sent_.front().at <= at; sent_.pop())
        sent_before_.take(sent_.front().flits, sent_.front().at, clock.domain->now());
      const Cycle open = sent_before_.open_from(at);
      if (open == at) break;
      at = open;
    }
    return at;
  }
  void send(unsigned flits, Cycle at) {
    if (flits == 0 || !has_port()) return;
    const auto [from, until] = time_.port.take(flits, at);
    sent_.push_in_order({at, flits}, &Sent::at);
    did(CropWork::flits, flits, from, until);
  }

  /// Moves what a look-up says of a line; returns when its sectors are there.
  Cycle move(const CropBehaviour::LineAccess& access, Cycle& at) {
    if (access.written_back != 0) {
      // Where tags run ahead, quads may still be blended into what the line held.
      const Cycle from = fetches_ahead() ? std::max(at, last_blend_of_[access.line]) : at;
      memory_.write_back(access, from);
      CropTime::Moves moves;
      moves.write(static_cast<unsigned>(__builtin_popcount(access.written_back)));
      send(moves.flits, from);
    }
    // What replaces colours does not read them.
    if (fetches_ahead() && access.replaced) uses_of(access.address).come(at, access.filled != 0);
    return access.filled == 0 ? 0 : memory_.fill(access, at);
  }
  TimedLineUses& uses_of(std::uint64_t address) {
    return uses_[(address - behaviour_->surface()->address(0)) / time_.cache.line_bytes];
  }

  /// Where there are two.
  Cycle first_look_from(Cycle at) {
    at = std::max(at, look_ups_.next());
    for (Cycle tried = never; tried != at;) {
      tried = at;
      at = port_open_from(stops_.first_look_from(at));
    }
    return at;
  }
  /// In a queue, of a quad of a tile in the surface.
  unsigned places_of(const ShadedWarp& warp, unsigned index, std::size_t tile) {
    const QuadSectors& sectors = sectors_of(warp, index);
    return time_.takes_place(address_of(tile, sectors), sectors.sectors) ? 1 : 0;
  }
  /// The second look at the tag of a quad, as LinesAhead's; returns when its sectors are there.
  [[gnu::noinline]] Cycle look_again(const ShadedWarp& warp, unsigned index, std::size_t tile, Cycle looked_up,
                                     unsigned places) {
    const QuadSectors& needed = sectors_of(warp, index);
    const std::uint64_t address = address_of(tile, needed);
    const LineVisits::Visit visit = visits_.of(tile, warp.first_primitive[index]);
    Cycle at = second_looks_.take(places > 0 ? queue_.free_from(looked_up, places) : looked_up, 1).first;
    Cycle there = at;
    const Cycle could_be = at;
    const TimedLineUses::Look look =
        uses_of(address).look_again(visit, needed.sectors, LineVisits::whole_line, time_.cache.sectors_of_a_half(), at);
    stops_.add(could_be, at);
    if (look.again != 0) {
      fetched_again_ += static_cast<unsigned>(__builtin_popcount(look.again));
      if (look.is_first) send(1, at);
      LineAccess again;
      again.address = address;
      again.filled = look.again;
      const Cycle filled = memory_.fill_at_once(again, at);
      if (look.comes_back) there = filled;
    }
    second_looks_.postpone(at);
    if (places > 0) ahead_.take(places, at + 1);  // second looks come after what arrives in their cycle
    return std::max(there, at);
  }

  [[gnu::always_inline]] void blend(const ShadedWarp& warp, unsigned from, unsigned to, std::size_t tile,
                                    CycleInterval at) {
    CropBehaviour::Outcomes outcomes;
    behaviour_->blend_quads(warp, from, to, outcomes);
    unsigned terminated = 0;
    for (unsigned i = from; i < to; ++i) {
      monitor_->blended(tile + warp.position[i], warp, i, at.last);
      terminated |= outcomes[i].terminated;
      const QuadSectors& quad = sectors_of(warp, i);
      const std::uint32_t line = cache_.line_of[quad.line];
      last_blend_of_[line] = at.last;
      if (tags_ != nullptr && (outcomes[i].changed || time_.writes_unchanged)) tags_->make_dirty(line, quad.sectors);
    }
    if (fetches_ahead()) uses_of(address_of(tile, sectors_of(warp, from))).used(LineVisits::whole_line, at.last);
    if (terminated != 0) signal(warp, from, to, outcomes, at);
  }

  void signal(const ShadedWarp& warp, unsigned from, unsigned to, const CropBehaviour::Outcomes& outcomes,
              CycleInterval at) {
    // Those of one cycle go together.
    TerminationBeat beat;
    Cycle cycle = at.first;
    for (unsigned i = from; i < to; ++i) {
      if (outcomes[i].terminated == 0) continue;
      const Cycle blended = at.of_part(i - from, to - from);
      if (beat.count > 0 && (blended != cycle || beat.count == TerminationBeat::capacity)) {
        send(beat, cycle);
        beat.count = 0;
      }
      cycle = blended;
      beat.signals[beat.count++] = {warp.tile, warp.position[i], outcomes[i].terminated,
                                    context_.draw(warp.draw[i]).epoch};
    }
    if (beat.count > 0) send(beat, cycle);
  }
  /// With those of the warp before that are of the same cycle.
  void send(const TerminationBeat& beat, Cycle cycle) {
    const bool joins = cycle == signalled_at_ && signalled_ + beat.count <= TerminationBeat::capacity;
    out_.send(beat, joins ? std::max(cycle, out_.last()) : cycle, joins ? 0 : 1, joins);
    signalled_ = beat.count + (joins ? signalled_ : 0);
    signalled_at_ = cycle;
  }

  struct Move {
    Cycle at = 0;
    unsigned sectors = 0;
  };

  const RenderContext& context_;
  TimedOut<TerminationBeat> out_;
  TimedOut<BlendsDone> out_done_;
  TimedIn<ShadedWarpItem> in_;
  TimedIn<PortReads> in_reads_;
  std::unique_ptr<CropBehaviour> behaviour_;
  CropTime time_;
  struct Sent {
    Cycle at = 0;
    unsigned flits = 0;
  };
  Ring<Sent> sent_;            ///< to the port, later than the last look-up
  Ring<Sent> reads_;           ///< ZROP's, to which the blender has not given its time yet
  TimedFlitPort sent_before_;  ///< what was sent before it
  const BarrierPlan barriers_;
  EffectGate hazard_gate_;
  const unsigned at_once_;  ///< quads looked up before the first of them is blended
  TimedCachePort memory_;
  std::unique_ptr<BlendOrderMonitor> monitor_;
  CropBehaviour::CacheLookUp cache_;
  ThroughputPort look_ups_;
  ThroughputPort second_looks_;
  SlotPool ahead_;                    ///< quads between the first look at their tags and the second, if there are two
  SlotPool queue_;                    ///< quads between look-up and blending
  Ring<Move> moves_;                  ///< that the blender has not given its time to yet
  std::vector<Cycle> last_blend_of_;  ///< by line of the cache: of a quad that needed it, or what it held before
  std::vector<TimedLineUses> uses_;   ///< by line of the surface, where tags are looked at twice
  VisitCounter visits_;
  SecondLookStops stops_;
  SectoredCache* tags_ = nullptr;  ///< of the behaviour, if it has any
  bool pins_lines_ = false;        ///< of queued quads
  TimedPins pins_;
  unsigned signalled_ = 0;  ///< quads, in the last cycle with any
  Cycle signalled_at_ = never;
  Cycle end_ = never;
  bool any_blended_ = false;
  StatisticSet more_cache_statistics_{*this, "cache"};
  Counter fetched_again_{more_cache_statistics_, "sectors_fetched_again", "sectors",
                         "a second time, since their line came back before what it had held was written back"};
};

[[maybe_unused]] const bool crop_timed_registered = [] {
  register_timed_unit_maker("crop",
                            [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                               const RenderContext& context, unsigned) -> std::unique_ptr<Unit> {
                              if (blends_in_shader(*behaviour))
                                return make_timed_in_shader_unit(name, domain, std::move(behaviour), context);
                              auto crop = behaviour_as<CropBehaviour>(std::move(behaviour));
                              const bool is_plain =
                                  crop->time().is_plain() && !TimedPins::are_needed(crop->time().cache.replacement);
                              if (is_plain)
                                return std::make_unique<TimedCrop<true>>(name.c_str(), domain, std::move(crop),
                                                                         context);
                              return std::make_unique<TimedCrop<false>>(name.c_str(), domain, std::move(crop), context);
                            });
  return true;
}();

}  // namespace

}  // namespace vrpipe
