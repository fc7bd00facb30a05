#pragma once

#include <array>
#include <optional>

#include "beat_lines.h"
#include "late_look_ups.h"
#include "z_cache_statistics.h"

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
  ZPort(PortOwner& owner, const ZCache& timing, unsigned quads_per_cycle, unsigned updates_per_cycle,
        const RenderContext& context, const LatePlan& plan)
      : context_(context),
        plan_(plan),
        timing_(timing),
        updates_per_cycle_(updates_per_cycle),
        port_(owner, "memory", timing.mshrs,
              {MemoryTraffic::depth_stencil, static_cast<std::uint16_t>(context.placement.gpc)},
              timing.organization.sectors_of_a_line()),
        look_ups_(quads_per_cycle),
        late_(quads_per_cycle, timing.input_quads) {}

  tlm::tlm_initiator_socket<32>& socket() { return port_.socket(); }
  const MemoryBytes& moved() const { return port_.moved(); }
  /// Before the first look-up. Surface and statistics outlive it.
  void make_cache(const DepthStencilSurface& surface, ZCacheStatistics& statistics) {
    port_.make_cache(timing_.organization, statistics);
    cleared_ = cleared_sectors_of(surface, timing_, statistics);
    if (cleared_) port_.know_cleared(*cleared_);
    lines_.emplace(timing_, surface);
  }
  bool idle() const {
    return beats_.empty() && updates_.empty() && late_.empty() && changed_.empty() && port_.has_written_back();
  }

  /// Takes what has come, and looks up what is at the links; true if anything moved.
  bool advance(Cycle now, StreamIn<QuadBeat>& quads, StreamIn<TerminationBeat>& updates,
               StreamIn<ShadedWarpItem>& late) {
    now_ = now;
    bool moved = port_.finish_fills(now);
    port_.write_back(Moved{owed_});
    moved |= put_changed();
    moved |= take_updates(updates);
    if (plan_.is_used()) moved |= take_late(late);
    moved |= take_beats(quads);
    moved |= read();
    return moved;
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
  bool beat_is_there() const { return !beats_.empty() && reads_done_ >= beats_.front().reads; }
  const QuadBeat& front() const { return beats_.front().beat; }
  void pop() {
    queued_quads_ -= beats_.front().beat.count;
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
    std::uint64_t reads = 0;  ///< of lines, that are done once this beat has what it needs
  };
  struct Read {
    SectoredCache::Line line = SectoredCache::no_line;
    std::uint32_t sectors = 0;
  };
  /// Of sectors that move.
  struct Moved {
    void operator()(unsigned sectors) const { owed += sectors; }
    std::uint64_t& owed;
  };
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
        if (!port_.look_up(update_, now_, Moved{owed_})) break;
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
    while (!waits_ && in.ready()) {
      const QuadBeat& beat = in.front();
      if (!beat_begun_ && !begin(beat)) break;
      for (; at_ < needed_.count; ++at_) {
        if (!port_.look_up(line_, now_, Moved{owed_})) return moved;
        reads_.push({line_.line, line_.sectors});
        ++reads_asked_;
        moved = true;
        if (at_ + 1 < needed_.count) begin_line(at_ + 1);
      }
      beat_begun_ = false;
      if (needed_.count > 0) count_accesses(beat.count);
      Beat& queued = beats_.push();
      queued.beat = beat;
      queued.reads = reads_asked_;
      queued_quads_ += beat.count;
      waits_ = beat.mark != Mark::none && plan_.waits_at(beat.mark);
      in.pop();
      moved = true;
    }
    return moved;
  }
  [[gnu::noinline]] bool take_late(StreamIn<ShadedWarpItem>& in) {
    const bool moved =
        late_.take(in, port_, *lines_, now_, Moved{owed_}, [this](unsigned quads) { count_accesses(quads); });
    return late_.read(port_) || moved;
  }
  /// To look a beat up; false if that has to wait.
  bool begin(const QuadBeat& beat) {
    if (!beats_.empty() && queued_quads_ + beat.count > timing_.input_quads) return false;
    const unsigned width = std::max<unsigned>(beat.count, 1);
    if (!look_ups_.allows(width, now_)) return false;
    look_ups_.take(width);
    next_look_up_ = look_ups_.next(now_);
    needed_.count = 0;
    at_ = 0;
    // All are of one state.
    if (beat.count > 0 && context_.state(beat.quads[0].draw).reads_depth_stencil_early()) {
      lines_->find(beat.tile, beat.quads.data(), beat.count, needed_);
      begin_line(0);
    } else if (beat.mark != Mark::none && !plan_.waits_at(beat.mark)) {
      clear_at(beat.mark);
    }
    beat_begun_ = true;
    return true;
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
      const bool is_held = port_.cache().find(line.address) != SectoredCache::no_line;
      if (!port_.put(line.address, line.sectors, Moved{owed_})) break;
      // What went in the meantime is accessed anew.
      if (!is_held) count_accesses(static_cast<unsigned>(__builtin_popcount(line.sectors)));
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
  const unsigned updates_per_cycle_;
  CachePort port_;
  BatchLimit look_ups_;
  std::optional<BeatLines> lines_;
  std::optional<ClearedSectors> cleared_;
  Cycle now_ = 0;
  Cycle next_look_up_ = 0;  ///< after a beat wider than the unit
  std::uint64_t owed_ = 0;
  unsigned accesses_ = 0;  ///< that are not counted yet
  // Of the beat at the link:
  bool beat_begun_ = false;
  BeatLines::Needed needed_;
  unsigned at_ = 0;         ///< of the lines needed
  CachePort::LookUp line_;  ///< that one
  // Of the updates at the link:
  bool update_begun_ = false;
  unsigned signal_ = 0;
  CachePort::LookUp update_;

  Ring<BeatLines::Needed::Line> changed_;  ///< by tests, and not put back yet
  Ring<Beat> beats_;                       ///< looked up, and not tested
  unsigned queued_quads_ = 0;
  Ring<Read> reads_;  ///< lines of these, that are not read yet
  std::uint64_t reads_asked_ = 0;
  std::uint64_t reads_done_ = 0;
  Ring<Update> updates_;  ///< looked up, and not applied
  LateLookUps late_;
  bool waits_ = false;  ///< for a mark to come around
};

}  // namespace vrpipe
