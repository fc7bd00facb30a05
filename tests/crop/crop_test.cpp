#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <list>
#include <memory>
#include <set>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/half.h>
#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

#include "crop/crop_cache.h"
#include "crop/sectors.h"
#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::color_of;

class ColorRopTest : public ::testing::Test {
 protected:
  ColorRopTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {
    testing::terminate_early(context);
  }

  void make(const std::vector<std::pair<std::string, std::string>>& settings = {}) {
    const Implementation& implementation = Registry::instance().find("crop", "color-rop");
    const std::unique_ptr<ParameterSet> parameters = implementation.make_parameters();
    for (const auto& [name, value] : settings) parameters->set("crop", name, value);
    behaviour = implementation.make_behaviour(*parameters, context);
    crop = dynamic_cast<CropBehaviour*>(behaviour.get());
    surface = std::make_unique<ColorSurface>(draw.width, draw.height, context.format);
    crop->attach(*surface);
  }
  std::uint64_t count(const std::string& name) const {
    for (const Counter* counter : behaviour->counters()) {
      if (name == counter->name()) return counter->value();
    }
    ADD_FAILURE() << "no counter " << name;
    return 0;
  }
  LaneMask blend(float alpha, LaneMask live = all_lanes, unsigned position = 0, float grey = 1) {
    return crop->blend(0, position, live, color_of(alpha * grey, alpha * grey, alpha * grey, alpha)).terminated;
  }
  void set_alpha(float alpha) { surface->quad({0, 0}, 0).alpha = splat_lanes(alpha); }
  float alpha(unsigned lane = 0) const { return surface->quad({0, 0}, 0).alpha[lane]; }

  Draw draw;
  RenderContext context;
  std::unique_ptr<Behaviour> behaviour;
  CropBehaviour* crop = nullptr;
  std::unique_ptr<ColorSurface> surface;
};

TEST_F(ColorRopTest, OnlyLiveLanesAreBlendedAndCounted) {
  make();
  blend(0.5F, 0b0110);
  EXPECT_EQ(alpha(0), 0.0F);
  EXPECT_EQ(alpha(1), 0.5F);
  EXPECT_EQ(alpha(2), 0.5F);
  EXPECT_EQ(alpha(3), 0.0F);
  EXPECT_EQ(count("quads_blended"), 1U);
  EXPECT_EQ(count("fragments_blended"), 2U);
}

// case H01
TEST_F(ColorRopTest, EveryPixelSignalsOnceWhenItPassesTheThreshold) {
  make();
  unsigned pixels = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const LaneMask signalled = blend(testing::uniform(8, i, 0.1F, 0.5F), static_cast<LaneMask>(1 + mix(i) % 15));
    pixels += popcount(signalled);
  }
  unsigned terminated = 0;
  for (unsigned lane = 0; lane < 4; ++lane) terminated += alpha(lane) >= 0.996F;
  EXPECT_EQ(terminated, 4U);
  EXPECT_EQ(pixels, terminated);
}

// case H01
TEST_F(ColorRopTest, WithoutThePreviousAlphaCheckEveryLaterFragmentSignals) {
  make({{"previous_alpha_check", "off"}});
  unsigned signals = 0;
  for (unsigned i = 0; i < 10; ++i) signals += blend(0.99F) != 0;
  EXPECT_EQ(signals, 9U) << "0.99, then 0.9999 and all that follow";
}

// case H06
TEST_F(ColorRopTest, PixelsThatTerminateTogetherAreOneSignal) {
  make();
  blend(0.99F, 0b1011);
  EXPECT_EQ(blend(0.9F, 0b0011), 0b0011);
  EXPECT_EQ(count("termination_signals"), 1U);
}

// case H07
TEST_F(ColorRopTest, AMergedQuadThatTerminatesItsPixelsSignalsOnce) {
  make();
  const QuadColor merged = blend_front_to_back(color_of(0, 0, 0, 0.99F), color_of(0, 0, 0, 0.99F));
  EXPECT_EQ(crop->blend(0, 0, all_lanes, merged).terminated, all_lanes);
  EXPECT_EQ(count("termination_signals"), 1U);
  EXPECT_EQ(half_bits(alpha()), 0x3C00);
}

TEST_F(ColorRopTest, WithoutEarlyTerminationNothingIsSignalled) {
  testing::terminate_early(context, false);
  make();
  for (unsigned i = 0; i < 5; ++i) EXPECT_EQ(blend(0.99F), 0);
}

