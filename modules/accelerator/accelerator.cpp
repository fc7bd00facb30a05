#include "accelerator/accelerator.h"

#include <algorithm>
#include <numeric>
#include <string>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {
constexpr std::uint64_t most_entries = 0xffffffff;  // as lists number them
constexpr std::uint32_t pixels_of_vector = 8;

std::uint64_t rounded_up(std::uint64_t amount, std::uint64_t rate) { return (amount + rate - 1) / rate; }

std::uint32_t side_within(const Integer& subtile_side, const Integer& tile_side) {
  const std::uint32_t side = subtile_side;
  if (tile_side % side != 0 || side % 4 != 0) {
    throw UserError("cannot divide tiles into sub-tiles", "accelerator.subtile_side_pixels",
                    fmt::format("{} pixels are no multiple of 4 that divides a tile of {}", side, tile_side.value()),
                    "take a side such as 8");
  }
  return side;
}
}  // namespace

TileAcceleratorParameters::TileAcceleratorParameters(const Preset& preset)
    : tile_side_pixels{*this,
                       "tile_side_pixels",
                       preset.tile_side,
                       4,
                       1024,
                       "pixels",
                       preset.flow_source,
                       "of a tile, whose pixels are on chip while its list is drawn"},
      subtile_side_pixels{*this,
                          "subtile_side_pixels",
                          preset.subtile_side,
                          4,
                          1024,
                          "pixels",
                          preset.masks_source,
                          "of a sub-tile, which splats are masked for"},
      masks{*this,
            "masks",
            {"obb", "ellipse"},
            preset.masks,
            preset.masks_source,
            "a splat is in a tile or a sub-tile if this shape touches it: its oriented box at alpha 1/255, or that "
            "ellipse"},
      conversion{*this,
                 "conversion",
                 {"frame", "chunk"},
                 preset.conversion,
                 preset.flow_source,
                 "Gaussians are converted before the first tile, or chunk by chunk, when they are to be drawn"},
      volume_units{
          *this, "volume_units", preset.volume_units, 1,
          1024,  "units",        preset.units_source, "of a core: pixels of a sub-tile that it blends in a cycle"},
      pair_bytes{*this, "pair_bytes", preset.pair_bytes,  0,
                 65536, "bytes",      preset.pair_source, "of a list's entry in memory"},
      area_mm2{*this, "area_mm2", preset.area_mm2, 0, 1e6, "mm2", preset.area_source, "as published; no result"},
      power_watts{*this, "power_watts", preset.power_watts,  0,
                  1e6,   "W",           preset.power_source, "as published; no result"} {}

