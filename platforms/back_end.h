#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include <vrpipe/batch.h>
#include <vrpipe/order_monitor.h>
#include <vrpipe/platforms/configuration.h>

#include "bound.h"

namespace vrpipe {

/// QRU, SM and CROP of one GPC without time: a tested bin goes in, terminations come out.
class BackEnd {
 public:
  BackEnd(const Configuration& configuration, unsigned gpc, ColorSurface& surface)
      : qru(configuration.make_as<QruBehaviour>("qru", gpc)),
        sm(configuration.make_as<SmBehaviour>("sm", gpc)),
        crop(configuration.make_as<CropBehaviour>("crop", gpc)),
        surface_(surface),
        monitor_(surface.width(), surface.height()) {
    crop->attach(surface);
  }

  /// Takes the survivors of a part of a bin. `signal` is called with each TerminationSignal.
  template <class Signal>
  void take(const QuadBeat& beat, Signal&& signal) {
    Warp warp;
    bool launched = false;
    for (unsigned from = 0; from < beat.count;) {
      from += qru->examine(beat.tile, &beat.quads[from], beat.count - from, warp, launched);
      if (launched) run(warp, signal);
    }
    if (!beat.last_of_bin) return;
    while (qru->finish_bin(warp)) run(warp, signal);
  }

  /// Counts the work from now on, and what the colour cache moves. With `only_needed` that of quads alone whose pixels
  /// are not all terminated by what was blended before: no run is spared these, however early it flushes its bins. With
  /// `any_order` each sector is filled once: in another order of screen tiles the cache may miss it no more often.
  void count_into(Work& work, bool only_needed, bool any_order) {
    work_ = &work;
    if (only_needed) terminated_.resize(surface_.grid().quads());
    if (any_order) filled_.resize(surface_.size_bytes() / crop->cost().line_bytes + 1);
    writes_unchanged_ = crop->cost().writes_unchanged;
    looked_up_at_once_ = quads_looked_up_at_once(crop->cost());
  }

  /// Of the survivors of a part of a bin, those to be counted.
  unsigned count_needed(const QuadBeat& beat) const {
    if (terminated_.empty()) return beat.count;
    const std::size_t tile = surface_.grid().place(beat.tile, 0);
    unsigned count = 0;
    for (unsigned i = 0; i < beat.count; ++i) count += is_needed(tile, beat.quads[i]) ? 1U : 0U;
    return count;
  }

  std::unique_ptr<QruBehaviour> qru;
  std::unique_ptr<SmBehaviour> sm;
  std::unique_ptr<CropBehaviour> crop;

 private:
  template <class Signal>
  void run(const Warp& warp, Signal& signal) {
    // Shading takes longer than the memory does.
    const std::size_t tile = surface_.grid().place(warp.tile, 0);
    for (unsigned i = 0; i < warp.count; ++i) {
      const std::size_t place = tile + warp.quads[i].position;
      __builtin_prefetch(&surface_.quad(place), 1);
      monitor_.prefetch(place);
    }
    sm->shade(warp, shaded_);
    if (work_ == nullptr) return blend(0, shaded_.count, signal);
    count(warp, tile);
    for (unsigned from = 0; from < shaded_.count; from += looked_up_at_once_) {
      const unsigned to = std::min<unsigned>(from + looked_up_at_once_, shaded_.count);
      crop->look_up(shaded_, from, to, cache_);
      for (unsigned line = 0; line < cache_.count; ++line) {
        const CropBehaviour::LineAccess& access = cache_.lines[line];
        count_moves(access);
      }
      blend(from, to, signal);
    }
  }

  template <class Signal>
  void blend(unsigned from, unsigned to, Signal& signal) {
    monitor_.blended(shaded_, from, to, 0);
    CropBehaviour::Outcomes outcomes;
    crop->blend_quads(shaded_, from, to, outcomes);
    for (unsigned i = from; i < to; ++i) {
      const CropBehaviour::Outcome outcome = outcomes[i];
      if (work_ != nullptr && cache_.count > 0 && (outcome.changed || writes_unchanged_)) {
        crop->make_dirty(cache_.lines[cache_.line_of[i]].line, cache_.sectors_of[i]);
      }
      if (work_ != nullptr) count_blend(shaded_, i, outcome.terminated);
      if (outcome.terminated != 0) signal(TerminationSignal{shaded_.tile, shaded_.position[i], outcome.terminated});
    }
  }

