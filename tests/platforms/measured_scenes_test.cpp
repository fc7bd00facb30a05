// Synthetic splats that were drawn on a GPU: the same splats, its counts, and its cycles.

#include <optional>

#include <gtest/gtest.h>

#include <vrpipe/workloads/multi_pass.h>

#include "support/builders.h"
#include "support/measured_scenes.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

RunRequest on_the_gpu(const std::string& variant, Fidelity fidelity) {
  return testing::request_of(variant, fidelity, [](RunRequest& request) {
    request.platform = &platform_named("gh100-gpc");
    request.settings = {{"state", "obb_padding", "0"}};
    testing::strictly(request);
  });
}

// The others by benchmarks/measured_gpu --synthetic, which docs/silicon.md quotes.
TEST(MeasuredScenes, TheSmallestHasItsCounts) {
  const testing::MeasuredScene scene = testing::measured_scene("sweep-50k");
  ASSERT_EQ(scene.draw.splats.size(), 50'000U);
  const Counts counts = testing::run(on_the_gpu("baseline", Fidelity::functional), scene.draw).counts;
  const auto expect_near = [&](std::uint64_t got, const std::string& column) {
    const auto measured = static_cast<double>(scene.count(column));
    EXPECT_NEAR(static_cast<double>(got), measured, 2e-4 * measured) << column;
  };
  expect_near(counts.quads_shaded, "quads");
  expect_near(counts.quads_blended, "quads_blended");
  expect_near(counts.fragments_shaded, "fragments");
  expect_near(counts.fragments_blended, "fragments_blended");
  expect_near(counts.warps, "warps");
  expect_near(testing::run(on_the_gpu("het", Fidelity::functional), scene.draw).counts.fragments_shaded,
              "fragments_until_termination");
}

// Early termination by software; cycles by benchmarks/measured_gpu --passes.
TEST(MeasuredScenes, TheSmallestHasItsCountsInPasses) {
  const Draw draw = testing::measured_scene("sweep-50k").draw;
  const RunRequest request = on_the_gpu("baseline", Fidelity::functional);
  for (const testing::MeasuredScene& row : testing::measured_passes()) {
    if (row.name != "sweep-50k" || row.count("passes") == 1) continue;
    DrawState state = draw_state_of(request);
    state.early_termination = false;
    const auto frame = multi_pass_frame(draw, state, static_cast<std::uint32_t>(row.count("passes")));
    const Counts counts = testing::run(request, *frame).counts;
    const auto expect_near = [&](std::uint64_t got, const std::string& column) {
      EXPECT_NEAR(static_cast<double>(got), row.values.at(column), 2e-4 * row.values.at(column))
          << column << ", passes " << row.count("passes");
    };
    expect_near(counts.fragments_shaded, "fragments");
    expect_near(counts.fragments_blended + counts.fragments_unblended, "samples_passed");
  }
}

struct Drawn {
  const char* column;
  ColorFormat format = ColorFormat::rgba16f;
  bool blends = true;
  std::optional<Compare> stencil = {};
};

class MeasuredSplats : public ::testing::TestWithParam<Fidelity> {};
INSTANTIATE_TEST_SUITE_P(Fidelities, MeasuredSplats, ::testing::Values(Fidelity::lt, Fidelity::cycle),
                         testing::name_of_fidelity);

// Of 4x4 pixels, which the ROPs' port to L2 bounds, but for those that are killed.
TEST_P(MeasuredSplats, OfOneSizeTakeTheirCycles) {
  for (const testing::MeasuredScene& scene : testing::measured_uniform_scenes()) {
    if (scene.name != "4x4") continue;
    Draw draw = scene.draw;
    draw.splats.resize(6000);
    for (const Drawn& drawn :
         {Drawn{"rgba16f"}, Drawn{"rgba8", ColorFormat::rgba8}, Drawn{"not_blended", ColorFormat::rgba16f, false},
          Drawn{"stencil_all_pass", ColorFormat::rgba16f, true, Compare::always},
          Drawn{"stencil_all_killed", ColorFormat::rgba16f, true, Compare::none}}) {
      RunRequest request = on_the_gpu("baseline", GetParam());
      request.format = drawn.format;
      DrawState state = draw_state_of(request);
      state.blend = drawn.blends;
      state.early_termination = false;
      state.stencil.test = drawn.stencil.has_value();
      state.stencil.front.compare = state.stencil.back.compare = drawn.stencil.value_or(Compare::always);
      Frame frame(draw.width, draw.height);
      frame.draw(geometry_of(draw.width, draw.height, draw.splats), state);
      fresh_simulation();
      const double measured = scene.values.at(drawn.column);
      EXPECT_NEAR(static_cast<double>(*simulate(request, frame).cycles) / 6000, measured, 0.05 * measured)
          << drawn.column << ", opacity " << scene.values.at("opacity");
    }
  }
}

}  // namespace
}  // namespace vrpipe