// case B03
TEST_F(ColorRopTest, TheThresholdIsPassedAtTheFirstStoredAlphaNotBelowIt) {
  const auto passes = [&](ColorFormat format, bool inclusive, float stored) {
    context.format = format;
    testing::change_state(context, [&](DrawState& drawn) { drawn.termination_inclusive = inclusive; });
    make();
    QuadColor fragment{};
    fragment.alpha = splat_lanes(stored);
    return crop->blend(0, 0, all_lanes, fragment).terminated != 0;
  };
  for (const bool inclusive : {true, false}) {
    EXPECT_TRUE(passes(ColorFormat::rgba16f, inclusive, half_value(0x3BF8)));
    EXPECT_FALSE(passes(ColorFormat::rgba16f, inclusive, half_value(0x3BF7)));
    EXPECT_TRUE(passes(ColorFormat::rgba8, inclusive, 254.0F / 255.0F));
    EXPECT_FALSE(passes(ColorFormat::rgba8, inclusive, 253.0F / 255.0F));
    EXPECT_EQ(passes(ColorFormat::rgba32f, inclusive, 0.996F), inclusive) << "only here the two comparisons differ";
    EXPECT_TRUE(passes(ColorFormat::rgba32f, inclusive, std::nextafter(0.996F, 1.0F)));
    EXPECT_FALSE(passes(ColorFormat::rgba32f, inclusive, std::nextafter(0.996F, 0.0F)));
  }
}

// case M11
TEST_F(ColorRopTest, AcrossTheThresholdAPairDiffersFromItsPartsByTheMissingTransmittanceAtMost) {
  context.format = ColorFormat::rgba32f;
  context.termination = Termination::strict;
  make();
  set_alpha(0.995F);
  blend(0.5F);
  blend(0.5F);  // dropped: terminated
  const float unmerged = alpha();
  EXPECT_NEAR(static_cast<double>(unmerged), 0.9975, 1e-6);
  make();
  set_alpha(0.995F);
  const QuadColor pair = blend_front_to_back(color_of(0.5F, 0, 0, 0.5F), color_of(0.5F, 0, 0, 0.5F));
  crop->blend(0, 0, all_lanes, pair);
  EXPECT_NEAR(static_cast<double>(alpha()), 0.99875, 1e-6);
  EXPECT_LE(alpha() - unmerged, 0.004F);
}

TEST_F(ColorRopTest, StrictlyAFragmentOfATerminatedPixelIsDropped) {
  context.termination = Termination::strict;
  make();
  blend(0.99F, 0b0011);
  blend(0.9F, 0b0011);
  const float before = alpha(0);
  const CropBehaviour::Outcome part = crop->blend(0, 0, 0b0110, color_of(0.5F, 0.5F, 0.5F, 0.5F));
  EXPECT_TRUE(part.changed);
  EXPECT_EQ(alpha(1), before);
  EXPECT_EQ(alpha(2), 0.5F);
  EXPECT_EQ(count("fragments_dropped_late"), 1U);
  EXPECT_EQ(count("quads_dropped_late"), 0U);
  const CropBehaviour::Outcome all = crop->blend(0, 0, 0b0001, color_of(0.5F, 0.5F, 0.5F, 0.5F));
  EXPECT_FALSE(all.changed);
  EXPECT_EQ(count("fragments_dropped_late"), 2U);
  EXPECT_EQ(count("quads_dropped_late"), 1U);
}

// case H02
TEST_F(ColorRopTest, InPaperTerminationALateFragmentStillBlendsByWhatIsLeftAtMost) {
  make();
  blend(0.99F, all_lanes, 0, 0);
  blend(0.9F, all_lanes, 0, 0);
  ASSERT_GE(alpha(), 0.996F);
  for (unsigned i = 0; i < 50; ++i) blend(0.99F);
  EXPECT_LE(surface->quad({0, 0}, 0).red[0], 0.004F);
  EXPECT_EQ(count("fragments_dropped_late"), 0U);
}

TEST_F(ColorRopTest, TellsWhetherAValueChanged) {
  make();
  EXPECT_TRUE(crop->blend(0, 0, all_lanes, color_of(0.5F, 0, 0, 0.5F)).changed);
  EXPECT_FALSE(crop->blend(0, 0, all_lanes, color_of(0, 0, 0, 0)).changed);
  set_alpha(1.0F);
  EXPECT_FALSE(crop->blend(0, 0, all_lanes, color_of(0.5F, 0.5F, 0.5F, 0.5F)).changed);
}

