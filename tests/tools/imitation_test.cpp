// The paper's imitation of its extensions, by a stencil that counts and a shader that discards.

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>

#include "jobs/imitation.h"
#include "support/simulate.h"
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;
using tools::Imitation;

RunRequest request_at(Fidelity fidelity, const char* platform = "agx-orin-ideal-memory") {
  RunRequest request;
  request.platform = &platform_named(platform);
  request.variant = variant_named("baseline");
  request.fidelity = fidelity;
  return request;
}

Imitation imitation_of(const RunRequest& request, const Draw& draw) {
  return tools::imitation_of(request, std::make_shared<const Draw>(draw), draw_state_of(request));
}

RunResult run(const RunRequest& request, const Frame& frame) {
  fresh_simulation();
  return simulate(request, frame);
}

/// As many layers over all of a small image, each with this alpha.
Draw layers(unsigned count, float alpha) {
  Draw draw;
  draw.width = draw.height = 16;
  Splat splat{};
  splat.cx = splat.cy = 8;
  splat.opacity = alpha;
  splat.r = 3;
  splat.ax = splat.by = 3e5F;
  draw.splats.assign(count, splat);
  return draw;
}

TEST(Imitation, KillsWhatTheExtensionTerminates) {
  const Draw draw = tiny_draw();
  RunRequest terminating = request_at(Fidelity::functional);
  terminating.variant = variant_named("het");
  terminating.termination = Termination::strict;
  const Counts het = run(terminating, *Frame::of(draw, draw_state_of(terminating))).counts;
  ASSERT_GT(het.fragments_terminated, 0U);
  for (const Fidelity fidelity : fidelities()) {
    SCOPED_TRACE(name_of(fidelity));
    const RunRequest plain = request_at(fidelity);
    const Imitation imitation = imitation_of(plain, draw);
    EXPECT_EQ(imitation.pixels_short, 0U);
    const Counts counts = run(plain, *imitation.frame).counts;  // without its shader
    // The extension knows of some only when they come to CROP.
    EXPECT_EQ(counts.fragments_depth_stencil_failed, het.fragments_terminated + het.fragments_dropped_late);
    EXPECT_GE(counts.quads_depth_stencil_failed, het.quads_terminated);
    EXPECT_EQ(counts.fragments_blended, het.fragments_blended);
    EXPECT_EQ(counts.fragments_late_failed, 0U);
  }
}

TEST(Imitation, OfMergingIsAsMuchAsThereIs) {
  const RunRequest plain = request_at(Fidelity::lt);
  const Draw draw = tiny_draw();
  const Imitation imitation = imitation_of(plain, draw);
  RunRequest merging = request_at(Fidelity::functional);
  merging.variant = variant_named("het+qm");
  merging.termination = Termination::strict;
  const Counts merged = run(merging, *Frame::of(draw, draw_state_of(merging))).counts;
  EXPECT_DOUBLE_EQ(imitation.discarded_quads, static_cast<double>(merged.quads_merged) /
                                                  static_cast<double>(merged.quads_shaded - merged.quads_pruned));
  EXPECT_GE(imitation.paired_quads, 2 * imitation.discarded_quads *
                                        static_cast<double>(merged.quads_shaded - merged.quads_pruned) /
                                        static_cast<double>(merged.quads_shaded));
  const RunResult imitated = run(imitation.request, *imitation.frame);
  const double left = static_cast<double>(imitated.counts.quads_shaded - imitated.counts.quads_pruned);
  EXPECT_NEAR(static_cast<double>(imitated.counts.quads_merged) / left, imitation.discarded_quads, 0.03);
  std::uint64_t quads = 0, warps = 0;
  for (const StatisticReport& statistic : imitated.statistics) {
    if (statistic.name == "sm.imitation.quads") quads = statistic.value;
    if (statistic.name == "sm.imitation.warps") warps = statistic.value;
  }
  EXPECT_NEAR(static_cast<double>(quads) / static_cast<double>(imitated.counts.quads_shaded), imitation.paired_quads,
              0.03);
  EXPECT_LE(warps, imitated.counts.warps);
  EXPECT_GT(warps, imitated.counts.warps / 2);
}

