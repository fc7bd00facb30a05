#include <vrpipe/memory/sectored_cache.h>

#include <algorithm>
#include <stdexcept>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {

namespace {

unsigned log2_of(std::uint64_t power_of_two) { return static_cast<unsigned>(__builtin_ctzll(power_of_two)); }

unsigned count_of(std::uint32_t sectors) { return static_cast<unsigned>(__builtin_popcount(sectors)); }

/// Bits of the hash for four places a line, so that chains are short.
unsigned chain_bits(std::uint32_t lines) {
  unsigned bits = 2;
  while ((std::uint64_t{1} << bits) < std::uint64_t{4} * lines) ++bits;
  return bits;
}

constexpr unsigned word_bits = 64;
std::size_t mask_words(const CacheOrganization& organization) {
  return (organization.line_bytes + word_bits - 1) / word_bits;
}

}  // namespace

/// What a fully associative cache does with the same accesses.
struct SectoredCache::Shadow {
  explicit Shadow(const CacheOrganization& organization) : cache(organization, statistics) {}
  StatisticSet owner;
  SectoredCacheStatistics statistics{owner, "shadow"};
  SectoredCache cache;
};

SectoredCache::SectoredCache(const CacheOrganization& organization, SectoredCacheStatistics& statistics)
    : organization_(organization), statistics_(&statistics), details_(statistics.has_details()) {
  organization.check("cache", "cache", "bytes");
  order_ = order_of(organization);
  ways_ = organization.ways_of_a_set();
  line_shift_ = log2_of(organization.line_bytes);
  sector_shift_ = log2_of(organization.sector_bytes);
  sector_bytes_ = organization.sector_bytes;
  interleaving_ = Interleaving(organization.sets());
  lines_.resize(organization.lines());
  links_.resize(lines_.size());
  seen_.resize(lines_.size());
  sets_.resize(organization.sets());
  for (std::uint32_t set = 0; set < sets_.size(); ++set) {
    for (std::uint32_t way = 0; way < ways_; ++way) links_[line_of(set, way)].set = set;
  }
  chain_bits_ = chain_bits(organization.lines());
  chains_.assign(std::size_t{1} << chain_bits_, no_line);
  last_chain_ = chains_.size() - 1;
  if (organization.write_allocate == WriteAllocate::byte_mask) {
    byte_masks_.resize(lines_.size() * mask_words(organization));
  }
  if (organization.tells_conflicts && organization.sets() > 1 && details_) {
    CacheOrganization of_one_set = organization;
    of_one_set.ways = 0;
    of_one_set.replacement = Replacement::lru;
    of_one_set.tells_conflicts = false;
    shadow_ = std::make_unique<Shadow>(of_one_set);
  }
}

SectoredCache::~SectoredCache() = default;
SectoredCache::SectoredCache(SectoredCache&& other) noexcept = default;

SectoredCache::Line SectoredCache::allocate(std::uint64_t address, Evicted& evicted) {
  const std::uint64_t tag = address >> line_shift_;
  const std::uint32_t index = set_of_tag(tag);
  Set& set = sets_[index];
  if (set.pinned == ways_) throw std::logic_error("a line was allocated in a set of which every line is pinned");
  ++allocated_;
  ++statistics_->line_misses;
  if (details_) statistics_->lines_pinned.see(set.pinned);
  evicted = {};
  Line line;
  if (set.held < ways_) {
    line = free_line(index);
    ++set.held;
    statistics_->most_lines_held.see(++held_);
  } else {
    if (before_eviction_) before_eviction_();
    line = victim(index);
    if (set.kept != 0 && kept_[line]) {
      const Line other = victim_not_kept(index);
      evicted.spared = other != no_line;
      if (evicted.spared) line = other;
    }
    const Entry& old = lines_[line];
    evicted.address = old.tag << line_shift_;
    evicted.dirty = old.dirty;
    evicted.masked = old.dirty & ~old.present;
    ++statistics_->lines_evicted;
    count_written_back(evicted.dirty);
    take_out(line);
    ++evictions_;
  }
  Entry& entry = lines_[line];
  entry.tag = tag;
  entry.note = 0;
  seen_[line] = details_ ? &were_there_.of(tag) : everything_.data();
  Line& chain = chains_[chain_of(tag)];
  entry.next = chain;
  chain = line;
  if (is_masked()) {
    const std::size_t words = mask_words(organization_);
    std::fill_n(byte_masks_.begin() + static_cast<std::ptrdiff_t>(line * words), words, 0);
  }
  if (is_listed()) {
    make_newest(set, line);
  } else {
    use(line);
  }
  return line;
}

