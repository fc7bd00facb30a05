#pragma once

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "beat_lines.h"
#include "z_cache_statistics.h"
#include "zrop_time.h"

#include <vrpipe/kernel/rate.h>
#include <vrpipe/memory/line_visits.h>
#include <vrpipe/memory/sectored_cache.h>
#include <vrpipe/model/timed_cache_port.h>
#include <vrpipe/model/timed_pins.h>

namespace vrpipe {

/// The z-cache at lt, in front of ZROP's memory port: as z_port.h, but what is looked up is there for the cache at
/// once, and the times are kept beside it.
class TimedZCache {
 public:
  /// @param out_reads  what they take of the ROPs' port
  TimedZCache(TimedUnit& owner, TimedOut<PortReads>& out_reads, const ZropTime& time, const Placement& placement,
              ZCacheStatistics& statistics)
      : timing_(time.z_cache),
        out_reads_(out_reads),
        sectors_of_a_line_(timing_.organization.sectors_of_a_line()),
        statistics_(statistics),
        port_(owner, "memory", timing_.mshrs, std::min(sectors_of_a_line_, timing_.mshrs),
              timing_.organization.sector_bytes, statistics,
              {MemoryTraffic::depth_stencil, static_cast<std::uint16_t>(placement.gpc)}),
        early_(time.quads_per_cycle, std::max(timing_.places(), QuadBeat::capacity)),
        late_(time.quads_per_cycle, std::max(timing_.input_quads, quads_per_warp)),
        updates_(time.updates_per_cycle),
        foreseen_(time.updates_per_cycle),
        expected_(time.updates_per_cycle),
        queued_updates_(timing_.input_updates),
        pins_lines_(TimedPins::are_needed(timing_.organization.replacement) && !timing_.fetches_ahead()),
        lines_ahead_(std::max(timing_.fetch_ahead_lines, std::uint32_t{QuadBeat::capacity})) {}

  tlm::tlm_initiator_socket<32>& socket() { return port_.socket(); }
  const MemoryBytes& moved() const { return port_.moved(); }
  /// Before the first look-up. The surface outlives it.
  void make_cache(const DepthStencilSurface& surface) {
    lines_.emplace(timing_, surface);
    cache_.emplace(timing_.organization, statistics_);
    cleared_ = cleared_sectors_of(surface, timing_, statistics_);
    kept_until_.resize(timing_.organization.lines());
    there_.resize(std::size_t{timing_.organization.lines()} * sectors_of_a_line_);
    if (timing_.fetches_ahead()) uses_.resize(lines_->lines());
  }

  struct Times {
    Cycle at = 0;           ///< looked up
    Cycle there = 0;        ///< can be tested
    bool has_come = false;  ///< a line, into the cache
  };
  /// The depth-stencil target is cleared, behind what was looked up before.
  void clear() {
    if (cleared_) cleared_->clear();
  }
  /// When so many quads that become visible in a cycle are looked up. Where tags run ahead a beat takes its time with the first
  /// part of it, and the others go beside that; `begun`: its quads, or 0.
  Cycle turn(unsigned quads, unsigned begun, Cycle visible) {
    if (!timing_.fetches_ahead()) return early_.turn(quads, visible);
    BatchLimit& look_ups = early_.look_ups;
    const Cycle at = std::max(lines_ahead_.free_from(visible, 1), next_first_look_);
    if (begun > 0) return look_ups.take(begun, stops_.first_look_from(look_ups.free_from(begun, at)));
    look_ups.hold(stops_.first_look_from(at));
    return look_ups.now();
  }
  /// In its turn; `tested` follows.
  Times look_up(const QuadBeat& beat, Cycle turn, bool needs_stencil) {
    places_ = timing_.places_of(beat);
    if (!needs_stencil) return {turn, turn};
    Times times = look_up(beat, turn, early_);
    if (!timing_.fetches_ahead()) return times;
    next_first_look_ = times.at + 1;
    times.there = std::max(times.there, look_again(beat, times.at));
    return times;
  }
  void tested(bool needs_stencil, Cycle at) {
    early_.queue.take(places_, at);
    if (!timing_.fetches_ahead() || !needs_stencil) return;
    for (unsigned i = 0; i < needed_.count; ++i) {
      const BeatLines::Needed::Line& line = needed_.lines[i];
      uses_[lines_->index(line.address)].used(lines_->halves_with(line.address, line.sectors), at);
    }
  }
  /// The same of quads to be tested late, which become visible in a cycle; `tested_late` follows.
  Times look_up_late(const QuadBeat& quads, Cycle visible) {
    return look_up(quads, late_.turn(quads.count, visible), late_);
  }
  void tested_late(unsigned quads, Cycle at) { late_.queue.take(quads, at); }
  /// Quads of a beat have changed depth or stencil in the cycle of their test, a bit each; `beat` is that before the test.
  void change(const QuadBeat& beat, std::uint32_t quads, Cycle at) {
    lines_->find(beat, quads, needed_);
    for (unsigned i = 0; i < needed_.count; ++i) {
      const BeatLines::Needed::Line& changed = needed_.lines[i];
      LineAccess access;
      access.line = cache_->find(changed.address);
      if (access.line == SectoredCache::no_line && timing_.fetches_ahead()) {
        access.old_address = changed.address;
        access.written_back = changed.sectors;
        cache_->count_written_back(changed.sectors);
        write_back(access, at);
        owe(at);
        continue;
      }
      if (access.line == SectoredCache::no_line) {
        // It went when another line of the same beat came, which may still be held fast.
        if (pins_lines_) at = pins_.line_free_from(*cache_, changed.address, at);
        const unsigned sector_bytes = timing_.organization.sector_bytes;
        for_each_sector_run(changed.sectors, sectors_of_a_line_, [&](unsigned first, unsigned count) {
          access = cache_->access(changed.address + std::uint64_t{first} * sector_bytes, count * sector_bytes, true);
          if (access.written_back != 0) write_back(access, at);
        });
        owe(at);
      }
      cache_->make_dirty(access.line, changed.sectors);
      kept_until_[access.line] = std::max(kept_until_[access.line], at);
    }
  }

