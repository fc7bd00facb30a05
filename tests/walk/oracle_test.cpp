// The oracle of the random walk sees what it is there to see: results that were right are made wrong.
#include "walk/oracle.h"

#include <gtest/gtest.h>

#include "support/simulate.h"

namespace vrpipe::walk {
namespace {

class Oracle : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Draw draw = testing::random_draw(48, 40, 200, 7);
    result = std::make_unique<RunResult>(
        testing::run(testing::request_of("het+qm", Fidelity::cycle, testing::strictly), draw));
  }
  static void TearDownTestSuite() { result.reset(); }

  static void expect_rule(const std::vector<Finding>& findings, const std::string& rule) {
    for (const Finding& finding : findings) {
      if (finding.rule == rule) return;
    }
    ADD_FAILURE() << "nothing breaks the rule: " << rule;
  }
  RunResult changed(const std::function<void(RunResult&)>& change) const {
    RunResult other = *result;
    change(other);
    return other;
  }
  static std::unique_ptr<RunResult> result;
};
std::unique_ptr<RunResult> Oracle::result;

TEST_F(Oracle, HasNothingAgainstARightResult) {
  EXPECT_TRUE(broken_rules(*result).empty());
  EXPECT_TRUE(broken_rules(*result, *result).empty());
  EXPECT_TRUE(broken_repetition(*result, *result).empty());
}

TEST_F(Oracle, SeesALostQuadAndALostFragment) {
  expect_rule(broken_rules(changed([](RunResult& r) { ++r.counts.quads_rasterized; })), "conservation");
  expect_rule(broken_rules(changed([](RunResult& r) { --r.counts.fragments_blended; })), "conservation");
}

TEST_F(Oracle, SeesAStateBelowZeroThoughTheSumIsRight) {
  const RunResult wrapped = changed([](RunResult& r) {
    r.units[0].cycles[0] -= *r.cycles + 1;
    r.units[0].cycles[1] += *r.cycles + 1;
  });
  expect_rule(broken_rules(wrapped), "a state is part of the cycles");
}

TEST_F(Oracle, SeesACycleThatNoStateHas) {
  expect_rule(broken_rules(changed([](RunResult& r) { ++*r.cycles; })), "states sum to the cycles");
}

TEST_F(Oracle, SeesAUtilizationBeyondOne) {
  expect_rule(broken_rules(changed([](RunResult& r) { r.utilization[0].second = 1.01; })), "utilization is a share");
  expect_rule(broken_rules(changed([](RunResult& r) { r.utilization[0].second = std::nan(""); })),
              "utilization is a share");
}

TEST_F(Oracle, SeesAnOccupancyBeyondOneAndOneBelowTheUtilization) {
  expect_rule(broken_rules(changed([](RunResult& r) { r.units[4].occupancy = 1.01; })), "occupancy is a share");
  expect_rule(broken_rules(changed([](RunResult& r) { r.units[4].parts.front().second = -0.1; })),
              "occupancy is a share");
  const RunResult idle = changed([](RunResult& r) {
    for (UnitReport& unit : r.units) unit.occupancy = 0;
  });
  expect_rule(broken_rules(idle), "occupancy covers the utilization");
}

TEST_F(Oracle, SeesABottleneckThatAnotherUnitOrItsPartsContradict) {
  const std::string rule = "the bottleneck is occupied the most, by its parts";
  expect_rule(broken_rules(changed([](RunResult& r) { r.bottleneck->parts.pop_back(); })), rule);
  expect_rule(broken_rules(changed([](RunResult& r) { r.units[4].occupancy = 1; })), rule);
}

TEST_F(Oracle, SeesWhatAVariantCannotDo) {
  expect_rule(broken_rules(changed([](RunResult& r) { r.request.variant = variant_named("qm"); })),
              "only what the variant does");
  expect_rule(broken_rules(changed([](RunResult& r) { r.request.variant = variant_named("het"); })),
              "only what the variant does");
}

TEST_F(Oracle, SeesAQuadOfFiveFragments) {
  expect_rule(broken_rules(changed([](RunResult& r) { r.counts.fragments_shaded = 4 * r.counts.quads_shaded + 1; })),
              "a quad has 1 to 4 fragments");
}

TEST_F(Oracle, SeesAStrictCountOrPictureThatTimeChanges) {
  expect_rule(broken_rules(*result, changed([](RunResult& r) { ++r.counts.warps; })), "strict counts are the same");
  const RunResult other =
      changed([](RunResult& r) { r.framebuffer.color = ColorSurface(48, 40, ColorFormat::rgba16f); });
  expect_rule(broken_rules(*result, other), "order alone decides the picture");
}

TEST_F(Oracle, SeesARepetitionThatDiffersInOneStatistic) {
  expect_rule(broken_repetition(*result, changed([](RunResult& r) { ++r.statistics[3].value; })),
              "equal requests, equal results");
  expect_rule(broken_repetition(*result, changed([](RunResult& r) { ++r.units[2].cycles[1]; })),
              "equal requests, equal results");
}

}  // namespace
}  // namespace vrpipe::walk
