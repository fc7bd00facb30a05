#include "qru/qru.h"
#include "qru/warp_numbering.h"

#include <algorithm>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::beat_of;

/// The pairs (front, back) and the singles, by the quads' numbers in the order in which they came, in launch order.
struct Outcome {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  std::vector<std::uint32_t> singles;
  std::vector<Warp> warps;
};

void collect(const Warp& warp, Outcome& outcome) {
  ASSERT_GE(warp.count, 1);
  ASSERT_LE(warp.count, 8);
  outcome.warps.push_back(warp);
  for (unsigned i = 0; i < warp.count; ++i) {
    if (i % 2 == 0 && ((warp.merge_pairs >> (i / 2)) & 1U) != 0) {
      ASSERT_LT(i + 1U, warp.count);
      ASSERT_EQ(warp.quads[i].position, warp.quads[i + 1].position);
      outcome.pairs.emplace_back(warp.quads[i].splat, warp.quads[i + 1].splat);
      ++i;
    } else {
      outcome.singles.push_back(warp.quads[i].splat);
    }
  }
}

class QruTest : public ::testing::Test {
 protected:
  QruTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {}

  /// One bin of quads at these positions, numbered from `first`.
  Outcome run(QruBehaviour& qru, const std::vector<unsigned>& positions, std::uint32_t first = 0,
              TileId tile = {0, 0}) {
    Outcome outcome;
    Warp warp;
    for (std::size_t at = 0; at < positions.size(); at += 16) {
      const std::vector<unsigned> part(positions.begin() + static_cast<std::ptrdiff_t>(at),
                                       positions.begin() +
                                           static_cast<std::ptrdiff_t>(std::min(at + 16, positions.size())));
      const QuadBeat beat = beat_of(tile, part, first + static_cast<std::uint32_t>(at));
      for (unsigned from = 0; from < beat.count;) {
        bool launched = false;
        from += qru.examine(tile, &beat.quads[from], beat.count - from, warp, launched);
        if (launched) collect(warp, outcome);
      }
    }
    while (qru.finish_bin(warp)) collect(warp, outcome);
    return outcome;
  }
  Outcome run(const std::vector<unsigned>& positions) {
    PairingQru qru(parameters, context);
    return run(qru, positions);
  }

  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  using Singles = std::vector<std::uint32_t>;
  Draw draw;
  RenderContext context;
  PairingQru::Parameters parameters;
};

// case M01
TEST_F(QruTest, QuadsOfOnePositionLeaveInPairsAndASingleInOrder) {
  for (const std::uint32_t count : {1U, 2U, 3U, 4U, 5U, 128U}) {
    const Outcome outcome = run(std::vector<unsigned>(count, 17));
    ASSERT_EQ(outcome.pairs.size(), count / 2);
    for (std::uint32_t i = 0; i < count / 2; ++i) EXPECT_EQ(outcome.pairs[i], (std::pair{2 * i, 2 * i + 1}));
    EXPECT_EQ(outcome.singles, count % 2 == 1 ? Singles{count - 1} : Singles{});
  }
}

// case M02
TEST_F(QruTest, TheFirstAndTheLastOf128QuadsCanPair) {
  std::vector<unsigned> positions(128);
  for (unsigned i = 1; i < 127; ++i) positions[i] = 1 + (i - 1) / 2 % 63;
  positions[0] = positions[127] = 0;
  const Outcome outcome = run(positions);
  EXPECT_TRUE(std::count(outcome.pairs.begin(), outcome.pairs.end(), std::pair<std::uint32_t, std::uint32_t>(0, 127)));
  EXPECT_EQ(outcome.pairs.size(), 64U);
}

// case M03
TEST_F(QruTest, ARegisterIsEmptyAfterItsPair) {
  const Outcome outcome = run({9, 9, 9});
  EXPECT_EQ(outcome.pairs, (Pairs{{0, 1}}));
  EXPECT_EQ(outcome.singles, (Singles{2}));
}

// case M04
TEST_F(QruTest, ABufferOf128QuadsIsExaminedInOnePartAndABiggerBinInTwo) {
  for (const std::uint32_t count : {127U, 128U, 129U}) {
    // The first and the last quad share a position, all others pair within the first 128.
    std::vector<unsigned> positions(count, 5);
    positions[0] = positions[count - 1] = 3;
    const Outcome outcome = run(positions);
    const bool one_part = count <= 128;
    EXPECT_EQ(std::count(outcome.pairs.begin(), outcome.pairs.end(),
                         std::pair<std::uint32_t, std::uint32_t>(0, count - 1)),
              one_part ? 1 : 0)
        << count;
    EXPECT_EQ(2 * outcome.pairs.size() + outcome.singles.size(), count);
  }
}

