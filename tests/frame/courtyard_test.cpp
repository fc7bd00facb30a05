// The built-in scene of meshes and splats through the whole pipeline, against a renderer that knows samples and order alone.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/mixed_frame.h>
#include <vrpipe/workloads/scene.h>

#include "support/builders.h"
#include "support/mixed_reference.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::count;

constexpr ImageSize courtyard_size{96, 54};

LoadedScene courtyard() {
  SceneRequest request;
  request.scene = "builtin:courtyard";
  request.size = courtyard_size;
  return load_scene(request);
}

double brightest_of(const Draw& splats) {
  double brightest = 1;
  for (const Splat& splat : splats.splats) {
    brightest = std::max<double>(brightest, std::max({splat.red, splat.green, splat.blue}));
  }
  return brightest;
}

unsigned wrong_channels(const RunResult& result, const testing::MixedReference& reference, double brightest) {
  // What termination leaves out, and a fragment or two that rounding prunes here and not there.
  const double slack = brightest * (1 - 0.996 + 2.0 / 255);
  unsigned wrong = 0;
  for (std::uint32_t y = 0; y < courtyard_size.height; ++y) {
    for (std::uint32_t x = 0; x < courtyard_size.width; ++x) {
      const std::size_t index = std::size_t{y} * courtyard_size.width + x;
      const auto pixel = result.framebuffer.color.pixel(x, y);
      for (std::size_t channel = 0; channel < 4; ++channel) {
        const double bound = (channel == 3 ? reference.bound[index].alpha : reference.bound[index].color) + slack;
        wrong += std::fabs(static_cast<double>(pixel[channel]) - reference.rgba[index][channel]) > bound;
      }
    }
  }
  return wrong;
}

TEST(CourtyardFrame, IsThatOfTheReferenceAndWhatIsBehindWallsIsNotShaded) {
  const LoadedScene scene = courtyard();
  testing::MixedReference reference;
  for (const Variant& variant : variants()) {
    SCOPED_TRACE(variant.name);
    const RunRequest request = testing::request_of(variant.name, Fidelity::functional, testing::strictly);
    MixedFrameOptions options;
    options.splats = draw_state_of(request);
    const auto frame = mixed_frame(scene.draw, scene.meshes, options);
    ASSERT_EQ(frame->draws().size(), 3U);
    EXPECT_EQ(frame->draw_call(0).splats, scene.meshes[0].mesh.size());
    // It does not terminate, so that all variants have the same.
    if (reference.rgba.empty()) reference = testing::render_mixed(testing::context_of(*frame));

    fresh_simulation();
    const RunResult result = simulate(request, *frame);
    EXPECT_EQ(wrong_channels(result, reference, brightest_of(scene.draw)), 0U);
    const DrawReport& splats = result.draws[1];
    const testing::MixedCounts& expected = reference.of_draw[1];
    const std::uint64_t failed = count(splats, "fragments_depth_stencil_failed");
    const std::uint64_t passed = count(splats, "fragments_rasterized") - failed;
    EXPECT_EQ(passed, expected.rasterized - expected.failed)
        << "splats do not write depth, so termination takes none away";
    EXPECT_GT(expected.failed, expected.rasterized / 4);
    EXPECT_LT(failed, expected.failed / 3) << "Hi-Z takes most of them";
    EXPECT_EQ(count(result.draws[0], "fragments_blended"), 0U);
    // Of equal depth are the fragments that were nearest before: one for each pixel of the meshes, or two along an edge.
    EXPECT_GT(count(result.draws[2], "fragments_blended"), courtyard_size.width * courtyard_size.height / 3);
  }
}

}  // namespace
}  // namespace vrpipe
