#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <vrpipe/memory/cache_organization.h>
#include <vrpipe/memory/cache_statistics.h>
#include <vrpipe/memory/interleaving.h>
#include <vrpipe/memory/sector_history.h>
#include <vrpipe/memory/sectors.h>

namespace vrpipe {

/// The tags of a cache of sectored lines, write-back; data stays elsewhere. A way that is free is taken first, the lowest
/// one; then a line goes that is not pinned, by the replacement policy. If that is one to be kept, the policy chooses
/// again among those that are not, if any is neither kept nor pinned. Sectors of a line are a bit each.
///
/// An access is made in steps by models that follow fills through the cache: find, or can_allocate and allocate; read
/// or write, and start_fill for what they return; pin; looked_up; later finish_fill, make_dirty and unpin. Others call
/// look_up or access, which do it all at once. A line counts as used when it is allocated, when it loses its last pin,
/// and when it is accessed at once; so both ways give the same order while those who pin a line first unpin it first.
class SectoredCache {
 public:
  /// Of each set the one in way 0, then those in way 1, ...
  using Line = std::uint32_t;
  static constexpr Line no_line = ~0U;

  /// What happens in it is counted in `statistics`, which outlive it. Throws UserError for what cannot be.
  SectoredCache(const CacheOrganization& organization, SectoredCacheStatistics& statistics);
  ~SectoredCache();
  SectoredCache(SectoredCache&& other) noexcept;
  SectoredCache& operator=(SectoredCache&&) = delete;

  const CacheOrganization& organization() const { return organization_; }
  /// The set of an address, from 0.
  std::uint32_t set_of(std::uint64_t address) const { return set_of_tag(address >> line_shift_); }

  /// The line that holds the address; `no_line` when none does.
  Line find(std::uint64_t address) const {
    const std::uint64_t tag = address >> line_shift_;
    Line line = chains_[chain_of(tag)];
    while (line != no_line && lines_[line].tag != tag) line = lines_[line].next;
    return line;
  }
  /// Brings what `find` reads of an address to the host's cache. Tags of a large cache are beyond its first ones.
  void prefetch(std::uint64_t address) const {
    const Line line = chains_[chain_of(address >> line_shift_)];
    if (line == no_line) return;
    __builtin_prefetch(&lines_[line]);
    __builtin_prefetch(&links_[line]);
  }
  /// Of a line that is held: the first byte of what it holds.
  std::uint64_t address(Line line) const { return lines_[line].tag << line_shift_; }
  /// The set of a line.
  std::uint32_t set_of_line(Line line) const { return links_[line].set; }
  /// A number that whoever looks lines up keeps with a line; 0 once it is allocated. It comes to the host's cache with the tag.
  std::uint64_t& note(Line line) { return lines_[line].note; }
  /// Whether a line can be had for an address that is not held: its set has one that is free or not pinned.
  bool can_allocate(std::uint64_t address) const { return sets_[set_of(address)].pinned < ways_; }
  /// What a line held before.
  struct Evicted {
    std::uint64_t address = 0;
    std::uint32_t dirty = 0;   ///< to be written back
    std::uint32_t masked = 0;  ///< of these, only the bytes that were written
    bool spared = false;       ///< it went instead of a line that is kept
  };
  /// Takes a line for an address that is not held. Throws std::logic_error if none can be had.
  Line allocate(std::uint64_t address, Evicted& evicted);

  /// Called before a line goes for another.
  void before_eviction(std::function<void()> call) { before_eviction_ = std::move(call); }
  /// Marks a line as one to be kept for as long as it holds the same: it goes only where no other can. Unlike one that
  /// is pinned, which never does.
  void keep(Line line);

  /// Holds a line fast, as one with fills on their way has to be.
  void pin(Line line) {
    Links& links = links_[line];
    if (links.pins++ != 0) return;
    Set& set = sets_[links.set];
    ++set.pinned;
    if (order_ == Order::list) unlink(set, line);
  }
  void unpin(Line line) {
    Links& links = links_[line];
    if (--links.pins != 0) return;
    Set& set = sets_[links.set];
    --set.pinned;
    if (order_ == Order::list) return make_newest(set, line);
    use(line);
  }

  /// As if it was pinned and let go.
  void touch(Line line) {
    if (links_[line].pins == 0) use(line);
  }

