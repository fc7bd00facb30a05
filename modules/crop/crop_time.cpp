#include "crop/crop_time.h"

#include <array>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {
/// Of a position in a screen tile, the bits of its row and of its place in 64 bytes of that.
std::size_t place_in_64_bytes(ColorFormat format) {
  const std::size_t columns = 64 / (2 * bytes_per_pixel(format));
  constexpr std::size_t rows = positions_per_tile - quads_per_tile_row;
  return rows | (std::min<std::size_t>(columns, quads_per_tile_row) - 1);
}
}  // namespace

CropTime::CropTime(const CropParameters& parameters, ColorFormat format)
    : cache(parameters.cache.organization()),
      blend_rate(Rate::of_bytes(parameters.bytes_per_cycle, 4 * bytes_per_pixel(format))),
      most_in_a_cycle(blend_rate.most_in_a_cycle()),
      input_quads(parameters.input_quads),
      latency_cycles(format == ColorFormat::rgba32f && parameters.rgba32f_latency_cycles > 0
                         ? parameters.rgba32f_latency_cycles
                         : parameters.latency_cycles),
      mshrs(parameters.mshrs),
      forwards(parameters.forwarding),
      writes_unchanged(parameters.writes_unchanged),
      fetch_ahead_quads(parameters.fetch_ahead_quads),
      parts_of_a_cycle(std::int64_t{blend_rate.items} * parameters.sectors_per_cycle),
      port(parameters.port_flits_per_cycle, parameters.port_backlog_flits),
      price_(std::int64_t{blend_rate.cycles} * parameters.sectors_per_cycle),
      sector_price_(blend_rate.items),
      column_parts_(format == ColorFormat::rgba32f ? parameters.rgba32f_column_cycles * parts_of_a_cycle : 0),
      in_pairs_(parameters.pairs_in_sector && most_in_a_cycle > 1),
      most_kept_((in_pairs_ ? parts_of_a_cycle : price_) - 1),
      cycles_(static_cast<std::uint64_t>(parts_of_a_cycle)),
      hazard_mask_(parameters.gob_hazards ? place_in_64_bytes(format) : positions_per_tile - 1) {
  cache.check("CROP cache", "crop", "cache_bytes");
  const std::uint32_t quad = 4 * bytes_per_pixel(format);
  if (quad > cache.line_bytes) {
    throw UserError("unusable CROP cache", "crop.line_bytes, --format",
                    fmt::format("a quad of {} bytes does not fit into a line of {}", quad, cache.line_bytes),
                    "use longer lines");
  }
  sectors_of_quads_ = vrpipe::sectors_of_quads(cache, quad, parameters.gob_lines ? TileOrder::gobs : TileOrder::morton);
}

std::vector<WorkKind> CropTime::kinds() const {
  const auto cycles = [this](std::int64_t parts) {
    return static_cast<double>(parts) / static_cast<double>(parts_of_a_cycle);
  };
  return {{"blend", 0, cycles(price_), true},           {"sectors", 0, cycles(sector_price_), false},
          {"forwarding", 0, cycles(1), false},          {"unpaired", 0, cycles(1), false},
          {"flits", 1, port.cycles_of_a_flit(), false}, {"reads", 0, 1, false}};
}

double CropTime::least_cycles(const Sum& sum) const {
  const auto of = [](std::uint64_t items, double cycles) { return static_cast<double>(items) * cycles; };
  // What is under way at the beginning may have been asked for before.
  const auto turns = [&](std::uint64_t fills, std::uint64_t places) {
    return fills <= places ? 0.0 : of(fills - places, sum.memory_latency_cycles / static_cast<double>(places));
  };
  // Ahead of its data, a quad that needs more registers than there are has them all, and lines go while they are filled.
  const std::uint64_t registers = fetches_ahead() ? std::max(mshrs, cache.sectors_of_a_line()) : mshrs;
  const std::vector<WorkKind> kind = kinds();
  return std::max(
      {of(sum.quads, kind[CropWork::blend].cycles_per_item) + of(sum.sectors, kind[CropWork::sectors].cycles_per_item),
       of(sum.flits, kind[CropWork::flits].cycles_per_item), turns(sum.sectors_filled, registers),
       fetches_ahead() ? 0.0 : turns(sum.lines_filled, cache.lines())});
}

unsigned CropTime::flits_of_reads(const ShadedWarp& warp, unsigned from, unsigned to,
                                  const CropBehaviour::CacheLookUp& looked_up, const ColorSurface& surface) {
  const std::size_t tile = surface.grid().place(warp.tile, 0);
  std::array<std::uint32_t, positions_per_tile> lacking{};  // by line of the tile
  for (unsigned i = 0; i < looked_up.count; ++i)
    lacking[sectors_of_quads_[warp.position[looked_up.first_quad[i]]].line] = looked_up.lines[i].filled;
  unsigned flits = 0;
  for (unsigned i = from; i < to; ++i) {
    const QuadSectors& quad = sectors_of_quads_[warp.position[i]];
    std::uint32_t& left = lacking[quad.line];
    if ((left & quad.sectors) == 0) continue;
    left &= ~quad.sectors;
    flits += flits_of_read(tile, warp.first_primitive[i], quad.line);
  }
  return flits;
}

unsigned CropTime::looked_up_at_once() const {
  constexpr std::uint32_t enough = 16 * quads_per_warp;
  const bool roomy = cache.lines() >= enough && input_quads >= 3 * enough && mshrs >= enough;
  const bool keeps_a_warp = cache.replacement == Replacement::lru && (cache.ways == 0 || cache.ways >= quads_per_warp);
  return roomy && keeps_a_warp ? quads_per_warp : 1;
}

}  // namespace vrpipe