TileAccelerator::TileAccelerator(const TileAcceleratorParameters& parameters, const RenderContext& context)
    : context_(context),
      width_(context.frame->width()),
      height_(context.frame->height()),
      tile_side_(parameters.tile_side_pixels),
      subtile_side_(side_within(parameters.subtile_side_pixels, parameters.tile_side_pixels)),
      tiles_x_(static_cast<std::uint32_t>(rounded_up(width_, tile_side_))),
      tiles_y_(static_cast<std::uint32_t>(rounded_up(height_, tile_side_))),
      subtiles_side_(tile_side_ / subtile_side_),
      vectors_(std::size_t{subtile_side_} * subtile_side_ / pixels_of_vector),
      touched_tiles_(parameters.masks == 0U ? ListShape::oriented : ListShape::ellipse, width_, height_, tile_side_),
      touched_subtiles_(parameters.masks == 0U ? ListShape::oriented : ListShape::ellipse, width_, height_,
                        subtile_side_),
      conversion_(static_cast<Conversion>(static_cast<unsigned>(parameters.conversion))),
      conversion_units_(parameters.conversion_units),
      conversion_cycles_(parameters.conversion_cycles),
      test_cycles_(parameters.test_cycles),
      chunk_entries_(parameters.chunk_entries),
      quick_sorters_(parameters.quick_sorters),
      quick_ways_(parameters.quick_ways),
      bitonic_sorters_(parameters.bitonic_sorters),
      bitonic_width_(parameters.bitonic_width),
      bitonic_cycles_(parameters.bitonic_cycles),
      volume_cores_(parameters.volume_cores),
      pair_cycles_(rounded_up(std::uint64_t{subtile_side_} * subtile_side_, parameters.volume_units)),
      least_transmittance_(static_cast<float>(static_cast<double>(parameters.least_transmittance))),
      pruning_threshold_(context.frame->draws().empty() ? 0 : context.state(0).pruning_threshold),
      sram_bytes_(std::uint64_t{parameters.sram_kilobytes} * 1024),
      gaussian_bytes_(parameters.gaussian_bytes),
      culled_bytes_(parameters.culled_bytes),
      pair_bytes_(parameters.pair_bytes),
      pixel_bytes_(parameters.pixel_bytes),
      timing_{parameters.frequency_mhz,
              parameters.dram_gigabytes_per_second.thousandths(),
              {parameters.conversion_latency_cycles, parameters.sort_latency_cycles, parameters.volume_latency_cycles},
              parameters.chunk_buffers,
              {"conversion units", "sorters", "volume units"}} {
  const std::size_t subtiles = std::size_t{subtiles_side_} * subtiles_side_;
  pixels_.resize(subtiles * vectors_);
  is_living_.resize(subtiles);
  core_cycles_.resize(volume_cores_);
  records_.reserve(context.frame->splats());
  for (const DrawCall& call : context.frame->draws()) {
    for (std::uint32_t number = call.base; number < call.base + call.splats && !call.geometry->is_mesh(); ++number) {
      records_.push_back(splat_record(call.splat(number)));
    }
  }
}

void TileAccelerator::use_surfaces(Framebuffer& framebuffer) { color_ = &framebuffer.color; }

std::size_t TileAccelerator::subtile_of(std::uint32_t x, std::uint32_t y) const {
  return std::size_t{y - static_cast<std::uint32_t>(subtiles_.y0)} * subtiles_side_ + x -
         static_cast<std::uint32_t>(subtiles_.x0);
}

TileAccelerator::Lists TileAccelerator::make_lists() {
  const Frame& frame = *context_.frame;
  const auto side = static_cast<std::int32_t>(subtiles_side_);
  const PixelRect all{0, 0, static_cast<std::int32_t>(tiles_x_), static_cast<std::int32_t>(tiles_y_)};
  const auto each = [&](const auto& with_splat) {
    for (const DrawCall& call : frame.draws()) {
      for (std::uint32_t splat = call.base; splat < call.base + call.splats; ++splat) {
        if (has_area(call.splat(splat))) with_splat(splat, call.splat(splat));
      }
    }
  };
  Lists lists;
  lists.begin.assign(std::size_t{tiles_x_} * tiles_y_ + 1, 0);
  each([&](std::uint32_t, const Splat& splat) {
    tile_tests += touched_tiles_.visit(splat, all, [&](std::uint32_t x, std::uint32_t y) {
      ++lists.begin[std::size_t{y} * tiles_x_ + x + 1];
      const auto left = static_cast<std::int32_t>(x) * side;
      const auto top = static_cast<std::int32_t>(y) * side;
      touched_subtiles_.visit(splat, {left, top, left + side, top + side},
                              [&](std::uint32_t, std::uint32_t) { ++subtile_pairs; });
    });
  });
  pairs += std::accumulate(lists.begin.begin(), lists.begin.end(), std::uint64_t{0});
  if (pairs.value() > most_entries) {
    throw UserError("cannot list splats by tiles", "accelerator",
                    fmt::format("they make {} pairs, of {} at most", pairs.value(), most_entries),
                    "take a smaller image, or fewer splats");
  }
  for (std::size_t tile = 1; tile < lists.begin.size(); ++tile) lists.begin[tile] += lists.begin[tile - 1];
  lists.splats.resize(lists.begin.back());
  std::vector<std::uint32_t> next = lists.begin;
  each([&](std::uint32_t number, const Splat& splat) {
    touched_tiles_.visit(splat, all, [&](std::uint32_t x, std::uint32_t y) {
      lists.splats[next[std::size_t{y} * tiles_x_ + x]++] = number;
    });
  });
  return lists;
}