SectoredCache::Line SectoredCache::free_line(std::uint32_t set) {
  std::uint32_t& way = sets_[set].lowest_free;
  while (lines_[line_of(set, way)].tag != no_tag) ++way;
  return line_of(set, way++);
}

SectoredCache::Order SectoredCache::order_of(const CacheOrganization& organization) {
  switch (organization.replacement) {
    case Replacement::lru: break;
    case Replacement::fifo: return Order::arrivals;
    case Replacement::random: return Order::random;
    case Replacement::tree_plru: return Order::tree;
  }
  return organization.ways_of_a_set() <= most_ways_without_list ? Order::last_use : Order::list;
}

SectoredCache::Line SectoredCache::victim(std::uint32_t set) {
  const auto can_go = [&](Line line) { return links_[line].pins == 0; };
  if (order_ == Order::tree) {
    const bool all_can = sets_[set].pinned == 0;
    return victim_of_tree(set, [&](Line line) { return all_can || can_go(line); });
  }
  if (order_ != Order::random) return first_in_order(set, can_go);
  std::uint64_t before = mix(organization_.random_seed + evictions_) % (ways_ - sets_[set].pinned);
  if (sets_[set].pinned == 0) return line_of(set, static_cast<std::uint32_t>(before));
  for (std::uint32_t way = 0;; ++way) {
    if (can_go(line_of(set, way)) && before-- == 0) return line_of(set, way);
  }
}

template <class CanGo>
SectoredCache::Line SectoredCache::first_in_order(std::uint32_t set, CanGo&& can_go) const {
  if (is_listed()) {
    Line line = sets_[set].oldest;
    while (line != no_line && !can_go(line)) line = links_[line].newer;
    return line;
  }
  Line oldest = no_line;
  for (std::uint32_t way = 0; way < ways_; ++way) {
    const Line line = line_of(set, way);
    if (can_go(line) && (oldest == no_line || links_[line].used() < links_[oldest].used())) oldest = line;
  }
  return oldest;
}

// Inner node n has children 2n and 2n + 1; way w is leaf `ways` + w.

void SectoredCache::point_away(Set& set, Line line) {
  for (std::uint32_t node = ways_ + way_of(line); node > 1; node /= 2) {
    const std::uint64_t bit = std::uint64_t{1} << (node / 2);
    set.tree = node % 2 == 0 ? set.tree | bit : set.tree & ~bit;
  }
}

template <class CanGo>
SectoredCache::Line SectoredCache::victim_of_tree(std::uint32_t set, CanGo&& can_go) const {
  const auto has_one = [&](std::uint32_t node) {
    std::uint32_t end = node + 1;
    for (; node < ways_; node *= 2) end *= 2;
    for (; node < end; ++node) {
      if (can_go(line_of(set, node - ways_))) return true;
    }
    return false;
  };
  std::uint32_t node = 1;
  while (node < ways_) {
    node = 2 * node + (sets_[set].tree >> node & 1U);
    if (!has_one(node)) node ^= 1U;
  }
  return line_of(set, node - ways_);
}

SectoredCache::Line SectoredCache::victim_not_kept(std::uint32_t set) const {
  const auto can_go = [&](Line line) { return links_[line].pins == 0 && !kept_[line]; };
  if (order_ != Order::tree && order_ != Order::random) return first_in_order(set, can_go);
  std::uint32_t others = 0;
  for (std::uint32_t way = 0; way < ways_; ++way) others += can_go(line_of(set, way)) ? 1U : 0U;
  if (others == 0) return no_line;
  if (order_ == Order::tree) return victim_of_tree(set, can_go);
  std::uint64_t before = mix(organization_.random_seed + evictions_) % others;
  for (std::uint32_t way = 0;; ++way) {
    if (can_go(line_of(set, way)) && before-- == 0) return line_of(set, way);
  }
}

