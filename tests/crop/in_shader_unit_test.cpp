// When a shader that blends loads and stores: with a lock, and without.
#include <gtest/gtest.h>

#include "crop/in_shader_bench.h"

namespace vrpipe {
namespace {

using testing::InShaderBench;

constexpr Cycle latency = 100, blend = 40, hand_over = 500;
/// From when it loads to when it has stored.
constexpr Cycle inside = latency + blend + latency;
const testkit::Bench::Settings locked{{"tile_lock_cycles", "20"},
                                      {"warp_lock_cycles", "10"},
                                      {"blend_cycles", "40"},
                                      {"hand_over_cycles", "500"}};
testkit::Bench::Settings with(testkit::Bench::Settings settings) {
  settings.insert(settings.begin(), locked.begin(), locked.end());
  return settings;
}

class InShaderUnitTest : public ::testing::TestWithParam<Fidelity> {
 protected:
  InShaderUnitTest() : draw(testing::draw_of(256, 128)), context(testing::context_of(draw)) {}
  InShaderBench bench(const testkit::Bench::Settings& settings = {}) const {
    return InShaderBench(GetParam(), context, with(settings), latency);
  }
  Draw draw;
  RenderContext context;
};
INSTANTIATE_TEST_SUITE_P(Fidelities, InShaderUnitTest, ::testing::ValuesIn(testing::fidelities_with_time()),
                         testing::name_of_fidelity);

TEST_P(InShaderUnitTest, AWarpLoadsBlendsAndStores) {
  InShaderBench shader = bench();
  shader.warp({0, 0}, {{0, 0.5F}, {1, 0.25F}});
  EXPECT_EQ(shader.run(), 1 + inside);
  EXPECT_EQ(shader.alpha({0, 0}, 0), 0.5F);
  EXPECT_EQ(shader.alpha({0, 0}, 1), 0.25F);
  EXPECT_EQ(shader.bench.unit().memory_bytes().read, 64U);
  EXPECT_EQ(shader.bench.unit().memory_bytes().written, 64U);
}

TEST_P(InShaderUnitTest, OneOfTheSamePixelWaitsForAHandOver) {
  InShaderBench shader = bench();
  for (unsigned i = 0; i < 3; ++i) shader.warp({0, 0}, {{0, 0.5F}});
  EXPECT_EQ(shader.run(), 1 + 3 * inside + 2 * hand_over);
  EXPECT_EQ(shader.alpha({0, 0}, 0), 0.875F);
}

TEST_P(InShaderUnitTest, OneThatComesLaterWaitsForWhatIsLeftOfIt) {
  InShaderBench shader = bench();
  shader.warp({0, 0}, {{0, 0.5F}});
  shader.warp({0, 0}, {{0, 0.5F}}, inside + 300);
  EXPECT_EQ(shader.run(), 1 + 2 * inside + hand_over);
}

TEST_P(InShaderUnitTest, OthersTakeTheLockInTurn) {
  InShaderBench apart = bench();
  for (std::uint16_t tile = 0; tile < 4; ++tile) apart.warp({tile, 0}, {{0, 0.5F}});
  EXPECT_EQ(apart.run(), 1 + 3 * (20 + 10) + inside) << "a coverage tile each";
  InShaderBench together = bench();
  for (unsigned position = 0; position < 4; ++position) together.warp({0, 0}, {{position, 0.5F}});
  EXPECT_EQ(together.run(), 1 + (20 + 10) + 2 * 10 + inside) << "one coverage tile";
}

TEST_P(InShaderUnitTest, TheOtherHalfOfAQuadDoesNotWait) {
  InShaderBench shader = bench();
  shader.warp({0, 0}, {{0, 0.5F, 0b0011}});
  shader.warp({0, 0}, {{0, 0.25F, 0b1100}});
  EXPECT_EQ(shader.run(), 1 + 30 + inside);
  EXPECT_EQ(shader.alpha({0, 0}, 0, 0), 0.5F);
  EXPECT_EQ(shader.alpha({0, 0}, 0, 3), 0.25F);
}

TEST_P(InShaderUnitTest, AWarpThatHasAPixelTwiceTakesTheLockTwice) {
  InShaderBench shader = bench();
  shader.warp({0, 0}, {{0, 0.5F}, {1, 0.5F}, {0, 0.5F}});
  EXPECT_EQ(shader.run(), 1 + 2 * inside + hand_over);
  EXPECT_EQ(shader.alpha({0, 0}, 0), 0.75F);
}

TEST_P(InShaderUnitTest, NoMoreWarpsAreInsideThanThereAreHeld) {
  InShaderBench shader = bench({{"warps", "2"}, {"tile_lock_cycles", "0"}, {"warp_lock_cycles", "0"}});
  for (std::uint16_t tile = 0; tile < 6; ++tile) shader.warp({tile, 0}, {{0, 0.5F}});
  const Cycle cycles = shader.run();
  EXPECT_GE(cycles, 1 + 3 * inside);
  EXPECT_LE(cycles, 1 + 3 * inside + 8);
}

TEST_P(InShaderUnitTest, WithoutALockUpdatesAreLost) {
  InShaderBench shader = bench({{"lock", "none"}});
  shader.warp({0, 0}, {{0, 0.5F}});
  shader.warp({0, 0}, {{0, 0.25F}}, 20);                         // loads before that is stored
  shader.warp({0, 0}, {{0, 0.5F}}, 2 * (latency + blend) + 50);  // behind both stores
  EXPECT_EQ(shader.run(), 2 * (latency + blend) + 51 + inside);
  EXPECT_EQ(shader.alpha({0, 0}, 0), 0.625F) << "the second on nothing, the third on the second";
  EXPECT_EQ(shader.lost(), 4U);
}

TEST_P(InShaderUnitTest, WithoutALockAStoreIsSeenByALoadOfTheSameCycle) {
  for (const Cycle later : {latency + blend - 1, latency + blend}) {
    InShaderBench shader = bench({{"lock", "none"}});
    shader.warp({0, 0}, {{0, 0.5F}});
    shader.warp({0, 0}, {{0, 0.5F}}, later);
    shader.run();
    EXPECT_EQ(shader.lost(), later < latency + blend ? 4U : 0U);
    EXPECT_EQ(shader.alpha({0, 0}, 0), later < latency + blend ? 0.5F : 0.75F);
  }
}

TEST_P(InShaderUnitTest, WithoutALockNobodyWaits) {
  InShaderBench shader = bench({{"lock", "none"}});
  for (unsigned i = 0; i < 8; ++i) shader.warp({0, 0}, {{0, 0.5F}});
  const Cycle cycles = shader.run();
  EXPECT_GE(cycles, 1 + inside);
  EXPECT_LE(cycles, 9 + inside);
}

TEST_P(InShaderUnitTest, AMarkWaitsUntilAllBeforeItIsStored) {
  Frame frame(256, 128);
  frame.draw(testing::geometry_of(256, 128), {});
  Clear clear;
  clear.color = true;
  frame.clear(clear);
  frame.draw(testing::geometry_of(256, 128), {});
  context = testing::context_of(frame);
  for (const char* lock : {"ordered", "none"}) {
    InShaderBench shader = bench({{"lock", lock}});
    shader.warp({0, 0}, {{0, 0.5F}});
    shader.warp({1, 0}, {{0, 0.5F}});
    shader.mark(static_cast<Mark>(2));
    shader.warp({1, 0}, {{0, 0.25F}});
    const Cycle cycles = shader.run();
    EXPECT_GE(cycles, 2 * inside) << lock;
    EXPECT_EQ(shader.alpha({0, 0}, 0), 0) << lock;
    EXPECT_EQ(shader.alpha({1, 0}, 0), 0.25F) << lock;
  }
}

TEST_P(InShaderUnitTest, CyclesAreChargedOnce) {
  InShaderBench shader = bench();
  for (unsigned i = 0; i < 3; ++i) shader.warp({0, 0}, {{0, 0.5F}});
  const Cycle end = shader.run();
  EXPECT_GT(testing::charged(shader.bench.unit(), UnitState::busy, end), 0U);
  EXPECT_NEAR(testing::occupied(shader.bench.unit(), InShaderWork::lock), 30 + 2 * 30, 0.001);
}

TEST_P(InShaderUnitTest, StallsChangeTimeAlone) {
  const auto alphas = [&](std::uint64_t seed) {
    InShaderBench shader = bench();
    if (seed != 0) shader.bench.stall_randomly(seed, 64);
    for (std::uint64_t i = 0; i < 200; ++i) {
      std::vector<InShaderBench::Quad> quads;
      for (std::uint64_t q = 0; q < 1 + mix(i) % 8; ++q) {
        quads.push_back({static_cast<unsigned>(mix(8 * i + q) % 6), testing::uniform(3, 8 * i + q, 0, 0.5F),
                         static_cast<LaneMask>(1 + mix(i ^ q) % 15)});
      }
      shader.warp({static_cast<std::uint16_t>(mix(i + 77) % 3), 0}, quads);
    }
    EXPECT_NE(shader.run(), never);
    EXPECT_EQ(shader.lost(), 0U);
    std::vector<float> all;
    for (std::uint16_t tile = 0; tile < 3; ++tile) {
      for (unsigned position = 0; position < 6; ++position) {
        for (unsigned lane = 0; lane < 4; ++lane) all.push_back(shader.alpha({tile, 0}, position, lane));
      }
    }
    return all;
  };
  const std::vector<float> without = alphas(0);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) EXPECT_EQ(alphas(seed), without) << seed;
}

TEST(InShaderFidelities, LtAndCycleAgreeOnRandomWarps) {
  const Draw draw = testing::draw_of(256, 128);
  const RenderContext context = testing::context_of(draw);
  for (const char* lock : {"ordered", "none"}) {
    const auto cycles = [&](Fidelity fidelity) {
      InShaderBench shader(fidelity, context, with({{"lock", lock}, {"warps", "16"}}), latency);
      for (std::uint64_t i = 0; i < 400; ++i) {
        std::vector<InShaderBench::Quad> quads;
        for (std::uint64_t q = 0; q < 1 + mix(i) % 8; ++q)
          quads.push_back(
              {static_cast<unsigned>(mix(8 * i + q) % 30), 0.1F, static_cast<LaneMask>(1 + mix(i ^ q) % 15)});
        shader.warp({static_cast<std::uint16_t>(mix(i + 77) % 16), 0}, quads);
      }
      return std::pair{shader.run(), shader.lost()};
    };
    const auto lt = cycles(Fidelity::lt), cycle = cycles(Fidelity::cycle);
    EXPECT_NEAR(static_cast<double>(lt.first), static_cast<double>(cycle.first),
                0.01 * static_cast<double>(cycle.first))
        << lock;
    EXPECT_NEAR(static_cast<double>(lt.second), static_cast<double>(cycle.second),
                0.05 * static_cast<double>(cycle.second) + 1)
        << lock;
  }
}

}  // namespace
}  // namespace vrpipe
