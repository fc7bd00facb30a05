#include <algorithm>
#include <optional>
#include <vector>

#include "zrop/beat_lines.h"
#include "zrop/hi_z_reports.h"
#include "zrop/late_quads.h"
#include "zrop/z_cache_statistics.h"
#include "zrop/zrop_time.h"

#include <vrpipe/memory/sectored_cache.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

namespace {

/// ZROP without time: a bin's test sees what the bins before it have terminated and what their late tests have stored, so no mark
/// need come around. Nobody counts what its reads take of the ROPs' port. Where its memory wants to know, tests and updates go through the z-cache. Ports as in zrop_timed.cpp.
class UntimedZrop : public UntimedUnit {
 public:
  UntimedZrop(const std::string& name, std::unique_ptr<ZropBehaviour> behaviour, const RenderContext& context)
      : UntimedUnit(name, behaviour->time().kinds()),
        context_(context),
        out_(*this, "out_quads"),
        out_hi_z_(*this, "out_hi_z"),
        out_late_(*this, "out_late"),
        out_reads_(*this, "out_reads"),
        in_late_(input<ShadedWarpItem>("in_late", [this](const ShadedWarpItem& item) { test_late(item); })),
        in_(input<BinItem>("in_quads", [this](const BinItem& item) { test(item); })),
        in_terminations_(input<TerminationBeat>("in_terminations",
                                                [this](const TerminationBeat& beat) {
                                                  for (unsigned i = 0; i < beat.count; ++i) update(beat.signals[i]);
                                                })),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        memory_({MemoryTraffic::depth_stencil, static_cast<std::uint16_t>(context.placement.gpc)}),
        z_cache_gate_(context, "zrop.z_cache"),
        blocks_(time_.blocks),
        tiling_(context.frame->width(), context.frame->height()),
        places_(blocks_.is_on() && context.termination == Termination::paper ? tiling_.tiles() : 1),
        hi_z_(context) {
    if (!EffectGate(context, "cache.details").is_active()) cache_statistics_.leave_out_details();
    out_hi_z_.set_optional();
    out_late_.set_optional();
    in_late_->set_optional();
    out_reads_.set_optional();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  UntimedMemoryPort* memory_port() override { return &memory_; }
  BoundTerms terms() const override { return {false, false, 0, time_.updates_hide()}; }
  std::vector<OccupancyPart> least_parts(const Items& items, bool to_last) const override {
    return time_.least_parts(items, to_last);
  }
  double idle_after_last() const override { return static_cast<double>(time_.longest_beat()) / 1000; }
  void leave_out_pending(Items& items) const override {
    items[ZropWork::sectors] = time_.sectors_not_ahead(items[ZropWork::sectors]);
    items[ZropWork::bytes_moved] = items[ZropWork::sectors] * time_.z_cache.organization.sector_bytes;
  }

 private:
  void update(const TerminationSignal& signal) {
    if (follows_cache()) {
      needed_.count = 1;
      needed_.lines[0] = lines().find(signal);
      did(ZropWork::sectors, look_up(1));
      cache_->make_dirty(line_, needed_.lines[0].sectors);
    }
    behaviour_->update(signal);
  }
  /// As few thousandths beyond what quads take as any order in time of the beats can do with: those behind a block share no
  /// more of its time than its last cycle.
  [[gnu::noinline]] void count_blocks() {
    BlockPrice::Place& last = places_.size() == 1 ? places_[0] : places_[tiling_.index(beat_.tile)];
    const std::uint64_t price = blocks_.of(beat_.tile, beat_.quads.data(), beat_.count, last);
    const std::uint64_t of_quads =
        (std::uint64_t{1000} * beat_.count + time_.quads_per_cycle - 1) / time_.quads_per_cycle;
    unshared_ += static_cast<std::int64_t>(price) - static_cast<std::int64_t>(of_quads);
    if (unshared_ <= 0) return;
    did(ZropWork::blocks, static_cast<std::uint64_t>(unshared_));
    unshared_ = 0;
  }
  void test(const BinItem& incoming) {
    if (incoming.mark != Mark::none) {
      behaviour_->pass(incoming.mark);
      if (cleared_ && context_.frame->clears_depth_stencil(incoming.mark)) cleared_->clear();
      if (hi_z_.returns(incoming.mark)) out_hi_z_.send(HiZReports::of_mark(incoming.mark));
      return out_.send(incoming);
    }
    BinItem item = incoming;
    std::vector<Quad>& quads = item.storage->flush.quads;
    did(ZropWork::tests, item.quads);
    item.quads = 0;
    beat_.tile = item.tile;
    for (unsigned from = 0; from < incoming.quads;) {
      beat_.count = static_cast<std::uint8_t>(std::min(incoming.quads - from, QuadBeat::capacity));
      std::copy_n(quads.begin() + from, beat_.count, beat_.quads.begin());
      from += beat_.count;
      beat_.last_of_bin = from == incoming.quads;
      // All are of one state.
      const DrawState& state = context_.state(beat_.quads[0].draw);
      if (follows_cache() && state.reads_depth_stencil_early()) {
        lines().find(beat_.tile, beat_.quads.data(), beat_.count, needed_);
        did(ZropWork::sectors, look_up(beat_.count));
      }
      if (blocks_.is_on()) count_blocks();
      QuadBeat before;
      const bool may_change = follows_cache() && state.tests_early() && state.writes_depth_stencil();
      const bool hi_z = hi_z_.wanted(beat_.quads[0].draw);
      if (may_change || hi_z) before = beat_;
      const std::uint32_t changed = behaviour_->test(beat_);
      if (may_change && changed != 0) change(before, changed);
      if (hi_z && changed != 0) tell(before, changed);
      std::copy_n(beat_.quads.begin(), beat_.count, quads.begin() + item.quads);
      item.quads += beat_.count;
    }
    out_.send(item);
  }

  [[gnu::noinline]] void test_late(const ShadedWarpItem& item) {
    ShadedWarp& warp = item.warp->editable();
    const QuadBeat before = quads_of(warp);
    did(ZropWork::late_tests, before.count);
    if (follows_cache()) {
      // The bound does not know what time these sectors take from other tests.
      lines().find(before.tile, before.quads.data(), before.count, needed_);
      look_up(before.count);
    }
    const std::uint32_t changed = behaviour_->test_late(warp);
    if (follows_cache() && changed != 0) change(before, changed);
    if (changed != 0 && hi_z_.wanted(before.quads[0].draw)) tell(before, changed);
    out_late_.send(item);
  }

  [[gnu::noinline]] void tell(const QuadBeat& beat, std::uint32_t changed) {
    hi_z_.changed(beat, changed, *behaviour_->surface(), [this](const HiZUpdate& update) { out_hi_z_.send(update); });
  }

  /// Quads of a beat have changed depth or stencil, a bit each.
  void change(const QuadBeat& beat, std::uint32_t quads) {
    for (; quads != 0; quads &= quads - 1) {
      const Quad& quad = beat.quads[static_cast<unsigned>(__builtin_ctz(quads))];
      lines().find(beat.tile, &quad, 1, needed_);
      const BeatLines::Needed::Line& changed = needed_.lines[0];
      line_ = cache_->find(changed.address);
      // It may have gone when another line of the same beat came.
      if (line_ == SectoredCache::no_line) did(ZropWork::sectors, look_up(1));
      cache_->make_dirty(line_, changed.sectors);
    }
  }
  /// Whether anybody wants to know what moves.
  bool follows_cache() { return memory_.connected() && z_cache_gate_.enter(); }
  const BeatLines& lines() {
    if (!lines_) {
      lines_.emplace(time_.z_cache, *behaviour_->surface());
      cache_.emplace(time_.z_cache.organization, cache_statistics_);
      cleared_ = cleared_sectors_of(*behaviour_->surface(), time_.z_cache, cache_statistics_);
    }
    return *lines_;
  }
  /// What so many quads or updates need. Returns the sectors that no run is spared, whatever its order: for the bound.
  std::uint64_t look_up(unsigned accesses) {
    const std::uint64_t before = cache_statistics_.sector_misses_compulsory.value();
    for (unsigned i = 0; i < needed_.count; ++i) {
      LineAccess access;
      access.address = needed_.lines[i].address;
      access.sectors = needed_.lines[i].sectors;
      if (cleared_) access.known = cleared_->of_line(access.address);
      cache_->look_up(access);
      if (cleared_) {
        cleared_->count(access.missed & access.known);
        if (access.written_back != 0) cleared_->written(access.old_address, access.written_back);
      }
      line_ = access.line;
      memory_.move(access, time_.z_cache.organization);
    }
    cache_->accessed(accesses, accesses);
    // Cleared sectors are not read for the first time; and what takes flits takes no time of the tests.
    return cleared_ || !out_reads_.is_stub() ? 0 : cache_statistics_.sector_misses_compulsory.value() - before;
  }
  const RenderContext& context_;
  UntimedOut<BinItem> out_;
  UntimedOut<HiZUpdate> out_hi_z_;
  UntimedOut<ShadedWarpItem> out_late_;
  UntimedOut<PortReads> out_reads_;
  std::unique_ptr<UntimedIn<ShadedWarpItem>> in_late_;
  std::unique_ptr<UntimedIn<BinItem>> in_;
  std::unique_ptr<UntimedIn<TerminationBeat>> in_terminations_;
  std::unique_ptr<ZropBehaviour> behaviour_;
  const ZropTime time_;
  UntimedMemoryPort memory_;
  EffectGate z_cache_gate_;
  ZCacheStatistics cache_statistics_{*this, "cache"};
  std::optional<BeatLines> lines_;      ///< once looked up
  std::optional<SectoredCache> cache_;  ///< the same
  std::optional<ClearedSectors> cleared_;
  BeatLines::Needed needed_;
  SectoredCache::Line line_ = SectoredCache::no_line;  ///< that was looked up last
  QuadBeat beat_;
  BlockPrice blocks_;
  const ScreenTiling tiling_;
  /// The last; by screen tile where bins may time out, in which a primitive's quads may be together that are not so here.
  std::vector<BlockPrice::Place> places_;
  std::int64_t unshared_ =
      -1000;  ///< what blocks cost beyond quads, but for their last cycle: thousandths, not counted yet
  HiZReports hi_z_;
};

[[maybe_unused]] const bool zrop_untimed_registered = [] {
  register_untimed_unit_maker("zrop", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                         const RenderContext& context, unsigned) {
    return std::make_unique<UntimedZrop>(name, behaviour_as<ZropBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
