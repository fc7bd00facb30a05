#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/units.h>

namespace vrpipe {

/// The colour cache: sectored lines, fully associative; of the lines that no queued quad needs, the one not needed for
/// the longest time goes. Tags only; data stays in the surface.
/// Fully associative since a real GPU's holds its whole size in any shape of rectangles (measured, paper 7.1).
class CropCache {
 public:
  using Line = std::uint32_t;
  static constexpr Line no_line = ~0U;

  struct Sizes {
    std::uint32_t cache_bytes, line_bytes, sector_bytes;
  };
  /// What happens in it is counted in `statistics`, which outlive it.
  CropCache(const Sizes& sizes, std::uint64_t surface_bytes, SectoredCacheStatistics& statistics);

  /// The line that holds the address; `no_line` when none does.
  Line find(std::uint64_t address) const { return line_of_tag_[address >> line_shift_]; }
  /// Whether a line can be had for another address: one is free or not pinned.
  bool can_allocate() const { return used_ < lines_.size() || oldest_ != no_line; }
  /// Takes a line for the address. `evicted_dirty` gets the dirty sectors, a bit each, of the line that went, and
  /// `evicted_address` its byte address.
  Line allocate(std::uint64_t address, unsigned& evicted_dirty, std::uint64_t& evicted_address);

  /// Keeps a line while a queued quad needs it.
  void pin(Line line) {
    if (lines_[line].pins++ == 0) unlink(line);
  }
  void unpin(Line line) {
    if (--lines_[line].pins == 0) make_newest(line);
  }
  // Sectors are a bit each.
  std::uint32_t filling(Line line) const { return lines_[line].filling; }  ///< those on their way
  std::uint32_t absent(Line line) const { return ~(lines_[line].present | lines_[line].filling); }
  void start_fill(Line line, unsigned sector) {
    lines_[line].filling |= 1U << sector;
    count_fills(1);
  }
  void finish_fill(Line line, unsigned sector) {
    lines_[line].filling &= ~(1U << sector);
    lines_[line].present |= 1U << sector;
  }
  void dirty(Line line, std::uint32_t sectors) { lines_[line].dirty |= sectors; }
  /// Ends the accesses of so many quads, which need so many sectors: those for which nothing was allocated or filled
  /// since the accesses before were hits.
  void accessed(std::uint64_t quads, std::uint64_t sectors) {
    statistics_->line_accesses += quads;
    statistics_->line_hits += quads - allocated_;
    statistics_->sector_accesses += sectors;
    statistics_->sector_hits += sectors - asked_for_;
    allocated_ = 0;
    asked_for_ = 0;
  }

  /// All at once for sectors of a line (`address` and `sectors` are given): looks it up, allocates and fills. Lines go
  /// in the same order as with pins, since the line that was looked up the longest ago is the first to lose its last pin.
  /// `accessed` follows.
  void access(CropBehaviour::LineAccess& access) {
    access.line = find(access.address);
    access.written_back = 0;
    access.replaced = access.line == no_line;
    if (access.replaced) {
      access.line = allocate(access.address, access.written_back, access.old_address);
    } else if (access.line != newest_) {
      unlink(access.line);
      make_newest(access.line);
    }
    Entry& entry = lines_[access.line];
    access.filled = access.sectors & ~entry.present;
    entry.present |= access.sectors;
    count_fills(static_cast<unsigned>(__builtin_popcount(access.filled)));
  }

 private:
  struct Entry {
    std::uint64_t tag = 0;
    std::uint32_t present = 0;
    std::uint32_t filling = 0;
    std::uint32_t dirty = 0;
    std::uint32_t pins = 0;
    Line newer = no_line;
    Line older = no_line;
  };
  void count_fills(unsigned sectors) {
    asked_for_ += sectors;
    statistics_->sector_misses += sectors;
    statistics_->bytes_filled += sectors * sector_bytes_;
  }
  void unlink(Line line) {
    const Entry& entry = lines_[line];
    (entry.newer == no_line ? newest_ : lines_[entry.newer].older) = entry.older;
    (entry.older == no_line ? oldest_ : lines_[entry.older].newer) = entry.newer;
  }
  void make_newest(Line line) {
    Entry& entry = lines_[line];
    entry.newer = no_line;
    entry.older = newest_;
    (newest_ == no_line ? oldest_ : lines_[newest_].newer) = line;
    newest_ = line;
  }

  unsigned line_shift_;  ///< log2 of the bytes of a line
  std::uint64_t sector_bytes_;
  SectoredCacheStatistics* statistics_;
  std::uint64_t allocated_ = 0;  ///< lines, in the accesses under way
  std::uint64_t asked_for_ = 0;  ///< sectors to fill, in these
  std::uint32_t used_ = 0;
  Line newest_ = no_line;  ///< of the lines that are not pinned
  Line oldest_ = no_line;
  std::vector<Entry> lines_;
  std::vector<Line> line_of_tag_;
};

/// The cache of a CROP for its surface. Throws UserError for sizes that cannot be.
CropCache make_crop_cache(const CropBehaviour::TimingParameters& timing, const ColorSurface& surface,
                          SectoredCacheStatistics& statistics);

/// Where a quad stands in the modelled memory.
struct QuadSectors {
  std::uint32_t line;     ///< of those of its screen tile, from 0
  std::uint32_t sectors;  ///< of this line, a bit each
};
/// By position in a screen tile; every tile is the same, since they are naturally aligned. For sizes that a cache has.
std::array<QuadSectors, positions_per_tile> sectors_of_quads(const CropBehaviour::TimingParameters& timing,
                                                             const ColorSurface& surface);

}  // namespace vrpipe