  std::uint32_t present(Line line) const { return lines_[line].present; }
  /// Those on their way.
  std::uint32_t filling(Line line) const { return lines_[line].filling; }
  /// Those that nobody waits for: what is written whole while it is on its way is both there and awaited.
  std::uint32_t settled(Line line) const { return lines_[line].present & ~lines_[line].filling; }
  std::uint32_t absent(Line line) const { return ~(lines_[line].present | lines_[line].filling); }
  std::uint32_t dirty(Line line) const { return lines_[line].dirty; }
  /// Sectors to be filled for a read of bytes `first` to `first + bytes` - 1 of a line.
  std::uint32_t read(Line line, unsigned first, unsigned bytes) const;
  /// And for a write, which makes its sectors dirty, and those present that it completes.
  std::uint32_t write(Line line, unsigned first, unsigned bytes);
  void start_fill(Line line, std::uint32_t sectors) {
    Entry& entry = lines_[line];
    entry.filling |= sectors;
    const auto count = static_cast<std::uint32_t>(__builtin_popcount(sectors));
    if (details_) see_filling(count);
    filling_ += count;
    count_misses(line, sectors);
  }
  /// Ends what start_fill began, while the line still holds the same.
  void finish_fill(Line line, std::uint32_t sectors) {
    Entry& entry = lines_[line];
    entry.filling &= ~sectors;
    filling_ -= static_cast<std::uint32_t>(__builtin_popcount(sectors));
    entry.present |= sectors;
  }
  /// Of what `absent` has: it is known what sectors hold, so that they are there without a fill.
  void fill_unread(Line line, std::uint32_t sectors) {
    Entry& entry = lines_[line];
    entry.present |= sectors;
    count_misses(line, sectors);
    not_filled_ += static_cast<unsigned>(__builtin_popcount(sectors));
  }
  void make_dirty(Line line, std::uint32_t sectors) { lines_[line].dirty |= sectors; }
  /// As those of an evicted line; also of one that has gone before its sectors were changed, which are written without it.
  void count_written_back(std::uint32_t sectors) {
    const auto count = static_cast<unsigned>(__builtin_popcount(sectors));
    statistics_->sectors_written_back += count;
    statistics_->bytes_written_back += count * sector_bytes_;
  }
  /// After each access in steps, in their order: finds the causes of its misses.
  void looked_up(Line line, std::uint32_t sectors) {
    if (shadow_ != nullptr) follow(address(line), sectors);
  }
  void looked_up(Line line, unsigned first, unsigned bytes, bool writes) {
    if (shadow_ != nullptr) follow(address(line) + first, bytes, writes);
  }
  /// Sectors missed in the accesses that `accessed` has not ended yet.
  std::uint64_t missed() const { return missed_; }
  /// Ends so many accesses, which need so many sectors: those for which nothing was allocated or missed since the
  /// accesses before were hits.
  [[gnu::always_inline]] void accessed(std::uint64_t accesses, std::uint64_t sectors) {
    statistics_->line_accesses += accesses;
    statistics_->line_hits += accesses - allocated_;
    statistics_->sector_accesses += sectors;
    statistics_->sector_hits += sectors - missed_;
    if (missed_ == 0) {
      allocated_ = 0;
      return;
    }
    statistics_->sector_misses += missed_;
    statistics_->sector_misses_capacity += missed_ - of_other_cause_;
    statistics_->bytes_filled += (missed_ - not_filled_) * sector_bytes_;
    allocated_ = missed_ = of_other_cause_ = not_filled_ = 0;
  }

  /// The same of an access that has found all of its sectors there, where every access is ended at once.
  void hit(std::uint64_t sectors) {
    ++statistics_->line_accesses;
    ++statistics_->line_hits;
    statistics_->sector_accesses += sectors;
    statistics_->sector_hits += sectors;
  }

  /// All at once for sectors of a line (`address`, `sectors` and `known` are given): looks it up, allocates and fills.
  /// `accessed` follows.
  void look_up(LineAccess& access) {
    take_line(access);
    Entry& entry = lines_[access.line];
    access.missed = access.sectors & ~entry.present;
    access.filled = access.missed & ~access.known;
    if (access.missed != 0) {
      entry.present |= access.missed;
      count_misses(access.line, access.missed);
      not_filled_ += static_cast<unsigned>(__builtin_popcount(access.missed & access.known));
    }
    if (shadow_ != nullptr) follow(access.address, access.sectors);
  }
  /// All at once for bytes of a line, as one access, if all of their sectors are there; else nothing, and `access` is to be called.
  /// `sectors` gets those needed. Returns the line, or `no_line`.
  Line hit(std::uint64_t address, std::uint32_t bytes, bool writes, std::uint32_t& sectors) {
    if (shadow_ != nullptr) return no_line;
    const Line line = find(address);
    if (line == no_line) return no_line;
    Entry& entry = lines_[line];
    sectors = touched(static_cast<unsigned>(address) & (organization_.line_bytes - 1), bytes);
    if ((sectors & ~entry.present) != 0) return no_line;
    if (writes) entry.dirty |= sectors;
    use(line);
    hit(static_cast<unsigned>(__builtin_popcount(sectors)));
    return line;
  }
  /// All at once for bytes of a line, as one access.
  LineAccess access(std::uint64_t address, std::uint32_t bytes, bool writes);