// case B10
TEST_F(ColorRopTest, AThousandQuadsOnOnePositionAreTheSequentialResult) {
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
    context.format = format;
    make();
    QuadColor expected{};
    const BlendFunction reference = blend_function(format, BlendRounding::rne);
    for (std::uint64_t i = 0; i < 1000; ++i) {
      const float a = testing::uniform(9, i, 0.001F, 0.02F);
      const QuadColor fragment = color_of(a * 0.3F, a * 0.9F, a, a);
      crop->blend(0, surface->grid().place({1, 1}, 7), all_lanes, fragment);
      expected = reference(expected, fragment);
    }
    EXPECT_EQ(std::memcmp(&surface->quad({1, 1}, 7), &expected, sizeof expected), 0) << name_of(format);
  }
}

/// Eight quads at four positions, some of their pixels live.
ShadedWarp random_warp(std::uint64_t seed) {
  ShadedWarp warp;
  warp.tile = {1, 2};
  warp.count = quads_per_warp;
  for (unsigned i = 0; i < warp.count; ++i) {
    const float a = testing::uniform(5, quads_per_warp * seed + i, 0.0F, 0.6F);
    warp.position[i] = static_cast<std::uint8_t>(mix(seed + 1000 * i) % 4);
    warp.live[i] = static_cast<LaneMask>(1 + mix(seed * 8 + i) % 15);
    warp.color[i] = color_of(a * 0.2F, a * 0.8F, a, a);
  }
  return warp;
}

TEST_F(ColorRopTest, QuadsOfAWarpAreBlendedAsOneByOne) {
  struct Result {
    std::vector<QuadColor> image;
    unsigned outcomes = 0;
    std::uint64_t fragments = 0, signals = 0;
  };
  const auto blend_warps = [&](bool together) {
    make();
    Result result;
    for (std::uint64_t w = 0; w < 300; ++w) {
      const ShadedWarp warp = random_warp(w);
      const auto from = static_cast<unsigned>(w % 3);
      CropBehaviour::Outcomes outcomes{};
      if (together) {
        crop->blend_quads(warp, from, warp.count, outcomes);
      } else {
        for (unsigned i = from; i < warp.count; ++i) {
          const std::size_t place = surface->grid().place(warp.tile, warp.position[i]);
          outcomes[i] = crop->blend(0, place, warp.live[i], warp.color[i]);
        }
      }
      for (const CropBehaviour::Outcome outcome : outcomes) {
        result.outcomes = 31 * result.outcomes + 2U * outcome.terminated + static_cast<unsigned>(outcome.changed);
      }
    }
    for (unsigned position = 0; position < 4; ++position) result.image.push_back(surface->quad({1, 2}, position));
    result.fragments = count("fragments_blended");
    result.signals = count("termination_signals");
    return result;
  };
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      context.format = format;
      context.termination = termination;
      const Result alone = blend_warps(false);
      const Result together = blend_warps(true);
      EXPECT_EQ(std::memcmp(alone.image.data(), together.image.data(), 4 * sizeof(QuadColor)), 0) << name_of(format);
      EXPECT_EQ(alone.outcomes, together.outcomes) << name_of(format);
      EXPECT_EQ(alone.fragments, together.fragments) << name_of(format);
      EXPECT_EQ(alone.signals, together.signals) << name_of(format);
      EXPECT_GT(together.signals, 0U) << name_of(format);
    }
  }
}

TEST_F(ColorRopTest, QuadsPerCycleFollowTheFormat) {
  const std::pair<ColorFormat, unsigned> expected[] = {{ColorFormat::rgba8, 4},
                                                       {ColorFormat::rgba16f, 2},
                                                       {ColorFormat::rgba32f, 1}};
  for (const auto& [format, quads] : expected) {
    context.format = format;
    make();
    EXPECT_EQ(crop->timing().blend_rate, (Rate{quads, 1}));
  }
}

struct Counted : StatisticSet {
  SectoredCacheStatistics statistics{*this, "cache"};
};

