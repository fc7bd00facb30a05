#include <vrpipe/memory/sectored_cache.h>

#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>

namespace vrpipe {
namespace {

struct Counted : StatisticSet {
  SectoredCacheStatistics statistics{*this, "cache"};
};

CacheOrganization of_lines(std::uint32_t lines, std::uint32_t ways = 0, Replacement replacement = Replacement::lru) {
  CacheOrganization made;
  made.bytes = std::uint64_t{lines} * made.line_bytes;
  made.ways = ways;
  made.replacement = replacement;
  made.tells_conflicts = true;
  return made;
}

/// Reads lines by number.
class LineReader {
 public:
  explicit LineReader(const CacheOrganization& organization) : cache(organization, counted.statistics) {}
  bool misses(std::uint64_t line) { return cache.access(line * 128, 32, false).filled != 0; }
  std::uint64_t misses_of(const std::vector<std::uint64_t>& lines) {
    std::uint64_t missed = 0;
    for (const std::uint64_t line : lines) missed += misses(line) ? 1 : 0;
    return missed;
  }
  Counted counted;
  SectoredCache cache;
};

constexpr Replacement all_policies[] = {Replacement::lru, Replacement::fifo, Replacement::random,
                                        Replacement::tree_plru};

std::vector<std::uint64_t> rounds_over(std::uint64_t lines, unsigned rounds) {
  std::vector<std::uint64_t> made;
  for (unsigned round = 0; round < rounds; ++round) {
    for (std::uint64_t line = 0; line < lines; ++line) made.push_back(line);
  }
  return made;
}

TEST(SectoredCache, ALoopThatFitsMissesOnceALineAndALongerOneAlways) {
  for (const Replacement replacement : {Replacement::lru, Replacement::fifo}) {
    for (std::uint32_t lines = 1; lines <= 40; ++lines) {
      for (std::uint32_t loop = 1; loop <= lines + 3; ++loop) {
        LineReader reader(of_lines(lines, 0, replacement));
        ASSERT_EQ(reader.misses_of(rounds_over(loop, 5)), loop <= lines ? loop : 5 * loop) << loop << " in " << lines;
        const SectoredCacheStatistics& counts = reader.counted.statistics;
        ASSERT_EQ(counts.sector_misses_compulsory.value(), loop);
        ASSERT_EQ(counts.sector_misses_capacity.value(), loop <= lines ? 0 : 4 * loop);
        ASSERT_EQ(counts.sector_misses_conflict.value(), 0U);
      }
    }
  }
}

// Belady, Nelson and Shedler, "An anomaly in space-time characteristics of certain programs running in a paging
// machine", CACM 12(6), 1969.
TEST(SectoredCache, WithFifoALargerCacheMayMissMore) {
  const std::vector<std::uint64_t> references = {1, 2, 3, 4, 1, 2, 5, 1, 2, 3, 4, 5};
  EXPECT_EQ(LineReader(of_lines(3, 0, Replacement::fifo)).misses_of(references), 9U);
  EXPECT_EQ(LineReader(of_lines(4, 0, Replacement::fifo)).misses_of(references), 10U);
  EXPECT_EQ(LineReader(of_lines(3)).misses_of(references), 10U);
  EXPECT_EQ(LineReader(of_lines(4)).misses_of(references), 8U);
}

// The tree of four ways after reads of its ways 0, 1, 2, 3 leads to 0; a hit of 0 turns it to the other half, 2.
TEST(SectoredCache, ATreeLeadsAwayFromWhatWasUsed) {
  LineReader reader(of_lines(4, 0, Replacement::tree_plru));
  EXPECT_EQ(reader.misses_of({10, 11, 12, 13}), 4U);
  EXPECT_FALSE(reader.misses(10));
  EXPECT_TRUE(reader.misses(14)) << "takes the place of 12, though 11 was not used for longer";
  EXPECT_FALSE(reader.misses(11));
  EXPECT_FALSE(reader.misses(13));
  EXPECT_TRUE(reader.misses(12));
}

TEST(SectoredCache, RandomReplacementMissesALoopOfALineTooManyTwiceARound) {
  // One of the 65 lines is out, and the read of it drives out any of the 64 others, which is read 1 to 64 reads later: on
  // average, a read in 32.5 misses. Of 399 x 65, that is 798, with a standard deviation of 16.
  const std::vector<std::uint64_t> rounds = rounds_over(65, 400);
  std::vector<std::uint64_t> missed;
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    CacheOrganization organization = of_lines(64, 0, Replacement::random);
    organization.random_seed = seed;
    missed.push_back(LineReader(organization).misses_of(rounds));
    EXPECT_EQ(missed.back(), LineReader(organization).misses_of(rounds)) << "the same again";
    EXPECT_NEAR(static_cast<double>(missed.back()), 65 + 798, 64);
  }
  EXPECT_NE(missed[0], missed[1]);
}

TEST(SectoredCache, LinesOfOneSetAreConflictsAndOnesTooManyAreCapacity) {
  constexpr std::uint32_t sets = 8;
  {
    LineReader reader(of_lines(4 * sets, 4));
    for (unsigned round = 0; round < 10; ++round) {
      for (std::uint64_t line = 0; line < 5; ++line) EXPECT_TRUE(reader.misses(line * sets));
    }
    EXPECT_EQ(reader.counted.statistics.sector_misses_compulsory.value(), 5U);
    EXPECT_EQ(reader.counted.statistics.sector_misses_capacity.value(), 0U);
    EXPECT_EQ(reader.counted.statistics.sector_misses_conflict.value(), 45U);
  }
  {
    LineReader reader(of_lines(4 * sets, 4));
    reader.misses_of(rounds_over(5 * sets, 10));
    EXPECT_EQ(reader.counted.statistics.sector_misses_compulsory.value(), 5U * sets);
    EXPECT_EQ(reader.counted.statistics.sector_misses_capacity.value(), 45U * sets);
    EXPECT_EQ(reader.counted.statistics.sector_misses_conflict.value(), 0U);
  }
}

TEST(SectoredCache, HashedSetsSpreadAPowerOfTwoStride) {
  CacheOrganization organization = of_lines(64, 4);  // 16 sets
  LineReader plain(organization);
  organization.hashes_sets = true;
  LineReader hashed(organization);
  for (unsigned round = 0; round < 4; ++round) {
    for (std::uint64_t line = 0; line < 64; ++line) {
      plain.misses(16 * line);
      hashed.misses(16 * line);
    }
  }
  EXPECT_EQ(plain.counted.statistics.sector_misses.value(), 256U) << "all in one set";
  EXPECT_EQ(hashed.counted.statistics.sector_misses.value(), 64U) << "four in each";
}

TEST(SectoredCache, AnyNumberOfSetsHoldsItsCapacityAndLinesGoRoundThem) {
  for (const std::uint32_t sets : {3U, 5U, 10U, 12U, 40U, 48U, 3072U}) {
    for (const bool hashes : {false, true}) {
      CacheOrganization organization = of_lines(sets * 4, 4);
      organization.hashes_sets = hashes;
      LineReader reader(organization);
      for (unsigned round = 0; round < 3; ++round) {
        for (std::uint64_t line = 0; line < sets * 4; ++line) reader.misses(line);
      }
      EXPECT_EQ(reader.counted.statistics.line_misses.value(), sets * 4) << sets;
      // Without hashing, neighbours are in neighbouring sets; whatever is above, all sets have one of as many lines.
      const SectoredCache cache(organization, reader.counted.statistics);
      std::set<std::uint32_t> found;
      constexpr std::uint64_t far = std::uint64_t{1} << 44U;
      for (std::uint64_t i = 0; i < sets; ++i) {
        const std::uint64_t line = far / 128 / sets * sets + i;
        found.insert(cache.set_of(line * 128));
        EXPECT_TRUE(hashes || cache.set_of(line * 128) == i);
      }
      EXPECT_EQ(found.size(), sets);
      EXPECT_EQ(*found.rbegin(), sets - 1);
    }
  }
}

TEST(SectoredCache, APinnedLineStaysAndWithoutOthersNoneCanBeHad) {
  for (const Replacement replacement : all_policies) {
    Counted counted;
    SectoredCache cache(of_lines(4, 2, replacement), counted.statistics);
    SectoredCache::Evicted evicted;
    const SectoredCache::Line a = cache.allocate(0, evicted);
    const SectoredCache::Line b = cache.allocate(256, evicted);
    EXPECT_EQ(cache.find(0), a);
    EXPECT_EQ(cache.find(127), a);
    EXPECT_EQ(cache.find(128), SectoredCache::no_line);
    cache.pin(a);
    cache.pin(a);
    cache.pin(b);
    EXPECT_FALSE(cache.can_allocate(512));
    EXPECT_TRUE(cache.can_allocate(128)) << "of the other set";
    EXPECT_THROW(cache.allocate(512, evicted), std::logic_error);
    cache.unpin(a);
    EXPECT_FALSE(cache.can_allocate(512));
    cache.unpin(a);
    ASSERT_TRUE(cache.can_allocate(512));
    EXPECT_EQ(cache.allocate(512, evicted), a);
    EXPECT_EQ(evicted.address, 0U);
    EXPECT_EQ(cache.find(0), SectoredCache::no_line);
    EXPECT_EQ(cache.find(256), b);
    EXPECT_THROW(cache.invalidate(b), std::logic_error);
  }
}

TEST(SectoredCache, AStreamPassesByALineThatIsKept) {
  for (const Replacement replacement : all_policies) {
    LineReader reader(of_lines(8, 4, replacement));
    for (const std::uint64_t line : {0U, 2U, 4U}) {
      reader.misses(line);
      reader.cache.keep(reader.cache.find(line * 128));
    }
    for (std::uint64_t line = 100; line < 200; ++line) EXPECT_TRUE(reader.misses(line));
    EXPECT_EQ(reader.misses_of({0, 2, 4}), 0U);
    // The other set keeps nothing: its last four are there. In this one the last of them took the place left.
    EXPECT_FALSE(reader.misses(199));
    EXPECT_FALSE(reader.misses(198));
    EXPECT_TRUE(reader.misses(196));
  }
}

TEST(SectoredCache, OfLinesThatAreAllKeptThePolicyChoosesAndWhatComesIsNotKept) {
  for (const Replacement replacement : all_policies) {
    LineReader reader(of_lines(4, 0, replacement));
    LineReader without(of_lines(4, 0, replacement));
    for (std::uint64_t line = 0; line < 4; ++line) {
      reader.misses(line);
      without.misses(line);
      reader.cache.keep(reader.cache.find(line * 128));
    }
    SectoredCache::Evicted evicted;
    SectoredCache::Evicted expected;
    const SectoredCache::Line taken = reader.cache.allocate(10 * 128, evicted);
    EXPECT_EQ(taken, without.cache.allocate(10 * 128, expected));
    EXPECT_EQ(evicted.address, expected.address);
    EXPECT_FALSE(evicted.spared) << "no other could go";
    EXPECT_EQ(reader.cache.allocate(11 * 128, evicted), taken);
    EXPECT_EQ(reader.cache.allocate(12 * 128, evicted), taken);
    EXPECT_EQ(evicted.address, 11 * 128U);
    // Pinned, it cannot; then one of those goes that are kept.
    reader.cache.pin(taken);
    EXPECT_NE(reader.cache.allocate(13 * 128, evicted), taken);
    EXPECT_FALSE(evicted.spared);
  }
}

TEST(SectoredCache, ALineIsKeptForAsLongAsItHoldsTheSame) {
  LineReader reader(of_lines(2));
  reader.misses(0);
  reader.cache.keep(reader.cache.find(0));
  reader.misses_of({1, 2});
  SectoredCache::Evicted evicted;
  reader.cache.allocate(3 * 128, evicted);
  EXPECT_EQ(evicted.address, 2 * 128U);
  EXPECT_TRUE(evicted.spared) << "line 0 was used last before it";
  reader.cache.invalidate(reader.cache.find(0));
  EXPECT_EQ(reader.misses_of({0, 4}), 2U);
  EXPECT_EQ(reader.cache.find(3 * 128), SectoredCache::no_line) << "the oldest, and nothing is kept any more";
  EXPECT_NE(reader.cache.find(0), SectoredCache::no_line);
}

TEST(SectoredCache, SectorsComeOneByOneAndGoWithTheirLine) {
  Counted counted;
  SectoredCache cache(of_lines(1), counted.statistics);
  SectoredCache::Evicted evicted;
  SectoredCache::Line line = cache.allocate(0, evicted);
  EXPECT_EQ(cache.absent(line) & 15U, 0b1111U);
  cache.start_fill(line, 1U << 2U);
  EXPECT_EQ(cache.filling(line), 0b0100U);
  EXPECT_EQ(cache.absent(line) & 15U, 0b1011U) << "on its way: need not be asked for again";
  cache.finish_fill(line, 1U << 2U);
  EXPECT_EQ(cache.filling(line), 0U);
  EXPECT_EQ(cache.present(line), 0b0100U);
  cache.make_dirty(line, 0b0100);
  line = cache.allocate(256, evicted);
  EXPECT_EQ(cache.absent(line) & 15U, 0b1111U);
  EXPECT_EQ(evicted.dirty, 0b0100U);
  EXPECT_EQ(evicted.address, 0U);
  EXPECT_EQ(cache.dirty(line), 0U);
}

TEST(SectoredCache, AWholeSectorWrittenNeedsNoFillAndAPartOfOneByChoice) {
  for (const WriteAllocate choice : {WriteAllocate::fill, WriteAllocate::byte_mask}) {
    const bool fills = choice == WriteAllocate::fill;
    CacheOrganization organization = of_lines(8);
    organization.write_allocate = choice;
    Counted counted;
    SectoredCache cache(organization, counted.statistics);
    EXPECT_EQ(cache.access(32, 64, true).filled, 0U) << "sectors 1 and 2";
    EXPECT_EQ(cache.access(32, 64, false).filled, 0U);
    EXPECT_EQ(counted.statistics.sector_misses.value(), 2U);
    EXPECT_EQ(cache.access(96, 8, true).filled, fills ? 0b1000U : 0U) << "a part of sector 3";
    EXPECT_EQ(cache.access(100, 4, false).filled, 0U) << "what was written is there";
    EXPECT_EQ(cache.access(100, 8, false).filled, fills ? 0U : 0b1000U) << "what was not is not";
    EXPECT_EQ(cache.access(100, 8, false).filled, 0U);
    EXPECT_EQ(counted.statistics.bytes_filled.value(), 32U);
    // Written whole in two parts.
    EXPECT_EQ(cache.access(128, 16, true).filled, fills ? 1U : 0U);
    EXPECT_EQ(cache.access(144, 16, true).filled, 0U);
    EXPECT_EQ(cache.access(128, 32, false).filled, 0U);
    EXPECT_EQ(counted.statistics.sector_hits.value(), fills ? 7U : 6U);
  }
}

TEST(SectoredCache, ALineGoesWithAMaskWhereASectorIsNotWhole) {
  CacheOrganization organization = of_lines(1);
  organization.write_allocate = WriteAllocate::byte_mask;
  Counted counted;
  SectoredCache cache(organization, counted.statistics);
  cache.access(0, 32, true);
  cache.access(64, 1, true);
  SectoredCache::Evicted evicted;
  cache.allocate(128, evicted);
  EXPECT_EQ(evicted.dirty, 0b0101U);
  EXPECT_EQ(evicted.masked, 0b0100U);
}

TEST(SectoredCache, AFlushTakesDirtySectorsOnceAndLeavesTheLines) {
  LineReader reader(of_lines(16, 4));
  std::vector<std::pair<std::uint64_t, std::uint32_t>> taken;
  const auto take = [&](std::uint64_t address, std::uint32_t sectors) { taken.emplace_back(address, sectors); };
  reader.cache.access(0, 32, true);
  reader.cache.access(5 * 128 + 32, 64, true);
  reader.cache.access(9 * 128, 128, false);
  reader.cache.flush(take);
  EXPECT_EQ(taken, (std::vector<std::pair<std::uint64_t, std::uint32_t>>{{0, 0b0001}, {5 * 128, 0b0110}}));
  EXPECT_EQ(reader.counted.statistics.bytes_written_back.value(), 96U);
  reader.cache.flush(take);
  EXPECT_EQ(taken.size(), 2U);
  EXPECT_EQ(reader.cache.lines_held(), 3U);
  EXPECT_FALSE(reader.misses(0));
  reader.cache.invalidate();
  EXPECT_EQ(reader.cache.lines_held(), 0U);
  EXPECT_TRUE(reader.misses(0));
  EXPECT_EQ(reader.counted.statistics.sector_misses_capacity.value(), 1U) << "it was there once";
}

TEST(SectoredCache, SaysHowFullItWas) {
  Counted counted;
  SectoredCache cache(of_lines(4), counted.statistics);
  SectoredCache::Evicted evicted;
  for (std::uint64_t line = 0; line < 3; ++line) cache.pin(cache.allocate(128 * line, evicted));
  for (std::uint64_t line = 3; line < 6; ++line) cache.allocate(128 * line, evicted);
  EXPECT_EQ(counted.statistics.most_lines_held.value(), 4U);
  EXPECT_EQ(counted.statistics.lines_pinned.count(), 6U);
  EXPECT_EQ(counted.statistics.lines_pinned.sum(), 0U + 1 + 2 + 3 * 3);
}

TEST(SectoredCache, WithoutTheSecondCacheConflictsAreCountedAsCapacity) {
  CacheOrganization organization = of_lines(4, 1);
  organization.tells_conflicts = false;
  LineReader reader(organization);
  reader.misses_of({0, 4, 0, 4});
  EXPECT_EQ(reader.counted.statistics.sector_misses_compulsory.value(), 2U);
  EXPECT_EQ(reader.counted.statistics.sector_misses_capacity.value(), 2U);
}

TEST(CacheOrganization, RefusesWhatCannotBeAndNamesTheRule) {
  const auto refused = [](CacheOrganization made, const std::string& where, const std::string& why) {
    try {
      made.check("CROP cache", "crop", "cache_bytes");
      ADD_FAILURE() << "accepted: " << where;
    } catch (const UserError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find("unusable CROP cache (" + where + ")"), std::string::npos) << what;
      EXPECT_NE(what.find(why), std::string::npos) << what;
    }
    Counted counted;
    EXPECT_THROW(SectoredCache(made, counted.statistics), UserError);
  };
  const auto made = [](std::uint64_t bytes, std::uint32_t line, std::uint32_t sector, std::uint32_t ways,
                       Replacement replacement = Replacement::lru) {
    CacheOrganization organization;
    organization.bytes = bytes;
    organization.line_bytes = line;
    organization.sector_bytes = sector;
    organization.ways = ways;
    organization.replacement = replacement;
    return organization;
  };
  refused(made(4096, 96, 32, 0), "crop.line_bytes", "96 is no power of two");
  refused(made(4096, 0, 32, 0), "crop.line_bytes", "0 is no power of two");
  refused(made(4096, 128, 48, 0), "crop.sector_bytes", "48 is no power of two");
  refused(made(64, 128, 32, 0), "crop.line_bytes, crop.cache_bytes", "128 bytes do not fit into a cache of 64");
  refused(made(4096, 128, 256, 0), "crop.sector_bytes, crop.line_bytes", "256 bytes do not fit into a line of 128");
  refused(made(4096, 1024, 16, 0), "crop.line_bytes, crop.sector_bytes", "a line has 64 sectors");
  refused(made(4100, 128, 32, 0), "crop.cache_bytes", "4100 bytes are no whole lines of 128");
  refused(made(1024, 128, 32, 16), "crop.ways, crop.cache_bytes",
          "16 ways of 128 bytes are more than the cache of 1024");
  refused(made(1024, 128, 32, 3), "crop.ways, crop.cache_bytes", "8 lines are no whole sets of 3 ways");
  refused(made(6 * 128, 128, 32, 6, Replacement::tree_plru), "crop.replacement, crop.ways", "and this has 6");
  refused(made(16384, 128, 32, 0, Replacement::tree_plru), "crop.replacement, crop.ways", "and this has 128");
  made(48 * 1024, 128, 32, 6).check("L1", "l1", "bytes");
  made(3 * 128, 128, 32, 0).check("L1", "l1", "bytes");
  made(6 * 128, 128, 32, 2).check("L1", "l1", "bytes");
  made(1024, 1024, 32, 1).check("L1", "l1", "bytes");
}

