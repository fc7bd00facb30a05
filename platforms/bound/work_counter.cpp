#include "bound/work_counter.h"

#include <algorithm>

#include <vrpipe/pipeline/batch.h>
#include <vrpipe/pipeline/hi_z_plan.h>
#include <vrpipe/pipeline/slots/crop.h>
#include <vrpipe/pipeline/slots/draw.h>
#include <vrpipe/pipeline/slots/raster.h>
#include <vrpipe/pipeline/slots/sm.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/pipeline/slots/tgc.h>
#include <vrpipe/pipeline/slots/vpo.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

namespace {

unsigned bits_of_mask(std::uint32_t mask) {
  unsigned count = 0;
  for (; mask != 0; mask &= mask - 1) ++count;
  return count;
}

std::uint64_t items(const UntimedUnit* unit, unsigned kind) { return unit == nullptr ? 0 : unit->items(kind); }

}  // namespace

/// From the survivors of a test to the colour cache.
class WorkCounter::Blends final : public BlendObserver {
 public:
  Blends(PhaseBound& bound, const Frame& frame, const ColorSurface& surface,
         const CropBehaviour::TimingParameters& crop, bool only_needed, bool any_order)
      : work_(bound.work),
        bound_(bound),
        frame_(frame),
        surface_(surface),
        grid_(surface.grid()),
        line_bytes_(crop.line_bytes) {
    if (only_needed) terminated_.resize(grid_.quads());
    const std::size_t lines = surface.size_bytes() / line_bytes_ + 1;
    if (any_order) filled_.resize(lines);
    if (crop.line_cycles > 0) unpaid_.resize(lines);
  }

  void passed(Mark mark) {
    const Clear* const clear = frame_.clear_of(mark);
    if (clear != nullptr && clear->termination) std::fill(terminated_.begin(), terminated_.end(), LaneMask{0});
  }

  void survived(const BinItem& item) {
    work_.survivors += item.quads;
    if (terminated_.empty() || item.quads == 0) return;
    const std::size_t tile = grid_.place(item.tile, 0);
    for (unsigned i = 0; i < item.quads; ++i) {
      work_.survivors -= is_needed(tile, item.storage->flush.quads[i]) ? 0U : 1U;
    }
  }

  void launched(const Warp& warp) {
    if (warp.mark != Mark::none) return;
    if (terminated_.empty()) {
      ++work_.warps;
      work_.fragment_instructions += instructions_of(warp);
      work_.merging_warps += warp.merge_pairs != 0 ? 1U : 0U;
      return;
    }
    // No warp runs two programs.
    if (const std::uint64_t instructions = instructions_of(warp); instructions != instructions_) {
      instructions_ = instructions;
      needed_quads_ = 0;
    }
    // In warps that are full: flushed at other times, these quads may find other company.
    const std::size_t tile = grid_.place(warp.tile, 0);
    for (unsigned i = 0; i < warp.count; ++i) {
      if (!is_needed(tile, warp.quads[i])) continue;
      ++needed_quads_;
      const bool pair = i % 2 == 1 && (warp.merge_pairs >> (i / 2) & 1U) != 0;
      needed_pairs_ += pair && is_needed(tile, warp.quads[i - 1]) ? 1U : 0U;
    }
    work_.warps += needed_quads_ / quads_per_warp;
    work_.fragment_instructions += needed_quads_ / quads_per_warp * instructions_;
    needed_quads_ %= quads_per_warp;
    work_.merging_warps += needed_pairs_ / (quads_per_warp / 2);
    needed_pairs_ %= quads_per_warp / 2;
  }

  void looked_up(const CropBehaviour::LineAccess& access) override {
    std::uint32_t fills = access.filled;
    std::uint32_t written_back = access.written_back;
    bool fills_line = access.replaced && fills != 0;
    if (!filled_.empty()) {
      std::uint32_t& before = filled_[access.address / line_bytes_];
      fills_line = before == 0 && fills != 0;
      fills &= ~before;
      before |= fills;
      written_back = 0;
    }
    work_.sectors += bits_of_mask(fills) + bits_of_mask(written_back);
    work_.sectors_filled += bits_of_mask(fills);
    work_.lines_filled += fills_line ? 1U : 0U;
    if (unpaid_.empty()) return;
    work_.lines_paid += written_back != 0 ? 1U : 0U;
    if (fills_line) unpaid_[access.address / line_bytes_] = true;
  }

