#include <vrpipe/pipeline/slots/crop.h>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

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