TEST(CropCache, HoldsItsLinesAndThenLetsTheOldestUnneededGo) {
  Counted counted;
  CropCache cache({512, 128, 32}, 4096, counted.statistics);
  unsigned dirty = 0;
  std::uint64_t evicted = 0;
  CropCache::Line lines[4];
  for (unsigned i = 0; i < 4; ++i) {
    EXPECT_EQ(cache.find(128 * i), CropCache::no_line);
    ASSERT_TRUE(cache.can_allocate());
    lines[i] = cache.allocate(128 * i, dirty, evicted);
    EXPECT_EQ(cache.find(128 * i + 127), lines[i]);
  }
  cache.dirty(lines[1], 0b0101);
  cache.pin(lines[0]);  // a queued quad needs the oldest
  const CropCache::Line line = cache.allocate(1024, dirty, evicted);
  EXPECT_EQ(line, lines[1]);
  EXPECT_EQ(dirty, 0b0101U);
  EXPECT_EQ(evicted, 128U);
  EXPECT_EQ(cache.find(128), CropCache::no_line);
  EXPECT_NE(cache.find(0), CropCache::no_line);
}

TEST(CropCache, NoLineCanBeHadWhileAllAreNeeded) {
  Counted counted;
  CropCache cache({256, 128, 32}, 4096, counted.statistics);
  unsigned dirty = 0;
  std::uint64_t evicted = 0;
  const CropCache::Line a = cache.allocate(0, dirty, evicted);
  const CropCache::Line b = cache.allocate(128, dirty, evicted);
  cache.pin(a);
  cache.pin(b);
  cache.pin(a);
  EXPECT_FALSE(cache.can_allocate());
  cache.unpin(a);
  EXPECT_FALSE(cache.can_allocate());
  cache.unpin(a);
  EXPECT_TRUE(cache.can_allocate());
}

TEST(CropCache, SectorsComeOneByOneAndGoWithTheirLine) {
  Counted counted;
  CropCache cache({128, 128, 32}, 4096, counted.statistics);
  unsigned dirty = 0;
  std::uint64_t evicted = 0;
  CropCache::Line line = cache.allocate(0, dirty, evicted);
  EXPECT_EQ(cache.absent(line) & 15U, 0b1111U);
  cache.start_fill(line, 2);
  EXPECT_EQ(cache.filling(line), 0b0100U);
  EXPECT_EQ(cache.absent(line) & 15U, 0b1011U) << "on its way: need not be asked for again";
  cache.finish_fill(line, 2);
  EXPECT_EQ(cache.filling(line), 0U);
  EXPECT_EQ(cache.absent(line) & 15U, 0b1011U);
  line = cache.allocate(256, dirty, evicted);
  EXPECT_EQ(cache.absent(line) & 15U, 0b1111U);
  EXPECT_EQ(dirty, 0U);
}

/// A cache as a list of lines, the one needed the longest ago first, and what it should count.
class LruOracle {
 public:
  LruOracle(std::size_t lines, std::uint64_t line_bytes) : lines_(lines), line_bytes_(line_bytes) {}

  struct Line {
    std::uint64_t tag;
    std::set<unsigned> present, dirty;
    unsigned pins = 0;
  };
  /// A quad needs sectors of a line; null when no line can be had for it.
  Line* access(std::uint64_t address, const std::vector<unsigned>& needed) {
    const std::uint64_t tag = address / line_bytes_;
    auto found = std::find_if(held.begin(), held.end(), [&](const Line& line) { return line.tag == tag; });
    const bool hit = found != held.end();
    if (!hit) {
      if (held.size() == lines_) {
        const auto oldest = std::find_if(held.begin(), held.end(), [](const Line& line) { return line.pins == 0; });
        if (oldest == held.end()) return nullptr;
        written_back += oldest->dirty.size();
        ++evicted;
        held.erase(oldest);
      }
      found = held.insert(held.end(), Line{tag, {}, {}});
    }
    ++(hit ? line_hits : line_misses);
    for (const unsigned sector : needed) ++(found->present.insert(sector).second ? sector_misses : sector_hits);
    held.splice(held.end(), held, found);
    return &held.back();
  }
  void needed_last(Line* line) {
    const auto at = std::find_if(held.begin(), held.end(), [&](const Line& other) { return &other == line; });
    held.splice(held.end(), held, at);
  }
  void expect_equal(const SectoredCacheStatistics& actual, std::uint64_t sector_bytes) const {
    EXPECT_EQ(actual.line_hits.value(), line_hits);
    EXPECT_EQ(actual.line_misses.value(), line_misses);
    EXPECT_EQ(actual.line_accesses.value(), line_hits + line_misses);
    EXPECT_EQ(actual.lines_evicted.value(), evicted);
    EXPECT_EQ(actual.sector_hits.value(), sector_hits);
    EXPECT_EQ(actual.sector_misses.value(), sector_misses);
    EXPECT_EQ(actual.sector_accesses.value(), sector_hits + sector_misses);
    EXPECT_EQ(actual.sectors_written_back.value(), written_back);
    EXPECT_EQ(actual.bytes_filled.value(), sector_bytes * sector_misses);
    EXPECT_EQ(actual.bytes_written_back.value(), sector_bytes * written_back);
  }

