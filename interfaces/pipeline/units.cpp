#include <vrpipe/pipeline/units.h>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

std::uint32_t SmBehaviour::TimingParameters::fragment_slots() const {
  const std::uint64_t slots = std::uint64_t{cores} * warps_per_core;
  if (slots > no_slot) {
    throw UserError("unusable SM array", "sm.cores, sm.warps_per_core",
                    fmt::format("{} cores of {} warps are more than {} warps", cores, warps_per_core, no_slot),
                    "lower one of them");
  }
  return static_cast<std::uint32_t>(slots);
}

CacheOrganization CropBehaviour::TimingParameters::cache() const {
  CacheOrganization made;
  made.bytes = cache_bytes;
  made.line_bytes = line_bytes;
  made.sector_bytes = sector_bytes;
  made.ways = ways;
  made.replacement = replacement;
  made.random_seed = random_seed;
  made.hashes_sets = hashes_sets;
  made.tells_conflicts = tells_conflicts;
  return made;
}

void CropBehaviour::TimingParameters::check_cache(ColorFormat format) const {
  cache().check("CROP cache", "crop", "cache_bytes");
  const std::uint32_t quad = 4 * bytes_per_pixel(format);
  if (quad <= line_bytes) return;
  throw UserError("unusable CROP cache", "crop.line_bytes, --format",
                  fmt::format("a quad of {} bytes does not fit into a line of {}", quad, line_bytes),
                  "use longer lines");
}

}  // namespace vrpipe
