#pragma once

#include <cstdint>

#include <vrpipe/component/statistic.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/ring.h>

namespace vrpipe {

/// What a sectored cache counts. Every access is of one line, and of one or more of its sectors:
///     accesses = hits + misses, of lines and of sectors;
///     sector_misses = compulsory + capacity + conflict.
/// A compulsory miss is of a sector that was never there, or, as a cache with masks of bytes may read it, never wholly.
/// Of the others, a capacity miss is one that a fully associative cache of the same size has too that lets the least
/// recently used line go; the rest are conflicts, which a fully associative cache has none of (Hill, "Aspects of Cache
/// Memory and Instruction Buffer Performance", 1987).
struct SectoredCacheStatistics : StatisticSet {
  /// The part `name` of a component.
  SectoredCacheStatistics(StatisticSet& owner, const char* name) : StatisticSet(owner, name) {}

  /// Causes of misses and distributions, which take the host's time, are not followed. Before the cache is made.
  void leave_out_details() {
    for (Counter* counter : {&sector_misses_compulsory, &sector_misses_capacity, &sector_misses_conflict})
      counter->leave_out();
    for (Histogram* histogram : {&lines_pinned, &fill_cycles, &sectors_filling}) histogram->leave_out();
  }
  bool has_details() const { return !fill_cycles.is_left_out(); }
  /// Sectors of a line, a bit each, have come together.
  void see_fill(std::uint32_t sectors, Cycle took) {
    if (has_details() && sectors != 0) fill_cycles.see(took, static_cast<unsigned>(__builtin_popcount(sectors)));
  }

  Counter line_accesses{*this, "line_accesses", "accesses", "one for each item that needs sectors of a line"};
  Counter line_hits{*this, "line_hits", "accesses", "to a line that is held, its sectors there or not"};
  Counter line_misses{*this, "line_misses", "accesses", "that allocate the line"};
  Counter lines_evicted{*this, "lines_evicted", "lines", "that went for another"};
  Counter sector_accesses{*this, "sector_accesses", "sectors", "needed, by one access each"};
  Counter sector_hits{*this, "sector_hits", "sectors", "needed that are there or on their way"};
  Counter sector_misses{*this, "sector_misses", "sectors", "needed that are neither"};
  Counter sector_misses_compulsory{*this, "sector_misses_compulsory", "sectors", "missed by the first access to them"};
  Counter sector_misses_capacity{*this, "sector_misses_capacity", "sectors",
                                 "missed that a fully associative cache misses too; where that is not looked into, all "
                                 "but compulsory misses"};
  Counter sector_misses_conflict{*this, "sector_misses_conflict", "sectors", "missed because their set was full"};
  Counter sectors_written_back{*this, "sectors_written_back", "sectors",
                               "dirty in evicted lines; those left at the end of the frame stay"};
  Counter bytes_filled{*this, "bytes_filled", "bytes", "read from the memory below"};
  Counter bytes_written_back{*this, "bytes_written_back", "bytes", "written to it"};
  MinMax most_lines_held{*this, MinMax::Of::largest, "most_lines_held", "lines", "at a time"};
  Histogram lines_pinned{*this, Histogram::Buckets::log2(), "lines_pinned", "lines",
                         "of a set that are waited for when another line of it is allocated"};
  /// Both seen by timing models, for each sector.
  Histogram fill_cycles{*this, Histogram::Buckets::log2(), "fill_cycles", "cycles",
                        "from asking for a sector until it is there"};
  Histogram sectors_filling{*this, Histogram::Buckets::log2(), "sectors_filling", "sectors",
                            "of the cache that are on their way when another one is asked for"};
  Ratio line_hit_rate{*this, line_hits, line_accesses, "line_hit_rate", "hits per access", "of accesses"};
  Ratio sector_hit_rate{*this, sector_hits, sector_accesses, "sector_hit_rate", "hits per sector", "of sectors needed"};
  Ratio bytes_per_sector{*this,
                         bytes_filled + bytes_written_back,
                         sector_accesses,
                         "bytes_per_sector",
                         "bytes per sector",
                         "moved for a sector needed"};
};

/// Counts the fills of a cache at `lt`, where memory says at once when a sector is there. Asked for in another
/// order than that of time, as at `lt`, those that have come by a later cycle are no longer on their way in an earlier.
class AnnotatedFillCounter {
 public:
  /// @param statistics  outlive it
  explicit AnnotatedFillCounter(SectoredCacheStatistics& statistics) : statistics_(&statistics) {}

  /// So many sectors, at least 1, are asked for in cycle `at`.
  void ask(std::uint32_t sectors, Cycle at, Cycle there) {
    if (!statistics_->has_details()) return;
    for (; !fills_.empty() && fills_.front().there <= at; fills_.pop()) on_their_way_ -= fills_.front().sectors;
    statistics_->fill_cycles.see(there - at, sectors);
    for (std::uint32_t i = 0; i < sectors; ++i) statistics_->sectors_filling.see(on_their_way_++);
    fills_.push_in_order({there, sectors}, &Fill::there);
  }

 private:
  struct Fill {
    Cycle there = 0;
    std::uint32_t sectors = 0;
  };
  SectoredCacheStatistics* statistics_;
  Ring<Fill> fills_;
  std::uint32_t on_their_way_ = 0;
};

/// What a cache counts that holds whatever was accessed once. Every access is of one or more sectors:
///     accesses = hits + misses.
struct CompulsoryMissStatistics : StatisticSet {
  /// The part `name` of a component.
  CompulsoryMissStatistics(StatisticSet& owner, const char* name) : StatisticSet(owner, name) {}

  void count(bool hit) {
    ++sector_accesses;
    ++(hit ? sector_hits : sector_misses);
  }

  Counter sector_accesses{*this, "sector_accesses", "sectors", "read or written, by one access each"};
  Counter sector_hits{*this, "sector_hits", "sectors", "accessed that are there or on their way"};
  Counter sector_misses{*this, "sector_misses", "sectors", "accessed for the first time"};
  Counter bytes_filled{*this, "bytes_filled", "bytes",
                       "read from the memory below; for a sector that is first written whole none are"};
  Ratio sector_hit_rate{
      *this, sector_hits, sector_accesses, "sector_hit_rate", "hits per sector", "of sectors accessed"};
};

}  // namespace vrpipe
