#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <vrpipe/component/statistic.h>
#include <vrpipe/memory/cache_organization.h>

namespace vrpipe {

/// Which sectors of a surface are in memory as a fast clear has left them: a cache knows what they hold, and does not read
/// them. A bit for each on the chip, as ATTILA's ROPs have a state for each block.
class ClearedSectors {
 public:
  /// All of them. A surface of whole lines.
  /// @param address   of its first byte, a multiple of a line
  /// @param not_read  counts those that a clear has spared; outlives it
  ClearedSectors(std::uint64_t address, std::uint64_t bytes, const CacheOrganization& cache, Counter& not_read)
      : address_(address),
        line_shift_(static_cast<unsigned>(__builtin_ctz(cache.line_bytes))),
        cleared_(bytes >> line_shift_, all_sectors),
        not_read_(&not_read) {}

  std::uint32_t of_line(std::uint64_t line_address) const { return cleared_[line(line_address)]; }
  /// So many were missed, and need not be read.
  void count(std::uint32_t missed) { *not_read_ += static_cast<unsigned>(__builtin_popcount(missed)); }
  /// Sectors of a line have been written back.
  void written(std::uint64_t line_address, std::uint32_t sectors) { cleared_[line(line_address)] &= ~sectors; }
  /// The surface has been cleared.
  void clear() { std::fill(cleared_.begin(), cleared_.end(), all_sectors); }

 private:
  static constexpr std::uint32_t all_sectors = ~0U;
  std::size_t line(std::uint64_t line_address) const { return (line_address - address_) >> line_shift_; }

  std::uint64_t address_;
  unsigned line_shift_;
  std::vector<std::uint32_t> cleared_;  ///< by line, a bit for each sector
  Counter* not_read_;
};

}  // namespace vrpipe
