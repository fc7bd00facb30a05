#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "beat_lines.h"
#include "late_look_ups.h"
#include "z_cache_statistics.h"
#include "z_lines_ahead.h"
#include "zrop_time.h"

#include <vrpipe/kernel/rate.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/cache_port.h>
#include <vrpipe/pipeline/late_plan.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// The z-cache at cycle, in front of ZROP's memory port, and the queues of what was looked up in it.
///
/// Beats and updates are looked up as they arrive, each in their order, which starts the fills that they need. What a
/// beat needs is read into its queue in order, as soon as it is there, and then its line may go: so a line is kept no
/// longer than the memory takes, whatever becomes of the tests, and updates come by when lines or miss registers are
/// few. The queue's values follow updates. An update keeps its line until it is applied. What a test changes is put back, in
/// whole sectors; nothing is tested while that waits for a line. Warps that are tested late have a queue of their own. Nothing is
/// looked up behind a mark that has to come around first (LatePlan).
class ZPort {
 public:
  /// @param out_reads  what they take of the ROPs' port
  ZPort(PortOwner& owner, StreamOut<PortReads>& out_reads, const ZropTime& time, const RenderContext& context,
        const LatePlan& plan)
      : context_(context),
        plan_(plan),
        timing_(time.z_cache),
        out_reads_(out_reads),
        updates_per_cycle_(time.updates_per_cycle),
        port_(owner, "memory", timing_.mshrs,
              {MemoryTraffic::depth_stencil, static_cast<std::uint16_t>(context.placement.gpc)},
              timing_.organization.sectors_of_a_line()),
        look_ups_(time.quads_per_cycle),
        late_(time.quads_per_cycle, timing_.input_quads) {}

  tlm::tlm_initiator_socket<32>& socket() { return port_.socket(); }
  const MemoryBytes& moved() const { return port_.moved(); }
  /// Before the first look-up. Surface and statistics outlive it.
  void make_cache(const DepthStencilSurface& surface, ZCacheStatistics& statistics) {
    port_.make_cache(timing_.organization, statistics);
    cleared_ = cleared_sectors_of(surface, timing_, statistics);
    if (cleared_) port_.know_cleared(*cleared_);
    lines_.emplace(timing_, surface);
    flits_.emplace(out_reads_, *lines_);
    if (timing_.fetches_ahead()) ahead_.emplace(port_, *flits_, timing_, *lines_, cleared_ ? &*cleared_ : nullptr);
  }
  bool idle() const {
    return beats_.empty() && updates_.empty() && late_.empty() && changed_.empty() && port_.has_written_back();
  }

  /// Takes what has come, and looks up what is at the links; true if anything moved.
  bool advance(Cycle now, StreamIn<QuadBeat>& quads, StreamIn<TerminationBeat>& updates,
               StreamIn<ShadedWarpItem>& late) {
    now_ = now;
    bool moved = port_.finish_fills(now);
    port_.write_back(moves());
    moved |= put_changed();
    moved |= take_updates(updates);
    if (plan_.is_used()) moved |= take_late(late);
    moved |= take_beats(quads);
    if (!ahead_) return read() || moved;
    ahead_->take_reads([this](std::uint32_t number) {
      --beats_[(number - static_cast<std::uint32_t>(beats_tested_)) & ZLinesAhead::number_mask].waits.reads_again;
    });
    return look_again() || moved;
  }
  /// When it has to do so next, if nothing of its queues moves before.
  Cycle next(Cycle now, const StreamIn<QuadBeat>& quads, const StreamIn<TerminationBeat>& updates,
             const StreamIn<ShadedWarpItem>& late) const {
    Cycle next = port_.next_completion();
    // What could not be looked up waits for a completion, for the queue to move or for its turn.
    for (const Cycle at : {quads.next_ready(), updates.next_ready(), late.next_ready(), next_look_up_, late_.next()}) {
      if (at > now) next = std::min(next, at);
    }
    return next;
  }

  /// Sectors whose time the z-cache has not given yet.
  std::uint64_t owed_sectors() const { return owed_; }
  void pay_sectors(unsigned sectors) { owed_ -= sectors; }

