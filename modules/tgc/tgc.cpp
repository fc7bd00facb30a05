#include "tgc/tgc.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

TileGridCoalescing::TileGridCoalescing(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      bins_limit_(parameters.bins),
      bin_primitives_(parameters.bin_primitives),
      grid_pixels_(static_cast<std::int32_t>(parameters.grid_tiles * screen_tile_pixels)),
      grids_x_((context.frame->width() + static_cast<std::uint32_t>(grid_pixels_) - 1) /
               static_cast<std::uint32_t>(grid_pixels_)),
      entries_per_cycle_(parameters.entries_per_cycle),
      latency_cycles_(parameters.latency_cycles),
      bins_(bins_limit_),
      eviction_gate_(context, "tgc.eviction") {
  const std::uint32_t grids_y = (context.frame->height() + static_cast<std::uint32_t>(grid_pixels_) - 1) /
                                static_cast<std::uint32_t>(grid_pixels_);
  bin_of_grid_.assign(std::size_t{grids_x_} * grids_y, -1);
  for (std::uint32_t bin = bins_limit_; bin-- > 0;) {
    bins_[bin].primitives.reserve(bin_primitives_);
    free_.push_back(bin);
  }
}

void TileGridCoalescing::begin(const Primitive& primitive) {
  primitive_ = primitive;
  grid_x_begin_ = primitive.bounds.x0 / grid_pixels_;
  grid_x_end_ = (primitive.bounds.x1 - 1) / grid_pixels_ + 1;
  grid_y_ = primitive.bounds.y0 / grid_pixels_;
  grid_y_end_ = (primitive.bounds.y1 - 1) / grid_pixels_ + 1;
  grid_x_ = grid_x_begin_;
  skip_foreign_grids();
}

void TileGridCoalescing::advance() {
  if (++grid_x_ == grid_x_end_) {
    grid_x_ = grid_x_begin_;
    ++grid_y_;
  }
}

PixelRect TileGridCoalescing::area_of_grid(std::int32_t x, std::int32_t y) const {
  return {x * grid_pixels_, y * grid_pixels_, (x + 1) * grid_pixels_, (y + 1) * grid_pixels_};
}

bool TileGridCoalescing::owns_pixels_in_grid() const {
  return context_.placement.owns_any_of(intersection(primitive_.bounds, area_of_grid(grid_x_, grid_y_)));
}

void TileGridCoalescing::skip_foreign_grids() {
  if (context_.placement.gpcs == 1) return;
  while (entering() && !owns_pixels_in_grid()) advance();
}

void TileGridCoalescing::flush_bin(std::uint32_t index, Flush& out) {
  Bin& bin = bins_[index];
  out.clip =
      area_of_grid(static_cast<std::int32_t>(bin.grid % grids_x_), static_cast<std::int32_t>(bin.grid / grids_x_));
  flush_sizes.see(bin.primitives.size());
  out.primitives.clear();
  std::swap(out.primitives, bin.primitives);
  bin_of_grid_[bin.grid] = -1;
  free_.push_back(index);
  ++flushes;
}

bool TileGridCoalescing::step(Flush& out) {
  const std::uint32_t grid = static_cast<std::uint32_t>(grid_y_) * grids_x_ + static_cast<std::uint32_t>(grid_x_);
  std::int32_t index = bin_of_grid_[grid];
  if (index < 0) {
    if (free_.empty() && !eviction_gate_.enter()) {
      free_.push_back(static_cast<std::uint32_t>(bins_.size()));
      bins_.emplace_back();
    }
    if (free_.empty()) {
      const std::uint32_t oldest = allocation_order_.front();
      allocation_order_.pop_front();
      flush_bin(oldest, out);
      ++evictions;
      return true;
    }
    index = static_cast<std::int32_t>(free_.back());
    free_.pop_back();
    bins_[static_cast<std::size_t>(index)].grid = grid;
    bin_of_grid_[grid] = index;
    ++bins_begun;
    allocation_order_.push_back(static_cast<std::uint32_t>(index));
  }
  Bin& bin = bins_[static_cast<std::size_t>(index)];
  bin.primitives.push_back(primitive_);
  ++entries;
  advance();
  skip_foreign_grids();
  if (bin.primitives.size() < bin_primitives_) return false;
  allocation_order_.erase(
      std::find(allocation_order_.begin(), allocation_order_.end(), static_cast<std::uint32_t>(index)));
  flush_bin(static_cast<std::uint32_t>(index), out);
  return true;
}

bool TileGridCoalescing::drain(Flush& out) {
  if (allocation_order_.empty()) return false;
  const std::uint32_t oldest = allocation_order_.front();
  allocation_order_.pop_front();
  flush_bin(oldest, out);
  return true;
}

std::uint64_t TileGridCoalescing::storage_bytes() const {
  constexpr std::uint64_t pointer_bytes = 4;
  constexpr std::uint64_t vertices = 3;
  constexpr std::uint64_t grid_id_bytes = 2;
  return (pointer_bytes * vertices * bin_primitives_ + grid_id_bytes) * bins_limit_;
}

TgcPassThrough::TgcPassThrough(const Parameters&, const RenderContext&) {}

void TgcPassThrough::begin(const Primitive& primitive) {
  primitive_ = primitive;
  pending_ = true;
}

bool TgcPassThrough::step(Flush& out) {
  out.clip = primitive_.bounds;
  out.primitives.assign(1, primitive_);
  pending_ = false;
  return true;
}

namespace {
const SlotRegistrar tgc_slot{{"tgc", 30, "tile-grid-coalescing", "pass-through", false, check_tgc}};
const Registrar<TileGridCoalescing, TgcBehaviour> coalescing("tgc", "tile-grid-coalescing",
                                                             "bins of primitives, one per tile grid (QM)", false,
                                                             Trust::trusted);
const Registrar<TgcPassThrough, TgcBehaviour> pass_through("tgc", "pass-through", "primitives go on one by one", true,
                                                           Trust::trusted);
const EffectRegistrar binning_effect{
    {"tgc",
     "binning",
     "tile-grid-coalescing",
     EffectKind::functional,
     "primitives binned by tile grids (QM): each is set up and rasterised once for each grid",
     "the variant does without, and its TGC passes through",
     "masks of samples outside the grid",
     "in the rasteriser, where less than a primitive's bounds is to be filled",
     {},
     [](const EffectQuestion&) { return EffectDecision::keep("TGC bins primitives"); }}};
const EffectRegistrar eviction_effect{
    {"tgc",
     "eviction",
     "tile-grid-coalescing",
     EffectKind::functional,
     "a bin that goes since another grid needs it",
     "there are as many bins as grids; else until one goes",
     "nothing: bins are kept in order in any case",
     "where no bin is free",
     {},
     [](const EffectQuestion& asked) {
       const auto& tgc = asked.as<TileGridCoalescing::Parameters>();
       const std::uint32_t side = tgc.grid_tiles * screen_tile_pixels;
       const Frame& frame = *asked.context.frame;
       const std::uint32_t grids = ((frame.width() + side - 1) / side) * ((frame.height() + side - 1) / side);
       const std::string numbers = fmt::format("{} tile grid{}, {} bin{}", grids, grids == 1 ? "" : "s",
                                               std::uint32_t{tgc.bins}, tgc.bins == 1 ? "" : "s");
       return grids <= tgc.bins ? EffectDecision::omit(numbers) : EffectDecision::watch(numbers);
     }}};
}  // namespace

}  // namespace vrpipe
