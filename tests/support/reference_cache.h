#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/memory/cache_organization.h>
#include <vrpipe/memory/cache_statistics.h>

namespace vrpipe::testing {

/// A sectored cache by its definition, of single bytes that are there or not. Slow; shares no code with the real one.
class ReferenceCache {
 public:
  explicit ReferenceCache(const CacheOrganization& organization)
      : shape_(organization),
        ways_(organization.ways == 0 ? organization.bytes / organization.line_bytes : organization.ways),
        sets_(organization.bytes / organization.line_bytes / ways_, Set(ways_)) {
    if (sets_.size() == 1) return;
    CacheOrganization of_one_set = organization;
    of_one_set.ways = 0;
    of_one_set.replacement = Replacement::lru;
    ideal_ = std::make_unique<ReferenceCache>(of_one_set);
  }

  struct Outcome {
    std::uint64_t line = 0;  ///< its place, way by way
    bool replaced = false;
    std::set<unsigned> filled, missed, written_back;  ///< sectors
    std::uint64_t old_address = 0;
    bool spared = false;  ///< it went instead of a line that is kept
    bool operator==(const Outcome& other) const {
      return line == other.line && replaced == other.replaced && filled == other.filled &&
             written_back == other.written_back && spared == other.spared &&
             (written_back.empty() || old_address == other.old_address);
    }
  };

  /// Bytes of one line.
  Outcome access(std::uint64_t address, std::uint64_t bytes, bool writes) {
    const Outcome outcome = enter(address, bytes, writes);
    use(address);
    return outcome;
  }
  /// The same, but the line is kept and not used until its last `unpin`.
  Outcome access_and_pin(std::uint64_t address, std::uint64_t bytes, bool writes) {
    const Outcome outcome = enter(address, bytes, writes);
    ++way_of(address)->pins;
    return outcome;
  }
  bool can_take(std::uint64_t address) const {
    const Set& set = sets_[set_of(address)];
    return find(address) != nullptr ||
           std::any_of(set.begin(), set.end(), [](const Way& way) { return way.pins == 0; });
  }
  void unpin(std::uint64_t address) {
    Way* const way = way_of(address);
    if (--way->pins == 0) use(address);
  }
  /// It goes only where its set has no other that can.
  void keep(std::uint64_t address) { way_of(address)->kept = true; }
  void make_dirty(std::uint64_t address, const std::set<unsigned>& sectors) {
    way_of(address)->dirty.insert(sectors.begin(), sectors.end());
  }
  /// Dirty sectors by address of their line, which are clean from now on.
  std::map<std::uint64_t, std::set<unsigned>> flush() {
    std::map<std::uint64_t, std::set<unsigned>> taken;
    for (Set& set : sets_) {
      for (Way& way : set) {
        if (way.dirty.empty()) continue;
        written_back += way.dirty.size();
        taken[*way.address] = std::exchange(way.dirty, {});
      }
    }
    return taken;
  }
  void invalidate(std::uint64_t address) {
    Way* const way = way_of(address);
    if (way != nullptr) *way = Way();
    if (ideal_) ideal_->invalidate(address);
  }
  bool holds(std::uint64_t address) const { return find(address) != nullptr; }

  std::uint64_t line_hits = 0, line_misses = 0, evicted = 0;
  std::uint64_t hits = 0, compulsory = 0, capacity = 0, conflict = 0, filled = 0, written_back = 0;  ///< sectors

