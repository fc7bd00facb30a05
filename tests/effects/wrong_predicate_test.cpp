// A predicate that is wrong ends the run with the effect's name, whoever declared it.
#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

#include "effects/effect_case.h"
#include "tc/tc.h"

namespace vrpipe {
namespace {

using testing::Scene;

/// A unit of a plugin's, with an effect of its own: quads are taken into bins.
class TcWithAnEffect : public TileCoalescing {
 public:
  TcWithAnEffect(const Parameters& parameters, const RenderContext& context)
      : TileCoalescing(parameters, context), gate_(context, "tc.quads") {}
  unsigned insert(const QuadBeat& beat, unsigned from, Flush& out, bool& flushed) override {
    gate_.enter();
    return TileCoalescing::insert(beat, from, out, flushed);
  }

 private:
  EffectGate gate_;
};
const Registrar<TcWithAnEffect, TcBehaviour> registrar("tc", "with-an-effect", "has an effect of its own");

/// Left out where the frame is as wide as this.
constexpr std::uint32_t wrong_width = testing::scene_side;

class WrongPredicate : public ::testing::TestWithParam<Fidelity> {
 protected:
  static void SetUpTestSuite() {
    static bool is_declared = false;
    if (std::exchange(is_declared, true)) return;
    add_effect({"tc",
                "quads",
                "with-an-effect",
                EffectKind::functional,
                "quads in bins",
                "never",
                "nothing",
                "where quads are taken into bins",
                {},
                [](const EffectQuestion& asked) {
                  if (asked.context.frame->width() == wrong_width) return EffectDecision::omit("no quads");
                  return EffectDecision::keep("quads");
                }});
  }
  static RunResult run(const EffectChoice& choice, std::uint32_t width = wrong_width) {
    Scene scene = testing::scene_of("baseline", GetParam());
    scene.frame = Frame(width, testing::scene_side);
    scene.request.units = {{"tc", "with-an-effect"}};
    scene.request.effects = choice;
    draw(scene, testing::boxes(2, 2, 2, 14, 14, 0.5F));
    fresh_simulation();
    return simulate(scene.request, scene.frame);
  }
};
INSTANTIATE_TEST_SUITE_P(Effects, WrongPredicate, ::testing::ValuesIn(fidelities()),
                         [](const auto& fidelity) { return std::string(name_of(fidelity.param)); });

TEST_P(WrongPredicate, EndsTheRunWithTheNameOfTheEffect) {
  try {
    run({});
    ADD_FAILURE() << "nobody noticed";
  } catch (const SimulationFault& fault) {
    const std::string what = fault.what();
    EXPECT_NE(what.find("tc.quads"), std::string::npos) << what;
    EXPECT_NE(what.find("predicate is wrong"), std::string::npos) << what;
    EXPECT_NE(what.find("--effects all"), std::string::npos) << what;
  }
}

TEST_P(WrongPredicate, EndsNoRunThatTakesTheEffectIn) {
  const RunResult all = run(EffectChoice::everything());
  EXPECT_GT(all.counts.quads_blended, 0U);
  EXPECT_EQ(run(EffectChoice::parse("auto,tc.quads")).result_hash, all.result_hash);
  EXPECT_GT(run({}, 2 * wrong_width).counts.quads_blended, 0U) << "where it is right";
}

}  // namespace
}  // namespace vrpipe
