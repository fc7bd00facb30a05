// What windows say of a frame: exact where work alone takes time, and inside of the interval where chance does.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

#include "run/sampled_time.h"

namespace vrpipe {
namespace {

double uniform_at(std::uint64_t seed) { return static_cast<double>(mix(seed) >> 11U) * 0x1p-53; }

/// Cycles are 2 of the first kind and 3 of the second, and by chance up to `noise` of that more or less.
struct SyntheticFrame {
  std::vector<SampledStratum> strata;
  double cycles = 0;

  SyntheticFrame(std::uint64_t seed, double noise) {
    constexpr unsigned windows_in_stratum = 30;
    constexpr double quads = 20000;
    for (std::uint64_t i = 0; i < 24; ++i) {
      SampledStratum stratum;
      const auto drawn = static_cast<unsigned>(uniform_at(seed * 31 + i) * windows_in_stratum);
      for (unsigned part = 0; part < windows_in_stratum; ++part) {
        const std::uint64_t place = (seed << 32U) + i * 1000 + part;
        SampledWork work{};
        work[0] = 1000 + 500 * uniform_at(place * 3);
        work[1] = 800 * uniform_at(place * 3 + 1) + 20 * static_cast<double>(i);
        const double took = (2 * work[0] + 3 * work[1]) * (1 + noise * (2 * uniform_at(place * 3 + 2) - 1));
        cycles += took;
        stratum.quads += quads;
        for (std::size_t kind = 0; kind < work.size(); ++kind) stratum.work[kind] += work[kind];
        if (part != drawn) continue;
        stratum.window_quads = quads;
        stratum.window_work = work;
        stratum.window_cycles = took;
      }
      strata.push_back(stratum);
    }
  }
};

TEST(SampledTime, IsExactWhereWorkAloneTakesTime) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const SyntheticFrame frame(seed, 0);
    const EstimatedTime time = estimate_time(frame.strata);
    EXPECT_NEAR(time.cycles / frame.cycles, 1, 1e-5);
    EXPECT_LT(time.half_width / frame.cycles, 1e-4);
  }
}

TEST(SampledTime, ItsIntervalHolds95InAHundred) {
  unsigned inside = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    const SyntheticFrame frame(seed, 0.2);
    const EstimatedTime time = estimate_time(frame.strata);
    inside += std::fabs(time.cycles - frame.cycles) <= time.half_width ? 1 : 0;
    EXPECT_LT(time.half_width / frame.cycles, 0.1) << "and is of use";
  }
  EXPECT_GE(inside, 376) << "of 400";  // 380 expected, less one standard deviation
}

TEST(SampledTime, WhatGroupsTakeBeyondTheirWorkIsNoChanceBetweenThem) {
  unsigned inside = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SyntheticFrame frame(seed, 0.01);
    for (std::size_t i = 0; i < 4; ++i) {
      SampledStratum& stratum = frame.strata[6 * i];
      stratum.window_cycles += 0.05 * stratum.window_quads;
      frame.cycles += 0.05 * stratum.quads;
    }
    const EstimatedTime as_one = estimate_time(frame.strata);
    for (std::size_t i = 0; i < 4; ++i) frame.strata[6 * i].group = 1;
    const EstimatedTime time = estimate_time(frame.strata);
    EXPECT_EQ(time.cycles, as_one.cycles);
    inside += std::fabs(time.cycles - frame.cycles) <= time.half_width ? 1 : 0;
    EXPECT_LT(time.half_width, 0.8 * as_one.half_width) << seed;
  }
  EXPECT_GE(inside, 376) << "of 400";
}

}  // namespace
}  // namespace vrpipe
