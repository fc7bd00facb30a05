// Units and memories of other makes: what they call for is not known, so that nothing of theirs is left out.
#include <algorithm>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>

#include "effects/effect_case.h"
#include "qru/qru.h"
#include "tc/tc.h"
#include "tgc/tgc.h"

namespace vrpipe {
namespace {

using testing::run_with;
using testing::Scene;

// As a plugin derives them.
struct AnotherTgc : TileGridCoalescing {
  using TileGridCoalescing::TileGridCoalescing;
};
struct AnotherTc : TileCoalescing {
  using TileCoalescing::TileCoalescing;
};
struct AnotherQru : PairingQru {
  using PairingQru::PairingQru;
};
const Registrar<AnotherTgc, TgcBehaviour> tgc("tgc", "another-make", "bins primitives");
const Registrar<AnotherTc, TcBehaviour> tc("tc", "another-make", "bins quads");
const Registrar<AnotherQru, QruBehaviour> qru("qru", "another-make", "pairs quads");

[[maybe_unused]] const bool has_l2 = [] {
  Implementation l2 = Registry::instance().find("l2", "sectored-cache");
  l2.name = "another-make";
  l2.trust = Trust::checked;
  Registry::instance().add(std::move(l2));
  return true;
}();

/// What `auto` says of it.
EffectReport said_of(const std::string& effect, const RunResult& result) {
  const auto found = std::find_if(result.effects.begin(), result.effects.end(),
                                  [&](const EffectReport& report) { return report.name == effect; });
  return found == result.effects.end() ? EffectReport() : *found;
}

class OtherMakes : public ::testing::TestWithParam<Fidelity> {};
INSTANTIATE_TEST_SUITE_P(Effects, OtherMakes, ::testing::ValuesIn(fidelities()),
                         [](const auto& fidelity) { return std::string(name_of(fidelity.param)); });

TEST_P(OtherMakes, OfUnitsDoAsTheyLike) {
  Scene scene = testing::plain_splats(GetParam(), "het+qm");
  scene.request.settings = {{"tgc", "bins", "1"},
                            {"tgc", "grid_tiles", "1"},
                            {"tc", "bins", "1"},
                            {"tc", "idle_timeout_cycles", "1"}};
  const RunResult usual = run_with(scene, {});
  scene.request.units = {{"tgc", "another-make"}, {"tc", "another-make"}, {"qru", "another-make"}};
  const RunResult result = run_with(scene, {});
  EXPECT_EQ(result.result_hash, usual.result_hash);
  EXPECT_EQ(run_with(scene, EffectChoice::everything()).result_hash, usual.result_hash);
  for (const char* effect : {"tgc.binning", "tgc.eviction", "tc.eviction", "tc.time_out", "qru.pairing"}) {
    EXPECT_FALSE(said_of(effect, result).omitted) << effect;
    EXPECT_NE(said_of(effect, result).reason.find("another-make"), std::string::npos) << effect;
  }
}

TEST_P(OtherMakes, OfAPassThroughArePassedThrough) {
  Scene scene = testing::plain_splats(GetParam(), "qm");
  scene.request.units = {{"tgc", "pass-through"}, {"qru", "pass-through"}};
  const RunResult result = run_with(scene, {});
  EXPECT_TRUE(said_of("tgc.binning", result).omitted);
  EXPECT_TRUE(said_of("qru.pairing", result).omitted);
  EXPECT_EQ(result.result_hash, run_with(scene, EffectChoice::everything()).result_hash);
}

// A cache of another make may ask the DRAM also where nothing has time.
TEST_P(OtherMakes, OfMemoriesKeepWhatIsBelowThem) {
  Scene scene = testing::plain_splats(GetParam());
  scene.request.platform = &platform_named("agx-orin");
  const std::string usual = run_with(scene, {}).result_hash;
  scene = testing::on_platform(scene, "agx-orin", [](Netlist& netlist) { netlist.replace("l2", "another-make"); });
  const RunResult result = run_with(scene, {});
  EXPECT_EQ(result.result_hash, usual);
  EXPECT_FALSE(said_of("l2.contents", result).omitted);
  EXPECT_FALSE(said_of("dram.accesses", result).omitted) << said_of("dram.accesses", result).reason;
  EXPECT_GT(testing::statistic(result, "dram.color_bytes_read"), 0U);
}

}  // namespace
}  // namespace vrpipe
