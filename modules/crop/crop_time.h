#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "crop_parameters.h"
#include "flit_port.h"

#include <vrpipe/arithmetic/divisor.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/pipeline_stages.h>
#include <vrpipe/kernel/rate.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/pipeline/quad_sectors.h>
#include <vrpipe/pipeline/slots/crop.h>

namespace vrpipe {

/// Of a quad: those of two pixels, one above the other, in which samples live.
constexpr unsigned columns_of(LaneMask live) { return ((live & 5U) != 0 ? 1U : 0U) + ((live & 10U) != 0 ? 1U : 0U); }

/// What CROP's work takes, and when it may be done: stated here alone. The unit of `cycle` asks for each quad in each
/// cycle, that of `lt` for a warp, `bound` for a sum.
///
/// The blender does one thing after the other: quads, and what the colour cache moves. It has `parts_of_a_cycle` in a
/// cycle, of which both are whole numbers. Cycles in which it has nothing to do are lost, fractions of a quad are not.
class CropTime {
 public:
  /// Throws UserError for a cache that cannot be (CacheOrganization::check), or whose lines do not hold a quad.
  CropTime(const CropParameters& parameters, ColorFormat format);

  const CacheOrganization cache;
  const Rate blend_rate;                  ///< of quads, of the format
  const unsigned most_in_a_cycle;         ///< quads looked up or blended
  const std::uint32_t input_quads;        ///< queue between tag look-up and blending
  const std::uint32_t latency_cycles;     ///< of blending, termination test included
  const std::uint32_t mshrs;              ///< sectors in flight
  const bool forwards;                    ///< overlapping quads need not wait for `latency_cycles`
  const bool writes_unchanged;            ///< a blend that changes no value makes its sector dirty all the same
  const std::uint32_t fetch_ahead_quads;  ///< between two looks at tags, if there are two
  const std::int64_t parts_of_a_cycle;

  /// What of the cache a quad needs, by its position in a screen tile.
  const std::array<QuadSectors, positions_per_tile>& sectors_of_quads() const { return sectors_of_quads_; }
  unsigned sectors_of_a_quad() const {
    return static_cast<unsigned>(__builtin_popcount(sectors_of_quads_.front().sectors));
  }

  /// What the cache moves through this, beside the blender; where it is not on, sectors take time of the blender.
  FlitPort port;
  /// Of lines that are written back, and of their sectors.
  static constexpr unsigned flits_of_writes(unsigned lines, unsigned sectors) { return lines + sectors; }
  /// What the cache moves.
  struct Moves {
    unsigned sectors = 0;  ///< filled or written back
    unsigned flits = 0;    ///< of lines written back, and of fetches
    /// Sectors of a line are written back.
    void write(unsigned count) {
      sectors += count;
      flits += flits_of_writes(1, count);
    }
  };
  /// A quad's triangle reads sectors of a line of its screen tile: flits, of which it takes one for all of its quads there.
  unsigned flits_of_read(std::size_t tile, std::uint32_t primitive, unsigned line) {
    if (tile != visit_.tile || primitive != visit_.primitive) visit_ = {tile, primitive, 0};
    const std::uint64_t asks = std::uint64_t{1} << line;
    const bool asked = (visit_.lines & asks) != 0;
    visit_.lines |= asks;
    return asked ? 0 : 1;
  }

