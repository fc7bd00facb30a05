#include <vrpipe/workloads/scene_description.h>

#include <cmath>
#include <limits>

#include "workload_test_support.h"

namespace vrpipe {
namespace {

using testing::ordinary_gaussian;
using testing::scene_of;

/// 101 Gaussians, of which the one that stands at p percent has these attributes, in a shuffled order.
std::vector<GaussianAttributes> hundred_steps() {
  std::vector<GaussianAttributes> gaussians;
  for (unsigned i = 0; i <= 100; ++i) {
    const unsigned p = i * 37 % 101;
    GaussianAttributes g = ordinary_gaussian();
    g.position = {static_cast<float>(p), static_cast<float>(100 - p), 7};
    g.opacity_logit = std::log(static_cast<float>(p + 1) / static_cast<float>(102 - (p + 1)));  // opacity (p + 1) / 102
    g.log_scale = {std::log(static_cast<float>(p + 1)), 0, std::log(0.5f)};
    gaussians.push_back(g);
  }
  return gaussians;
}

TEST(SceneDescription, QuantilesAreThoseOfTheValuesInOrder) {
  const SceneDescription d = describe(scene_of(hundred_steps()));
  EXPECT_EQ(d.count, 101U);
  for (std::size_t i = 0; i < kDescribedPercents.size(); ++i) {
    const double p = kDescribedPercents[i];
    EXPECT_NEAR(d.opacity[i], (p + 1) / 102, 1e-6) << p;
    EXPECT_NEAR(d.scale[i], p + 1, 1e-4 * (p + 1)) << p;
    EXPECT_NEAR(d.anisotropy[i], 2 * (p + 1), 1e-4 * (p + 1)) << p;
  }
}

TEST(SceneDescription, BoundsHoldAllPositionsAndThoseOfTheMiddleLeaveOutOneInAHundredAtEachEnd) {
  const SceneDescription d = describe(scene_of(hundred_steps()));
  EXPECT_EQ(d.low, (std::array<double, 3>{0, 0, 7}));
  EXPECT_EQ(d.high, (std::array<double, 3>{100, 100, 7}));
  EXPECT_EQ(d.low_middle, (std::array<double, 3>{1, 1, 7}));
  EXPECT_EQ(d.high_middle, (std::array<double, 3>{99, 99, 7}));
}

TEST(SceneDescription, WhatCannotBeDrawnIsCountedAndLeftOut) {
  std::vector<GaussianAttributes> gaussians(3, ordinary_gaussian());
  gaussians[0].position[0] = std::numeric_limits<float>::infinity();
  gaussians[1].rotation = {0, 0, 0, 0};
  const SceneDescription d = describe(scene_of(gaussians));
  EXPECT_EQ(d.rejected.not_finite, 1U);
  EXPECT_EQ(d.rejected.zero_quaternion, 1U);
  EXPECT_EQ(d.high[0], 0);
}

TEST(SceneDescription, OfNothingIsNothing) {
  EXPECT_EQ(describe(GaussianScene()).count, 0U);
  EXPECT_EQ(describe(GaussianScene()).scale[0], 0);
}

TEST(SceneDescription, AnOpacityOfZeroAndAPointAreSaidAsSuch) {
  GaussianAttributes g = ordinary_gaussian();
  g.opacity_logit = -40;
  const float minus_infinity = -std::numeric_limits<float>::infinity();
  g.log_scale = {minus_infinity, minus_infinity, minus_infinity};
  const SceneDescription d = describe(scene_of({g}));
  EXPECT_EQ(d.opacity[0], 0);
  EXPECT_EQ(d.scale[0], 0);
  EXPECT_EQ(d.anisotropy[0], 1);
}

}  // namespace
}  // namespace vrpipe