  void blended(const ShadedWarp& warp, unsigned index, const CropBehaviour::Outcome& outcome) override {
    if (!unpaid_.empty()) pay(warp, index, outcome.changed);
    if (terminated_.empty()) {
      ++work_.color_quads;
      work_.updates += outcome.terminated != 0 ? 1U : 0U;
      return;
    }
    LaneMask& before = terminated_[grid_.place(warp.tile, warp.position[index])];
    work_.color_quads += !terminates(warp.draw[index]) || (warp.live[index] & ~before) != 0 ? 1U : 0U;
    work_.updates += before == 0 && outcome.terminated != 0 ? 1U : 0U;
    before = static_cast<LaneMask>(before | outcome.terminated);
  }

 private:
  void pay(const ShadedWarp& warp, unsigned index, bool changed) {
    const std::size_t place = grid_.place(warp.tile, warp.position[index]);
    if (!terminated_.empty() && terminates(warp.draw[index]) && (warp.live[index] & ~terminated_[place]) == 0) return;
    const std::size_t line = surface_.address(place) / line_bytes_;
    work_.lines_paid += unpaid_[line] && changed ? 1U : 0U;
    unpaid_[line] = false;
  }
  bool is_needed(std::size_t tile, const Quad& quad) const {
    return !terminates(quad.draw) || (quad.coverage & ~terminated_[tile + quad.position]) != 0;
  }
  std::uint64_t instructions_of(const Warp& warp) const {
    return bound_.instructions_of(frame_.draw_call(warp.quads[0].draw).state.shader);  // all quads' state
  }
  bool terminates(DrawIndex draw) const { return frame_.draw_call(draw).state.early_termination; }

  Work& work_;
  const PhaseBound& bound_;
  const Frame& frame_;
  const ColorSurface& surface_;
  const ScreenTiling grid_;
  const std::uint32_t line_bytes_;
  std::vector<LaneMask> terminated_;   ///< by quad of the surface; empty if all work counts
  std::vector<std::uint32_t> filled_;  ///< sectors so far, by line of the surface; empty if all moves count
  std::vector<bool> unpaid_;           ///< by line of the surface; empty if lines have no price
  std::uint64_t instructions_ = 0;     ///< of the last warp
  unsigned needed_quads_ = 0;          ///< less than a warp
  unsigned needed_pairs_ = 0;
};

/// Puts a function in the way of what a unit sends; it is given what comes next as well.
template <class Item, class Function>
void WorkCounter::tap(UntimedUnit* unit, const char* port, Function function) {
  struct Made final : UntimedTarget<Item> {
    Made(UntimedTarget<Item>& target, Function call) : next(target), function(call) {}
    void take(const Item& item) override { function(item, next); }
    UntimedTarget<Item>& next;
    Function function;
  };
  if (unit == nullptr || !unit->has_out(port)) return;
  auto* const out = dynamic_cast<UntimedOut<Item>*>(&unit->out(port));
  if (out == nullptr || out->target() == nullptr) return;
  auto made = std::make_shared<Made>(*out->target(), function);
  out->attach(*made);
  taps_.push_back(std::move(made));
}