void SectoredCache::keep(Line line) {
  if (kept_.empty()) kept_.resize(lines_.size());
  if (kept_[line]) return;
  kept_[line] = true;
  ++sets_[links_[line].set].kept;
}

void SectoredCache::take_out(Line line) {
  Entry& entry = lines_[line];
  Set& set = sets_[links_[line].set];
  if (set.kept != 0 && kept_[line]) {
    kept_[line] = false;
    --set.kept;
  }
  if (is_listed()) unlink(set, line);
  Line* at = &chains_[chain_of(entry.tag)];
  while (*at != line) at = &lines_[*at].next;
  *at = entry.next;
  entry.present = entry.filling = entry.dirty = 0;
}

void SectoredCache::invalidate(Line line) {
  Entry& entry = lines_[line];
  if (links_[line].pins != 0) throw std::logic_error("a line was invalidated that is pinned");
  if (shadow_ != nullptr) {
    const Line shadow = shadow_->cache.find(address(line));
    if (shadow != no_line) shadow_->cache.invalidate(shadow);
  }
  take_out(line);
  entry.tag = no_tag;
  --held_;
  Set& set = sets_[links_[line].set];
  --set.held;
  set.lowest_free = std::min(set.lowest_free, way_of(line));
}

void SectoredCache::invalidate() {
  for (Line line = 0; line < lines_.size(); ++line) {
    if (lines_[line].tag != no_tag) invalidate(line);
  }
  if (shadow_ != nullptr) shadow_->cache.invalidate();
}

bool SectoredCache::has_byte(Line line, unsigned byte) const {
  const std::uint64_t word = byte_masks_[line * mask_words(organization_) + byte / word_bits];
  return (word >> (byte % word_bits) & 1U) != 0;
}

std::uint32_t SectoredCache::read(Line line, unsigned first, unsigned bytes) const {
  std::uint32_t missing = touched(first, bytes) & absent(line);
  if (!is_masked()) return missing;
  for (std::uint32_t rest = missing; rest != 0; rest &= rest - 1) {
    const auto sector = static_cast<unsigned>(__builtin_ctz(rest));
    unsigned byte = std::max(first, sector << sector_shift_);
    const unsigned end = std::min(first + bytes, (sector + 1) << sector_shift_);
    while (byte < end && has_byte(line, byte)) ++byte;
    if (byte == end) missing &= ~(1U << sector);
  }
  return missing;
}

std::uint32_t SectoredCache::write(Line line, unsigned first, unsigned bytes) {
  if (is_masked()) return write_masked(line, first, bytes);
  Entry& entry = lines_[line];
  const std::uint32_t written = touched(first, bytes);
  const std::uint32_t missing = written & absent(line);
  const unsigned from = (first + organization_.sector_bytes - 1) >> sector_shift_;
  const unsigned to = (first + bytes) >> sector_shift_;
  const std::uint32_t whole = from < to ? sector_mask(from, to - from) : 0;
  entry.dirty |= written;
  entry.present |= whole;
  count_unfilled(missing & whole, *seen_[line]);
  return missing & ~whole;
}