/// What precedes every tile. Without it nothing of a list is in memory.
AcceleratorStep TileAccelerator::begin_frame(std::uint64_t gaussians) const {
  const std::uint64_t visible = context_.frame->splats();
  const std::uint64_t all = std::max(gaussians, visible);
  AcceleratorStep step;
  AcceleratorStep::Part& part = step.of(AcceleratorStage::conversion);
  part.items = all;
  part.bytes = pairs.value() * pair_bytes_;
  if (conversion_ == Conversion::frame) {
    part.cycles = rounded_up(all * conversion_cycles_ + tile_tests.value() * test_cycles_, conversion_units_);
    part.bytes += visible * gaussian_bytes_ + (all - visible) * culled_bytes_;
  } else {
    part.cycles = rounded_up(all * conversion_cycles_, conversion_units_);
    part.bytes += all * culled_bytes_;
  }
  return step;
}

std::vector<AcceleratorStep> TileAccelerator::draw(std::optional<std::uint64_t> gaussians) {
  converts_ = gaussians.has_value();
  const Lists lists = make_lists();
  std::vector<AcceleratorStep> steps;
  steps.reserve(lists.begin.size() + lists.splats.size() / chunk_entries_ + 1);
  if (gaussians) {
    steps.push_back(begin_frame(*gaussians));
    if (conversion_ == Conversion::frame) gaussians_converted += context_.frame->splats();
  }
  for (std::uint32_t tile = 0; tile < tiles_x_ * tiles_y_; ++tile) {
    draw_tile(tile, lists.splats.data() + lists.begin[tile], lists.begin[tile + 1] - lists.begin[tile], steps);
  }
  return steps;
}

void TileAccelerator::begin_tile(std::uint32_t tile) {
  const auto side = static_cast<std::int32_t>(subtiles_side_);
  const auto left = static_cast<std::int32_t>(tile % tiles_x_) * side;
  const auto top = static_cast<std::int32_t>(tile / tiles_x_) * side;
  subtiles_ = {left, top, left + side, top + side};
  living_ = 0;
  for (std::uint32_t subtile = 0; subtile < is_living_.size(); ++subtile) {
    const std::uint32_t x0 = (static_cast<std::uint32_t>(left) + subtile % subtiles_side_) * subtile_side_;
    const std::uint32_t y0 = (static_cast<std::uint32_t>(top) + subtile / subtiles_side_) * subtile_side_;
    is_living_[subtile] = x0 < width_ && y0 < height_ ? 1 : 0;
    living_ += is_living_[subtile];
    for (std::size_t vector = 0; vector < vectors_; ++vector) {
      SplatPixels& pixels = pixels_[subtile * vectors_ + vector];
      pixels = SplatPixels{};
      pixels.transmittance = splat_pair(1);
      for (std::uint32_t lane = 0; lane < pixels_of_vector; ++lane) {
        const auto pixel = static_cast<std::uint32_t>(vector) * pixels_of_vector + lane;
        const std::uint32_t x = x0 + pixel % subtile_side_;
        const std::uint32_t y = y0 + pixel / subtile_side_;
        pixels.x[lane] = static_cast<float>(x) + 0.5F;
        pixels.y[lane] = static_cast<float>(y) + 0.5F;
        pixels.alive[lane] = x < width_ && y < height_ ? -1 : 0;
      }
    }
  }
}

