#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/cleared_sectors.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/memory/sectored_cache.h>

namespace vrpipe {

/// A sectored cache in front of a memory port, at `cycle`, for a unit that looks lines up early and uses them once their
/// sectors are there: asks for what is absent, and writes dirty sectors of evicted lines back.
class CachePort {
 public:
  /// A look-up, which is given the first two members and may take several cycles.
  struct LookUp {
    std::uint64_t address = 0;  ///< of the line
    std::uint32_t sectors = 0;  ///< of the line that are needed, a bit each
    SectoredCache::Line line = SectoredCache::no_line;
    std::uint32_t asked_for = 0;  ///< sectors, by this look-up
    bool reads = true;            ///< given as well: else sectors are there without a fill, since they are overwritten
  };

  /// @param mshrs        sectors that are filled at a time
  /// @param longest_run  neighbouring sectors that are asked for in one access, where they are aligned
  CachePort(PortOwner& owner, const std::string& name, unsigned mshrs, MemoryOrigin origin, unsigned longest_run = 1)
      : memory_(owner, name, 2 * mshrs, origin), mshrs_(mshrs), longest_run_(longest_run) {}

  tlm::tlm_initiator_socket<32>& socket() { return memory_.socket; }
  /// Before the first look-up. The statistics outlive it.
  void make_cache(const CacheOrganization& organization, SectoredCacheStatistics& statistics) {
    sectors_of_a_line_ = organization.sectors_of_a_line();
    sector_shift_ = static_cast<unsigned>(__builtin_ctz(organization.sector_bytes));
    cache_.emplace(organization, statistics);
    statistics_ = &statistics;
    has_details_ = statistics.has_details();
    if (has_details_) asked_at_.resize(std::size_t{organization.lines()} * sectors_of_a_line_);
  }
  /// And where it is known what sectors hold that were cleared, which outlives it.
  void know_cleared(ClearedSectors& cleared) { cleared_ = &cleared; }
  SectoredCache& cache() { return *cache_; }
  MemoryPort& memory() { return memory_; }
  const MemoryBytes& moved() const { return memory_.moved(); }
  Cycle next_completion() const { return memory_.next_completion(); }

  /// Takes the sectors that have come; true if there were any.
  bool finish_fills(Cycle now) {
    bool any = false;
    std::uint32_t tag = 0;
    while (memory_.next_completed(tag)) {
      any = true;
      if (tag == write_back_tag) continue;
      if ((tag & ahead_tag) != 0) {
        ahead_done_.push(tag & ~ahead_tag);
        continue;
      }
      const SectoredCache::Line line = tag >> (2 * sector_bits);
      const unsigned first = tag & (sectors_at_most - 1);
      const unsigned count = (tag >> sector_bits & (sectors_at_most - 1)) + 1;
      cache_->finish_fill(line, sector_mask(first, count));
      for (unsigned sector = first; has_details_ && sector < first + count; ++sector)
        statistics_->fill_cycles.see(now - asked_at(line, sector));
      fills_in_flight_ -= count;
    }
    return any;
  }

  /// The common case of a look-up: the line is held, and what is needed is there or on its way. Then it is pinned, and the
  /// look-up done; `no_line` otherwise.
  SectoredCache::Line pin_held(std::uint64_t address, std::uint32_t sectors) {
    if (write_back_ != 0) return SectoredCache::no_line;
    const SectoredCache::Line line = cache_->find(address);
    if (line == SectoredCache::no_line || (sectors & cache_->absent(line)) != 0) return SectoredCache::no_line;
    cache_->pin(line);
    cache_->looked_up(line, sectors);
    return line;
  }
  /// Goes on with a look-up; false while it has to wait: for a line, a miss register, or the memory to take an access. Then
  /// its line is pinned. `moved(sectors)` is called for what it moves.
  template <class Moved>
  bool look_up(LookUp& wanted, Cycle now, Moved&& moved) {
    if (!write_back(moved)) return false;
    if (wanted.line == SectoredCache::no_line && !take_line(wanted)) return false;
    std::uint32_t missing = wanted.sectors & cache_->absent(wanted.line);
    if (cleared_ != nullptr && missing != 0) take_cleared(wanted, missing);
    if (!wanted.reads && missing != 0) {
      cache_->fill_unread(wanted.line, missing);
      missing = 0;
    }
    while (missing != 0) {
      if (!memory_.available() || fills_in_flight_ == mshrs_) return false;
      const SectorRun run = longest_run_ == 1
                                ? take_sector(missing)
                                : take_sector_run(missing, std::min(longest_run_, mshrs_ - fills_in_flight_));
      memory_.read(wanted.address + (std::uint64_t{run.first} << sector_shift_), run.count << sector_shift_,
                   (wanted.line << sector_bits | (run.count - 1)) << sector_bits | run.first);
      const std::uint32_t sectors = sector_mask(run.first, run.count);
      cache_->start_fill(wanted.line, sectors);
      for (unsigned sector = run.first; has_details_ && sector < run.first + run.count; ++sector)
        asked_at(wanted.line, sector) = now;
      wanted.asked_for |= sectors;
      fills_in_flight_ += run.count;
      moved(run.count);
    }
    cache_->looked_up(wanted.line, wanted.sectors);
    return true;
  }
  /// Puts whole sectors of a line in, which are dirty then; what the cache lacks of them is not read. If the line has gone it is
  /// allocated for them, or they are written at once without one. False while it has to wait, as `look_up`.
  template <class Moved>
  bool put(std::uint64_t address, std::uint32_t sectors, bool allocates, Moved&& moved) {
    if (!write_back(moved)) return false;
    LookUp whole{address, sectors, cache_->find(address), 0};
    if (whole.line == SectoredCache::no_line && !allocates) {
      LineAccess gone;
      gone.old_address = address;
      gone.written_back = sectors;
      cache_->count_written_back(sectors);
      evict(gone);
      write_back(moved);
      return true;
    }
    if (whole.line == SectoredCache::no_line) {
      if (!take_line(whole)) return false;
      cache_->unpin(whole.line);
    }
    cache_->make_dirty(whole.line, sectors);
    for (std::uint32_t missing = sectors & cache_->absent(whole.line); missing != 0; missing &= missing - 1) {
      cache_->write(whole.line, static_cast<unsigned>(__builtin_ctz(missing)) << sector_shift_, 1U << sector_shift_);
    }
    return true;
  }
  /// Where tags run ahead of data, who looks up in the cache himself has read what it lacks: for himself, not for a line, which
  /// may go meanwhile. Only while the memory is available; `id`, below 2^31 - 1, comes back from `next_ahead`.
  void read_ahead(std::uint64_t address, unsigned sectors, std::uint32_t id) {
    memory_.read(address, sectors << sector_shift_, ahead_tag | id);
  }
  bool memory_is_available() const { return memory_.available(); }
  bool next_ahead(std::uint32_t& id) {
    if (ahead_done_.empty()) return false;
    id = ahead_done_.front();
    ahead_done_.pop();
    return true;
  }
  /// Of what a look-up needs, what is still on its way.
  std::uint32_t awaited(SectoredCache::Line line, std::uint32_t sectors) const {
    return cache_->filling(line) & sectors;
  }

