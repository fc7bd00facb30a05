// What ZROP was measured to take on a real GPU beyond its rate: blocks that quads touch, flits of the ROPs' port, lines that
// come back.
#include <algorithm>
#include <functional>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "support/fidelities.h"
#include "zrop/block_price.h"
#include "zrop/block_time.h"
#include "zrop/zrop.h"

namespace vrpipe {
namespace {

using testing::Bins;
using testkit::Bench;
using testkit::Sink;
using testkit::Source;

Quad quad_at(unsigned position, std::uint32_t splat = 0, unsigned triangle = 0) {
  Quad quad{};
  quad.splat = splat;
  quad.position = static_cast<std::uint8_t>(position);
  quad.coverage = all_lanes;
  quad.triangle = triangle & 1U;
  return quad;
}

/// All quads of an 8x8 block, row by row, or of one of its halves.
std::vector<Quad> block_quads(unsigned first, unsigned columns, std::uint32_t splat = 0) {
  std::vector<Quad> quads;
  for (unsigned row = 0; row < 4; ++row) {
    for (unsigned column = 0; column < columns; ++column) quads.push_back(quad_at(first + 8 * row + column, splat));
  }
  return quads;
}

std::uint64_t price_of(const std::vector<Quad>& quads, BlockPrice price = BlockPrice(1000, 1400)) {
  return price.of({0, 0}, quads.data(), static_cast<unsigned>(quads.size()));
}

TEST(BlockPrice, IsOfTouchedHalvesAndAtLeastThatOfTheBlock) {
  EXPECT_EQ(price_of({quad_at(0)}), 1400U);
  EXPECT_EQ(price_of(block_quads(0, 2)), 1400U) << "a half";
  EXPECT_EQ(price_of(block_quads(0, 4)), 2000U) << "both: 8 quads a cycle";
  EXPECT_EQ(price_of({quad_at(0), quad_at(3)}), 2000U) << "a quad in each";
  EXPECT_EQ(price_of({quad_at(0), quad_at(4)}), 2800U) << "in the blocks on the left and on the right";
  EXPECT_EQ(price_of({quad_at(0), quad_at(32)}), 2800U) << "in those above and below";
}

TEST(BlockPrice, IsPaidByEachPrimitive) {
  EXPECT_EQ(price_of({quad_at(0, 0, 0), quad_at(1, 0, 1)}), 2800U) << "a strip of two triangles pays twice";
  EXPECT_EQ(price_of({quad_at(0, 0), quad_at(1, 1)}), 2800U);
}

TEST(BlockPrice, DoesNotDependOnWhereBeatsEnd) {
  const std::vector<Quad> quads = block_quads(0, 4);
  for (unsigned cut = 1; cut < quads.size(); ++cut) {
    BlockPrice price(1000, 1400);
    const std::uint64_t first = price.of({0, 0}, quads.data(), cut);
    EXPECT_EQ(first + price.of({0, 0}, quads.data() + cut, static_cast<unsigned>(quads.size()) - cut), 2000U) << cut;
  }
  BlockPrice price(1000, 1400);
  price.of({0, 0}, quads.data(), 1);
  EXPECT_EQ(price.of({1, 0}, quads.data(), 1), 1400U) << "another screen tile";
}

/// What was said, by cycle.
class SaidBlocks {
 public:
  explicit SaidBlocks(std::uint32_t quads_per_cycle)
      : time(quads_per_cycle, [this](std::uint64_t thousandths, Cycle from, Cycle until) {
          ASSERT_LT(from, until);
          for (Cycle cycle = from; cycle < until; ++cycle) of_cycle[cycle] += thousandths / (until - from);
        }) {}
  BlockTime time;
  std::map<Cycle, std::uint64_t> of_cycle;
};

TEST(BlockTime, IsWhatQuadsLeave) {
  SaidBlocks said(8);
  said.time.test(0, 4, 3400);
  said.time.settle(0);
  EXPECT_TRUE(said.of_cycle.empty()) << "others may come in this cycle";
  said.time.settle(3);
  EXPECT_EQ(said.of_cycle, (std::map<Cycle, std::uint64_t>{{0, 500}, {1, 1000}, {2, 1000}}));
  // In the last cycle 400 of the block are left, beside which quads are tested.
  said.time.test(3, 2, 0);
  said.time.settle(never);
  EXPECT_EQ(said.of_cycle[3], 150U);
  said.time.settle(never);
  EXPECT_EQ(said.of_cycle[3], 150U) << "once";
}

TEST(BlockTime, IsNotThatOfAWholeCycleThatGoesToOthers) {
  SaidBlocks said(8);
  said.time.test(0, 1, 1400);
  said.time.take_cycle(1);
  said.time.test(7, 16, 2000);
  said.time.settle(never);
  EXPECT_EQ(said.of_cycle, (std::map<Cycle, std::uint64_t>{{0, 875}}));
}

TEST(BlockTime, IsWholeThousandthsOfRatesThatAreNone) {
  SaidBlocks said(3);
  for (Cycle cycle = 0; cycle < 300; ++cycle) said.time.test(cycle, 1, 1000);
  said.time.settle(never);
  std::uint64_t sum = 0;
  for (const auto& [cycle, thousandths] : said.of_cycle) sum += thousandths;
  EXPECT_EQ(sum, 200'000U);
}

/// ZROP at any fidelity with time, in front of a memory or not; bins of up to a beat.
class ZropPrices : public ::testing::TestWithParam<Fidelity> {
 protected:
  ZropPrices()
      : draw(testing::draw_of(2048, 64, std::vector<Splat>(2048, testing::flat_box(0, 0, 1, 1, 0.5F)))),
        context(testing::context_of(draw)) {
    testing::terminate_early(context);
  }
  struct Bin {
    TileId tile;
    std::vector<Quad> quads;
  };
  /// The cycle in which the last of the bins leaves.
  Cycle run(const std::vector<Bin>& all, Bench::Settings settings, bool memory = false, unsigned latency = 100) {
    settings.insert(settings.begin(), {{"latency_cycles", "1"}, {"fast_clear", "off"}, {"quads_per_cycle", "8"}});
    Bench bench(GetParam(), "zrop", "depth-stencil-rop", context, settings);
    FixedLatencyMemory behind("memory", bench.clock(), latency - 1, 4096, 1);
    if (memory) bench.bind_memory(behind.port(0));
    bench.source<TerminationBeat>("in_terminations");
    Sink<PortReads>* const port = memory ? &bench.sink<PortReads>("out_reads", 8192) : nullptr;
    Bins bins;
    Cycle last = 0;
    if (GetParam() == Fidelity::cycle) {
      Source<QuadBeat>& in = bench.source<QuadBeat>("in_quads", 32);
      Sink<QuadBeat>& out = bench.sink<QuadBeat>("out_quads", 8192);
      for (const Bin& bin : all) {
        for (std::size_t from = 0; from < bin.quads.size(); from += QuadBeat::capacity) {
          QuadBeat beat;
          beat.tile = bin.tile;
          beat.count = static_cast<std::uint8_t>(std::min<std::size_t>(QuadBeat::capacity, bin.quads.size() - from));
          std::copy_n(bin.quads.begin() + static_cast<std::ptrdiff_t>(from), beat.count, beat.quads.begin());
          beat.last_of_bin = from + beat.count == bin.quads.size();
          in.add(beat);
        }
      }
      bench.run();
      last = out.records().back().cycle;
      close(bench, last);
      reads = behind_reads(bench);
    } else {
      Source<BinItem>& in = bench.source<BinItem>("in_quads", 32);
      Sink<BinItem>& out = bench.sink<BinItem>("out_quads", 8192);
      for (const Bin& bin : all) in.add(bins.of(bin.tile, bin.quads));
      bench.run();
      last = out.records().back().last;
      close(bench, last);
      reads = behind_reads(bench);
    }
    flits = 0;
    flits_at.clear();
    for (std::size_t i = 0; port != nullptr && i < port->records().size(); ++i) {
      flits += port->records()[i].item.flits;
      flits_at.push_back(port->records()[i].last);
    }
    return last;
  }
  void close(Bench& bench, Cycle end) {
    bench.unit().close_account(end);
    tests = testing::occupied(bench.unit(), ZropWork::tests, end);
    block_cycles = testing::occupied(bench.unit(), ZropWork::blocks, end);
  }
  static std::uint64_t behind_reads(Bench& bench) { return bench.unit().memory_bytes().read / 32; }
  /// Of each of so many bins more.
  double cycles_of_a_bin(const std::function<Bin(unsigned)>& make, const Bench::Settings& settings,
                         bool memory = false) {
    const auto cycles = [&](unsigned count) {
      std::vector<Bin> bins;
      for (unsigned i = 0; i < count; ++i) bins.push_back(make(i));
      return static_cast<double>(run(bins, settings, memory));
    };
    return (cycles(1200) - cycles(600)) / 600;
  }
  Draw draw;
  RenderContext context;
  std::uint64_t reads = 0;  ///< sectors, of the last run
  std::uint64_t flits = 0;  ///< of the same
  std::vector<Cycle> flits_at;
  double tests = 0;  ///< cycles of its own, of the same
  double block_cycles = 0;
};

INSTANTIATE_TEST_SUITE_P(Fidelities, ZropPrices, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

const Bench::Settings priced_blocks{{"half_block_cycles", "1"}, {"block_cycles", "1.4"}};

TEST_P(ZropPrices, FullBlocksAreTestedEightQuadsACycle) {
  const auto full = [](unsigned i) { return Bin{{0, 0}, block_quads(0, 4, i)}; };
  EXPECT_NEAR(cycles_of_a_bin(full, priced_blocks), 2, 0.01);
  EXPECT_NEAR(cycles_of_a_bin(full, {}), 2, 0.01);
}

TEST_P(ZropPrices, ASingleQuadTakesItsBlock) {
  const auto single = [](unsigned i) { return Bin{{0, 0}, {quad_at(i % 64, i)}}; };
  EXPECT_NEAR(cycles_of_a_bin(single, priced_blocks), 1.4, 0.01);
  EXPECT_LT(cycles_of_a_bin(single, {}), 1.01);
}

TEST_P(ZropPrices, BlocksTakeNoMoreThanTheTimeThatQuadsLeave) {
  // A quad pays for its block, and shares the time of that with the rest of the block's half, which costs nothing more.
  std::vector<Bin> bins;
  for (unsigned i = 0; i < 500; ++i) {
    std::vector<Quad> half = block_quads(i % 2 * 4, 2, i);
    bins.push_back({{0, 0}, {half.back()}});
    half.pop_back();
    bins.push_back({{0, 0}, half});
  }
  const auto cycles = static_cast<double>(run(bins, priced_blocks));
  EXPECT_NEAR(cycles, 500 * 1.4, 8);
  EXPECT_NEAR(tests, 500, 2) << "eight quads each";
  EXPECT_NEAR(block_cycles, 500 * 0.4, 8);
  EXPECT_LE(tests + block_cycles, cycles);
}

TEST_P(ZropPrices, BlocksTakeWhatTheyAreMeasuredTo) {
  std::vector<Bin> bins;
  for (unsigned i = 0; i < 500; ++i) bins.push_back({{0, 0}, {quad_at(i % 64, i)}});
  const auto cycles = static_cast<double>(run(bins, priced_blocks));
  EXPECT_NEAR(tests, 500 / 8.0, 1);
  EXPECT_NEAR(tests + block_cycles, 700, 2);
  EXPECT_LE(tests + block_cycles, cycles);
}

/// 32 lines of two blocks of D24S8.
const Bench::Settings small_cache{{"cache_bytes", "16384"},
                                  {"line_bytes", "512"},
                                  {"mshrs", "2048"},
                                  {"fetch_ahead_lines", "256"}};

TEST_P(ZropPrices, AFlitReadsAHalfOfABlock) {
  const auto flits_of = [this](const std::vector<std::vector<Quad>>& beats) {
    std::vector<Bin> bins;
    for (const std::vector<Quad>& quads : beats) bins.push_back({{3, 0}, quads});
    run(bins, small_cache, true);
    return flits;
  };
  EXPECT_EQ(flits_of({{quad_at(0)}}), 1U);
  EXPECT_EQ(flits_of({block_quads(0, 2)}), 1U) << "a half";
  EXPECT_EQ(flits_of({block_quads(0, 4)}), 2U) << "both";
  EXPECT_EQ(flits_of({{quad_at(0), quad_at(3)}}), 2U) << "a quad in each";
  EXPECT_EQ(flits_of({{quad_at(0), quad_at(4)}}), 2U) << "in two blocks";
  EXPECT_EQ(flits_of({{quad_at(0)}, {quad_at(25)}}), 1U) << "the rest of a half that is held";
  EXPECT_EQ(flits_of({{quad_at(0)}, {quad_at(2)}}), 2U);
}

TEST_P(ZropPrices, LinesComeBackAsFarAsTheQueueBehindTheSecondLookReaches) {
  // Two halves of each of 40 tiles in turn, with 33 of which a line has left the cache when it comes again.
  std::vector<Bin> bins;
  for (unsigned i = 0; i < 400; ++i)
    bins.push_back({{static_cast<std::uint16_t>(i % 40), 0}, {quad_at(0, i), quad_at(1, i), quad_at(2, i)}});
  const auto reads_with = [&](const char* halves) {
    Bench::Settings settings = small_cache;
    settings.emplace_back("input_halves", halves);
    run(bins, settings, true, 400);
    return reads;
  };
  EXPECT_EQ(reads_with("60"), 800U) << "a tile's halves are used before it is looked at again";
  EXPECT_EQ(reads_with("200"), 800U + 9 * 2) << "the first tile of each round but one stops";
}

TEST_P(ZropPrices, AheadOfItsDataMoreLinesAreUnderWayThanTheCacheHolds) {
  std::vector<Bin> bins;
  for (unsigned i = 0; i < 128; ++i) bins.push_back({{static_cast<std::uint16_t>(i), 0}, {quad_at(0, i)}});
  Bench::Settings pinned = small_cache;
  pinned.back().second = "0";
  EXPECT_LT(run(bins, small_cache, true, 1000), 1000U + 128 * 2 + 50);
  EXPECT_EQ(reads, 128U);
  EXPECT_GT(run(bins, pinned, true, 1000), 3 * 1000U) << "32 lines at a time";
}

TEST_P(ZropPrices, AheadOfItsDataACycleHasTheQuadsOfOnePrimitiveInOneBeat) {
  Bench::Settings wide = small_cache;
  wide.push_back({"quads_per_cycle", "16"});
  const auto cycles_of = [&](const std::vector<unsigned>& quads_of_primitives) {
    std::uint32_t primitive = 0;
    const auto make = [&](unsigned) {
      Bin bin{{0, 0}, {}};
      for (const unsigned quads : quads_of_primitives) {
        for (unsigned i = 0; i < quads; ++i) bin.quads.push_back(quad_at(i, primitive));
        ++primitive;
      }
      return bin;
    };
    return cycles_of_a_bin(make, wide, true);
  };
  EXPECT_NEAR(cycles_of({16}), 1, 0.01);
  EXPECT_NEAR(cycles_of({8, 8}), 2, 0.01);
  EXPECT_NEAR(cycles_of({12, 12}), 3, 0.01) << "12, 4 and 8 quads";
}

class ZropReturns : public ZropPrices {
 protected:
  static constexpr unsigned trip = 400;
  using Positions = std::vector<unsigned>;
  /// What a round of visits to tiles in turn takes, of a primitive for each of the positions, a quad of it. `by_round`: these, in turn.
  double trips(unsigned tiles, const std::vector<Positions>& by_round) {
    const auto cycles = [&](unsigned rounds) {
      std::vector<Bin> bins;
      std::uint32_t primitive = 0;
      for (unsigned i = 0; i < rounds * tiles; ++i) {
        Bin bin{{static_cast<std::uint16_t>(i % tiles), 0}, {}};
        for (const unsigned position : by_round[i / tiles % by_round.size()])
          bin.quads.push_back(quad_at(position, primitive++));
        bins.push_back(bin);
      }
      return static_cast<double>(run(bins, small_cache, true, trip));
    };
    return (cycles(24) - cycles(8)) / 16 / trip;
  }
};

INSTANTIATE_TEST_SUITE_P(Fidelities, ZropReturns, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(ZropReturns, TakeTrips) {
  EXPECT_LT(trips(32, {{0}}), 0.2) << "held: nothing comes back";
  for (const unsigned tiles : {33U, 64U, 96U}) EXPECT_NEAR(trips(tiles, {{0}}), 1, 0.03) << tiles;
  EXPECT_NEAR(trips(40, {{0, 1}}), 1, 0.05) << "the same half of a block";
  EXPECT_GT(trips(40, {{0, 2}}), 1.4) << "the other half";
  EXPECT_LT(trips(40, {{0, 2}}), 2.1);
  EXPECT_NEAR(trips(40, {{0, 4}}), 1, 0.05) << "another block of the line";
  EXPECT_NEAR(trips(40, {{0, 32}}), 1, 0.05) << "another line";
}

TEST_P(ZropReturns, AreOfHalvesOfBlocks) {
  EXPECT_NEAR(trips(40, {{0}, {1}}), 1, 0.05) << "the half that the round before needs";
  EXPECT_LT(trips(40, {{0}, {2}}), 0.7) << "the other half";
  EXPECT_LT(trips(40, {{0}, {4}}), 0.7) << "the other block";
}

TEST_P(ZropReturns, KeepWhatComesBehindThemFromBeingAskedFor) {
  const auto flits_in_time = [&](std::uint16_t after_33_tiles) {
    std::vector<Bin> bins;
    for (std::uint16_t tile = 0; tile < 33; ++tile) bins.push_back({{tile, 0}, {quad_at(0, tile)}});
    bins.push_back({{after_33_tiles, 0}, {quad_at(0, 33)}});
    for (std::uint16_t tile = 40; tile < 70; ++tile) bins.push_back({{tile, 0}, {quad_at(0, tile)}});
    run(bins, small_cache, true, trip);
    return std::count_if(flits_at.begin(), flits_at.end(), [](Cycle at) { return at < trip; });
  };
  EXPECT_EQ(flits_in_time(99), 33 + 1 + 30);
  EXPECT_LE(flits_in_time(0), 33 + 1 + 2) << "the first tile's line is still to be used";
}

}  // namespace
}  // namespace vrpipe