  /// Takes all dirty sectors: `write_back(address of the line, sectors)`, by set, then by way.
  template <class WriteBack>
  void flush(WriteBack&& write_back) {
    for (std::uint32_t set = 0; set < sets_.size(); ++set) {
      for (std::uint32_t way = 0; way < ways_; ++way) {
        Entry& entry = lines_[line_of(set, way)];
        if (entry.dirty == 0) continue;
        count_written_back(entry.dirty);
        write_back(entry.tag << line_shift_, entry.dirty);
        entry.dirty = 0;
      }
    }
  }
  /// Forgets what a line holds, which is not pinned; dirty sectors are lost.
  void invalidate(Line line);
  /// And what all hold.
  void invalidate();
  std::uint32_t lines_held() const { return held_; }
  /// Holds what another one of the same organization does, of which no line is pinned or on its way. Nothing is counted.
  void hold_as(const SectoredCache& other);

 private:
  static constexpr std::uint64_t no_tag = ~std::uint64_t{0};
  /// Two in a line of the host's caches.
  struct alignas(32) Entry {
    std::uint64_t tag = no_tag;
    std::uint64_t note = 0;
    std::uint32_t present = 0;
    std::uint32_t filling = 0;
    std::uint32_t dirty = 0;
    Line next = no_line;  ///< of the chain
  };
  /// How it is known which line of a set goes. lru: of many ways by a list, of few by when each was used last, so that a use
  /// touches no other line's place. fifo: by a list.
  enum class Order : std::uint8_t { last_use, list, arrivals, tree, random };
  static constexpr std::uint32_t most_ways_without_list = 32;
  static Order order_of(const CacheOrganization& organization);
  /// Where it stands in its set.
  struct Links {
    Line newer = no_line;
    Line older = no_line;
    std::uint32_t set = 0;
    std::uint32_t pins = 0;
    /// last_use has in place of neighbours: the how manieth use of any line was its last.
    std::uint64_t used() const { return std::uint64_t{older} << 32U | newer; }
    void set_used(std::uint64_t use) {
      newer = static_cast<Line>(use);
      older = static_cast<Line>(use >> 32U);
    }
  };
  struct Set {
    Line newest = no_line;  ///< list: of the lines that are not pinned, by use; arrivals: of all
    Line oldest = no_line;
    std::uint32_t pinned = 0;
    std::uint32_t held = 0;
    std::uint32_t lowest_free = 0;  ///< no way below is free
    std::uint32_t kept = 0;
    std::uint64_t tree = 0;  ///< tree_plru: a bit for each inner node, from 1; set: to the higher ways
  };
  struct Shadow;

  /// Lines that follow one another have neighbouring chains.
  std::size_t chain_of(std::uint64_t tag) const { return (tag ^ tag >> chain_bits_) & last_chain_; }
  std::uint32_t set_of_tag(std::uint64_t tag) const {
    const Interleaving::Share share = interleaving_.share(tag);
    return organization_.hashes_sets ? interleaving_.hashed_place<Interleaving::all_digits>(share) : share.place;
  }
  void take_line(LineAccess& access) {
    access.line = find(access.address);
    access.written_back = 0;
    access.replaced = access.line == no_line;
    if (access.replaced) {
      Evicted evicted;
      access.line = allocate(access.address, evicted);
      access.written_back = evicted.dirty;
      access.old_address = evicted.address;
      access.spared = evicted.spared;
    } else {
      use(access.line);
    }
  }
  Line line_of(std::uint32_t set, std::uint32_t way) const { return way * static_cast<Line>(sets_.size()) + set; }
  std::uint32_t way_of(Line line) const { return line / static_cast<Line>(sets_.size()); }
  /// A line that is not pinned, or no longer.
  void use(Line line) {
    if (order_ == Order::last_use) {
      links_[line].set_used(++uses_);
      return;
    }
    Set& set = sets_[links_[line].set];
    if (order_ == Order::list) {
      if (line == set.newest || links_[line].pins != 0) return;
      unlink(set, line);
      make_newest(set, line);
    } else if (order_ == Order::tree) {
      point_away(set, line);
    }
  }
  void unlink(Set& set, Line line) {
    const Links& links = links_[line];
    (links.newer == no_line ? set.newest : links_[links.newer].older) = links.older;
    (links.older == no_line ? set.oldest : links_[links.older].newer) = links.newer;
  }
  void make_newest(Set& set, Line line) {
    Links& links = links_[line];
    links.newer = no_line;
    links.older = set.newest;
    (set.newest == no_line ? set.oldest : links_[set.newest].newer) = line;
    set.newest = line;
  }
  void point_away(Set& set, Line line);
  Line free_line(std::uint32_t set);
  Line victim(std::uint32_t set);
  bool is_listed() const { return order_ == Order::list || order_ == Order::arrivals; }
  /// By a list or the last uses: of those that can go the one that was used, or arrived, longest ago, or `no_line`.
  template <class CanGo>
  Line first_in_order(std::uint32_t set, CanGo&& can_go) const;
  Line victim_not_kept(std::uint32_t set) const;
  template <class CanGo>
  Line victim_of_tree(std::uint32_t set, CanGo&& can_go) const;
  void take_out(Line line);
  /// Those that bytes `first` to `first + bytes` - 1 of a line lie in.
  std::uint32_t touched(unsigned first, unsigned bytes) const {
    const unsigned from = first >> sector_shift_;
    return sector_mask(from, ((first + bytes - 1) >> sector_shift_) - from + 1);
  }
  std::uint32_t write_masked(Line line, unsigned first, unsigned bytes);
  bool has_byte(Line line, unsigned byte) const;
  bool is_masked() const { return !byte_masks_.empty(); }