  bool has_beats() const { return !beats_.empty(); }
  /// Whether all that the first beat needs has come.
  bool beat_is_there() const {
    if (beats_.empty()) return false;
    const ZLinesAhead::Waits& waits = beats_.front().waits;
    if (!ahead_) return reads_done_ >= waits.reads;
    return looked_twice_ > 0 && ahead_->has_come(waits.reads) && waits.reads_again == 0;
  }
  const QuadBeat& front() const { return beats_.front().beat; }
  void pop() {
    queued_ -= beats_.front().places;
    if (ahead_) use();
    beats_.pop();
  }

  /// Quads of the beat tested last have changed depth or stencil, a bit each; `beat` is that before the test.
  void change(const QuadBeat& beat, std::uint32_t quads) {
    BeatLines::Needed changed;
    lines_->find(beat, quads, changed);
    for (unsigned i = 0; i < changed.count; ++i) changed_.push(changed.lines[i]);
    put_changed();
  }
  /// Whether what was changed waits for a line.
  bool holds_changed() const { return !changed_.empty(); }

  /// The same of warps that are tested late.
  bool has_late() const { return !late_.empty(); }
  bool late_is_there() const { return late_.is_there(); }
  const ShadedWarpItem& front_late() const { return late_.front(); }
  void pop_late() { late_.pop(); }
  /// A mark has come around: what is behind it may be looked up.
  void mark_is_back(Mark mark) {
    waits_ = false;
    clear_at(mark);
  }

  bool update_is_there() const {
    return !updates_.empty() && port_.awaited(updates_.front().line, updates_.front().sectors) == 0;
  }
  const TerminationSignal& front_update() const { return updates_.front().signal; }
  void pop_update() {
    const Update& update = updates_.front();
    port_.cache().make_dirty(update.line, update.sectors);
    port_.cache().unpin(update.line);
    updates_.pop();
  }

 private:
  struct Beat {
    QuadBeat beat;
    unsigned lines = 0;
    unsigned places = 0;       ///< of the queue
    ZLinesAhead::Waits waits;  ///< where tags do not run ahead, for reads of lines alone
  };
  struct Read {
    SectoredCache::Line line = SectoredCache::no_line;
    std::uint32_t sectors = 0;
  };
  /// Of sectors that move, unless a port's flits are what takes time.
  struct Moved {
    void operator()(unsigned sectors) const { owed += takes_time ? sectors : 0; }
    std::uint64_t& owed;
    bool takes_time;
  };
  Moved moves() { return {owed_, out_reads_.is_stub()}; }
  /// Goes on with a look-up in the cache.
  bool look_up(CachePort::LookUp& wanted) {
    if (!flits_->has_room() || !port_.look_up(wanted, now_, moves())) return false;
    const SectoredCache& cache = port_.cache();
    flits_->read(wanted.address, wanted.asked_for,
                 (cache.present(wanted.line) | cache.filling(wanted.line)) & ~wanted.asked_for);
    return true;
  }
  bool look_up_line() {
    if (ahead_) return ahead_->look_up(line_, at_, waits_of_beat_, moves());
    if (!look_up(line_)) return false;
    reads_.push({line_.line, line_.sectors});
    waits_of_beat_.reads = ++reads_asked_;
    return true;
  }
  bool reads_early(const QuadBeat& beat) const {
    // All are of one state.
    return beat.count > 0 && context_.state(beat.quads[0].draw).reads_depth_stencil_early();
  }
  /// Beats that were looked up, a line or less in a cycle.
  [[gnu::noinline]] bool look_again() {
    if (looked_twice_ == beats_.size()) return false;
    Beat& next = beats_[looked_twice_];
    if (looked_twice_ > 0 && queued_ + next.places > timing_.places()) return false;
    if (reads_early(next.beat) && !ahead_->look_again(next.beat, beats_tested_ + looked_twice_, next.waits, moves()))
      return false;
    lines_ahead_ -= next.lines;
    queued_ += next.places;
    ++looked_twice_;
    return true;
  }
  /// The first beat is tested.
  [[gnu::noinline]] void use() {
    ++beats_tested_;
    --looked_twice_;
    const Beat& first = beats_.front();
    if (reads_early(first.beat)) ahead_->used(first.beat, first.waits);
  }
  struct Update {
    TerminationSignal signal;
    SectoredCache::Line line = SectoredCache::no_line;
    std::uint32_t sectors = 0;
  };