  /// A quad that is to be blended.
  struct Quad {
    std::uint64_t line = 0;     ///< its address, or what stands for it
    std::uint32_t sectors = 0;  ///< of the line, a bit each
    std::size_t place = 0;      ///< in the surface's grid
    LaneMask live = 0;
    bool blends = true;  ///< else its colours replace those that are there
  };
  /// What one takes before it is blended, in parts.
  struct Price {
    std::int64_t parts = 0;
    bool joins = false;  ///< the last quads, with which it shares a sector
  };
  /// Nothing but the blender holds it from cycle `ready` on.
  Price price_of(const Quad& quad, Cycle ready) const {
    if (!in_pairs_) return {price_, false};
    // Quads of one cycle share a sector: those that go together take a cycle, or as long as they do one by one.
    const bool joins = ready <= last_blend_ && group_.quads > 0 && group_.quads < most_in_a_cycle &&
                       group_.line == quad.line && group_.sectors == quad.sectors;
    return {joins ? group_.lengthened_by(price_, parts_of_a_cycle) : std::max(parts_of_a_cycle, price_), joins};
  }
  /// Whether there is time for it in a cycle to which the blender is `open`.
  bool is_free(const Price& price, Cycle now) const { return price.parts <= parts_left(now); }
  /// The first cycle from `ready` on in which there is.
  Cycle free_from(const Price& price, Cycle ready) const {
    const std::int64_t end = std::max(done_, earliest(ready)) + price.parts;
    return std::max({ready, last_blend_, cycle_of(end)});
  }
  /// Nothing is done before this cycle any more; returns the parts that are lost for that.
  std::int64_t open(Cycle now) {
    const std::int64_t lost = earliest(now) - done_;
    if (lost <= 0) return 0;
    done_ += lost;
    return lost;
  }
  /// The same where nothing is waited for but quads and their sectors.
  void idle_until(Cycle now) {
    const std::int64_t from = done_;
    if (open(now) > 0 && port.is_on()) keep_idle(from);
  }
  /// It is blended in a cycle in which there is time for it.
  void blend(const Quad& quad, const Price& price, Cycle at) {
    idle_until(at);
    std::int64_t parts = price.parts;
    if (in_pairs_) go_with(quad, price.joins);
    if (column_parts_ > 0 && quad.blends) parts += lengthen(quad, at);
    done_ += parts;
    unpaired_ += parts - price_;
    if (!forwards && quad.blends) in_pipeline_.push({address_of(quad.place), at, quad.live});
    last_blend_ = at;
  }
  /// Whether no quad has another price than its rate's, and none has to wait for another.
  bool quads_are_alike() const { return forwards && !in_pairs_ && column_parts_ == 0; }
  /// Whether that is all that takes time, but for sectors.
  bool is_plain() const { return quads_are_alike() && !port.is_on() && !fetches_ahead(); }
  /// Whether the next quad to be looked up takes a place of its own in a queue, where tags run ahead: in pairs the second of a
  /// sector shares that of the first.
  bool takes_place(std::uint64_t line, std::uint32_t sectors) {
    if (!in_pairs_) return true;
    const bool shares = queued_.line == line && queued_.sectors == sectors && queued_.quads < most_in_a_cycle;
    if (!shares) queued_ = {line, sectors, 0, 0};
    ++queued_.quads;
    return !shares;
  }
  /// Whether a line may go while quads wait to be blended into it.
  bool fetches_ahead() const { return fetch_ahead_quads > 0; }
  Price price() const { return {price_, false}; }
  /// Where quads are alike: what is left of a cycle to which the blender is open, and so many that fit there are blended in it.
  std::int64_t parts_left(Cycle now) const { return parts_until(now + 1) - done_; }
  void blend(unsigned quads, Cycle now) {
    done_ += quads * price_;
    last_blend_ = now;
  }
  /// Or so many from the first cycle on in which there is time; returns the cycles of the first and of the last.
  [[gnu::always_inline]] std::pair<Cycle, Cycle> blend_all(unsigned quads, Cycle ready) {
    const Cycle first = free_from(price(), ready);
    idle_until(first);
    done_ += quads * price_;
    last_blend_ = std::max(first, cycle_of(done_));
    return {first, last_blend_};
  }
  /// Of the last quad; 0 before the first.
  Cycle last_blend() const { return last_blend_; }
  /// The cache moves so many sectors without a port; false if that takes the blender nothing, since the cache is idle
  /// beside a blend of several cycles. `at` does not go back.
  bool move(unsigned sectors, Cycle at) {
    const std::int64_t parts = sectors * sector_price_;
    if (!idle_cache_.empty() && moves_beside(parts, at)) return false;
    open(at);
    done_ += parts;
    return true;
  }
  /// ZROP reads so many flits through the port, one after the other: in a cycle for each nothing is blended. lt is told late of
  /// them; then those take nothing in whose cycles the blender was idle. `at` does not go back.
  void rest(unsigned flits, Cycle at) {
    idle_until(at);
    const std::int64_t from = std::max(earliest(at), reads_until_);
    reads_until_ = from + flits * parts_of_a_cycle;
    done_ += reads_until_ - from;
    for (; !idle_.empty() && idle_.front().from < reads_until_; idle_.pop()) {
      const IdleParts& idle = idle_.front();
      done_ -= std::max<std::int64_t>(std::min(idle.until, reads_until_) - std::max(idle.from, from), 0);
      if (idle.until > reads_until_) break;
    }
  }
  /// From when on no blend of the same pixels is in the pipeline, without forwarding; `now` does not go back.
  Cycle hazard_until(std::size_t place, LaneMask live, Cycle now) {
    while (!in_pipeline_.empty() && in_pipeline_.front().at + latency_cycles <= now) in_pipeline_.pop();
    Cycle until = 0;
    const std::size_t address = address_of(place);
    for (std::size_t i = 0; i < in_pipeline_.size(); ++i) {
      if (in_pipeline_[i].address == address && (in_pipeline_[i].live & live) != 0)
        until = in_pipeline_[i].at + latency_cycles;
    }
    return until;
  }