  std::list<Line> held;
  std::uint64_t line_hits = 0, line_misses = 0, evicted = 0, sector_hits = 0, sector_misses = 0, written_back = 0;

 private:
  const std::size_t lines_;
  const std::uint64_t line_bytes_;
};

/// Random accesses, most of them near the one before.
struct RandomAccess {
  std::uint64_t address;  ///< of the line
  std::vector<unsigned> needed;
  std::uint32_t sectors = 0;
  RandomAccess(std::uint64_t seed, std::uint64_t line_bytes, unsigned sectors_of_line, std::uint64_t lines) {
    const std::uint64_t near = seed / 20 % lines;
    address = line_bytes * (mix(seed) % 4 == 0 ? mix(seed + 1) % lines : (near + mix(seed + 2) % 6) % lines);
    for (unsigned sector = 0; sector < sectors_of_line; ++sector) {
      if (mix(seed + 3) >> sector & 1U) needed.push_back(sector), sectors |= 1U << sector;
    }
  }
};

struct CacheShape {
  std::uint32_t lines, line_bytes, sector_bytes;
};
class CropCacheOfShape : public ::testing::TestWithParam<CacheShape> {};
INSTANTIATE_TEST_SUITE_P(Shapes, CropCacheOfShape,
                         ::testing::Values(CacheShape{1, 128, 32}, CacheShape{2, 128, 128}, CacheShape{8, 128, 32},
                                           CacheShape{16, 1024, 32}, CacheShape{32, 64, 16}));

TEST_P(CropCacheOfShape, CountsAsAListOfLinesDoes) {
  const auto [lines, line_bytes, sector_bytes] = GetParam();
  constexpr std::uint64_t lines_of_surface = 64;
  Counted counted;
  CropCache cache({lines * line_bytes, line_bytes, sector_bytes}, lines_of_surface * line_bytes, counted.statistics);
  LruOracle oracle(lines, line_bytes);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const RandomAccess random(10 * i, line_bytes, line_bytes / sector_bytes, lines_of_surface);
    CropBehaviour::LineAccess access;
    access.address = random.address;
    access.sectors = random.sectors;
    cache.access(access);
    cache.accessed(1, static_cast<unsigned>(random.needed.size()));
    LruOracle::Line* const line = oracle.access(random.address, random.needed);
    if (mix(i) % 3 != 0) continue;
    cache.dirty(access.line, random.sectors);
    line->dirty.insert(random.needed.begin(), random.needed.end());
  }
  oracle.expect_equal(counted.statistics, sector_bytes);
  EXPECT_GT(oracle.sector_hits, 100U);
  EXPECT_GT(oracle.evicted, 100U);
}

