// Of every effect: where it may be omitted nothing tells that it was, and where it may not everything does.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/effects.h>

#include "effects/effect_case.h"

namespace vrpipe {
namespace testing {

const std::vector<EffectCase>& effect_cases() {
  static const std::vector<EffectCase> all = [] {
    std::vector<EffectCase> cases;
    for (const auto& part : {geometry_cases(), test_cases(), shading_cases(), time_cases()})
      cases.insert(cases.end(), part.begin(), part.end());
    return cases;
  }();
  return all;
}

}  // namespace testing

namespace {

using testing::EffectCase;
using testing::run_with;
using testing::Scene;

/// Those that are ever omitted.
std::vector<std::string> names() {
  std::vector<std::string> names;
  for (const Effect& effect : effects()) {
    if (effect.decide != nullptr) names.push_back(effect.full_name());
  }
  return names;
}

EffectReport report_of(const RunResult& result, const std::string& effect) {
  for (const EffectReport& report : result.effects) {
    if (report.name == effect) return report;
  }
  ADD_FAILURE() << "nothing is said of " << effect;
  return {};
}

/// What `auto` would take in, without one effect.
EffectChoice without(const std::string& effect) {
  EffectChoice choice;
  choice.without = {effect};
  return choice;
}

void expect_same(const RunResult& one, const RunResult& other) {
  EXPECT_EQ(one.counts.named(), other.counts.named());
  EXPECT_EQ(one.cycles, other.cycles);
  EXPECT_TRUE(testing::same_image(one.framebuffer.color, other.framebuffer.color));
  EXPECT_EQ(one.result_hash, other.result_hash);
}

class EveryEffect : public ::testing::TestWithParam<std::string> {
 protected:
  static std::vector<EffectCase> cases() {
    std::vector<EffectCase> of_effect;
    for (const EffectCase& each : testing::effect_cases()) {
      if (each.effect == GetParam()) of_effect.push_back(each);
    }
    EXPECT_FALSE(of_effect.empty()) << "no frame does without it, and none calls for it";
    return of_effect;
  }
};
INSTANTIATE_TEST_SUITE_P(Effects, EveryEffect, ::testing::ValuesIn(names()), [](const auto& each) {
  std::string name = each.param;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

TEST(Effects, HaveCasesOfTheirNames) {
  for (const EffectCase& each : testing::effect_cases()) EXPECT_NE(effect_named(each.effect).decide, nullptr);
}

// With its reason.
TEST(Effects, ThatAreNeverOmittedCannotBeLeftOut) {
  for (const Effect& effect : effects()) {
    if (effect.decide != nullptr) continue;
    Scene scene = testing::plain_splats(Fidelity::cycle, "het+qm");
    scene.request.platform = &platform_named("agx-orin");  // which has all components but an L1
    EXPECT_FALSE(report_of(run_with(scene, {}), effect.full_name()).omitted);
    try {
      run_with(testing::plain_splats(Fidelity::functional), without(effect.full_name()));
      ADD_FAILURE() << "took it";
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find(effect.full_name()), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(effect.omitted_when), std::string::npos) << error.what();
    }
  }
}

TEST_P(EveryEffect, IsOmittedWhereNothingTellsTheDifference) {
  for (const EffectCase& each : cases()) {
    ASSERT_FALSE(each.without_at.empty());
    for (const Fidelity fidelity : each.without_at) {
      SCOPED_TRACE(name_of(fidelity));
      const RunResult automatic = run_with(each.without(fidelity), {});
      const RunResult all = run_with(each.without(fidelity), EffectChoice::everything());
      const EffectReport report = report_of(automatic, GetParam());
      EXPECT_TRUE(report.omitted) << report.reason;
      EXPECT_FALSE(report.reason.empty());
      EXPECT_FALSE(report_of(all, GetParam()).omitted);
      expect_same(automatic, all);
      // Nor does it matter whether it was the predicate that left it out.
      expect_same(run_with(each.without(fidelity), without(GetParam())), all);
    }
  }
}

TEST_P(EveryEffect, IsActiveWhereTheFrameCallsForIt) {
  for (const EffectCase& each : cases()) {
    ASSERT_FALSE(each.with_at.empty());
    for (const Fidelity fidelity : each.with_at) {
      SCOPED_TRACE(name_of(fidelity));
      const RunResult automatic = run_with(each.with(fidelity), {});
      const EffectReport report = report_of(automatic, GetParam());
      EXPECT_FALSE(report.omitted) << report.reason;
      expect_same(automatic, run_with(each.with(fidelity), EffectChoice::everything()));
    }
  }
}

TEST_P(EveryEffect, LeftOutInSilenceThereIsMissed) {
  EffectChoice silent = without(GetParam());
  silent.tripwires = false;
  for (const EffectCase& each : cases()) {
    for (const Fidelity fidelity : each.with_at) {
      SCOPED_TRACE(name_of(fidelity));
      const Scene whole = each.with(fidelity);
      const std::string expected = whole.looked_at(run_with(whole, {}));
      const Scene maimed = each.with(fidelity);
      try {
        EXPECT_NE(maimed.looked_at(run_with(maimed, silent)), expected);
        EXPECT_EQ(each.refusal, "") << "it ran";
        EXPECT_FALSE(each.faults) << "it ran";
      } catch (const SimulationFault& fault) {
        EXPECT_TRUE(each.faults) << fault.what();
      } catch (const UserError& error) {
        EXPECT_FALSE(each.refusal.empty()) << error.what();
        EXPECT_NE(std::string(error.what()).find(each.refusal), std::string::npos) << error.what();
      }
    }
  }
}

TEST_P(EveryEffect, LeftOutByForceThereEndsTheRunWithItsName) {
  for (const EffectCase& each : cases()) {
    for (const Fidelity fidelity : each.with_at) {
      SCOPED_TRACE(name_of(fidelity));
      try {
        run_with(each.with(fidelity), without(GetParam()));
        ADD_FAILURE() << "nobody noticed";
      } catch (const UserError& error) {
        EXPECT_NE(std::string(error.what()).find(GetParam()), std::string::npos) << error.what();
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