void TileAccelerator::draw_tile(std::uint32_t tile, const std::uint32_t* splats, std::uint32_t length,
                                std::vector<AcceleratorStep>& steps) {
  begin_tile(tile);
  chunks += rounded_up(length, chunk_entries_);
  AcceleratorStep step;
  step.of(AcceleratorStage::sorting) = sort_tile(length);
  std::uint32_t next = 0;
  while (next < length && living_ > 0) {
    const std::uint32_t entries = std::min(chunk_entries_, length - next);
    if (converts_ && conversion_ == Conversion::chunk) {
      step.of(
          AcceleratorStage::conversion) = {entries,
                                           rounded_up(entries * (conversion_cycles_ + test_cycles_), conversion_units_),
                                           entries * gaussian_bytes_};
      gaussians_converted += entries;
    }
    const AcceleratorStep::Part sorted = sort_chunk(entries);
    AcceleratorStep::Part& sorting = step.of(AcceleratorStage::sorting);
    sorting.items += sorted.items;
    sorting.cycles += sorted.cycles;
    entries_sorted += entries;
    step.of(AcceleratorStage::rendering) = draw_chunk(splats + next, entries);
    next += entries;
    if (next < length && living_ > 0) {
      steps.push_back(step);
      step = {};
    }
  }
  if (living_ == 0) ++tiles_terminated;
  chunks_skipped += rounded_up(length - next, chunk_entries_);
  const std::uint64_t across = std::min(tile_side_, width_ - tile % tiles_x_ * tile_side_);
  const std::uint64_t down = std::min(tile_side_, height_ - tile / tiles_x_ * tile_side_);
  step.of(AcceleratorStage::rendering).bytes += across * down * pixel_bytes_;
  steps.push_back(step);
  if (color_ != nullptr) store_tile();
}

/// All of a list, into chunks: read from memory, and split by pivots until no part is larger than a chunk.
AcceleratorStep::Part TileAccelerator::sort_tile(std::uint32_t length) {
  std::uint64_t passes = 0;
  for (std::uint64_t sorted = chunk_entries_; sorted < length; sorted *= quick_ways_) ++passes;
  const std::uint64_t bytes = length * pair_bytes_;
  const bool is_spilled = passes > 0 && bytes > sram_bytes_ / 2;
  if (is_spilled) ++lists_spilled;
  return {0, rounded_up(length * passes, quick_sorters_), is_spilled ? bytes * 2 * passes : bytes};
}

AcceleratorStep::Part TileAccelerator::sort_chunk(std::uint32_t length) const {
  std::uint64_t rounds = 1;
  for (std::uint64_t run = 2 * bitonic_width_; run < length; run *= 2) ++rounds;
  return {length, rounded_up(length * rounds * bitonic_cycles_, bitonic_sorters_ * bitonic_width_), 0};
}

AcceleratorStep::Part TileAccelerator::draw_chunk(const std::uint32_t* splats, std::uint32_t length) {
  std::fill(core_cycles_.begin(), core_cycles_.end(), 0);
  std::uint64_t drawn = 0;
  for (std::uint32_t entry = 0; entry < length && living_ > 0; ++entry) {
    ++entries_drawn;
    const SplatRecord& record = records_[splats[entry]];
    const Splat& splat = context_.draw(0).splat(splats[entry]);
    touched_subtiles_.visit(splat, subtiles_, [&](std::uint32_t x, std::uint32_t y) {
      const std::size_t subtile = subtile_of(x, y);
      if (is_living_[subtile] == 0) return;
      ++drawn;
      // Four sub-tiles about a corner are of different cores.
      core_cycles_[(x + 2 * y) % volume_cores_] += pair_cycles_;
      if (draw_in_subtile(record, subtile)) return;
      is_living_[subtile] = 0;
      --living_;
      ++subtiles_terminated;
    });
  }
  subtile_pairs_drawn += drawn;
  return {drawn, *std::max_element(core_cycles_.begin(), core_cycles_.end()), 0};
}