// case M05
TEST_F(QruTest, PositionsPairIndependentlyAndEachInOrder) {
  const Outcome outcome = run({10, 20, 10, 20, 10});
  EXPECT_EQ(outcome.pairs, (Pairs{{0, 2}, {1, 3}}));
  EXPECT_EQ(outcome.singles, (Singles{4}));
}

// case M12
TEST_F(QruTest, RelabelledPositionsGiveTheSamePairs) {
  std::vector<unsigned> positions;
  for (std::uint64_t i = 0; i < 120; ++i) positions.push_back(static_cast<unsigned>(mix(i) % 64));
  const Outcome expected = run(positions);
  for (unsigned k = 1; k < 64; k += 2) {
    std::vector<unsigned> relabelled;
    for (const unsigned position : positions) relabelled.push_back((position * k + 13) % 64);
    const Outcome outcome = run(relabelled);
    EXPECT_EQ(outcome.pairs, expected.pairs) << k;
    EXPECT_EQ(outcome.singles, expected.singles) << k;
  }
}

// case M13
TEST_F(QruTest, AnEmptyBinLaunchesNoWarp) { EXPECT_TRUE(run(std::vector<unsigned>{}).warps.empty()); }

// case M13
TEST_F(QruTest, OneAndThreeQuadsLeaveAsOneWarp) {
  EXPECT_EQ(run({4}).warps.size(), 1U);
  const Outcome three = run({4, 4, 4});
  EXPECT_EQ(three.warps.size(), 1U);
  EXPECT_EQ(three.warps[0].count, 3);
}

// case M14
TEST_F(QruTest, QuadsOfDifferentBinsNeverPair) {
  PairingQru qru(parameters, context);
  const Outcome first = run(qru, {7}, 0);
  const Outcome second = run(qru, {7}, 1);
  EXPECT_TRUE(first.pairs.empty());
  EXPECT_TRUE(second.pairs.empty());
  EXPECT_EQ(second.singles, (Singles{1}));
}

TEST_F(QruTest, QuadsOfOneSplatPairAsAnyOthers) {
  QuadBeat beat = beat_of({0, 0}, {5, 5}, 3);
  beat.quads[1].splat = 3;
  beat.quads[0].coverage = 0b0011;
  beat.quads[1].coverage = 0b1100;
  beat.quads[1].triangle = 1;
  PairingQru qru(parameters, context);
  Warp warp;
  bool launched = false;
  ASSERT_EQ(qru.examine(beat.tile, beat.quads.data(), 2, warp, launched), 2U);
  ASSERT_TRUE(qru.finish_bin(warp));
  EXPECT_EQ(warp.merge_pairs, 1);
}

TEST_F(QruTest, WarpsOfPairsAreFullBeforeTheLeftOversCome) {
  std::vector<unsigned> positions;
  for (unsigned i = 0; i < 8; ++i) positions.insert(positions.end(), {i, i});  // 8 pairs
  for (unsigned i = 20; i < 29; ++i) positions.push_back(i);                   // 9 singles
  const Outcome outcome = run(positions);
  ASSERT_EQ(outcome.warps.size(), 4U);
  EXPECT_EQ(outcome.warps[0].merge_pairs, 0xF);
  EXPECT_EQ(outcome.warps[1].merge_pairs, 0xF);
  EXPECT_EQ(outcome.warps[2].merge_pairs, 0);
  EXPECT_EQ(outcome.warps[2].count, 8);
  EXPECT_EQ(outcome.warps[3].count, 1);
}

TEST_F(QruTest, WarpsAreNumberedInTheDrawAndInTheirTile) {
  const Draw two_tiles = testing::draw_of(32, 16);
  PairingQru qru(parameters, context);
  WarpNumbering numbering(testing::context_of(two_tiles), qru);
  const std::uint32_t in_tile[] = {0, 1, 0, 1, 2, 3};
  std::uint32_t launched = 0;
  for (const unsigned x : {0U, 0U, 1U, 1U, 0U, 0U}) {
    Warp warp;
    warp.tile = {static_cast<std::uint16_t>(x), 0};
    numbering.number(warp);
    EXPECT_EQ(warp.sequence, launched);
    EXPECT_EQ(warp.tile_sequence, in_tile[launched]);
    ++launched;
  }
}

TEST_F(QruTest, AMarkHasTheNumberOfTheWarpThatFollows) {
  const Draw two_tiles = testing::draw_of(32, 16);
  PairingQru qru(parameters, context);
  WarpNumbering numbering(testing::context_of(two_tiles), qru);
  Warp warp;
  numbering.number(warp);
  numbering.number(warp);
  Warp mark;
  numbering.number_mark(mark);
  EXPECT_EQ(mark.sequence, 2U);
  numbering.number(warp);
  EXPECT_EQ(warp.sequence, 2U);
  EXPECT_EQ(warp.tile_sequence, 2U);
}

