// What is left out under `approximate` alone: off by no more than the report says.
#include <algorithm>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>

#include "effects/effect_case.h"

namespace vrpipe {
namespace {

using testing::Scene;

constexpr double share_of_refresh = 130.0 / 1000;  // tRFC in tREFI

/// A frame that waits for its DRAM: a channel of 8 bits.
RunResult run(Fidelity fidelity, const EffectChoice& choice) {
  Scene scene = testing::plain_splats(fidelity);
  scene.request.platform = &platform_named("agx-orin");
  scene.request.settings = {{"dram", "channels", "1"},     {"dram", "channel_bits", "8"},
                            {"dram", "trfc_ps", "130000"}, {"dram", "trefi_ps", "1000000"},
                            {"dram", "hash", "off"},       {"crop", "cache_bytes", "2048"}};
  scene.request.effects = choice;
  fresh_simulation();
  return simulate(scene.request, scene.frame);
}

EffectReport refresh(const RunResult& result) {
  const auto found = std::find_if(result.effects.begin(), result.effects.end(),
                                  [](const EffectReport& report) { return report.name == "dram.refresh"; });
  return found == result.effects.end() ? EffectReport() : *found;
}

TEST(Approximate, LeavesOutRefreshesOfTheBound) {
  const RunResult all = run(Fidelity::bound, EffectChoice::everything());
  const RunResult automatic = run(Fidelity::bound, {});
  EXPECT_FALSE(refresh(automatic).omitted);
  EXPECT_EQ(automatic.result_hash, all.result_hash);
  const RunResult approximate = run(Fidelity::bound, EffectChoice::parse("approximate"));
  EXPECT_TRUE(refresh(approximate).omitted);
  EXPECT_EQ(refresh(approximate).proof, EffectProof::bounded);
  EXPECT_NE(refresh(approximate).reason.find("at most 13 %"), std::string::npos) << refresh(approximate).reason;
  EXPECT_LT(*approximate.cycles, *all.cycles);
  EXPECT_GE(static_cast<double>(*approximate.cycles), (1 - share_of_refresh) * static_cast<double>(*all.cycles) - 1);
  EXPECT_EQ(run(Fidelity::bound, EffectChoice::parse("approximate,dram.refresh")).result_hash, all.result_hash);
}

TEST(Approximate, LeavesOutNothingThatCanBeWatched) {
  for (const Fidelity fidelity : testing::with_time) {
    SCOPED_TRACE(name_of(fidelity));
    const RunResult result = run(fidelity, EffectChoice::parse("approximate"));
    EXPECT_FALSE(refresh(result).omitted) << refresh(result).reason;
    EXPECT_EQ(result.result_hash, run(fidelity, EffectChoice::everything()).result_hash);
  }
}

TEST(Approximate, ByForceIsRefused) {
  try {
    run(Fidelity::bound, EffectChoice::parse("auto,-dram.refresh"));
    ADD_FAILURE() << "nobody noticed";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("dram.refresh"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace vrpipe