TEST(Sectors, SectorsMoveInTheLongestNaturallyAlignedRuns) {
  // By brute force: of all aligned runs that begin with the first sector, the longest that is wholly there.
  for (const unsigned longest : {1U, 2U, 3U, 4U, 7U, 8U, 32U}) {
    for (std::uint32_t seed = 1; seed < 4096; ++seed) {
      const std::uint32_t mask = seed | (seed % 3 == 0 ? 0xfff000U : 0U) | (seed % 5 == 0 ? 0xff000000U : 0U);
      unsigned first = 0;
      while ((mask >> first & 1U) == 0) ++first;
      unsigned count = 1;
      for (const unsigned longer : {2U, 4U, 8U, 16U, 32U}) {
        bool whole = longer <= longest && first % longer == 0 && first + longer <= 32;
        for (unsigned i = 0; whole && i < longer; ++i) whole = (mask >> (first + i) & 1U) != 0;
        if (whole) count = longer;
      }
      std::uint32_t left = mask;
      const SectorRun run = take_sector_run(left, longest);
      ASSERT_EQ(run.first, first) << mask;
      ASSERT_EQ(run.count, count) << mask << " up to " << longest;
      for (unsigned i = 0; i < 32; ++i) {
        const bool taken = i >= first && i < first + count;
        ASSERT_EQ(left >> i & 1U, taken ? 0U : mask >> i & 1U);
      }
    }
  }
}

TEST(SectoredCache, GoesOnAsTheOneWhoseLinesItHolds) {
  for (const Replacement policy : all_policies) {
    for (const std::uint32_t ways : {0U, 4U}) {
      LineReader one(of_lines(64, ways, policy)), other(of_lines(64, ways, policy));
      const auto line_at = [](std::uint64_t i) { return mix(i) % 100; };
      for (std::uint64_t i = 0; i < 500; ++i) one.misses(line_at(i));
      other.misses(3);
      other.cache.hold_as(one.cache);
      EXPECT_EQ(other.cache.lines_held(), one.cache.lines_held());
      for (std::uint64_t i = 500; i < 1500; ++i) EXPECT_EQ(other.misses(line_at(i)), one.misses(line_at(i))) << i;
    }
  }
}

}  // namespace
}  // namespace vrpipe