TEST_F(QruTest, WarpsPairsAndQuadsAreCountedOfAnyUnit) {
  QruPassThrough counts_nothing({}, context);
  WarpNumbering numbering(context, counts_nothing);
  Warp warp;
  warp.count = 5;
  warp.merge_pairs = 0b11;
  numbering.number(warp);
  warp.count = 8;
  warp.merge_pairs = 0;
  numbering.number(warp);
  EXPECT_EQ(counts_nothing.warps.value(), 2U);
  EXPECT_EQ(counts_nothing.pairs.value(), 2U);
  EXPECT_EQ(counts_nothing.quads_launched.value(), 13U);
}

// case T06
TEST_F(QruTest, NoQuadIsLostOrDoubledAndEachPositionKeepsItsOrder) {
  PairingQru qru(parameters, context);
  std::uint32_t first = 0;
  for (std::uint64_t bin = 0; bin < 300; ++bin) {
    std::vector<unsigned> positions;
    for (std::uint64_t i = 0; i < mix(bin) % 200; ++i)
      positions.push_back(static_cast<unsigned>(mix(bin * 1000 + i) % (1 + bin % 64)));
    const Outcome outcome = run(qru, positions, first);
    std::map<unsigned, std::uint32_t> last;
    std::set<std::uint32_t> seen;
    for (const Warp& warp : outcome.warps) {
      for (unsigned i = 0; i < warp.count; ++i) {
        const Quad& quad = warp.quads[i];
        ASSERT_TRUE(seen.insert(quad.splat).second);
        const auto before = last.find(quad.position);
        ASSERT_TRUE(before == last.end() || before->second < quad.splat) << "bin " << bin;
        last[quad.position] = quad.splat;
      }
    }
    ASSERT_EQ(seen.size(), positions.size());
    first += static_cast<std::uint32_t>(positions.size());
  }
}

TEST_F(QruTest, StorageIsThatOfThePapersTable) { EXPECT_EQ(PairingQru(parameters, context).storage_bytes(), 688U); }

TEST_F(QruTest, PassingThroughQuadsBecomeWarpsOfEightInTheirOrder) {
  const QruPassThrough::Parameters none;
  QruPassThrough qru(none, context);
  std::vector<unsigned> positions;
  for (unsigned i = 0; i < 19; ++i) positions.push_back(i / 2);
  const Outcome outcome = run(qru, positions);
  ASSERT_EQ(outcome.warps.size(), 3U);
  EXPECT_TRUE(outcome.pairs.empty());
  EXPECT_EQ(outcome.warps[2].count, 3);
  for (std::uint32_t i = 0; i < 19; ++i) EXPECT_EQ(outcome.singles[i], i);
}

TEST_F(QruTest, PassingThroughABinEndsItsWarp) {
  const QruPassThrough::Parameters none;
  QruPassThrough qru(none, context);
  EXPECT_EQ(run(qru, {1, 2}).warps.size(), 1U);
  EXPECT_EQ(run(qru, {1, 2}).warps.size(), 1U);
}

// A fragment of a pair that failed its test would have been blended with the other.
TEST_F(QruTest, QuadsOfADrawThatIsTestedLateFillWarpsInOrderAndNeverPair) {
  DrawState late;
  late.depth = {true, Compare::less, true};
  Frame frame(64, 64);
  frame.draw(testing::geometry_of(64, 64), DrawState());
  frame.draw(testing::geometry_of(64, 64), late);
  const RenderContext of_both = testing::context_of(frame);
  PairingQru pairing(PairingQru::Parameters(), of_both);
  for (const unsigned of_draw : {0U, 1U, 0U}) {
    QuadBeat bin = beat_of({0, 0}, {5, 5, 5, 7, 9, 7, 5, 9, 5, 5, 6});
    for (unsigned i = 0; i < bin.count; ++i) bin.quads[i].draw = of_draw & 0x7fffU;
    Outcome outcome;
    Warp warp;
    for (unsigned from = 0; from < bin.count;) {
      bool launched = false;
      from += pairing.examine(bin.tile, &bin.quads[from], bin.count - from, warp, launched);
      if (launched) collect(warp, outcome);
    }
    while (pairing.finish_bin(warp)) collect(warp, outcome);
    ASSERT_EQ(outcome.warps.size(), 2U);
    EXPECT_EQ(outcome.pairs.size(), of_draw == 0 ? 5U : 0U);
    if (of_draw == 0) continue;
    EXPECT_EQ(outcome.warps[0].count, 8);
    EXPECT_EQ(outcome.singles, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}));
  }
}

}  // namespace
}  // namespace vrpipe
