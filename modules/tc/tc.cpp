#include "tc/tc.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

TileCoalescing::TileCoalescing(const Parameters& parameters, const RenderContext& context)
    : bin_quads_(parameters.bin_quads),
      grid_(context.frame->width(), context.frame->height()),
      time_(parameters),
      bins_(parameters.bins),
      bin_of_tile_(grid_.tiles(), -1),
      eviction_gate_(context, "tc.eviction") {
  for (auto bin = static_cast<std::uint32_t>(bins_.size()); bin-- > 0;) {
    bins_[bin].quads.resize(bin_quads_);
    free_.push_back(bin);
  }
}

void TileCoalescing::flush_bin(std::uint32_t index, FlushReason reason, Flush& out) {
  Bin& bin = bins_[index];
  out.tile = bin.tile;
  out.reason = reason;
  flush_sizes.see(bin.count);
  out.quads.assign(bin.quads.begin(), bin.quads.begin() + bin.count);
  bin.count = 0;
  bin_of_tile_[grid_.index(bin.tile)] = -1;
  free_.push_back(index);
  ++flushes;
  switch (reason) {
    case FlushReason::full: ++flushes_full; break;
    case FlushReason::evicted: ++flushes_evicted; break;
    case FlushReason::timed_out: ++flushes_timed_out; break;
    case FlushReason::end_of_draw: ++flushes_end_of_draw; break;
  }
}

void TileCoalescing::flush_full(std::uint32_t bin, Flush& out) {
  allocation_order_.erase(std::find(allocation_order_.begin(), allocation_order_.end(), bin));
  flush_bin(bin, FlushReason::full, out);
}

bool TileCoalescing::begin_bin(TileId tile) {
  if (free_.empty() && !eviction_gate_.enter()) {
    free_.push_back(static_cast<std::uint32_t>(bins_.size()));
    bins_.emplace_back().quads.resize(bin_quads_);
  }
  if (free_.empty()) return false;
  const std::uint32_t bin = free_.back();
  free_.pop_back();
  bins_[bin].tile = tile;
  bin_of_tile_[grid_.index(tile)] = static_cast<std::int32_t>(bin);
  allocation_order_.push_back(bin);
  ++bins_begun;
  return true;
}

unsigned TileCoalescing::insert(const QuadBeat& beat, unsigned from, Flush& out, bool& flushed) {
  flushed = false;
  if (from == beat.count) return 0;
  const std::int32_t& index = bin_of_tile_[grid_.index(beat.tile)];
  if (index < 0 && !begin_bin(beat.tile)) {
    flushed = flush_oldest(FlushReason::evicted, out);
    return 0;
  }
  Bin& bin = bins_[static_cast<std::size_t>(index)];
  const unsigned taken = std::min(bin_quads_ - bin.count, beat.count - from);
  std::copy_n(beat.quads.begin() + from, taken, bin.quads.begin() + bin.count);
  bin.count += taken;
  quads += taken;
  if (bin.count == bin_quads_) {
    flush_full(static_cast<std::uint32_t>(index), out);
    flushed = true;
  }
  return taken;
}

bool TileCoalescing::flush_oldest(FlushReason reason, Flush& out) {
  if (allocation_order_.empty()) return false;
  const std::uint32_t oldest = allocation_order_.front();
  allocation_order_.pop_front();
  flush_bin(oldest, reason, out);
  return true;
}

namespace {
const SlotRegistrar tc_slot{{"tc", 50, "tile-coalescing", "", false, check_tc}};
const Registrar<TileCoalescing, TcBehaviour> registrar("tc", "tile-coalescing", "bins of quads, one per screen tile",
                                                       false, Trust::trusted);
const EffectRegistrar eviction_effect{
    {"tc",
     "eviction",
     "tile-coalescing",
     EffectKind::functional,
     "a bin that goes since another screen tile needs it",
     "primitives touch no more tiles than there are bins; else until one goes",
     "nothing: bins are kept in order in any case",
     "where no bin is free",
     {},
     [](const EffectQuestion& asked) {
       const std::uint32_t bins = asked.as<TileCoalescing::Parameters>().bins;
       const std::uint32_t touched = asked.facts.tiles_touched;
       const std::string numbers =
           fmt::format("primitives touch at most {} of {} tiles; {} bins", touched, asked.facts.tiles, bins);
       return touched <= bins ? EffectDecision::omit(numbers) : EffectDecision::watch(numbers);
     }}};
const EffectRegistrar time_out_effect{
    {"tc",
     "time_out",
     "tile-coalescing",
     EffectKind::functional,
     "bins that go since no quad has come for some time; what they hold depends on time from then on",
     "there is no time-out, or termination is strict, or there is no time; else until one goes",
     "nothing: it takes a comparison to know",
     "where a time-out is due",
     {},
     [](const EffectQuestion& asked) {
       const std::uint32_t cycles = asked.as<TileCoalescing::Parameters>().idle_timeout_cycles;
       if (!asked.has_time) return EffectDecision::omit("there is no time at this fidelity");
       if (asked.context.termination == Termination::strict) return EffectDecision::omit("not in strict termination");
       if (cycles == 0) return EffectDecision::omit("tc.idle_timeout_cycles=0");
       return EffectDecision::watch(fmt::format("{} cycles without a quad", cycles));
     }}};
}  // namespace

}  // namespace vrpipe