  bool take_updates(StreamIn<TerminationBeat>& in) {
    bool moved = false;
    for (unsigned budget = updates_per_cycle_; budget > 0 && in.ready() && updates_.size() < timing_.input_updates;
         --budget) {
      const TerminationBeat& beat = in.front();
      if (signal_ < beat.count) {
        const TerminationSignal& signal = beat.signals[signal_];
        if (!update_begun_) {
          const BeatLines::Needed::Line needed = lines_->find(signal);
          update_ = {needed.address, needed.sectors, SectoredCache::no_line, 0};
          update_begun_ = true;
        }
        if (!look_up(update_)) break;
        update_begun_ = false;
        count_accesses(1);
        updates_.push({signal, update_.line, update_.sectors});
        ++signal_;
      }
      moved = true;
      if (signal_ < beat.count) continue;
      in.pop();
      signal_ = 0;
    }
    return moved;
  }

  bool take_beats(StreamIn<QuadBeat>& in) {
    bool moved = false;
    while (!waits_ && in.ready() && !(ahead_ && ahead_->is_stopped())) {
      const QuadBeat& beat = in.front();
      if (!beat_begun_ && !begin(beat)) break;
      for (; at_ < needed_.count; ++at_) {
        if (!look_up_line()) return moved;
        moved = true;
        if (at_ + 1 < needed_.count) begin_line(at_ + 1);
      }
      beat_begun_ = false;
      if (needed_.count > 0) count_accesses(part_.count);
      Beat& queued = beats_.push();
      queued.beat = part_;
      queued.waits = waits_of_beat_;
      queued.lines = needed_.count;
      queued.places = timing_.places_of(part_);
      if (ahead_) {
        lines_ahead_ += needed_.count;
      } else {
        queued_ += queued.places;
      }
      taken_ += part_.count;
      moved = true;
      if (taken_ == beat.count) {
        taken_ = 0;
        waits_ = beat.mark != Mark::none && plan_.waits_at(beat.mark);
        in.pop();
      }
      if (ahead_ && needed_.count > 0) break;  // one look in a cycle, as the second ones
    }
    return moved;
  }
  [[gnu::noinline]] bool take_late(StreamIn<ShadedWarpItem>& in) {
    const auto count = [this](unsigned quads) { count_accesses(quads); };
    if (ahead_) {
      // In the place of the line, the read that it needs.
      const auto look_up = [this](CachePort::LookUp& line) {
        std::uint64_t needs = 0;
        if (!ahead_->look_up_late(line, late_left_, needs, moves())) return false;
        line.line = static_cast<SectoredCache::Line>(needs);
        return true;
      };
      const bool moved = late_.take(in, *lines_, now_, look_up, count);
      return late_.read([this](SectoredCache::Line needs, std::uint32_t) { return ahead_->has_come(needs); }) || moved;
    }
    const bool moved = late_.take(
        in, *lines_, now_, [this](CachePort::LookUp& line) { return look_up(line); }, count);
    const auto is_there = [this](SectoredCache::Line line, std::uint32_t sectors) {
      if (port_.awaited(line, sectors) != 0) return false;
      port_.cache().unpin(line);
      return true;
    };
    return late_.read(is_there) || moved;
  }
  /// To look a beat up, or what is of its next primitive where tags run ahead; false if that has to wait.
  bool begin(const QuadBeat& beat) {
    if (ahead_ ? lines_ahead_ >= timing_.fetch_ahead_lines
               : !beats_.empty() && queued_ + beat.count > timing_.input_quads)
      return false;
    if (taken_ == 0) {
      const unsigned width = std::max<unsigned>(beat.count, 1);
      if (!look_ups_.allows(width, now_)) return false;
      look_ups_.take(width);
      next_look_up_ = look_ups_.next(now_);
    }
    take_part(beat);
    needed_.count = 0;
    at_ = 0;
    if (reads_early(part_)) {
      lines_->find(part_.tile, part_.quads.data(), part_.count, needed_);
      begin_line(0);
    } else if (beat.mark != Mark::none && !plan_.waits_at(beat.mark)) {
      clear_at(beat.mark);
    }
    beat_begun_ = true;
    return true;
  }
  void take_part(const QuadBeat& beat) {
    if (!ahead_ || beat.count == 0) {
      part_ = beat;
      return;
    }
    const std::uint32_t primitive = primitive_order(beat.quads[taken_]);
    part_.tile = beat.tile;
    part_.mark = Mark::none;
    part_.count = 0;
    for (unsigned i = taken_; i < beat.count && primitive_order(beat.quads[i]) == primitive; ++i)
      part_.quads[part_.count++] = beat.quads[i];
    part_.last_of_bin = beat.last_of_bin && taken_ + part_.count == beat.count;
    waits_of_beat_ = {waits_of_beat_.reads, 0, visits_.of(lines_->tile(beat.tile), primitive), 0};
  }
  void clear_at(Mark mark) {
    if (cleared_ && context_.frame->clears_depth_stencil(mark)) cleared_->clear();
  }
  void begin_line(unsigned at) {
    line_ = {needed_.lines[at].address, needed_.lines[at].sectors, SectoredCache::no_line, 0};
  }

