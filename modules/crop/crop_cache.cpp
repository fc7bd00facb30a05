#include "crop/crop_cache.h"
#include "crop/sectors.h"

namespace vrpipe {

CropCache::CropCache(std::uint32_t cache_bytes, std::uint32_t line_bytes, std::uint64_t surface_bytes)
    : line_shift_(static_cast<unsigned>(__builtin_ctz(line_bytes))),
      lines_(cache_bytes / line_bytes),
      line_of_tag_((surface_bytes + line_bytes - 1) / line_bytes, no_line) {}

CropCache::Line CropCache::allocate(std::uint64_t address, unsigned& evicted_dirty, std::uint64_t& evicted_address) {
  evicted_dirty = 0;
  Line line = used_;
  if (used_ < lines_.size()) {
    ++used_;
  } else {
    line = oldest_;
    evicted_dirty = lines_[line].dirty;
    evicted_address = lines_[line].tag << line_shift_;
    line_of_tag_[lines_[line].tag] = no_line;
    unlink(line);
  }
  Entry& entry = lines_[line];
  entry.tag = address >> line_shift_;
  entry.present = 0;
  entry.dirty = 0;
  entry.pins = 0;
  line_of_tag_[entry.tag] = line;
  make_newest(line);
  return line;
}

CropCache make_crop_cache(const CropBehaviour::Cost& cost, const ColorSurface& surface) {
  cost.check_cache(surface.format());
  return {cost.cache_bytes, cost.line_bytes, surface.size_bytes()};
}

std::array<QuadSectors, positions_per_tile> sectors_of_quads(const CropBehaviour::Cost& cost,
                                                             const ColorSurface& surface) {
  const std::uint32_t bytes_per_quad = 4 * bytes_per_pixel(surface.format());
  std::array<QuadSectors, positions_per_tile> places{};
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    const auto address = static_cast<std::uint32_t>(surface.address({0, 0}, position));
    const std::uint32_t offset = address % cost.line_bytes;
    const std::uint32_t first = offset / cost.sector_bytes;
    const std::uint32_t last = (offset + bytes_per_quad - 1) / cost.sector_bytes;
    places[position] = {address / cost.line_bytes, sector_mask(first, last - first + 1)};
  }
  return places;
}

}  // namespace vrpipe