  /// For CropWork::unpaired: parts beyond their rate's that quads took with which none goes any more. `all`: nor with the last.
  std::int64_t take_unpaired(bool all = false) {
    if (all || !in_pairs_) settled_ += std::exchange(unpaired_, 0);
    return std::exchange(settled_, 0);
  }
  /// Work of which all may begin at once.
  struct Sum {
    std::uint64_t quads = 0;
    std::uint64_t sectors = 0;  ///< moved in the blender's time
    std::uint64_t flits = 0;
    std::uint64_t sectors_filled = 0;  ///< each of which takes a miss register, for as long as the memory's latency
    std::uint64_t lines_filled = 0;    ///< and a line of the cache
    std::uint32_t memory_latency_cycles = 0;
  };
  /// Of quads of a warp that have been looked up.
  unsigned flits_of_reads(const ShadedWarp& warp, unsigned from, unsigned to,
                          const CropBehaviour::CacheLookUp& looked_up, const ColorSurface& surface);
  /// The least that it takes: the resource that has most to do.
  double least_cycles(const Sum& sum) const;
  /// Of signals of termination, beats of them, and of what says that a barrier's blends are done.
  PipelineStages of_terminations() const {
    return PipelineStages::of_latency(latency_cycles, ColorBeat::in_a_cycle(blend_rate));
  }
  PipelineStages of_barriers() const { return PipelineStages::of_latency(latency_cycles); }
  /// The slot's kinds of work.
  std::vector<WorkKind> kinds() const;
  /// Quads of a warp that are looked up before the first of them is blended, where a warp is taken in one piece. Where places
  /// in the queue, lines or miss registers are few, one that is taken a few cycles longer than it need be tells; then quads go one by
  /// one, as they do where a line could go for another one of the same warp.
  unsigned looked_up_at_once() const;