// As CROP does at cycle: lines of queued quads stay, fills take their time, a look-up goes on where it had to stop.
TEST_P(CropCacheOfShape, CountsTheSameWhileFillsAreOnTheirWay) {
  const auto [lines, line_bytes, sector_bytes] = GetParam();
  constexpr std::uint64_t lines_of_surface = 64;
  Counted counted;
  CropCache cache({lines * line_bytes, line_bytes, sector_bytes}, lines_of_surface * line_bytes, counted.statistics);
  LruOracle oracle(lines, line_bytes);
  struct Queued {
    CropCache::Line line;
    std::uint32_t sectors;
    LruOracle::Line* expected;
    std::vector<unsigned> needed;
  };
  std::deque<Queued> queue;
  std::deque<std::pair<CropCache::Line, unsigned>> fills;
  const auto finish_fill = [&] {
    cache.finish_fill(fills.front().first, fills.front().second);
    fills.pop_front();
  };
  const auto blend = [&](std::uint64_t seed) {
    const Queued quad = queue.front();
    queue.pop_front();
    while ((cache.filling(quad.line) & quad.sectors) != 0) finish_fill();
    if (mix(seed) % 2 == 0) {
      cache.dirty(quad.line, quad.sectors);
      quad.expected->dirty.insert(quad.needed.begin(), quad.needed.end());
    }
    cache.unpin(quad.line);
    if (--quad.expected->pins == 0) oracle.needed_last(quad.expected);
  };
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const RandomAccess random(10 * i, line_bytes, line_bytes / sector_bytes, lines_of_surface);
    while (queue.size() > mix(i) % (2 * lines)) blend(i);
    CropCache::Line line = cache.find(random.address);
    while (line == CropCache::no_line && !cache.can_allocate()) blend(i);
    LruOracle::Line* const expected = oracle.access(random.address, random.needed);
    ASSERT_NE(expected, nullptr);
    if (line == CropCache::no_line) {
      unsigned dirty = 0;
      std::uint64_t evicted = 0;
      line = cache.allocate(random.address, dirty, evicted);
    }
    for (std::uint32_t missing = random.sectors & cache.absent(line); missing != 0; missing &= missing - 1) {
      const auto sector = static_cast<unsigned>(__builtin_ctz(missing));
      cache.start_fill(line, sector);
      fills.emplace_back(line, sector);
      if (mix(i + sector) % 4 == 0) finish_fill();
    }
    cache.pin(line);
    cache.accessed(1, static_cast<unsigned>(random.needed.size()));
    ++expected->pins;
    queue.push_back({line, random.sectors, expected, random.needed});
  }
  oracle.expect_equal(counted.statistics, sector_bytes);
}

TEST(CropCache, SectorsMoveInTheLongestNaturallyAlignedRuns) {
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

TEST(CropCache, AQuadsSectorsAreThoseThatHoldItsBytes) {
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
    const ColorSurface surface(32, 32, format);
    CropBehaviour::TimingParameters timing{};
    for (timing.line_bytes = 64; timing.line_bytes <= 1024; timing.line_bytes *= 2) {
      for (timing.sector_bytes = std::max(16U, timing.line_bytes / 32); timing.sector_bytes <= timing.line_bytes;
           timing.sector_bytes *= 2) {
        const auto quads = sectors_of_quads(timing, surface);
        for (unsigned position = 0; position < positions_per_tile; ++position) {
          const std::uint64_t tile = surface.address({1, 1}, 0);
          const std::uint64_t line = tile + std::uint64_t{quads[position].line} * timing.line_bytes;
          std::uint32_t expected = 0;
          for (std::uint64_t byte = 0; byte < 4 * bytes_per_pixel(format); ++byte) {
            const std::uint64_t offset = surface.address({1, 1}, position) + byte - line;
            ASSERT_LT(offset, timing.line_bytes) << position;
            expected |= 1U << (offset / timing.sector_bytes);
          }
          ASSERT_EQ(quads[position].sectors, expected) << position;
        }
      }
    }
  }
}

TEST_F(ColorRopTest, ShapesThatMakeNoCacheAreRefusedWhenTheUnitIsMade) {
  const auto refused = [&](const std::vector<std::pair<std::string, std::string>>& settings, const std::string& names) {
    try {
      make(settings);
      ADD_FAILURE() << "accepted, " << names;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("(" + names + ")"), std::string::npos) << error.what();
    }
  };
  refused({{"cache_bytes", "5000"}}, "crop.cache_bytes");
  refused({{"line_bytes", "96"}}, "crop.line_bytes");
  refused({{"sector_bytes", "48"}}, "crop.sector_bytes");
  refused({{"cache_bytes", "256"}, {"line_bytes", "512"}}, "crop.line_bytes, crop.cache_bytes");
  refused({{"sector_bytes", "256"}}, "crop.sector_bytes, crop.line_bytes");
  refused({{"line_bytes", "1024"}, {"sector_bytes", "16"}}, "crop.line_bytes, crop.sector_bytes");
  make({{"line_bytes", "32"}});
  context.format = ColorFormat::rgba32f;
  refused({{"line_bytes", "32"}}, "crop.line_bytes, --format");
}

}  // namespace
}  // namespace vrpipe
