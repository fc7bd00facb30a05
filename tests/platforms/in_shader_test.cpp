// Variants whose shader blends, as whole GPUs.
#include <cmath>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/multi_pass.h>

#include "support/measured_scenes.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::request_of;
using testing::run;
using testing::same_image;

RunRequest on(const char* platform, const char* variant, Fidelity fidelity) {
  return request_of(variant, fidelity, [&](RunRequest& request) { request.platform = &platform_named(platform); });
}

class InShaderVariants : public ::testing::TestWithParam<const char*> {
 protected:
  const Draw draw = testing::random_draw(160, 120, 300, 5);
};
INSTANTIATE_TEST_SUITE_P(Platforms, InShaderVariants, ::testing::Values("agx-orin", "gh100-gpc", "desktop"),
                         [](const auto& platform) {
                           std::string name = platform.param;
                           for (char& c : name) c = c == '-' ? '_' : c;
                           return name;
                         });

TEST_P(InShaderVariants, WithALockTheImageIsThatOfAColourRopAtEveryFidelity) {
  const RunResult rop = run(on(GetParam(), "baseline", Fidelity::functional), draw);
  for (const Fidelity fidelity : fidelities()) {
    const RunResult result = run(on(GetParam(), "in-shader", fidelity), draw);
    EXPECT_TRUE(same_image(result.framebuffer.color, rop.framebuffer.color)) << name_of(fidelity);
    EXPECT_EQ(result.counts.fragments_blended, rop.counts.fragments_blended);
    EXPECT_EQ(result.counts.quads_blended, rop.counts.quads_blended);
    EXPECT_EQ(testing::statistic(result, "crop.updates_lost"), 0U);
  }
}

TEST_P(InShaderVariants, WithoutALockTimeDecidesWhatIsLost) {
  const RunResult ordered = run(on(GetParam(), "in-shader", Fidelity::functional), draw);
  const RunResult without_time = run(on(GetParam(), "in-shader-no-lock", Fidelity::functional), draw);
  EXPECT_TRUE(same_image(without_time.framebuffer.color, ordered.framebuffer.color)) << "nothing races";
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    const RunResult first = run(on(GetParam(), "in-shader-no-lock", fidelity), draw);
    const RunResult second = run(on(GetParam(), "in-shader-no-lock", fidelity), draw);
    EXPECT_EQ(first.result_hash, second.result_hash);
    EXPECT_GT(testing::statistic(first, "crop.updates_lost"), 0U);
    EXPECT_FALSE(same_image(first.framebuffer.color, ordered.framebuffer.color));
    EXPECT_EQ(first.counts.fragments_blended, ordered.counts.fragments_blended) << "lost ones count";
  }
}

TEST_P(InShaderVariants, FidelitiesAgreeOnTime) {
  const Draw longer = testing::random_draw(160, 120, 3000, 5);
  for (const char* variant : {"in-shader", "in-shader-no-lock"}) {
    const auto cycles = [&](Fidelity fidelity) {
      return static_cast<double>(run(on(GetParam(), variant, fidelity), longer).cycles.value());
    };
    const double cycle = cycles(Fidelity::cycle);
    // Without a lock SMs bound it, and the order in which warps come to their schedulers.
    EXPECT_NEAR(cycles(Fidelity::lt), cycle, 0.035 * cycle) << variant;
    EXPECT_LE(cycles(Fidelity::bound), cycle) << variant;
  }
}

TEST_P(InShaderVariants, MergedQuadsAreBlendedAsOne) {
  RunRequest merging = on(GetParam(), "qm", Fidelity::functional);
  const RunResult rop = run(merging, draw);
  merging.units = {{"crop", "in-shader"}};
  const RunResult shader = run(merging, draw);
  EXPECT_TRUE(same_image(shader.framebuffer.color, rop.framebuffer.color));
  EXPECT_GT(shader.counts.quads_merged, 0U);
  for (const Fidelity fidelity : {Fidelity::bound, Fidelity::lt, Fidelity::cycle}) {
    merging.fidelity = fidelity;
    EXPECT_EQ(run(merging, draw).counts.fragments_shaded, shader.counts.fragments_shaded);
  }
}

TEST_P(InShaderVariants, PassesAreDrawnAsByAColourRop) {
  const RunRequest rop = on(GetParam(), "baseline", Fidelity::functional);
  DrawState state = draw_state_of(rop);
  state.early_termination = false;
  const auto frame = multi_pass_frame(draw, state, 3);
  const RunResult expected = run(rop, *frame);
  for (const Fidelity fidelity : fidelities()) {
    const RunResult result = run(on(GetParam(), "in-shader", fidelity), *frame);
    EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << name_of(fidelity);
  }
}

TEST(InShaderVariant, EarlyTerminationByHardwareIsRefused) {
  RunRequest request = on("agx-orin", "het", Fidelity::functional);
  request.units = {{"crop", "in-shader"}};
  EXPECT_THROW(run(request, testing::random_draw(64, 64, 5, 1)), UserError);
}

TEST(InShaderVariant, SettingsForAColourRopAreForOthers) {
  RunRequest request = on("gh100-gpc", "in-shader", Fidelity::functional);
  request.settings = {{"crop", "cache_bytes", "4096"}, {"crop", "hand_over_cycles", "7"}};
  const RunResult result = run(request, testing::random_draw(64, 64, 5, 1));
  for (const auto& [name, value] : result.parameters) {
    EXPECT_NE(name, "crop.cache_bytes");
    if (name == "crop.hand_over_cycles") {
      EXPECT_EQ(value, "7");
    }
  }
}

/// What was measured on the GPU itself, in splats of one size of which few overlap, and in a trained scene.
TEST(InShaderMeasured, TimesAreThoseOfTheGpu) {
  for (testing::MeasuredScene& scene : testing::measured_in_shader_scenes()) {
    const bool is_trained = scene.name == "trained";
    const bool is_short =
        scene.values.count("region") != 0 && scene.values["region"] == 1024 && scene.values["rop"] < 1e6;
    if (!is_trained && !is_short) continue;
    if (is_trained) scene.draw = testing::measured_draw();
    const auto cycles = [&](const char* variant) {
      RunRequest request = on("gh100-gpc", variant, Fidelity::lt);
      request.settings = {{"state", "obb_padding", "0"}};
      return static_cast<double>(run(request, scene.draw).cycles.value());
    };
    const double rop = cycles("baseline"), ordered = cycles("in-shader"), racing = cycles("in-shader-no-lock");
    const auto ratio = [&](const char* column) { return scene.values[column] / scene.values["rop"]; };
    EXPECT_NEAR(ordered / rop / ratio("ordered"), 1, 0.15) << scene.name;
    EXPECT_NEAR(racing / rop / ratio("no_lock"), 1, 0.10) << scene.name;
    if (is_trained) {
      EXPECT_NEAR(ordered / scene.values["ordered"], 1, 0.10);
    }
  }
}

}  // namespace
}  // namespace vrpipe
