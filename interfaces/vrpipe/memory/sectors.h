#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace vrpipe {

// Sectors of a line, a bit each, at most 32.

/// count: 1 to 32
constexpr std::uint32_t sector_mask(unsigned first, unsigned count) { return ((2U << (count - 1)) - 1) << first; }

struct SectorRun {
  unsigned first = 0;
  unsigned count = 0;
};
/// Of four sectors, by their mask: the first run. A table, since branches would be mispredicted.
inline constexpr std::array<SectorRun, 16> first_run_of_four = [] {
  std::array<SectorRun, 16> runs{};
  for (unsigned mask = 1; mask < 16; ++mask) {
    SectorRun& run = runs[mask];
    while ((mask >> run.first & 1U) == 0) ++run.first;
    const bool two = run.first % 2 == 0 && (mask >> run.first & 3U) == 3;
    run.count = mask == 15 ? 4 : two ? 2 : 1;
  }
  return runs;
}();

/// Takes the first sector out of a mask that is not 0.
inline SectorRun take_sector(std::uint32_t& mask) {
  const auto first = static_cast<unsigned>(__builtin_ctz(mask));
  mask &= mask - 1;
  return {first, 1};
}

/// Takes the first sectors out of a mask that is not 0: neighbours, as many as go in one naturally aligned access of up
/// to `longest`.
inline SectorRun take_sector_run(std::uint32_t& mask, unsigned longest) {
  const unsigned four = static_cast<unsigned>(__builtin_ctz(mask)) & ~3U;
  const SectorRun run = first_run_of_four[mask >> four & 15U];
  const unsigned first = four + run.first;
  unsigned count = std::min(run.count, longest);
  count -= count == 3 ? 1U : 0U;
  if (longest > 4 && count == 4) {
    while (2 * count <= longest && (first & (2 * count - 1)) == 0 &&
           (mask & sector_mask(first, 2 * count)) == sector_mask(first, 2 * count)) {
      count *= 2;
    }
  }
  mask &= ~sector_mask(first, count);
  return {first, count};
}

/// Takes all of a mask: `move(first, count)` for each run.
template <class Move>
void for_each_sector_run(std::uint32_t mask, unsigned longest, Move&& move) {
  while (mask != 0) {
    const SectorRun run = take_sector_run(mask, longest);
    move(run.first, run.count);
  }
}

/// An access to sectors of one line, and what a cache does for it.
struct LineAccess {
  std::uint32_t line = 0;          ///< of the cache, from 0
  std::uint32_t sectors = 0;       ///< of the line that are needed, a bit each
  std::uint32_t known = 0;         ///< of these, not to be read when they are missed
  std::uint32_t missed = 0;        ///< of these, neither there nor on their way
  std::uint32_t filled = 0;        ///< of these, to be read from below
  std::uint32_t filled_first = 0;  ///< of these, no byte was there before; with details of the statistics
  std::uint32_t written_back = 0;  ///< dirty sectors of what the line held
  bool replaced = false;           ///< the line held something else, or nothing, before
  bool spared = false;             ///< and it went instead of one that is kept
  std::uint64_t address = 0;       ///< of the line, bytes
  std::uint64_t old_address = 0;   ///< of what it held
  /// Whether the line is new, or sectors of it are read.
  bool moves() const { return replaced || filled != 0; }
};

}  // namespace vrpipe