  /// The same of a line that was evicted past the port; only while nothing waits to be sent.
  void evict(const LineAccess& evicted) {
    write_back_ = evicted.written_back;
    write_back_address_ = evicted.old_address;
    ++lines_moved_.written_back;
    lines_moved_.sectors_written_back += static_cast<unsigned>(__builtin_popcount(evicted.written_back));
    if (cleared_ != nullptr) cleared_->written(evicted.old_address, evicted.written_back);
  }
  /// Sends dirty sectors of an evicted line, as each look-up does that follows the eviction; false while some are left.
  template <class Moved>
  bool write_back(Moved&& moved) {
    while (write_back_ != 0 && memory_.available()) {
      const SectorRun run = take_sector_run(write_back_, sectors_of_a_line_);
      memory_.write(write_back_address_ + (std::uint64_t{run.first} << sector_shift_), run.count << sector_shift_,
                    write_back_tag);
      moved(run.count);
    }
    return write_back_ == 0;
  }
  bool has_written_back() const { return write_back_ == 0; }
  /// Since this was last called: lines of which sectors were written back, and these.
  struct LinesMoved {
    unsigned written_back = 0;
    unsigned sectors_written_back = 0;
  };
  LinesMoved take_lines_moved() { return std::exchange(lines_moved_, {}); }

 private:
  // What a memory access is for: a sector of a line, or nothing that anyone waits for.
  static constexpr std::uint32_t write_back_tag = ~0U;
  static constexpr std::uint32_t ahead_tag = 1U << 31U;
  static constexpr unsigned sector_bits = 5;
  static constexpr unsigned sectors_at_most = 1U << sector_bits;

  /// The cycle in which a sector that is on its way was asked for.
  Cycle& asked_at(SectoredCache::Line line, unsigned sector) {
    return asked_at_[std::size_t{line} * sectors_of_a_line_ + sector];
  }

  void take_cleared(const LookUp& wanted, std::uint32_t& missing) {
    const std::uint32_t known = missing & cleared_->of_line(wanted.address);
    if (known == 0) return;
    cache_->fill_unread(wanted.line, known);
    cleared_->count(known);
    missing &= ~known;
  }
  bool take_line(LookUp& wanted) {
    wanted.line = cache_->find(wanted.address);
    if (wanted.line == SectoredCache::no_line) {
      if (!cache_->can_allocate(wanted.address) || !memory_.available()) return false;
      SectoredCache::Evicted evicted;
      wanted.line = cache_->allocate(wanted.address, evicted);
      write_back_ = evicted.dirty;
      lines_moved_.written_back += evicted.dirty != 0 ? 1U : 0U;
      lines_moved_.sectors_written_back += static_cast<unsigned>(__builtin_popcount(evicted.dirty));
      write_back_address_ = evicted.address;
      if (cleared_ != nullptr && evicted.dirty != 0) cleared_->written(evicted.address, evicted.dirty);
    }
    cache_->pin(wanted.line);
    return true;
  }

  MemoryPort memory_;
  const unsigned mshrs_;
  const unsigned longest_run_;
  std::optional<SectoredCache> cache_;
  SectoredCacheStatistics* statistics_ = nullptr;
  bool has_details_ = true;
  ClearedSectors* cleared_ = nullptr;  ///< where that is known
  std::vector<Cycle> asked_at_;        ///< by sector of the cache
  unsigned sectors_of_a_line_ = 1;
  unsigned sector_shift_ = 0;  ///< log2 of the bytes of a sector
  unsigned fills_in_flight_ = 0;
  std::uint32_t write_back_ = 0;  ///< dirty sectors of an evicted line yet to be sent
  std::uint64_t write_back_address_ = 0;
  LinesMoved lines_moved_;
  Ring<std::uint32_t> ahead_done_;  ///< reads
};

}  // namespace vrpipe