std::uint32_t SectoredCache::write_masked(Line line, unsigned first, unsigned bytes) {
  Entry& entry = lines_[line];
  std::uint64_t* const mask = &byte_masks_[line * mask_words(organization_)];
  std::uint32_t missed = 0;
  std::uint32_t completed = 0;
  const std::uint32_t written = touched(first, bytes);
  for (std::uint32_t rest = written & ~entry.present; rest != 0; rest &= rest - 1) {
    const auto sector = static_cast<unsigned>(__builtin_ctz(rest));
    const unsigned begin = sector << sector_shift_;
    const unsigned end = begin + organization_.sector_bytes;
    unsigned before = 0;
    unsigned after = 0;
    for (unsigned byte = begin; byte < end; ++byte) {
      const std::uint64_t bit = std::uint64_t{1} << (byte % word_bits);
      std::uint64_t& word = mask[byte / word_bits];
      before += (word & bit) != 0 ? 1U : 0U;
      if (byte >= first && byte < first + bytes) word |= bit;
      after += (word & bit) != 0 ? 1U : 0U;
    }
    if (before == 0 && (entry.filling >> sector & 1U) == 0) missed |= 1U << sector;
    if (after == organization_.sector_bytes) completed |= 1U << sector;
  }
  entry.dirty |= written;
  entry.present |= completed;
  count_unfilled(missed, were_touched_.of(entry.tag));
  *seen_[line] |= completed;
  return 0;
}

LineAccess SectoredCache::access(std::uint64_t address, std::uint32_t bytes, bool writes) {
  const unsigned first = static_cast<unsigned>(address) & (organization_.line_bytes - 1);
  LineAccess access;
  access.address = address - first;
  access.sectors = touched(first, bytes);
  take_line(access);
  missed_sectors_ = 0;
  access.filled = writes ? write(access.line, first, bytes) : read(access.line, first, bytes);
  Entry& entry = lines_[access.line];
  if (access.filled != 0) {
    entry.present |= access.filled;
    access.filled_first = access.filled & ~(is_masked() ? were_touched_.of(entry.tag) : *seen_[access.line]);
    count_misses(access.line, access.filled);
  }
  access.missed = missed_sectors_;
  if (shadow_ != nullptr) follow(address, bytes, writes);
  accessed(1, count_of(access.sectors));
  return access;
}

void SectoredCache::count_compulsory(std::uint32_t sectors) {
  statistics_->sector_misses_compulsory += count_of(sectors);
  of_other_cause_ += count_of(sectors);
  first_time_ |= sectors;
}

void SectoredCache::fill_for_the_first_time(Line line, std::uint32_t sectors) {
  count_compulsory(sectors);
  *seen_[line] |= sectors;
  if (is_masked()) were_touched_.of(lines_[line].tag) |= sectors;
}

void SectoredCache::count_unfilled(std::uint32_t sectors, std::uint32_t& before) {
  missed_ += count_of(sectors);
  not_filled_ += count_of(sectors);
  missed_sectors_ |= sectors;
  count_compulsory(sectors & ~before);
  before |= sectors;
}

void SectoredCache::follow(std::uint64_t line_address, std::uint32_t sectors) {
  LineAccess access;
  access.address = line_address;
  access.sectors = sectors;
  shadow_->cache.missed_sectors_ = 0;
  shadow_->cache.look_up(access);
  find_conflicts(shadow_->cache.missed_sectors_);
}

void SectoredCache::follow(std::uint64_t address, unsigned bytes, bool writes) {
  shadow_->cache.missed_sectors_ = 0;
  shadow_->cache.access(address, bytes, writes);
  find_conflicts(shadow_->cache.missed_sectors_);
}

void SectoredCache::find_conflicts(std::uint32_t missed_by_shadow) {
  const unsigned conflicts = count_of(missed_sectors_ & ~first_time_ & ~missed_by_shadow);
  statistics_->sector_misses_conflict += conflicts;
  of_other_cause_ += conflicts;
  missed_sectors_ = first_time_ = 0;
}

void SectoredCache::hold_as(const SectoredCache& other) {
  lines_ = other.lines_;
  links_ = other.links_;
  for (Line line = 0; line < lines_.size(); ++line) {
    if (lines_[line].tag != no_tag) seen_[line] = details_ ? &were_there_.of(lines_[line].tag) : everything_.data();
  }
  sets_ = other.sets_;
  chains_ = other.chains_;
  kept_ = other.kept_;
  byte_masks_ = other.byte_masks_;
  held_ = other.held_;
  evictions_ = other.evictions_;
  uses_ = other.uses_;
}

}  // namespace vrpipe
