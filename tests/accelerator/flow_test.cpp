#include "accelerator/flow.h"

#include <algorithm>
#include <array>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {
namespace {

using Cycles = std::array<std::uint64_t, accelerator_stages>;

/// At 1 GHz, 50 bytes a cycle.
AcceleratorFlow flow_of(std::uint32_t buffers = 2, std::array<std::uint32_t, 3> latencies = {}) {
  return AcceleratorFlow({1000, 50'000, latencies, buffers, {"a", "b", "c"}});
}

AcceleratorStep step_of(const Cycles& cycles, const Cycles& bytes = {}) {
  AcceleratorStep step;
  for (std::size_t stage = 0; stage < accelerator_stages; ++stage) step.parts[stage] = {1, cycles[stage], bytes[stage]};
  return step;
}

TEST(AcceleratorFlow, EqualStepsTakeTheBusiestStageAndOneStepsWayThroughTheOthers) {
  const std::vector<AcceleratorStep> steps(100, step_of({5, 20, 8}));
  for (const std::uint32_t buffers : {2U, 3U, 50U}) {
    EXPECT_EQ(flow_of(buffers, {1, 2, 3}).end(steps), 1000U * (5 + 100 * 20 + 8 + 1 + 2 + 3));
    EXPECT_EQ(flow_of(buffers, {1, 2, 3}).bound(steps), 1000U * (5 + 100 * 20 + 1 + 2 + 3));
  }
  EXPECT_EQ(flow_of().end({}), 0U);
  EXPECT_EQ(flow_of().bound({}), 0U);
}

TEST(AcceleratorFlow, WithASingleBufferAStageWaitsUntilItsLastStepIsTaken) {
  const std::vector<AcceleratorStep> steps(100, step_of({0, 20, 8}));
  EXPECT_EQ(flow_of(1).end(steps), 1000U * 100 * (20 + 8));
}

TEST(AcceleratorFlow, WhatComesBeforeEveryStepIsAHead) {
  std::vector<AcceleratorStep> steps{step_of({700, 0, 0})};
  for (int i = 0; i < 10; ++i) steps.push_back(step_of({0, 3, 10}));
  EXPECT_EQ(flow_of().end(steps), 1000U * (700 + 3 + 10 * 10));
  EXPECT_EQ(flow_of().bound(steps), 1000U * (700 + 10 * 10)) << "of stages before, the busiest";
}

TEST(AcceleratorFlow, ImbalanceIsSeenStepByStep) {
  // Steps that are long in one stage, then steps that are long in the other: buffers hold two of them.
  std::vector<AcceleratorStep> apart, mixed;
  for (int i = 0; i < 100; ++i) {
    apart.push_back(i < 50 ? step_of({0, 10, 1}) : step_of({0, 1, 10}));
    mixed.push_back(i % 2 == 0 ? step_of({0, 10, 1}) : step_of({0, 1, 10}));
  }
  EXPECT_EQ(flow_of().bound(apart), flow_of().bound(mixed));
  EXPECT_LT(flow_of().end(mixed), 1000U * 600);
  EXPECT_EQ(flow_of().end(apart), 1000U * (50 * 10 + 1 + 50 * 10));
}

TEST(AcceleratorFlow, OneMemoryServesEveryStage) {
  const std::vector<AcceleratorStep> steps(100, step_of({1, 1, 1}, {100, 200, 300}));
  const std::uint64_t moving = 100 * (100 + 200 + 300) / 50;
  EXPECT_EQ(flow_of().bound(steps), 1000 * moving);
  EXPECT_GE(flow_of().end(steps), 1000 * moving);
  EXPECT_LE(flow_of().end(steps), 1000 * (moving + 600 / 50 + 3));
  EXPECT_EQ(flow_of().memory_time(1), 20U);
}

TEST(AcceleratorFlow, WhatIsMovedWhileAStageWorksIsHidden) {
  const std::vector<AcceleratorStep> steps(100, step_of({10, 0, 0}, {500, 0, 0}));
  EXPECT_EQ(flow_of().end(steps), 1000U * 1000);
}

TEST(AcceleratorFlow, IsNeverUnderItsBoundAndBuffersHelp) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const auto number = [&](std::uint64_t index, std::uint64_t below) { return mix(seed ^ mix(index)) % below; };
    std::vector<AcceleratorStep> steps;
    const bool moves = seed % 2 == 0;
    for (std::uint64_t i = 0; i < 1 + number(0, 40); ++i) {
      Cycles cycles{}, bytes{};
      for (std::uint64_t stage = 0; stage < 3; ++stage) {
        if (number(100 * i + stage, 4) != 0) cycles[stage] = number(100 * i + 10 + stage, 50);
        if (moves) bytes[stage] = number(100 * i + 20 + stage, 3000);
      }
      steps.push_back(step_of(cycles, bytes));
    }
    const std::array<std::uint32_t, 3> latencies{static_cast<std::uint32_t>(number(1, 30)), 5,
                                                 static_cast<std::uint32_t>(number(2, 30))};
    std::uint64_t before = ~std::uint64_t{0};
    for (const std::uint32_t buffers : {1U, 2U, 3U, 100U}) {
      const AcceleratorFlow flow = flow_of(buffers, latencies);
      EXPECT_GE(flow.end(steps), flow.bound(steps)) << seed;
      if (!moves) {
        EXPECT_LE(flow.end(steps), before) << seed;
      }
      before = flow.end(steps);
    }
  }
}

}  // namespace
}  // namespace vrpipe