  void expect_equal(const SectoredCacheStatistics& actual) const {
    EXPECT_EQ(actual.line_accesses.value(), line_hits + line_misses);
    EXPECT_EQ(actual.line_hits.value(), line_hits);
    EXPECT_EQ(actual.line_misses.value(), line_misses);
    EXPECT_EQ(actual.lines_evicted.value(), evicted);
    EXPECT_EQ(actual.sector_hits.value(), hits);
    EXPECT_EQ(actual.sector_misses_compulsory.value(), compulsory);
    EXPECT_EQ(actual.sector_misses_capacity.value(), capacity);
    EXPECT_EQ(actual.sector_misses_conflict.value(), conflict);
    EXPECT_EQ(actual.sector_misses.value(), compulsory + capacity + conflict);
    EXPECT_EQ(actual.sector_accesses.value(), hits + compulsory + capacity + conflict);
    EXPECT_EQ(actual.sectors_written_back.value(), written_back);
    EXPECT_EQ(actual.bytes_filled.value(), filled * shape_.sector_bytes);
    EXPECT_EQ(actual.bytes_written_back.value(), written_back * shape_.sector_bytes);
  }

 private:
  struct Way {
    std::optional<std::uint64_t> address;
    std::vector<bool> there;  ///< bytes
    std::set<unsigned> dirty;
    unsigned pins = 0;
    bool kept = false;
    std::uint64_t used = 0, allocated = 0;  ///< when
  };
  using Set = std::vector<Way>;

  std::uint64_t line_of(std::uint64_t address) const { return address - address % shape_.line_bytes; }
  std::size_t set_of(std::uint64_t address) const {
    std::uint64_t digits = address / shape_.line_bytes;
    std::uint64_t set = digits % sets_.size();
    if (!shape_.hashes_sets || sets_.size() == 1) return set;
    if ((sets_.size() & (sets_.size() - 1)) != 0) {
      return (set + (mix(digits / sets_.size()) >> 32U) * sets_.size() / (std::uint64_t{1} << 32U)) % sets_.size();
    }
    for (digits /= sets_.size(); digits != 0; digits /= sets_.size()) set ^= digits % sets_.size();
    return set;
  }
  const Way* find(std::uint64_t address) const {
    for (const Way& way : sets_[set_of(address)]) {
      if (way.address == line_of(address)) return &way;
    }
    return nullptr;
  }
  Way* way_of(std::uint64_t address) { return const_cast<Way*>(find(address)); }

  Outcome enter(std::uint64_t address, std::uint64_t bytes, bool writes) {
    Outcome outcome;
    Set& set = sets_[set_of(address)];
    Way* way = way_of(address);
    outcome.replaced = way == nullptr;
    ++(outcome.replaced ? line_misses : line_hits);
    if (way == nullptr) {
      way = &set[room_in(set, set_of(address), outcome.spared)];
      if (way->address) {
        ++evicted;
        written_back += way->dirty.size();
        outcome.written_back = way->dirty;
        outcome.old_address = *way->address;
      }
      *way = {line_of(address), std::vector<bool>(shape_.line_bytes), {}, 0, false, ++time_, time_};
      turn_away(set_of(address), static_cast<std::size_t>(way - set.data()));
    }
    outcome.line = static_cast<std::size_t>(way - set.data()) * sets_.size() + set_of(address);

    std::set<unsigned> of_missed_earlier;
    const std::uint64_t begin = address % shape_.line_bytes;
    for (unsigned sector = 0; sector < shape_.line_bytes / shape_.sector_bytes; ++sector) {
      const std::uint64_t first = std::uint64_t{sector} * shape_.sector_bytes;
      const std::uint64_t last = first + shape_.sector_bytes;
      const std::uint64_t from = std::max(begin, first);
      const std::uint64_t to = std::min(begin + bytes, last);
      if (from >= to) continue;
      std::uint64_t held = 0;
      std::uint64_t wanted = 0;
      for (std::uint64_t byte = first; byte < last; ++byte) {
        held += way->there[byte];
        wanted += byte >= from && byte < to && way->there[byte];
      }
      const bool hit = writes ? held > 0 : wanted == to - from;
      const bool whole = from == first && to == last;
      const bool fills = writes ? !hit && !whole && shape_.write_allocate == WriteAllocate::fill : !hit;
      for (std::uint64_t byte = first; byte < last; ++byte) {
        if (fills || (writes && byte >= from && byte < to)) way->there[byte] = true;
      }
      if (fills) {
        ++filled;
        outcome.filled.insert(sector);
      }
      if (writes) way->dirty.insert(sector);
      const std::uint64_t place = line_of(address) + first;
      if (hit) {
        ++hits;
      } else {
        outcome.missed.insert(sector);
        const bool first_time = writes && !fills ? ever_touched_.count(place) == 0 : ever_whole_.count(place) == 0;
        first_time ? void(++compulsory) : void(of_missed_earlier.insert(sector));
      }
      ever_touched_.insert(place);
      const auto at = way->there.begin() + static_cast<std::ptrdiff_t>(first);
      if (std::all_of(at, at + shape_.sector_bytes, [](bool there) { return there; })) ever_whole_.insert(place);
    }
    std::set<unsigned> ideally = of_missed_earlier;
    if (ideal_) ideally = ideal_->access(address, bytes, writes).missed;
    for (const unsigned sector : of_missed_earlier) ++(ideally.count(sector) > 0 ? capacity : conflict);
    return outcome;
  }