TEST(Imitation, DiscardsTheSameQuadsAtEveryFidelity) {
  const Draw draw = tiny_draw();
  const Imitation imitation = imitation_of(request_at(Fidelity::functional), draw);
  std::set<std::uint64_t> merged, blended;
  for (const Fidelity fidelity : fidelities()) {
    RunRequest request = imitation.request;
    request.fidelity = fidelity;
    const Counts counts = run(request, *imitation.frame).counts;
    merged.insert(counts.fragments_merged);
    blended.insert(counts.fragments_blended);
  }
  EXPECT_EQ(merged.size(), 1U);
  EXPECT_EQ(blended.size(), 1U);
}

TEST(Imitation, EndsAtTheMostThatEightBitsCount) {
  const RunRequest plain = request_at(Fidelity::functional);
  const Imitation imitation = imitation_of(plain, layers(300, 0.01F));
  EXPECT_EQ(imitation.pixels_short, 256U) << "0.99^300 is 0.05: none terminates";
  EXPECT_EQ(run(plain, *imitation.frame).counts.fragments_blended, 256U * 255);
  const Imitation long_enough = imitation_of(plain, layers(200, 0.01F));
  EXPECT_EQ(long_enough.pixels_short, 0U);
  EXPECT_EQ(run(plain, *long_enough.frame).counts.fragments_blended, 256U * 200) << "beyond 127, too";
}

TEST(Imitation, IsNotOfADrawWithAStencilTestOfItsOwn) {
  const RunRequest plain = request_at(Fidelity::functional);
  DrawState state = draw_state_of(plain);
  state.stencil.test = true;
  EXPECT_THROW(tools::imitation_of(plain, std::make_shared<const Draw>(tiny_draw()), state), UserError);
}

TEST(Imitation, EfficiencyIsOfTheTable) {
  const RunRequest plain = request_at(Fidelity::lt);
  const Draw draw = tiny_draw();
  const Imitation imitation = imitation_of(plain, draw);
  const RunResult baseline = run(plain, *Frame::of(draw, draw_state_of(plain)));
  const RunResult imitated = run(imitation.request, *imitation.frame);
  const tools::EnergyTable& table = tools::shipped_energies();
  const auto millijoules = [&](const RunResult& result) {
    return energy_report(energy_amounts(result, table), table).total->nominal;
  };
  EXPECT_NEAR(imitated_efficiency(baseline, imitated, table)->nominal, millijoules(baseline) / millijoules(imitated),
              1e-9);
  EXPECT_TRUE(energy_amounts(imitated, table).missing.empty());
}

class ImitationCommand : public ToolTest {};

TEST_F(ImitationCommand, IsOneMorePathOfFrames) {
  const std::vector<std::string> command{"frames", "--scene", "tiny.spl", "--fidelity", "lt", "--imitation"};
  const json result = json_of(command);
  ASSERT_EQ(result["frames"].size(), 7U);
  const json& path = result["frames"][5];
  EXPECT_EQ(path["path"], "imitation");
  EXPECT_GT(path["counts"]["quads_merged"], 0);
  EXPECT_GT(result["imitation"]["efficiency"]["nominal"], 0.0);
  EXPECT_NEAR(result["imitation"]["efficiency"]["nominal"].get<double>(),
              result["frames"][1]["millijoules"]["raster"]["nominal"].get<double>() /
                  path["millijoules"]["raster"]["nominal"].get<double>(),
              1e-9);
  EXPECT_NE(vrpipe(command).out.find("the paper measured 1.65x"), std::string::npos);
  const json elsewhere = json_of({"frames", "--scene", "tiny.spl", "--fidelity", "functional", "--imitation"});
  EXPECT_TRUE(elsewhere["imitation"]["efficiency"].is_null());
  EXPECT_TRUE(json_of({"frames", "--scene", "tiny.spl", "--fidelity", "functional"})["imitation"].is_null());
}

}  // namespace
}  // namespace vrpipe::testing
