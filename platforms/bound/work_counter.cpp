#include "bound/work_counter.h"

#include <algorithm>

#include <vrpipe/pipeline/batch.h>
#include <vrpipe/pipeline/hi_z_plan.h>
#include <vrpipe/pipeline/slots/draw.h>
#include <vrpipe/pipeline/slots/raster.h>
#include <vrpipe/pipeline/slots/sm.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/pipeline/slots/tgc.h>
#include <vrpipe/pipeline/slots/vpo.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

namespace {

std::uint64_t items(const UntimedUnit* unit, unsigned kind) { return unit == nullptr ? 0 : unit->items(kind); }

}  // namespace

/// What survives tests, and the warps of it, in a frame with termination where bins vary.
class WorkCounter::Survivors {
 public:
  Survivors(PhaseBound& bound, const Frame& frame, bool only_needed)
      : work_(bound.work), bound_(bound), frame_(frame), grid_(frame.width(), frame.height()) {
    if (only_needed) terminated_.resize(grid_.quads());
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

  void terminated(const TerminationBeat& beat) {
    for (unsigned i = 0; i < beat.count; ++i) {
      const TerminationSignal& signal = beat.signals[i];
      if (terminated_.empty()) {
        ++work_.updates;
        continue;
      }
      LaneMask& before = terminated_[grid_.place(signal.tile, signal.position)];
      work_.updates += before == 0 ? 1U : 0U;
      before = static_cast<LaneMask>(before | signal.pixels);
    }
  }

 private:
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
  const ScreenTiling grid_;
  std::vector<LaneMask> terminated_;  ///< by quad of the screen; empty if all work counts
  std::uint64_t instructions_ = 0;    ///< of the last warp
  unsigned needed_quads_ = 0;         ///< less than a warp
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
      sm_(gpu.of_slot("sm", gpc)),
      crop_(gpu.of_slot("crop", gpc)) {
  UntimedUnit* const prop = gpu.of_slot("prop", gpc);
  if (crop_ != nullptr) {
    const BoundTerms terms = bound.terms();
    crop_->count_least(terms);
    survivors_ = std::make_unique<Survivors>(bound, configuration.frame(),
                                             configuration.frame().terminates_early() && terms.bins_vary);
    tap<TerminationBeat>(crop_, "out_terminations",
                         [this](const TerminationBeat& beat, UntimedTarget<TerminationBeat>& next) {
                           survivors_->terminated(beat);
                           next.take(beat);
                         });
    tap<BinItem>(prop, "out_survivors", [this](const BinItem& item, UntimedTarget<BinItem>& next) {
      if (item.mark == Mark::none) {
        survivors_->survived(item);
      } else {
        survivors_->passed(item.mark);
      }
      next.take(item);
    });
    tap<Warp>(gpu.of_slot("qru", gpc), "out_warps", [this](const Warp& warp, UntimedTarget<Warp>& next) {
      survivors_->launched(warp);
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
  for (unsigned kind = 0; kind < bound_.work.crop.size(); ++kind)
    bound_.work.crop[kind] = items(crop_, kind) - before_.crop[kind];
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