  std::size_t room_in(const Set& set, std::size_t set_number, bool& spared) {
    std::vector<std::size_t> can_go, not_kept;
    for (std::size_t way = 0; way < set.size(); ++way) {
      if (!set[way].address) return way;
      if (set[way].pins != 0) continue;
      can_go.push_back(way);
      if (!set[way].kept) not_kept.push_back(way);
    }
    const std::size_t way = choose(set, set_number, can_go);
    spared = set[way].kept && !not_kept.empty();
    return spared ? choose(set, set_number, not_kept) : way;
  }
  std::size_t choose(const Set& set, std::size_t set_number, const std::vector<std::size_t>& can_go) {
    const auto first_by = [&](std::uint64_t Way::*when) {
      return *std::min_element(can_go.begin(), can_go.end(),
                               [&](std::size_t a, std::size_t b) { return set[a].*when < set[b].*when; });
    };
    switch (shape_.replacement) {
      case Replacement::lru: return first_by(&Way::used);
      case Replacement::fifo: return first_by(&Way::allocated);
      case Replacement::random: return can_go[mix(shape_.random_seed + evicted) % can_go.size()];
      case Replacement::tree_plru: break;
    }
    // Halve the ways, to the side that was not used last, unless all on it are pinned.
    std::size_t from = 0;
    std::size_t count = ways_;
    while (count > 1) {
      count /= 2;
      bool to_upper = upper_is_next_[{set_number, from, count}];
      const auto on_side = [&](std::size_t way) {
        const std::size_t side = from + (to_upper ? count : 0);
        return way >= side && way < side + count;
      };
      if (std::none_of(can_go.begin(), can_go.end(), on_side)) to_upper = !to_upper;
      from += to_upper ? count : 0;
    }
    return from;
  }
  void turn_away(std::size_t set_number, std::size_t way) {
    std::size_t from = 0;
    for (std::size_t count = ways_ / 2; count > 0; count /= 2) {
      const bool is_upper = way >= from + count;
      upper_is_next_[{set_number, from, count}] = !is_upper;
      from += is_upper ? count : 0;
    }
  }
  void use(std::uint64_t address) {
    Way* const way = way_of(address);
    way->used = ++time_;
    turn_away(set_of(address), static_cast<std::size_t>(way - sets_[set_of(address)].data()));
  }

  const CacheOrganization shape_;
  const std::size_t ways_;
  std::vector<Set> sets_;
  std::map<std::tuple<std::size_t, std::size_t, std::size_t>, bool> upper_is_next_;  ///< by set, first way and half
  std::set<std::uint64_t> ever_touched_, ever_whole_;                                ///< sectors
  std::uint64_t time_ = 0;
  std::unique_ptr<ReferenceCache> ideal_;  ///< fully associative, least recently used
};

}  // namespace vrpipe::testing
