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

void CropBehaviour::TimingParameters::check_cache(ColorFormat format) const {
  const auto power_of_two = [](const char* name, std::uint32_t value) {
    if (value != 0 && (value & (value - 1)) == 0) return;
    throw UserError("unusable CROP cache", name, fmt::format("{} is no power of two", value), "use a power of two");
  };
  power_of_two("crop.cache_bytes", cache_bytes);
  power_of_two("crop.line_bytes", line_bytes);
  power_of_two("crop.sector_bytes", sector_bytes);
  const auto at_most = [](const char* names, std::uint32_t part, const char* of, std::uint32_t whole) {
    if (part <= whole) return;
    throw UserError("unusable CROP cache", names, fmt::format("{} bytes do not fit into {} of {}", part, of, whole),
                    "use powers of two: sector <= line <= cache");
  };
  at_most("crop.line_bytes, crop.cache_bytes", line_bytes, "a cache", cache_bytes);
  at_most("crop.sector_bytes, crop.line_bytes", sector_bytes, "a line", line_bytes);
  at_most("crop.line_bytes, --format", 4 * bytes_per_pixel(format), "a line", line_bytes);
  if (line_bytes / sector_bytes > 32) {
    throw UserError("unusable CROP cache", "crop.line_bytes, crop.sector_bytes",
                    fmt::format("a line has {} sectors", line_bytes / sector_bytes), "use at most 32 sectors a line");
  }
}

}  // namespace vrpipe