WorkCounter::WorkCounter(const Configuration& configuration, const UntimedGpu& gpu, unsigned gpc, PhaseBound& bound,
                         OtherSlots& others)
    : bound_(bound),
      others_(others),
      gpc_(gpc),
      counts_late_(!(bound.times_out() && configuration.frame().terminates_early())),
      hides_at_other_times_(bound.times_out() && HiZPlan(configuration.context_of(gpc)).is_used()),
      barriers_(configuration.context_of(0)),
      draw_(gpu.of_slot("draw", gpc)),
      vpo_(gpu.of_slot("vpo", gpc)),
      tgc_(gpu.of_slot("tgc", gpc)),
      raster_(gpu.of_slot("raster", gpc)),
      tc_(gpu.of_slot("tc", gpc)),
      zrop_(gpu.of_slot("zrop", gpc)),
      sm_(gpu.of_slot("sm", gpc)) {
  UntimedUnit* const prop = gpu.of_slot("prop", gpc);
  UntimedUnit* const crop = gpu.of_slot("crop", gpc);
  if (crop != nullptr) {
    const auto* const colors = dynamic_cast<const CropBehaviour*>(&crop->behaviour());
    // A time-out flushes bins when this run does not, and quads of theirs may terminate those that are with them here.
    const bool times_out = bound.times_out();
    // Of lines that go in another order than they are used, which one goes depends on those that are waited for.
    const bool any_line = colors->timing().replacement != Replacement::lru;
    const bool any_order = times_out || bound.tiles_may_overtake() || any_line;
    const bool only_needed = configuration.frame().terminates_early() && times_out;
    blends_ = std::make_unique<Blends>(bound, configuration.frame(), *colors->surface(), colors->timing(), only_needed,
                                       any_order);
    crop->observe(*blends_);
    tap<BinItem>(prop, "out_survivors", [this](const BinItem& item, UntimedTarget<BinItem>& next) {
      if (item.mark == Mark::none) {
        blends_->survived(item);
      } else {
        blends_->passed(item.mark);
      }
      next.take(item);
    });
    tap<Warp>(gpu.of_slot("qru", gpc), "out_warps", [this](const Warp& warp, UntimedTarget<Warp>& next) {
      blends_->launched(warp);
      next.take(warp);
    });
  }
  tap<QuadBeat>(raster_, "out_quads", [this](const QuadBeat& beat, UntimedTarget<QuadBeat>& next) {
    if (beat.count > 0) {
      count_front_end(bound_.work);
      bound_.quad_rasterized();
      others_.quad_rasterized(gpc_);
    }
    next.take(beat);
    if (beat.count > 0) others_.quad_collected(gpc_);
  });
  tap<BinItem>(tc_, "out_bins", [this](const BinItem& item, UntimedTarget<BinItem>& next) {
    next.take(item);
    if (barriers_.is_barrier(item.mark)) {
      end_phase();
      bound_.pass_barrier();
    }
    if (item.mark != Mark::none) return;
    count();
    bound_.quads_ended();
    others_.bin_ended(gpc_);
    if (bound_.phase_is_full()) end_phase();
  });
}

WorkCounter::~WorkCounter() = default;

void WorkCounter::count_front_end(FrontEndWork& work) const {
  work.vertex_warps_issued = items(draw_, DrawWork::warps) - before_.vertex_warps_issued;
  work.vertex_warps = items(sm_, SmWork::vertex) - before_.vertex_warps;
  if (sm_ != nullptr && sm_->memory_port() != nullptr) {
    work.attribute_bytes_written = sm_->memory_port()->moved().written - before_.attribute_bytes_written;
  }
  work.triangles = items(vpo_, VpoWork::triangles) - before_.triangles;
  work.bin_entries = items(tgc_, TgcWork::entries) - before_.bin_entries;
  work.setups = items(raster_, RasterWork::setup) - before_.setups;
  work.coarse_tiles = items(raster_, RasterWork::coarse) - before_.coarse_tiles;
  work.fine_tiles = items(raster_, RasterWork::fine) - before_.fine_tiles;
  work.tile_pairs = items(raster_, RasterWork::pairs) - before_.tile_pairs;
  work.quads_rasterized = items(raster_, RasterWork::quads) - before_.quads_rasterized;
  if (!hides_at_other_times_) return;
  work.fine_tiles = work.tile_pairs = 0;
  work.quads_rasterized = std::min(work.quads_rasterized, std::max(bound_.work.survivors, std::uint64_t{1}));
}

void WorkCounter::count() {
  count_front_end(bound_.work);
  bound_.work.bin_beats = items(tc_, TcWork::beats) - before_.bin_beats;
  bound_.work.quads_tested = items(zrop_, ZropWork::tests) - before_.quads_tested;
  bound_.work.z_lines = bound_.z_lines_of(items(zrop_, ZropWork::lines) - z_lines_before_);
  bound_.work.z_blocks = items(zrop_, ZropWork::blocks) - before_.z_blocks;
  // Where time-outs decide what is flushed, some run may be spared warps of this one.
  if (counts_late_) bound_.work.launches = items(sm_, SmWork::launches) - before_.launches;
  if (counts_late_) bound_.work.late_quads = items(zrop_, ZropWork::late_tests) - before_.late_quads;
  bound_.work.z_sectors = bound_.z_sectors_of(items(zrop_, ZropWork::sectors) - z_sectors_before_);
  if (!hides_at_other_times_) return;
  bound_.work.quads_tested = bound_.work.survivors;
  bound_.work.bin_beats = bound_.work.z_lines = bound_.work.z_blocks = bound_.work.z_sectors = 0;
}

void WorkCounter::end_phase() {
  count();
  before_.add(bound_.work);
  z_sectors_before_ = items(zrop_, ZropWork::sectors);
  z_lines_before_ = items(zrop_, ZropWork::lines);
  bound_.end_phase();
}

}  // namespace vrpipe
