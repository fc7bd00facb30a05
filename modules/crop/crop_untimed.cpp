#include <algorithm>
#include <optional>
#include <vector>

#include "crop/crop_time.h"
#include "crop/in_shader.h"

#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>

namespace vrpipe {

namespace {

/// CROP without time. It signals quad by quad. Ports as in crop_timed.cpp.
class UntimedCrop : public UntimedUnit {
 public:
  UntimedCrop(const std::string& name, std::unique_ptr<CropBehaviour> behaviour, const RenderContext& context)
      : UntimedUnit(name, work(behaviour->time())),
        context_(context),
        out_(*this, "out_terminations"),
        out_done_(*this, "out_done"),
        in_(input<ShadedWarpItem>("in_color", [this](const ShadedWarpItem& item) { take(*item.warp); })),
        in_reads_(input<PortReads>("in_reads", [](const PortReads&) {})),
        behaviour_(std::move(behaviour)),
        signals_(context.frame->terminates_early()),
        barriers_(context),
        time_(behaviour_->time()),
        memory_({MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}) {
    out_done_.set_optional();
    in_reads_->set_optional();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  UntimedMemoryPort* memory_port() override { return &memory_; }

  void prefetch(const Warp& warp) override {
    if (warp.count == 0) return;
    const ColorSurface& surface = *behaviour_->surface();
    const std::size_t tile = surface.grid().place(warp.tile, 0);
    const QuadColor* const quads = &surface.quad(tile);
    for (unsigned i = 0; i < warp.count; ++i) __builtin_prefetch(&quads[warp.quads[i].position], 1);
    watch().prefetch_tile(tile);
  }

  void count_least(const BoundTerms& terms) override {
    counts_ = true;
    memory_latency_cycles_ = terms.memory_latency_cycles;
    if (terms.bins_vary && context_.frame->terminates_early())
      terminated_.resize(behaviour_->surface()->grid().quads());
    const std::size_t lines = behaviour_->surface()->size_bytes() / time_.cache.line_bytes + 1;
    // Of lines that go in another order than they are used, which one goes depends on those that are waited for.
    if (terms.order_varies || time_.cache.replacement != Replacement::lru) filled_.resize(lines);
  }
  double least_cycles(const Items& items) const override {
    return time_.least_cycles({items[CropWork::blend], items[CropWork::sectors], items[CropWork::flits],
                               items[CropWork::sectors_filled], items[CropWork::lines_filled], memory_latency_cycles_});
  }
  void leave_out_pending(Items& items) const override {
    items[CropWork::flits] -= std::min(items[CropWork::flits], time_.port.most_waiting(time_.cache));
  }
  std::uint64_t room_in_warps() const override { return time_.input_quads; }

 private:
  /// What is counted beside the kinds of the slot takes as long as the memory says (least_cycles).
  static std::vector<WorkKind> work(const CropTime& time) {
    std::vector<WorkKind> kinds = time.kinds();
    for (const char* name : {"sectors filled", "lines filled", "bytes moved"}) kinds.push_back({name, 1, 0, false});
    return kinds;
  }

  void take(const ShadedWarp& warp) {
    if (warp.mark != Mark::none) {
      behaviour_->pass(warp.mark);
      const Clear* const clear = context_.frame->clear_of(warp.mark);
      if (clear != nullptr && clear->termination) std::fill(terminated_.begin(), terminated_.end(), LaneMask{0});
      if (barriers_.is_barrier(warp.mark)) out_done_.send({warp.mark});
      return warp.release();
    }
    if (!follows_cache()) {
      blend(warp, 0, warp.count);
    } else {
      const unsigned at_once = time_.looked_up_at_once();
      for (unsigned from = 0; from < warp.count; from += at_once) {
        const unsigned to = std::min<unsigned>(from + at_once, warp.count);
        behaviour_->look_up(warp, from, to, cache_);
        if (counts_ && time_.port.is_on() && filled_.empty())
          did(CropWork::flits, time_.flits_of_reads(warp, from, to, cache_, *behaviour_->surface()));
        for (unsigned line = 0; line < cache_.count; ++line) {
          if (counts_) count(cache_.lines[line]);
          if (memory_.connected()) memory_.move(cache_.lines[line], time_.cache);
        }
        blend(warp, from, to);
      }
    }
    warp.release();
  }

  /// Whether anybody wants to know what the colour cache does.
  bool follows_cache() const { return counts_ || memory_.connected(); }

  BlendOrderMonitor& watch() { return monitor_ ? *monitor_ : begin_to_watch(); }
  [[gnu::noinline]] BlendOrderMonitor& begin_to_watch() {
    const ColorSurface& surface = *behaviour_->surface();
    return monitor_.emplace(surface.width(), surface.height());
  }

  void blend(const ShadedWarp& warp, unsigned from, unsigned to) {
    watch().blended(warp, from, to, 0);
    CropBehaviour::Outcomes outcomes;
    behaviour_->blend_quads(warp, from, to, outcomes);
    if (follows_cache()) {
      SectoredCache* const tags = behaviour_->cache();
      for (unsigned i = from; i < to; ++i) account(warp, i, outcomes[i], tags);
    }
    if (signals_) signal(warp, from, to, outcomes);
  }
  void signal(const ShadedWarp& warp, unsigned from, unsigned to, const CropBehaviour::Outcomes& outcomes) {
    for (unsigned i = from; i < to; ++i) {
      const CropBehaviour::Outcome outcome = outcomes[i];
      if (outcome.terminated == 0) continue;
      TerminationBeat beat;
      beat.count = 1;
      beat.signals[0] = {warp.tile, warp.position[i], outcome.terminated, context_.draw(warp.draw[i]).epoch};
      out_.send(beat);
    }
  }

  void account(const ShadedWarp& warp, unsigned index, const CropBehaviour::Outcome& outcome, SectoredCache* tags) {
    const bool changed = outcome.changed || time_.writes_unchanged;
    if (tags != nullptr && changed) {
      const QuadSectors& quad = time_.sectors_of_quads()[warp.position[index]];
      tags->make_dirty(cache_.line_of[quad.line], quad.sectors);
    }
    if (counts_) count(warp, index, outcome);
  }

  /// What the cache moves in any order: each sector is filled once, though others may go for those that are waited for.
  void count(const CropBehaviour::LineAccess& access) {
    std::uint32_t fills = access.filled;
    std::uint32_t written_back = access.written_back;
    bool fills_line = access.replaced && fills != 0;
    const std::size_t line = line_of(access.address);
    if (!filled_.empty()) {
      std::uint32_t& before = filled_[line];
      fills_line = before == 0 && fills != 0;
      fills &= ~before;
      before |= fills;
      written_back = 0;
    }
    const unsigned filled = popcount(fills);
    const unsigned moved = filled + popcount(written_back);
    did(CropWork::sectors_filled, filled);
    did(CropWork::bytes_moved, std::uint64_t{moved} * time_.cache.sector_bytes);
    did(CropWork::lines_filled, fills_line ? 1 : 0);
    if (!time_.port.is_on()) {
      did(CropWork::sectors, moved);
    } else {
      // In any order each line is asked for once.
      if (!filled_.empty()) did(CropWork::flits, fills_line ? 1 : 0);
      if (written_back != 0) did(CropWork::flits, CropTime::flits_of_writes(1, popcount(written_back)));
    }
  }
  /// A quad that is blended whenever bins are flushed: some of its pixels are not terminated by what was blended before.
  void count(const ShadedWarp& warp, unsigned index, const CropBehaviour::Outcome& outcome) {
    const std::size_t place = behaviour_->surface()->grid().place(warp.tile, warp.position[index]);
    bool is_needed = true;
    if (!terminated_.empty()) {
      LaneMask& before = terminated_[place];
      is_needed = !context_.state(warp.draw[index]).early_termination || (warp.live[index] & ~before) != 0;
      before = static_cast<LaneMask>(before | outcome.terminated);
    }
    if (is_needed) did(CropWork::blend, 1);
  }
  /// Of the surface.
  std::size_t line_of(std::uint64_t address) const {
    return static_cast<std::size_t>((address - behaviour_->surface()->address(0)) / time_.cache.line_bytes);
  }
  static unsigned popcount(std::uint32_t sectors) { return static_cast<unsigned>(__builtin_popcount(sectors)); }

  const RenderContext& context_;
  UntimedOut<TerminationBeat> out_;
  UntimedOut<BlendsDone> out_done_;
  std::unique_ptr<UntimedIn<ShadedWarpItem>> in_;
  std::unique_ptr<UntimedIn<PortReads>> in_reads_;
  std::unique_ptr<CropBehaviour> behaviour_;
  const bool signals_;
  const BarrierPlan barriers_;
  std::optional<BlendOrderMonitor> monitor_;
  CropTime time_;
  UntimedMemoryPort memory_;
  CropBehaviour::CacheLookUp cache_;
  // For `bound`:
  bool counts_ = false;
  std::uint32_t memory_latency_cycles_ = 0;
  std::vector<LaneMask> terminated_;   ///< by quad of the surface; empty if all quads count
  std::vector<std::uint32_t> filled_;  ///< sectors so far, by line of the surface; empty if all that moves counts
};

[[maybe_unused]] const bool crop_untimed_registered = [] {
  register_untimed_unit_maker("crop",
                              [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                 const RenderContext& context, unsigned) -> std::unique_ptr<UntimedUnit> {
                                if (blends_in_shader(*behaviour))
                                  return make_untimed_in_shader_unit(name, std::move(behaviour), context);
                                return std::make_unique<UntimedCrop>(name,
                                                                     behaviour_as<CropBehaviour>(std::move(behaviour)),
                                                                     context);
                              });
  return true;
}();

}  // namespace

}  // namespace vrpipe
