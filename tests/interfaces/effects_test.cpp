// What a user may say of effects, and what a unit is told of one that was left out.
#include <vrpipe/pipeline/effects.h>

#include <algorithm>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/render_context.h>

#include "support/refusals.h"

namespace vrpipe {
namespace {

std::string refusal_of_list(const std::string& list) {
  return testing::refusal_of([&] { EffectChoice::parse(list); });
}

void expect_in(const std::string& part, const std::string& whole) {
  EXPECT_NE(whole.find(part), std::string::npos) << whole;
}

TEST(EffectChoice, WithoutAWordIsWhatTheFrameCallsFor) {
  const EffectChoice choice;
  EXPECT_EQ(choice.base, EffectChoice::Base::automatic);
  EXPECT_EQ(choice.text(), "auto");
  EXPECT_TRUE(choice.tripwires);
  EXPECT_FALSE(choice.forces_out("raster.hi_z"));
  EXPECT_FALSE(choice.takes_in("raster.hi_z"));
  EXPECT_FALSE(choice.elaborates_all_of("raster.hi_z"));
}

TEST(EffectChoice, TakesABaseAloneOrBeforeNames) {
  EXPECT_EQ(EffectChoice::parse("auto").base, EffectChoice::Base::automatic);
  EXPECT_EQ(EffectChoice::parse("approximate").base, EffectChoice::Base::approximate);
  EXPECT_EQ(EffectChoice::parse("all").base, EffectChoice::Base::all);
  EXPECT_EQ(EffectChoice::parse("none").base, EffectChoice::Base::none);
  EXPECT_EQ(EffectChoice::parse("raster.hi_z").base, EffectChoice::Base::none);
  EXPECT_EQ(EffectChoice::parse("all").text(), EffectChoice::everything().text());
}

TEST(EffectChoice, SaysWhatItTakes) {
  for (const char* list : {"auto", "approximate", "all", "none", "auto,raster.hi_z", "all,-raster.hi_z",
                           "none,tc.eviction,zrop.z_cache", "approximate,l2.contents,-tc.time_out"}) {
    EXPECT_EQ(EffectChoice::parse(list).text(), list);
  }
  EXPECT_EQ(EffectChoice::parse("tc.eviction,raster.hi_z").text(), "none,tc.eviction,raster.hi_z");
}

TEST(EffectChoice, OfNamesAloneForcesOutAllOthers) {
  const EffectChoice choice = EffectChoice::parse("raster.hi_z");
  EXPECT_TRUE(choice.takes_in("raster.hi_z"));
  EXPECT_TRUE(choice.elaborates_all_of("raster.hi_z"));
  EXPECT_FALSE(choice.forces_out("raster.hi_z"));
  EXPECT_TRUE(choice.forces_out("tc.eviction"));
}

TEST(EffectChoice, WhatIsLeftOutIsOutWhateverElseIsSaid) {
  const EffectChoice choice = EffectChoice::parse("all,-raster.hi_z");
  EXPECT_TRUE(choice.forces_out("raster.hi_z"));
  EXPECT_FALSE(choice.elaborates_all_of("raster.hi_z"));
  EXPECT_TRUE(choice.elaborates_all_of("tc.eviction"));
}

TEST(EffectChoice, AnUnknownNameIsRefusedWithTheNearest) {
  expect_in("raster.hi_z", refusal_of_list("raster.hiz"));
  expect_in("unknown effect 'raster.hiz'", refusal_of_list("auto,-raster.hiz"));
  expect_in("zrop.z_cache", refusal_of_list("all,zrop.zcache"));
  expect_in("'all'", refusal_of_list("raster.hi_z,all"));
  expect_in("'-raster.hi_z'", refusal_of_list("--raster.hi_z"));
}

TEST(EffectChoice, AnEmptyListOrAnEmptyNameIsRefused) {
  expect_in("empty", refusal_of_list(""));
  for (const char* list : {",", ",auto", "auto,,raster.hi_z"}) {
    expect_in("empty", refusal_of_list(list));
  }
}

TEST(OmittedEffects, AreFoundByName) {
  OmittedEffects omitted;
  EXPECT_EQ(omitted.find("raster.hi_z"), nullptr);
  omitted.omit("raster.hi_z", OmittedEffects::How::watched);
  ASSERT_NE(omitted.find("raster.hi_z"), nullptr);
  EXPECT_EQ(omitted.find("raster.hi_z")->how, OmittedEffects::How::watched);
  EXPECT_EQ(omitted.find("raster.hi_z")->uses, 0U);
  EXPECT_EQ(omitted.find("raster"), nullptr);
  EXPECT_EQ(omitted.all().size(), 1U);
}

TEST(OmittedEffects, KeepPartsThatWereNotLeftOut) {
  OmittedEffects omitted;
  EXPECT_TRUE(omitted.has_part("zrop"));
  omitted.leave_out("zrop");
  EXPECT_FALSE(omitted.has_part("zrop"));
  EXPECT_TRUE(omitted.has_part("zrop.hi_z"));
  EXPECT_TRUE(RenderContext().has_part("zrop"));
}

class Gate : public ::testing::Test {
 protected:
  EffectGate gate_of(OmittedEffects::How how) {
    context.effects = std::make_shared<OmittedEffects>();
    context.effects->omit("tc.other", OmittedEffects::How::forced);
    context.effects->omit("tc.eviction", how);
    return {context, "tc.eviction"};
  }
  std::uint64_t uses() const { return context.effects->find("tc.eviction")->uses; }
  RenderContext context;
};

TEST_F(Gate, IsOpenWithoutEffectsInTheContext) {
  EffectGate of_nothing;
  EffectGate of_testbench(context, "tc.eviction");
  for (EffectGate* gate : {&of_nothing, &of_testbench}) {
    EXPECT_TRUE(gate->is_active());
    EXPECT_TRUE(gate->enter());
    EXPECT_FALSE(gate->is_silenced());
  }
}

TEST_F(Gate, IsOpenForWhatIsActive) {
  context.effects = std::make_shared<OmittedEffects>();
  context.effects->omit("tc.time_out", OmittedEffects::How::proved);
  EffectGate gate(context, "tc.eviction");
  EXPECT_TRUE(gate.is_active());
  EXPECT_TRUE(gate.enter());
}

TEST_F(Gate, CountsWhatWasWatchedFor) {
  EffectGate gate = gate_of(OmittedEffects::How::watched);
  EffectGate of_another_gpc = gate;
  EXPECT_FALSE(gate.is_active());
  EXPECT_TRUE(gate.enter());
  EXPECT_TRUE(of_another_gpc.enter());
  EXPECT_TRUE(gate.enter());
  EXPECT_EQ(uses(), 3U);
  EXPECT_FALSE(gate.is_silenced());
}

TEST_F(Gate, EndsTheRunWhereTheUserLeftOutWhatIsCalledFor) {
  EffectGate gate = gate_of(OmittedEffects::How::forced);
  EXPECT_FALSE(gate.is_active());
  EXPECT_FALSE(gate.is_silenced());
  try {
    gate.enter();
    ADD_FAILURE();
  } catch (const UserError& error) {
    expect_in("tc.eviction", error.what());
    expect_in("by force", error.what());
  }
}

TEST_F(Gate, EndsTheRunWhereAPredicateWasWrong) {
  EffectGate gate = gate_of(OmittedEffects::How::proved);
  try {
    gate.enter();
    ADD_FAILURE();
  } catch (const SimulationFault& fault) {
    expect_in("tc.eviction", fault.what());
    expect_in("predicate is wrong", fault.what());
  }
}

TEST_F(Gate, StaysShutInSilence) {
  EffectGate gate = gate_of(OmittedEffects::How::forced_in_silence);
  EXPECT_FALSE(gate.is_active());
  EXPECT_TRUE(gate.is_silenced());
  EXPECT_FALSE(gate.enter());
  EXPECT_EQ(uses(), 0U);
}

TEST_F(Gate, KeepsTheEffectsThatItAsks) {
  EffectGate gate = gate_of(OmittedEffects::How::watched);
  const std::weak_ptr<OmittedEffects> effects = context.effects;
  context.effects.reset();
  EXPECT_TRUE(gate.enter());
  EXPECT_EQ(effects.lock()->find("tc.eviction")->uses, 1U);
}

TEST(Effects, AreInTheOrderOfTheirNamesAndSayWhatTheyAre) {
  ASSERT_GE(effects().size(), 20U);
  EXPECT_TRUE(std::is_sorted(effects().begin(), effects().end(),
                             [](const Effect& a, const Effect& b) { return a.full_name() < b.full_name(); }));
  for (const Effect& effect : effects()) {
    SCOPED_TRACE(effect.full_name());
    EXPECT_FALSE(effect.models.empty());
    EXPECT_FALSE(effect.omitted_when.empty());
    EXPECT_FALSE(effect.elaborates.empty());
    EXPECT_EQ(effect.tripwire.empty(), effect.decide == nullptr) << "what stays active needs none";
    EXPECT_EQ(&effect_named(effect.full_name()), &effect);
  }
}

TEST(Effects, AreDeclaredOnce) {
  static_cast<void>(Registry::instance().take_problems());
  const std::size_t known = effects().size();
  Effect again = effect_named("tc.eviction");
  again.models = "something else";
  add_effect(again);
  EXPECT_EQ(effects().size(), known);
  EXPECT_NE(effect_named("tc.eviction").models, "something else");
  const auto problems = Registry::instance().take_problems();
  ASSERT_EQ(problems.size(), 1U);
  expect_in("tc.eviction", problems[0].why);
}

TEST(Effects, HaveNamesForTheirKindsAndProofs) {
  EXPECT_STREQ(name_of(EffectKind::functional), "functional");
  EXPECT_STREQ(name_of(EffectKind::timing), "timing");
  EXPECT_STREQ(name_of(EffectProof::by_facts), "static");
  EXPECT_STREQ(name_of(EffectProof::verified), "verified");
  EXPECT_STREQ(name_of(EffectProof::bounded), "bounded");
}

}  // namespace
}  // namespace vrpipe