 private:
  /// Whether the cache is idle for so long beside the last blend of several cycles.
  [[gnu::noinline]] bool moves_beside(std::int64_t parts, Cycle at) {
    while (idle_cache_.size() > 1 && idle_cache_[1].at <= at) idle_cache_.pop();
    Idle& idle = idle_cache_.front();
    if (idle.at > at || idle.parts < parts) return false;
    idle.parts -= parts;
    return true;
  }
  /// Up to what is done now. Of a read lt is told before the blender is idle for the 64th time since.
  [[gnu::noinline]] void keep_idle(std::int64_t from) {
    if (!idle_.empty() && idle_.back().until == from) {
      idle_.back().until = done_;
      return;
    }
    if (idle_.size() == 64) idle_.pop();
    idle_.push({from, done_});
  }
  /// In which parts end, of which there is at least one.
  Cycle cycle_of(std::int64_t parts) const {
    return cycles_.quotient_up(static_cast<std::uint64_t>(std::max<std::int64_t>(parts, 1))) - 1;
  }
  std::int64_t parts_until(Cycle cycle) const { return static_cast<std::int64_t>(cycle) * parts_of_a_cycle; }
  /// What is begun in a cycle may take what is left of the one before, if a quad did not fit there.
  std::int64_t earliest(Cycle cycle) const { return parts_until(cycle) - most_kept_; }
  void go_with(const Quad& quad, bool joins) {
    if (!joins) {
      settled_ += std::exchange(unpaired_, 0);
      group_ = {quad.line, quad.sectors, 0, 0};
    }
    ++group_.quads;
    group_.own += price_;
  }
  /// Columns of two pixels with live samples, of which each takes so long: what that is beyond the price.
  std::int64_t lengthen(const Quad& quad, Cycle at) {
    std::int64_t more = columns_of(quad.live) * column_parts_ - price_;
    if (more <= 0) return 0;
    if (in_pairs_) {
      const std::int64_t own = more;
      more = group_.lengthened_by(own, parts_of_a_cycle);
      group_.own += own;
    }
    // Of a move lt is told late: once what is in the queue before its quad has been blended.
    if (idle_cache_.size() > std::max(input_quads, fetch_ahead_quads)) idle_cache_.pop();
    idle_cache_.push({at, more});
    return more;
  }

  struct Group {
    std::uint64_t line = 0;
    std::uint32_t sectors = 0;
    unsigned quads = 0;
    std::int64_t own = 0;  ///< parts that they take one by one
    std::int64_t lengthened_by(std::int64_t more, std::int64_t least) const {
      return std::max(least, own + more) - std::max(least, own);
    }
  };
  struct Blend {
    std::size_t address = 0;  ///< by which hazards are found
    Cycle at = 0;
    LaneMask live = 0;
  };
  struct IdleParts {
    std::int64_t from = 0, until = 0;
  };
  struct Idle {
    Cycle at = 0;            ///< of the blend
    std::int64_t parts = 0;  ///< in which nothing moves
  };
  std::size_t address_of(std::size_t place) const {
    return place & (~std::size_t{positions_per_tile - 1} | hazard_mask_);
  }
  /// A triangle's quads in a screen tile, one after the other.
  struct Visit {
    std::size_t tile = 0;
    std::uint32_t primitive = ~0U;
    std::uint64_t lines = 0;  ///< that it has asked for, a bit each
  };

  std::int64_t price_;            ///< of a quad by its rate
  std::int64_t sector_price_;     ///< of one that moves
  std::int64_t column_parts_;     ///< 0: columns have no price
  bool in_pairs_;                 ///< several quads go in a cycle only if they share a sector
  std::int64_t most_kept_;        ///< of a cycle's parts in the next one
  Divisor cycles_;                ///< of parts
  std::int64_t done_ = 0;         ///< parts from the beginning, those that were lost too
  std::int64_t reads_until_ = 0;  ///< parts
  Ring<IdleParts> idle_;          ///< the last in which the blender did nothing, beside a port
  Ring<Idle> idle_cache_;         ///< by the last blends of several cycles
  Group group_;                   ///< the last quads that go together
  Group queued_;                  ///< of those that were looked up
  Cycle last_blend_ = 0;
  std::int64_t unpaired_ = 0;  ///< parts of the last quads' price beyond their rate's
  std::int64_t settled_ = 0;   ///< and of those before, not tallied yet
  Ring<Blend> in_pipeline_;    ///< without forwarding
  std::size_t hazard_mask_;    ///< of a quad's position
  std::array<QuadSectors, positions_per_tile> sectors_of_quads_{};
  Visit visit_;  ///< the last
};

}  // namespace vrpipe
