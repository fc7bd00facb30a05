#include <algorithm>
#include <deque>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>

#include <vrpipe/memory/sectored_cache.h>

#include "support/reference_cache.h"

namespace vrpipe {

namespace {

using testing::ReferenceCache;

CacheOrganization some_organization() {
  CacheOrganization made;
  const unsigned line_bits = *rc::gen::inRange(5U, 11U);
  const unsigned sector_bits = *rc::gen::inRange(std::max(4U, line_bits - 5), line_bits + 1);
  made.line_bytes = 1U << line_bits;
  made.sector_bytes = 1U << sector_bits;
  made.replacement =
      *rc::gen::element(Replacement::lru, Replacement::fifo, Replacement::random, Replacement::tree_plru);
  const bool tree = made.replacement == Replacement::tree_plru;
  // Of many ways the order of use is kept otherwise.
  const bool many = !tree && *rc::gen::inRange(0U, 3U) == 0;
  const std::uint32_t ways = tree   ? 1U << *rc::gen::inRange(1U, 5U)
                             : many ? *rc::gen::inRange(33U, 40U)
                                    : *rc::gen::inRange(1U, 20U);
  const std::uint32_t sets = *rc::gen::inRange(1U, many ? 4U : 33U);
  made.bytes = std::uint64_t{ways} * sets * made.line_bytes;
  made.ways = sets == 1 && *rc::gen::arbitrary<bool>() ? 0 : ways;
  made.random_seed = *rc::gen::arbitrary<std::uint32_t>();
  made.hashes_sets = *rc::gen::arbitrary<bool>();
  made.write_allocate = *rc::gen::element(WriteAllocate::fill, WriteAllocate::byte_mask);
  made.tells_conflicts = true;
  return made;
}

struct Access {
  std::uint64_t address = 0;
  unsigned bytes = 1;
  bool writes = false;
};

/// Mostly a little more than the cache holds, somewhere in memory; bytes of one line.
Access some_access(const CacheOrganization& shape, std::uint64_t seed) {
  const std::uint64_t base = mix(seed) % 16 == 0 ? std::uint64_t{1} << 40U : std::uint64_t{3} << 33U;
  const std::uint64_t lines = mix(seed + 1) % 4 == 0 ? 3 * shape.lines() + 1 : shape.lines() / 2 + 1;
  const std::uint64_t stride = mix(seed + 2) % 8 == 0 ? shape.sets() : 1;
  const unsigned first = static_cast<unsigned>(mix(seed + 3) % shape.line_bytes);
  Access access;
  access.writes = mix(seed + 4) % 3 == 0;
  switch (mix(seed + 5) % 3) {
    case 0:  // any bytes
      access.bytes = 1 + static_cast<unsigned>(mix(seed + 6) % (shape.line_bytes - first));
      access.address = first;
      break;
    case 1:  // a sector
      access.bytes = shape.sector_bytes;
      access.address = first - first % shape.sector_bytes;
      break;
    default:  // the line
      access.bytes = shape.line_bytes;
      break;
  }
  access.address += base + mix(seed + 7) % lines * stride * shape.line_bytes;
  return access;
}

std::set<unsigned> set_of(std::uint32_t mask) {
  std::set<unsigned> sectors;
  for (unsigned sector = 0; sector < 32; ++sector) {
    if ((mask >> sector & 1U) != 0) sectors.insert(sector);
  }
  return sectors;
}

ReferenceCache::Outcome outcome_of(const LineAccess& access) {
  return {access.line,
          access.replaced,
          set_of(access.filled),
          {},
          set_of(access.written_back),
          access.old_address,
          access.replaced && access.spared};
}

struct Counted : StatisticSet {
  SectoredCacheStatistics statistics{*this, "cache"};
};

RC_GTEST_PROP(SectoredCache, DoesAccessByAccessWhatTheDefinitionSays, ()) {
  const CacheOrganization shape = some_organization();
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  const auto one_in = *rc::gen::inRange<std::uint64_t>(1, 9);  // is a line that is kept
  Counted counted;
  SectoredCache cache(shape, counted.statistics);
  ReferenceCache reference(shape);
  for (std::uint64_t i = 0; i < 600; ++i) {
    const Access access = some_access(shape, seed + 20 * i);
    RC_ASSERT((cache.find(access.address) != SectoredCache::no_line) == reference.holds(access.address));
    const LineAccess done = cache.access(access.address, access.bytes, access.writes);
    RC_ASSERT(outcome_of(done) == reference.access(access.address, access.bytes, access.writes));
    if (mix(access.address / shape.line_bytes) % one_in == 0) {
      cache.keep(done.line);
      reference.keep(access.address);
    }
    if (mix(seed + i) % 100 == 0) {
      cache.invalidate(done.line);
      reference.invalidate(access.address);
    }
    if (mix(seed + i) % 200 == 1) {
      std::map<std::uint64_t, std::set<unsigned>> taken;
      cache.flush([&](std::uint64_t address, std::uint32_t sectors) { taken[address] = set_of(sectors); });
      RC_ASSERT(taken == reference.flush());
    }
  }
  reference.expect_equal(counted.statistics);
  RC_ASSERT(!::testing::Test::HasFailure());
}

// As a unit does that looks up early: lines are kept until their turn comes, and sectors come one by one.
RC_GTEST_PROP(SectoredCache, DoesTheSameInStepsWithLinesThatAreKept, ()) {
  const CacheOrganization shape = some_organization();
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  const auto one_in = *rc::gen::inRange<std::uint64_t>(1, 9);
  const auto most_queued = *rc::gen::inRange<std::size_t>(1, 2 * shape.lines() + 1);
  Counted counted;
  SectoredCache cache(shape, counted.statistics);
  ReferenceCache reference(shape);
  std::deque<std::pair<SectoredCache::Line, unsigned>> fills;
  struct Queued {
    std::uint64_t address;
    SectoredCache::Line line;
  };
  std::deque<Queued> queue;
  const auto finish_fill = [&] {
    cache.finish_fill(fills.front().first, 1U << fills.front().second);
    fills.pop_front();
  };
  const auto let_one_go = [&](std::uint64_t chance) {
    // Not always the first, as in a unit that answers out of order.
    const auto at = std::next(queue.begin(), static_cast<std::ptrdiff_t>(mix(chance) % 3 == 0 ? queue.size() / 2 : 0));
    while (cache.filling(at->line) != 0) finish_fill();
    RC_ASSERT(cache.address(at->line) == at->address - at->address % shape.line_bytes);
    cache.unpin(at->line);
    reference.unpin(at->address);
    queue.erase(at);
  };
  for (std::uint64_t i = 0; i < 600; ++i) {
    const Access access = some_access(shape, seed + 20 * i);
    if (queue.size() == most_queued) let_one_go(seed + i);
    SectoredCache::Line line = cache.find(access.address);
    while (line == SectoredCache::no_line && !cache.can_allocate(access.address)) {
      RC_ASSERT(!reference.can_take(access.address));
      let_one_go(seed + i);
      line = cache.find(access.address);
    }
    RC_ASSERT(reference.can_take(access.address));
    ReferenceCache::Outcome done;
    done.replaced = line == SectoredCache::no_line;
    if (done.replaced) {
      SectoredCache::Evicted evicted;
      line = cache.allocate(access.address, evicted);
      done.written_back = set_of(evicted.dirty);
      done.old_address = evicted.address;
      done.spared = evicted.spared;
    }
    done.line = line;
    const auto first = static_cast<unsigned>(access.address % shape.line_bytes);
    const std::uint32_t missing =
        access.writes ? cache.write(line, first, access.bytes) : cache.read(line, first, access.bytes);
    done.filled = set_of(missing);
    for (const unsigned sector : done.filled) {
      cache.start_fill(line, 1U << sector);
      fills.emplace_back(line, sector);
      if (mix(seed + i + sector) % 4 == 0) finish_fill();
    }
    cache.pin(line);
    cache.looked_up(line, first, access.bytes, access.writes);
    const unsigned last = first + access.bytes - 1;
    cache.accessed(1, last / shape.sector_bytes - first / shape.sector_bytes + 1);
    RC_ASSERT(done == reference.access_and_pin(access.address, access.bytes, access.writes));
    if (mix(access.address / shape.line_bytes) % one_in == 0) {
      cache.keep(line);
      reference.keep(access.address);
    }
    queue.push_back({access.address, line});
  }
  reference.expect_equal(counted.statistics);
  RC_ASSERT(!::testing::Test::HasFailure());
}

}  // namespace
}  // namespace vrpipe
