#pragma once

#include <algorithm>
#include <cstdint>

#include <vrpipe/blend.h>

namespace vrpipe {

// Sectors of a line, a bit each, at most 32.

constexpr std::uint32_t sector_mask(unsigned first, unsigned count) {
  return (count == 32 ? ~0U : (1U << count) - 1) << first;
}

/// Of a quad that begins a line. Quads are naturally aligned, so that another's are these, moved.
/// @param shift log2 of the bytes of a sector
constexpr std::uint32_t sectors_of_quad(ColorFormat format, unsigned shift) {
  return sector_mask(0, ((4 * bytes_per_pixel(format) - 1) >> shift) + 1);
}

struct SectorRun {
  unsigned first;
  unsigned count;
};
/// Takes the first sectors out of a mask that is not 0: neighbours, as many as go in one naturally aligned access of up
/// to `longest`.
inline SectorRun take_sector_run(std::uint32_t& mask, unsigned longest) {
  const auto first = static_cast<unsigned>(__builtin_ctz(mask));
  // Up to four without branches, which would be mispredicted.
  const std::uint32_t from_first = mask >> first;
  const unsigned two = ((from_first >> 1U) & ~first) & 1U;
  const unsigned four = (from_first & 15U) == 15U ? two & ~(first >> 1U) : 0U;
  unsigned count = std::min(1U + two + 2 * four, longest);
  count -= count == 3 ? 1U : 0U;
  while (count >= 4 && 2 * count <= longest && (first & (2 * count - 1)) == 0 &&
         (mask & sector_mask(first, 2 * count)) == sector_mask(first, 2 * count)) {
    count *= 2;
  }
  mask &= ~sector_mask(first, count);
  return {first, count};
}

}  // namespace vrpipe