  bool is_needed(std::size_t tile, const Quad& quad) const {
    return (quad.coverage & ~terminated_[tile + quad.position]) != 0;
  }

  void count(const Warp& warp, std::size_t tile) {
    if (terminated_.empty()) {
      ++work_->warps;
      work_->merging_warps += warp.merge_pairs != 0 ? 1U : 0U;
      return;
    }
    // In warps that are full: flushed at other times, these quads may find other company.
    for (unsigned i = 0; i < warp.count; ++i) {
      if (!is_needed(tile, warp.quads[i])) continue;
      ++needed_quads_;
      const bool pair = i % 2 == 1 && (warp.merge_pairs >> (i / 2) & 1U) != 0;
      needed_pairs_ += pair && is_needed(tile, warp.quads[i - 1]) ? 1U : 0U;
    }
    work_->warps += needed_quads_ / quads_per_warp;
    needed_quads_ %= quads_per_warp;
    work_->merging_warps += needed_pairs_ / (quads_per_warp / 2);
    needed_pairs_ %= quads_per_warp / 2;
  }

  void count_blend(const ShadedWarp& warp, unsigned index, LaneMask terminated) {
    if (terminated_.empty()) {
      ++work_->color_quads;
      work_->updates += terminated != 0 ? 1U : 0U;
      return;
    }
    LaneMask& before = terminated_[surface_.grid().place(warp.tile, warp.position[index])];
    work_->color_quads += (warp.live[index] & ~before) != 0 ? 1U : 0U;
    work_->updates += before == 0 && terminated != 0 ? 1U : 0U;
    before = static_cast<LaneMask>(before | terminated);
  }

  void count_moves(const CropBehaviour::LineAccess& access) {
    std::uint32_t fills = access.filled;
    std::uint32_t written_back = access.written_back;
    bool fills_line = access.replaced && fills != 0;
    if (!filled_.empty()) {
      std::uint32_t& before = filled_[access.address / crop->cost().line_bytes];
      fills_line = before == 0 && fills != 0;
      fills &= ~before;
      before |= fills;
      written_back = 0;
    }
    work_->sectors += popcount_of(fills) + popcount_of(written_back);
    work_->sectors_filled += popcount_of(fills);
    work_->lines_filled += fills_line ? 1U : 0U;
  }

  static unsigned popcount_of(std::uint32_t mask) {
    unsigned count = 0;
    for (; mask != 0; mask &= mask - 1) ++count;
    return count;
  }

  ShadedWarp shaded_;
  const ColorSurface& surface_;
  BlendOrderMonitor monitor_;
  Work* work_ = nullptr;
  bool writes_unchanged_ = false;
  unsigned looked_up_at_once_ = quads_per_warp;
  CropBehaviour::CacheLookUp cache_;
  std::vector<LaneMask> terminated_;   ///< by quad of the surface; empty if all work counts
  std::vector<std::uint32_t> filled_;  ///< sectors so far, by line of the surface; empty if all moves count
  unsigned needed_quads_ = 0;          ///< less than a warp
  unsigned needed_pairs_ = 0;
};

/// Strict termination where there is time: runs tested bins ahead, in order, on units of its own.
class BinForesight : public TerminationForesight {
 public:
  BinForesight(const Configuration& configuration, unsigned gpc)
      : surface_(configuration.state_of(gpc).draw->width, configuration.state_of(gpc).draw->height,
                 configuration.request().format),
        back_end_(configuration, gpc, surface_) {}

  void bin_tested(TileId tile, const std::vector<Quad>& survivors, std::vector<TerminationSignal>& terminated) override;

 private:
  ColorSurface surface_;
  BackEnd back_end_;
};

}  // namespace vrpipe
