#include "software/sm_array.h"

#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

#include "sm/sm_parameters.h"

namespace vrpipe {
namespace {

constexpr double issue = 0.91;
constexpr double interval = 7;

/// Cores of four schedulers of 32 lanes.
SmArray array_of(std::uint32_t cores, std::uint32_t blocks_per_core = 8, std::uint32_t lanes = 32) {
  SmTime array{SmParameters(), DevicePrecision()};
  array.cores = cores;
  array.schedulers_per_core = 4;
  array.lanes_per_scheduler = lanes;
  return {array, {blocks_per_core, 910, 7, 0}};
}

/// Of eight warps that issue the same in each of some batches.
BlockWork even(std::uint64_t instructions, std::size_t batches = 1) {
  return {8, std::vector<std::uint64_t>(8 * batches, 1000 * instructions)};
}

TEST(SmArray, ABlockAloneGoesAsFastAsItsWarpsMay) {
  EXPECT_DOUBLE_EQ(array_of(4).fluid({even(100)}), 100 * interval);
  EXPECT_DOUBLE_EQ(array_of(4).least({even(100)}).longest_block, 100 * interval);
}

TEST(SmArray, WarpsWaitForTheSlowestBehindEachBatch) {
  BlockWork block{2, {10'000, 90'000, 80'000, 20'000}};
  EXPECT_DOUBLE_EQ(array_of(1).fluid({block}), (90 + 80) * interval);
  EXPECT_DOUBLE_EQ(array_of(1).least({block}).longest_block, (90 + 80) * interval);
}

TEST(SmArray, FullCoresIssueAtTheirRate) {
  // Eight blocks of eight warps on each core share 4 x 0.91 instructions a cycle.
  const std::vector<BlockWork> blocks(16, even(100, 3));
  const double expected = 8 * 8 * 300 / (4 * issue);
  EXPECT_DOUBLE_EQ(array_of(2).fluid(blocks), expected);
  EXPECT_DOUBLE_EQ(array_of(2).least(blocks).issue, expected);
}

TEST(SmArray, HalfTheLanesTakeTwiceTheTime) {
  const std::vector<BlockWork> blocks(16, even(100));
  EXPECT_DOUBLE_EQ(array_of(2, 8, 16).fluid(blocks), 2 * array_of(2).fluid(blocks));
}

TEST(SmArray, ABlockBeginsWhereOneEndsFirst) {
  // One at a time on each of two cores: 50, 20 and then 40 on the second.
  EXPECT_DOUBLE_EQ(array_of(2, 1).fluid({even(50), even(20), even(40)}), (20 + 40) * interval);
  EXPECT_DOUBLE_EQ(array_of(2, 1).fluid({even(50), even(20), even(10)}), 50 * interval);
}

TEST(SmArray, CoresAreActiveUntilTheirLastBlockIsDone) {
  double core_cycles = -1;
  array_of(2, 1).fluid({even(50), even(20), even(10)}, &core_cycles);
  EXPECT_DOUBLE_EQ(core_cycles, (50 + 20 + 10) * interval);
  array_of(3, 1).fluid({even(50)}, &core_cycles);
  EXPECT_DOUBLE_EQ(core_cycles, 50 * interval) << "two have none";
  array_of(2, 1).clocked({{1, {50'000}}, {1, {20'000}}, {1, {10'000}}}, &core_cycles);
  EXPECT_EQ(core_cycles, 7 * 50 + 7 * (20 + 10) + 1);
  array_of(2).fluid({}, &core_cycles);
  EXPECT_EQ(core_cycles, 0);
}

TEST(SmArray, WhenWarpsEndTheOthersHaveTheirShare) {
  // 32 warps share 3.64; when half of them are done the others go at their own pace.
  std::vector<BlockWork> blocks{even(10), even(10), even(30), even(30)};
  const double together = 10 * 32 / (4 * issue);
  EXPECT_DOUBLE_EQ(array_of(1).fluid(blocks), together + 20 * interval);
}

TEST(SmArray, AWarpStaysWithItsScheduler) {
  // Warps 0 and 4 of eight blocks, on one scheduler: the other three have nothing to do.
  const BlockWork block{8, {100'000, 0, 0, 0, 100'000, 0, 0, 0}};
  EXPECT_DOUBLE_EQ(array_of(1).fluid(std::vector<BlockWork>(8, block)), 16 * 100 / issue);
}

TEST(SmArray, NothingTakesNoTime) {
  EXPECT_EQ(array_of(4).fluid({}), 0);
  EXPECT_EQ(array_of(4).fluid(std::vector<BlockWork>(5)), 0);
  EXPECT_EQ(array_of(4).least(std::vector<BlockWork>(5)).issue, 0);
}

TEST(ClockedSmArray, AWarpAloneIssuesAtItsInterval) {
  EXPECT_EQ(array_of(1).clocked({{1, {100'000}}}), 700U);
  EXPECT_EQ(array_of(1).clocked({{1, {100'000, 50'000}}}), 700U + 1 + 350) << "and a cycle at the barrier";
  EXPECT_EQ(array_of(1).clocked({{1, {99'499}}}), 7U * 99) << "whole instructions";
}

TEST(ClockedSmArray, WarpsWaitForTheSlowestBehindEachBatch) {
  EXPECT_EQ(array_of(1).clocked({{2, {10'000, 90'000, 80'000, 20'000}}}), 7U * (90 + 80) + 1);
}

TEST(ClockedSmArray, ASchedulerLosesItsSharesOfSlots) {
  // Sixteen warps on one scheduler have 1600 instructions, of which 91 go in 100 cycles; then the last one ends.
  const BlockWork block{8, {100'000, 1000, 1000, 1000, 100'000, 1000, 1000, 1000}};
  const double expected = 16 * 100 / issue;
  EXPECT_NEAR(static_cast<double>(array_of(1).clocked(std::vector<BlockWork>(8, block))), expected, 8);
}

TEST(ClockedSmArray, BlocksBeginWhereOneEndsFirst) {
  const BlockWork fifty{1, {50'000}}, twenty{1, {20'000}}, forty{1, {40'000}};
  EXPECT_EQ(array_of(2, 1).clocked({fifty, twenty, forty}), 7U * (20 + 40) + 1);
}

TEST(ClockedSmArray, NothingTakesNoTime) {
  EXPECT_EQ(array_of(4).clocked({}), 0U);
  EXPECT_EQ(array_of(4).clocked(std::vector<BlockWork>(5)), 0U);
}

/// As those of tiles: warps of a block have much the same to do, some end early.
std::vector<BlockWork> tiles(std::uint64_t seed, std::size_t count) {
  std::vector<BlockWork> blocks;
  for (std::size_t i = 0; i < count; ++i) {
    BlockWork block{8, {}};
    const std::size_t batches = 1 + mix(seed + 100 * i) % 4;
    for (std::size_t j = 0; j < 8 * batches; ++j) {
      const std::uint64_t number = mix(seed + 1000 * i + j);
      block.instructions.push_back(number % 5 == 0 ? 60'000 : 4'000'000 + number % 4'000'000);
    }
    blocks.push_back(block);
  }
  return blocks;
}

TEST(ClockedSmArray, IsNearTheFluid) {
  for (std::uint64_t seed = 1; seed < 6; ++seed) {
    const std::vector<BlockWork> blocks = tiles(seed, 120);
    const double fluid = array_of(4).fluid(blocks);
    EXPECT_NEAR(static_cast<double>(array_of(4).clocked(blocks)), fluid, 0.02 * fluid);
  }
}

TEST(SmArray, IsNeverUnderWhatBindsIt) {
  for (std::uint64_t seed = 1; seed < 40; ++seed) {
    std::vector<BlockWork> blocks;
    std::uint64_t number = seed;
    const auto next = [&](std::uint64_t below) {
      number = mix(number);
      return number % below;
    };
    for (std::uint64_t i = next(60); i > 0; --i) {
      BlockWork block{static_cast<std::uint32_t>(1 + next(8)), {}};
      for (std::uint64_t j = block.warps * next(6); j > 0; --j) block.instructions.push_back(next(1'000'000));
      blocks.push_back(block);
    }
    const SmArray array = array_of(static_cast<std::uint32_t>(1 + next(5)), static_cast<std::uint32_t>(1 + next(8)));
    const SmArray::Least least = array.least(blocks);
    const double fluid = array.fluid(blocks) * (1 + 1e-12);
    EXPECT_GE(fluid, least.issue) << seed;
    EXPECT_GE(fluid, least.longest_block) << seed;
  }
}

}  // namespace
}  // namespace vrpipe