  /// Who sends an update is told at once when the queue takes it, long before the look-up: by when those before it are expected
  /// to be applied.
  Cycle room_for_update(Cycle at) { return queued_updates_.free_from(at, 1); }
  void expect(const TerminationSignal& signal, Cycle arrived) {
    queued_updates_.take(1, expected_.take(there(signal, arrived)) + 1);
  }
  /// The cycle in which an update is applied that arrives in a cycle.
  Cycle update(const TerminationSignal& signal, Cycle arrived) {
    Times times{arrived, 0, false};
    const BeatLines::Needed::Line needed = lines_->find(signal);
    const SectoredCache::Line line = look_up(needed, times);
    cache_->accessed(1, 1);
    cache_->make_dirty(line, needed.sectors);
    owe(times.at);
    const Cycle applied = updates_.take(std::max(times.at, times.there));
    keep(line, applied);
    return applied;
  }
  /// The same of one that is looked up later, by what the cache holds now.
  Cycle foreseen(const TerminationSignal& signal, Cycle arrived) { return foreseen_.take(there(signal, arrived)); }

  /// Cycles that moving sectors takes from the z-cache and that were not asked for yet, and from when on.
  std::pair<Cycle, std::uint64_t> take_moves() {
    const std::uint64_t cycles = owed_ / timing_.sectors_per_cycle;
    owed_ -= cycles * timing_.sectors_per_cycle;
    return {owed_at_, cycles};
  }

