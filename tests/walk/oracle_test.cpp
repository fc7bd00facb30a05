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

TEST_F(Oracle, SeesAnEffectThatWasMissed) {
  const std::string rule = "what a frame does not call for changes nothing";
  EXPECT_TRUE(broken_effects(*result, *result).empty());
  expect_rule(broken_effects(*result, changed([](RunResult& r) { ++*r.cycles; })), rule);
  expect_rule(broken_effects(*result, changed([](RunResult& r) { ++r.counts.warps; })), rule);
  expect_rule(broken_effects(*result, changed([](RunResult& r) { r.result_hash.back() ^= 1; })), rule);
  const RunResult other =
      changed([](RunResult& r) { r.framebuffer.color = ColorSurface(48, 40, ColorFormat::rgba16f); });
  expect_rule(broken_effects(*result, other), rule);
}

/// Two draws, the second behind a clear of all.
class OracleOfFrames : public Oracle {
 protected:
  static void SetUpTestSuite() {
    const auto draw = std::make_shared<Draw>(testing::random_draw(48, 40, 200, 7));
    const RunRequest request = testing::request_of("het", Fidelity::functional, testing::strictly);
    Frame frame(48, 40);
    frame.draw(draw, draw_state_of(request), "first", 0, 100);
    frame.clear({true, true});
    frame.draw(draw, draw_state_of(request), "second", 100);
    Frame second(48, 40);
    second.draw(draw, draw_state_of(request), "second", 100);
    fresh_simulation();
    result = std::make_unique<RunResult>(simulate(request, frame));
    fresh_simulation();
    rest = std::make_unique<RunResult>(simulate(request, second));
  }
  static void TearDownTestSuite() {
    result.reset();
    rest.reset();
  }
  /// Changes a count of the second draw.
  RunResult miscounted(const std::string& name) const {
    return changed([&](RunResult& r) {
      for (auto& [each, count] : r.draws[1].counts) count += each == name ? 1 : 0;
    });
  }
  static std::unique_ptr<RunResult> rest;
};
std::unique_ptr<RunResult> OracleOfFrames::rest;

TEST_F(OracleOfFrames, HasNothingAgainstARightFrame) {
  EXPECT_TRUE(broken_rules(*result).empty());
  EXPECT_TRUE(broken_rules(*result, *result).empty());
  EXPECT_TRUE(broken_repetition(*result, *result).empty());
  EXPECT_TRUE(broken_beginning(*result, 1, *rest).empty());
  EXPECT_TRUE(broken_split(*result, *result).empty());
}

TEST_F(OracleOfFrames, SeesDrawsThatDoNotSumToTheFrameAndADrawThatLosesAQuad) {
  expect_rule(broken_rules(miscounted("primitives")), "draws sum to the frame");
  expect_rule(broken_rules(miscounted("quads_shaded")), "conservation in a draw");
  expect_rule(broken_rules(miscounted("fragments_blended")), "conservation in a draw");
}

TEST_F(OracleOfFrames, SeesADrawThatTimeCountsOtherwise) {
  expect_rule(broken_rules(*result, miscounted("quads_shaded")), "strict counts are the same");
  expect_rule(broken_repetition(*result, miscounted("quads_shaded")), "equal requests, equal results");
}

TEST_F(OracleOfFrames, SeesWhatAClearLeaves) {
  expect_rule(broken_beginning(miscounted("quads_terminated"), 1, *rest), "what is cleared is gone");
  const RunResult other =
      changed([](RunResult& r) { r.framebuffer.color = ColorSurface(48, 40, ColorFormat::rgba16f); });
  expect_rule(broken_beginning(other, 1, *rest), "what is cleared is gone");
}

TEST_F(OracleOfFrames, SeesASplitThatChangesACountOrThePicture) {
  expect_rule(broken_split(*result, changed([](RunResult& r) { ++r.counts.warps; })), "a split changes nothing");
  expect_rule(broken_split(*result, *rest), "a split changes nothing");
}

}  // namespace
}  // namespace vrpipe::walk