  bool put_changed() {
    bool any = false;
    for (; !changed_.empty(); changed_.pop()) {
      const BeatLines::Needed::Line& line = changed_.front();
      const bool allocates = !ahead_;  // where tags run ahead lines go as a rule before they are tested
      const bool is_held = port_.cache().find(line.address) != SectoredCache::no_line;
      if (!port_.put(line.address, line.sectors, allocates, moves())) break;
      // What went in the meantime is accessed anew.
      if (!is_held && allocates) count_accesses(static_cast<unsigned>(__builtin_popcount(line.sectors)));
      any = true;
    }
    return any;
  }

  /// Reads what has come into the queue.
  bool read() {
    bool any = false;
    for (; !reads_.empty() && port_.awaited(reads_.front().line, reads_.front().sectors) == 0; reads_.pop()) {
      port_.cache().unpin(reads_.front().line);
      ++reads_done_;
      any = true;
    }
    return any;
  }

  /// Of quads or updates. What the look-ups under way have missed is theirs, so that they end together.
  void count_accesses(unsigned accesses) {
    accesses_ += accesses;
    if (beat_begun_ || update_begun_ || late_.has_begun()) return;
    port_.cache().accessed(accesses_, accesses_);
    accesses_ = 0;
  }

  const RenderContext& context_;
  const LatePlan& plan_;
  const ZCache timing_;
  StreamOut<PortReads>& out_reads_;
  const unsigned updates_per_cycle_;
  CachePort port_;
  BatchLimit look_ups_;
  std::optional<BeatLines> lines_;
  std::optional<ReadFlits> flits_;
  std::optional<ClearedSectors> cleared_;
  // Where tags run ahead of data:
  std::optional<ZLinesAhead> ahead_;
  std::uint32_t late_left_ = 0;    ///< sectors of the line that is looked up for a late test, yet to be read
  std::size_t looked_twice_ = 0;   ///< beats at the front of the queue
  std::uint32_t lines_ahead_ = 0;  ///< of the beats behind them
  VisitCounter visits_;
  std::uint64_t beats_tested_ = 0;
  Cycle now_ = 0;
  Cycle next_look_up_ = 0;  ///< after a beat wider than the unit
  std::uint64_t owed_ = 0;
  unsigned accesses_ = 0;  ///< that are not counted yet
  // Of the beat at the link:
  bool beat_begun_ = false;
  unsigned taken_ = 0;  ///< quads of it
  QuadBeat part_;       ///< of it, that is looked up
  ZLinesAhead::Waits waits_of_beat_;
  BeatLines::Needed needed_;
  unsigned at_ = 0;         ///< of the lines needed
  CachePort::LookUp line_;  ///< that one
  // Of the updates at the link:
  bool update_begun_ = false;
  unsigned signal_ = 0;
  CachePort::LookUp update_;

  Ring<BeatLines::Needed::Line> changed_;  ///< by tests, and not put back yet
  Ring<Beat> beats_;                       ///< looked up, and not tested
  unsigned queued_ = 0;  ///< places taken: by beats that were looked up twice, where there are two looks
  Ring<Read> reads_;     ///< lines of these, that are not read yet
  std::uint64_t reads_asked_ = 0;
  std::uint64_t reads_done_ = 0;
  Ring<Update> updates_;  ///< looked up, and not applied
  LateLookUps late_;
  bool waits_ = false;  ///< for a mark to come around
};

}  // namespace vrpipe