 private:
  /// When the sectors of an update are there that is looked up later, by what the cache holds now.
  Cycle there(const TerminationSignal& signal, Cycle arrived) const {
    const BeatLines::Needed::Line needed = lines_->find(signal);
    const SectoredCache::Line line = cache_->find(needed.address);
    std::uint32_t missed = needed.sectors & ~(cleared_ ? cleared_->of_line(needed.address) : 0);
    Cycle there = arrived;
    if (line != SectoredCache::no_line) {
      missed &= ~cache_->present(line);
      there = std::max(there, all_there(line, needed.sectors & cache_->present(line)));
    }
    return missed == 0 ? there : std::max(there, arrived + fill_cycles_);
  }
  /// From the look-up of quads to their test, in order.
  struct Way {
    Way(unsigned quads_per_cycle, unsigned places) : look_ups(quads_per_cycle), queue(places) {}
    Cycle turn(unsigned quads, Cycle visible) { return look_ups.take(quads, queue.free_from(visible, quads)); }
    BatchLimit look_ups;
    SlotPool queue;  ///< between look-up and test
    Cycle read = 0;  ///< the last line looked up for a test
  };
  Times look_up(const QuadBeat& beat, Cycle turn, Way& way) {
    Times times;
    times.at = turn;
    lines_->find(beat.tile, beat.quads.data(), beat.count, needed_);
    for (unsigned i = 0; i < needed_.count; ++i) {
      const Cycle at = times.at;
      const SectoredCache::Line line = look_up(needed_.lines[i], times);
      if (std::exchange(times.has_come, false) && timing_.fetches_ahead() && &way == &early_)
        uses_[lines_->index(needed_.lines[i].address)].come(at, true);
      // Lines are read in order, and may go then.
      way.read = std::max(way.read, times.there);
      keep(line, way.read);
    }
    cache_->accessed(beat.count, beat.count);
    way.look_ups.hold(times.at);
    owe(times.at);
    return {times.at, std::max(times.at, times.there)};
  }
  /// Sets when its sectors are there, and when it could be looked up, if that has to wait.
  SectoredCache::Line look_up(const BeatLines::Needed::Line& needed, Times& times) {
    LineAccess access;
    access.address = needed.address;
    access.sectors = needed.sectors;
    if (cleared_) access.known = cleared_->of_line(needed.address);
    if (pins_lines_) times.at = pins_.line_free_from(*cache_, needed.address, times.at);
    cache_->look_up(access);
    if (cleared_) cleared_->count(access.missed & access.known);
    Cycle* const there = &there_[std::size_t{access.line} * sectors_of_a_line_];
    if (access.replaced) {
      if (!timing_.fetches_ahead()) times.at = std::max(times.at, kept_until_[access.line]);
      if (access.written_back != 0) write_back(access, times.at);
      times.has_come = true;
    }
    if (access.filled != 0) {
      if (const unsigned flits = flits_of(access.address, access.filled, cache_->present(access.line) & ~access.filled);
          flits > 0)
        times.at = out_reads_.send({flits}, times.at).first;
      const Cycle filled = port_.fill(access, times.at, [&](unsigned first, unsigned count, Cycle cycle) {
        std::fill_n(there + first, count, cycle);
      });
      fill_cycles_ = filled - times.at;
    }
    times.there = std::max(times.there, all_there(access.line, access.sectors));
    return access.line;
  }
  /// A line does not go before a cycle.
  void keep(SectoredCache::Line line, Cycle until) {
    kept_until_[line] = std::max(kept_until_[line], until);
    if (pins_lines_) pins_.pin(*cache_, line, until);
  }
  /// The second look at the lines of one primitive's quads, as ZLinesAhead's; returns when they are there.
  [[gnu::noinline]] Cycle look_again(const QuadBeat& beat, Cycle looked_up) {
    const LineVisits::Visit visit = visits_.of(lines_->tile(beat.tile), primitive_order(beat.quads[0]));
    Cycle at = second_looks_.take(early_.queue.free_from(looked_up, places_));
    Cycle there = at;
    for (unsigned i = 0; i < needed_.count; ++i) {
      const BeatLines::Needed::Line& needed = needed_.lines[i];
      const Cycle could_be = at;
      const std::uint32_t halves = lines_->halves_with(needed.address, needed.sectors);
      const TimedLineUses::Look look =
          uses_[lines_->index(needed.address)].look_again(visit, halves, halves, lines_->half_of_a_line(), at);
      stops_.add(could_be, at);
      LineAccess again;
      again.address = needed.address;
      again.filled = look.comes_back ? needed.sectors & lines_->sectors_of(needed.address, look.again) : 0;
      if (again.filled == 0) continue;
      // First looks of later beats may be long before.
      if (const unsigned flits = flits_of(needed.address, again.filled, 0); flits > 0)
        out_reads_.send_beside({flits}, at);
      there = std::max(there, port_.fill(again, at));
    }
    second_looks_.hold(at + 1);
    lines_ahead_.take(needed_.count, at + 1);  // second looks come after what arrives in their cycle
    owe(at);
    return std::max(there, at);
  }
  /// What reading sectors takes of the ROPs' port.
  unsigned flits_of(std::uint64_t line, std::uint32_t sectors, std::uint32_t held) const {
    return out_reads_.is_stub() ? 0 : lines_->flits_of(line, sectors, held);
  }
  /// When all of these sectors are there; 0 for none.
  Cycle all_there(SectoredCache::Line line, std::uint32_t sectors) const {
    const Cycle* const there = &there_[std::size_t{line} * sectors_of_a_line_];
    Cycle last = 0;
    for (; sectors != 0; sectors &= sectors - 1) last = std::max(last, there[__builtin_ctz(sectors)]);
    return last;
  }
  void write_back(const LineAccess& access, Cycle at) {
    port_.write_back(access, at);
    if (cleared_) cleared_->written(access.old_address, access.written_back);
  }
  void owe(Cycle at) {
    const unsigned sectors = port_.take_moved();
    owed_ += out_reads_.is_stub() ? sectors : 0;
    owed_at_ = at;
  }

  const ZCache timing_;
  TimedOut<PortReads>& out_reads_;
  const unsigned sectors_of_a_line_;
  ZCacheStatistics& statistics_;
  TimedCachePort port_;
  Way early_;
  Way late_;
  IssuePort updates_;
  IssuePort foreseen_, expected_;  ///< the same of updates that are looked up later
  SlotPool queued_updates_;
  std::optional<BeatLines> lines_;
  std::optional<SectoredCache> cache_;
  std::optional<ClearedSectors> cleared_;
  BeatLines::Needed needed_;
  unsigned places_ = 0;            ///< that the beat looked up last takes of its queue
  std::vector<Cycle> kept_until_;  ///< by line of the cache
  const bool pins_lines_;
  TimedPins pins_;
  std::vector<Cycle> there_;  ///< by sector
  Cycle fill_cycles_ = 0;     ///< of the last fill
  // Where tags are looked at twice:
  std::vector<TimedLineUses> uses_;  ///< by line of the surface
  SlotPool lines_ahead_;             ///< between two looks
  IssuePort second_looks_{1};
  VisitCounter visits_;
  SecondLookStops stops_;
  Cycle next_first_look_ = 0;  ///< of which there is one in a cycle
  std::uint64_t owed_ = 0;     ///< sectors
  Cycle owed_at_ = 0;
};

}  // namespace vrpipe