/// Whether any of its pixels takes more.
bool TileAccelerator::draw_in_subtile(const SplatRecord& splat, std::size_t subtile) {
  std::uint64_t blended = 0;
  bool is_living = false;
  for (std::size_t vector = 0; vector < vectors_; ++vector) {
    SplatPixels& pixels = pixels_[subtile * vectors_ + vector];
    if (!any_bit(pixels.alive)) continue;
    fragments_looked_at_ += static_cast<std::uint64_t>(__builtin_popcount(sign_mask(pixels.alive)));
    const SplatAlphas alphas = splat_alphas(splat, pixels, pruning_threshold_);
    if (any_bit(alphas.visible)) {
      fragments_visible_ += static_cast<std::uint64_t>(__builtin_popcount(sign_mask(alphas.visible)));
      const LanePairBits in = blend_splat<StopRule::before>(splat, alphas, least_transmittance_, pixels);
      blended += static_cast<std::uint64_t>(__builtin_popcount(sign_mask(in)));
    }
    is_living = is_living || any_bit(pixels.alive);
  }
  fragments_blended += blended;
  if (blended == 0) ++subtile_pairs_unblended;
  return is_living;
}

void TileAccelerator::add_to(Counts& counts, const CountOf& of) const {
  counts.fragments_rasterized += fragments_looked_at_;
  counts.fragments_shaded += fragments_looked_at_;
  counts.fragments_pruned += fragments_looked_at_ - fragments_visible_;
  counts.fragments_dropped_late += fragments_visible_ - of(fragments_blended);
  counts.fragments_blended += of(fragments_blended);
}

void TileAccelerator::store_tile() const {
  for (std::size_t i = 0; i < pixels_.size() * pixels_of_vector; ++i) {
    const SplatPixels& pixels = pixels_[i / pixels_of_vector];
    const std::size_t lane = i % pixels_of_vector;
    const auto x = static_cast<std::uint32_t>(pixels.x[lane]);
    const auto y = static_cast<std::uint32_t>(pixels.y[lane]);
    if (x < width_ && y < height_) store_pixel(pixels, lane, x, y, *color_);
  }
}

namespace {
TileAcceleratorParameters::Preset gcc_preset() {
  TileAcceleratorParameters::Preset preset;
  preset.tile_side = 128;
  preset.masks = 1;
  preset.conversion = 1;
  preset.pair_bytes = 8;
  preset.area_mm2 = preset.power_watts = 0;
  preset.flow_source = "assumed, after GCC: Gaussian by Gaussian, converted when it is needed";
  preset.masks_source = "assumed, after GCC: where its alpha counts";
  preset.units_source = "assumed: as GSCore";
  preset.pair_source = "assumed: a depth and a number";
  preset.area_source = preset.power_source = "not known here";
  return preset;
}

TileAcceleratorParameters::Preset flicker_preset() {
  TileAcceleratorParameters::Preset preset;
  preset.subtile_side = 4;
  preset.masks = 1;
  preset.volume_units = 8;
  preset.area_mm2 = 3.47;
  preset.power_watts = 0;
  preset.masks_source = "assumed: in the place of FLICKER's tests of what a Gaussian contributes to";
  preset.units_source = "FLICKER: 32; assumed: in 4 cores";
  preset.area_source = "FLICKER: an input";
  preset.power_source = "not known here";
  return preset;
}
}  // namespace

Gscore::Parameters::Parameters() : TileAcceleratorParameters(Preset{}) {}
Gcc::Parameters::Parameters() : TileAcceleratorParameters(gcc_preset()) {}
Flicker::Parameters::Parameters() : TileAcceleratorParameters(flicker_preset()) {}

namespace {
const OutsideSlotRegistrar accelerator_slot("accelerator", 230, "gscore");
const Registrar<Gscore, AcceleratorBehaviour> gscore("accelerator", "gscore",
                                                     "lists by tile, sorted and drawn in chunks by masks of sub-tiles",
                                                     false, Trust::trusted);
const Registrar<Gcc, AcceleratorBehaviour> gcc("accelerator", "gcc",
                                               "Gaussian by Gaussian over large tiles, converted when they are needed",
                                               false, Trust::trusted);
const Registrar<Flicker, AcceleratorBehaviour> flicker("accelerator", "flicker",
                                                       "as gscore, with 32 volume units and masks of 4x4 pixels", false,
                                                       Trust::trusted);
}  // namespace

}  // namespace vrpipe
