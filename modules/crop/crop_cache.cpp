#include "crop/crop_cache.h"
#include "crop/sectors.h"

namespace vrpipe {

CropCache::CropCache(const Sizes& sizes, std::uint64_t surface_bytes, SectoredCacheStatistics& statistics)
    : line_shift_(static_cast<unsigned>(__builtin_ctz(sizes.line_bytes))),
      sector_bytes_(sizes.sector_bytes),
      statistics_(&statistics),
      lines_(sizes.cache_bytes / sizes.line_bytes),
      line_of_tag_((surface_bytes + sizes.line_bytes - 1) / sizes.line_bytes, no_line) {}

CropCache::Line CropCache::allocate(std::uint64_t address, unsigned& evicted_dirty, std::uint64_t& evicted_address) {
  evicted_dirty = 0;
  ++allocated_;
  ++statistics_->line_misses;
  Line line = used_;
  if (used_ < lines_.size()) {
    ++used_;
  } else {
    line = oldest_;
    evicted_dirty = lines_[line].dirty;
    evicted_address = lines_[line].tag << line_shift_;
    const auto sectors = static_cast<unsigned>(__builtin_popcount(evicted_dirty));
    ++statistics_->lines_evicted;
    statistics_->sectors_written_back += sectors;
    statistics_->bytes_written_back += sectors * sector_bytes_;
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

CropCache make_crop_cache(const CropBehaviour::TimingParameters& timing, const ColorSurface& surface,
                          SectoredCacheStatistics& statistics) {
  timing.check_cache(surface.format());
  return {{timing.cache_bytes, timing.line_bytes, timing.sector_bytes}, surface.size_bytes(), statistics};
}

std::array<QuadSectors, positions_per_tile> sectors_of_quads(const CropBehaviour::TimingParameters& timing,
                                                             const ColorSurface& surface) {
  const std::uint32_t bytes_per_quad = 4 * bytes_per_pixel(surface.format());
  std::array<QuadSectors, positions_per_tile> places{};
  for (unsigned position = 0; position < positions_per_tile; ++position) {
    const auto address = static_cast<std::uint32_t>(surface.address({0, 0}, position));
    const std::uint32_t offset = address % timing.line_bytes;
    const std::uint32_t first = offset / timing.sector_bytes;
    const std::uint32_t last = (offset + bytes_per_quad - 1) / timing.sector_bytes;
    places[position] = {address / timing.line_bytes, sector_mask(first, last - first + 1)};
  }
  return places;
}

}  // namespace vrpipe
