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
    work_.survivors() += item.quads;
    if (terminated_.empty() || item.quads == 0) return;
    const std::size_t tile = grid_.place(item.tile, 0);
    for (unsigned i = 0; i < item.quads; ++i) {
      work_.survivors() -= is_needed(tile, item.storage->flush.quads[i]) ? 0U : 1U;
    }
  }

  void launched(const Warp& warp) {
    if (warp.mark != Mark::none) return;
    if (terminated_.empty()) {
      add(1, instructions_of(warp), warp.merge_pairs != 0 ? 1U : 0U);
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
    const unsigned warps = needed_quads_ / quads_per_warp;
    add(warps, warps * instructions_, needed_pairs_ / (quads_per_warp / 2));
    needed_quads_ %= quads_per_warp;
    needed_pairs_ %= quads_per_warp / 2;
  }

  void terminated(const TerminationBeat& beat) {
    for (unsigned i = 0; i < beat.count; ++i) {
      const TerminationSignal& signal = beat.signals[i];
      if (terminated_.empty()) {
        ++work_.of[Pipeline::zrop][ZropWork::updates];
        continue;
      }
      LaneMask& before = terminated_[grid_.place(signal.tile, signal.position)];
      work_.of[Pipeline::zrop][ZropWork::updates] += before == 0 ? 1U : 0U;
      before = static_cast<LaneMask>(before | signal.pixels);
    }
  }

 private:
  void add(unsigned warps, std::uint64_t instructions, unsigned merging_warps) {
    work_.warps() += warps;
    work_.of[Pipeline::sm][SmWork::fragment] += instructions;
    work_.of[Pipeline::sm][SmWork::merge] += merging_warps;
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
  const ScreenTiling grid_;
  std::vector<LaneMask> terminated_;  ///< by quad of the screen; empty if all work counts
  std::uint64_t instructions_ = 0;    ///< of the last warp
  unsigned needed_quads_ = 0;         ///< less than a warp
  unsigned needed_pairs_ = 0;
};

/// Puts a function in the way of what a unit sends; it is given what comes next as well.
template <class Item, class Function>
void WorkCounter::tap(Pipeline::Place place, const char* port, Function function) {
  struct Made final : UntimedTarget<Item> {
    Made(UntimedTarget<Item>& target, Function call) : next(target), function(call) {}
    void take(const Item& item) override { function(item, next); }
    UntimedTarget<Item>& next;
    Function function;
  };
  UntimedUnit* const sender = unit(place);
  if (sender == nullptr || !sender->has_out(port)) return;
  auto* const out = dynamic_cast<UntimedOut<Item>*>(&sender->out(port));
  if (out == nullptr || out->target() == nullptr) return;
  auto made = std::make_shared<Made>(*out->target(), function);
  out->attach(*made);
  taps_.push_back(std::move(made));
}

WorkCounter::WorkCounter(const Configuration& configuration, unsigned gpc, PhaseBound& bound, OtherSlots& others)
    : bound_(bound),
      others_(others),
      gpc_(gpc),
      counts_late_(!(bound.terms().bins_vary && configuration.frame().terminates_early())),
      hides_at_other_times_(bound.terms().bins_vary && HiZPlan(configuration.context_of(gpc)).is_used()),
      barriers_(configuration.context_of(0)) {
  if (unit(Pipeline::crop) != nullptr) {
    const BoundTerms& terms = bound.terms();
    unit(Pipeline::crop)->count_least(terms);
    survivors_ = std::make_unique<Survivors>(bound, configuration.frame(),
                                             configuration.frame().terminates_early() && terms.bins_vary);
    tap<TerminationBeat>(Pipeline::crop, "out_terminations",
                         [this](const TerminationBeat& beat, UntimedTarget<TerminationBeat>& next) {
                           survivors_->terminated(beat);
                           next.take(beat);
                         });
    tap<BinItem>(Pipeline::prop, "out_survivors", [this](const BinItem& item, UntimedTarget<BinItem>& next) {
      if (item.mark == Mark::none) {
        survivors_->survived(item);
      } else {
        survivors_->passed(item.mark);
      }
      next.take(item);
    });
    tap<Warp>(Pipeline::qru, "out_warps", [this](const Warp& warp, UntimedTarget<Warp>& next) {
      survivors_->launched(warp);
      next.take(warp);
    });
  }
  tap<QuadBeat>(Pipeline::raster, "out_quads", [this](const QuadBeat& beat, UntimedTarget<QuadBeat>& next) {
    if (beat.count > 0) {
      count_front_end();
      bound_.quad_rasterized();
      others_.quad_rasterized(gpc_);
    }
    next.take(beat);
    if (beat.count > 0) others_.quad_collected(gpc_);
  });
  tap<BinItem>(Pipeline::tc, "out_bins", [this](const BinItem& item, UntimedTarget<BinItem>& next) {
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

std::uint64_t WorkCounter::items(Pipeline::Place place, unsigned kind) const {
  return unit(place) == nullptr ? 0 : unit(place)->items(kind);
}

void WorkCounter::count(Pipeline::Place place, unsigned kind) {
  bound_.work.of[place][kind] = items(place, kind) - before_.of[place][kind];
}

void WorkCounter::count_front_end() {
  Work& work = bound_.work;
  count(Pipeline::draw, DrawWork::warps);
  count(Pipeline::draw, DrawWork::rectangle_warps);
  count(Pipeline::vpo, VpoWork::triangles);
  count(Pipeline::tgc, TgcWork::entries);
  for (unsigned kind = RasterWork::setup; kind <= RasterWork::rectangle_setup; ++kind) count(Pipeline::raster, kind);
  count(Pipeline::sm, SmWork::vertex);
  UntimedUnit* const sm = unit(Pipeline::sm);
  if (sm != nullptr && sm->memory_port() != nullptr) {
    work.attribute_bytes_written = sm->memory_port()->moved().written - before_.attribute_bytes_written;
  }
  if (!hides_at_other_times_) return;
  work.of[Pipeline::raster][RasterWork::fine] = work.of[Pipeline::raster][RasterWork::pairs] = 0;
  work.rasterized() = std::min(work.rasterized(), std::max(work.survivors(), std::uint64_t{1}));
}

void WorkCounter::count() {
  Work& work = bound_.work;
  count_front_end();
  for (unsigned kind = 0; kind < work.of[Pipeline::crop].size(); ++kind) count(Pipeline::crop, kind);
  if (const UntimedUnit* const crop = unit(Pipeline::crop)) crop->leave_out_pending(work.of[Pipeline::crop]);
  count(Pipeline::tc, TcWork::quads);
  count(Pipeline::tc, TcWork::beats);
  count(Pipeline::zrop, ZropWork::tests);
  count(Pipeline::zrop, ZropWork::blocks);
  // Where time-outs decide what is flushed, some run may be spared warps of this one.
  if (counts_late_) count(Pipeline::sm, SmWork::launches);
  if (counts_late_) count(Pipeline::sm, SmWork::visits);
  if (counts_late_) count(Pipeline::zrop, ZropWork::late_tests);
  Work::Items& tests = work.of[Pipeline::zrop];
  tests[ZropWork::sectors] = items(Pipeline::zrop, ZropWork::sectors) - z_sectors_before_;
  if (const UntimedUnit* const zrop = unit(Pipeline::zrop)) zrop->leave_out_pending(tests);
  if (!hides_at_other_times_) return;
  tests[ZropWork::tests] = work.survivors();
  work.of[Pipeline::tc][TcWork::beats] = 0;
  tests[ZropWork::blocks] = tests[ZropWork::sectors] = tests[ZropWork::bytes_moved] = 0;
}

void WorkCounter::end_phase() {
  count();
  before_.add(bound_.work);
  z_sectors_before_ = items(Pipeline::zrop, ZropWork::sectors);
  bound_.end_phase();
}

}  // namespace vrpipe