  void see_filling(std::uint32_t more) {
    for (std::uint32_t i = 0; i < more; ++i) statistics_->sectors_filling.see(filling_ + i);
  }
  /// Of sectors that are filled.
  void count_misses(Line line, std::uint32_t sectors) {
    missed_ += static_cast<unsigned>(__builtin_popcount(sectors));
    missed_sectors_ |= sectors;
    if (const std::uint32_t first = sectors & ~*seen_[line]; __builtin_expect(first != 0, 0)) {
      fill_for_the_first_time(line, first);
    }
  }
  void fill_for_the_first_time(Line line, std::uint32_t sectors);
  void count_compulsory(std::uint32_t sectors);
  /// Of sectors that are written whole, or masked. `before`: those that were there, to which they are added.
  void count_unfilled(std::uint32_t sectors, std::uint32_t& before);
  void follow(std::uint64_t line_address, std::uint32_t sectors);
  void follow(std::uint64_t address, unsigned bytes, bool writes);
  void find_conflicts(std::uint32_t missed_by_shadow);

  CacheOrganization organization_;
  Order order_;
  std::uint32_t ways_;
  unsigned line_shift_;    ///< log2 of the bytes of a line
  unsigned sector_shift_;  ///< log2 of the bytes of a sector
  unsigned chain_bits_;    ///< log2 of the chains
  std::size_t last_chain_;
  Interleaving interleaving_{1};  ///< of lines, to sets
  std::uint64_t sector_bytes_;
  SectoredCacheStatistics* statistics_;
  bool details_;  ///< of the statistics
  // In the accesses under way:
  std::uint64_t allocated_ = 0;       ///< lines
  std::uint64_t missed_ = 0;          ///< sectors
  std::uint64_t of_other_cause_ = 0;  ///< of these: not for capacity
  std::uint64_t not_filled_ = 0;      ///< of these: since they were written, or are known
  std::uint32_t missed_sectors_ = 0;  ///< of the access under way, where conflicts are told
  std::uint32_t first_time_ = 0;      ///< of these, compulsory
  std::uint64_t evictions_ = 0;       ///< so far, for random replacement
  std::uint64_t uses_ = 0;            ///< so far, by last_use
  std::uint32_t held_ = 0;
  std::uint32_t filling_ = 0;  ///< sectors
  std::vector<Entry> lines_;   ///< of each set that in way 0, in way 1, ...: those of a tile stand beside one another
  std::vector<Links> links_;   ///< the same
  std::vector<std::uint32_t*> seen_;  ///< the same: sectors of what it holds that were there so far
  std::vector<Set> sets_;
  std::vector<Line> chains_;               ///< the first of the lines whose tags hash to a place
  std::vector<bool> kept_;                 ///< by line; empty before the first
  std::vector<std::uint64_t> byte_masks_;  ///< WriteAllocate::byte_mask: bytes that are there, a bit each, by line
  SectorHistory were_there_;               ///< whole sectors
  std::vector<std::uint32_t> everything_ = {~0U};  ///< was there, where nobody wants to know
  SectorHistory were_touched_;                     ///< with byte masks: and those of which bytes were there
  std::function<void()> before_eviction_;          ///< or none
  std::unique_ptr<Shadow> shadow_;                 ///< fully associative, of the same size
};

}  // namespace vrpipe
