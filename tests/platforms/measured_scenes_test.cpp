// Stand-ins for the scenes that were measured on a GPU and not kept: the same bits everywhere, and counts as measured.

#include <cstring>
#include <set>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

#include "support/measured_scenes.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

std::uint64_t hash_of(const std::vector<Splat>& splats) {
  std::uint64_t hash = 0;
  for (const Splat& splat : splats) {
    std::uint32_t words[sizeof(Splat) / sizeof(std::uint32_t)];
    std::memcpy(words, &splat, sizeof splat);
    for (const std::uint32_t word : words) hash = mix(hash ^ word);
  }
  return hash;
}

testing::MeasuredScene scene_named(const std::string& name) {
  for (const testing::MeasuredScene& scene : testing::measured_scenes()) {
    if (scene.name == name) return scene;
  }
  ADD_FAILURE() << "no scene " << name;
  return {};
}

TEST(StandIn, HasTheSameBitsEverywhere) {
  const Draw clustered = testing::stand_in_scene(scene_named("sweep-50k").stand_in, 1000, 980, 545);
  EXPECT_EQ(hash_of(clustered.splats), 14816727616111176189ULL);
  const Draw ball = testing::stand_in_scene(scene_named("object").stand_in, 1000, 800, 800);
  EXPECT_EQ(hash_of(ball.splats), 12674272195172807839ULL);
}

TEST(StandIn, OfFewerSplatsIsTheBeginningOfOneOfMore) {
  const testing::StandIn parameters = scene_named("indoor").stand_in;
  Draw more = testing::stand_in_scene(parameters, 300, 1552, 1040);
  more.splats.resize(200);
  EXPECT_EQ(hash_of(more.splats), hash_of(testing::stand_in_scene(parameters, 200, 1552, 1040).splats));
}

TEST(StandIn, HasOtherSplatsForAnotherSeed) {
  testing::StandIn parameters;
  const Draw one = testing::stand_in_scene(parameters, 10, 64, 64);
  parameters.seed = 2;
  EXPECT_NE(hash_of(one.splats), hash_of(testing::stand_in_scene(parameters, 10, 64, 64).splats));
}

TEST(MeasuredScenes, AreTwelveWithWhatWasMeasuredOfEach) {
  std::set<std::string> names;
  for (const testing::MeasuredScene& scene : testing::measured_scenes()) {
    names.insert(scene.name);
    for (const char* column :
         {"width", "height", "splats", "fragments", "quads", "warps", "rgba16f", "ideal_termination"}) {
      EXPECT_GT(scene.values.count(column), 0U) << scene.name << ": " << column;
    }
    EXPECT_LE(scene.count("quads_blended"), scene.count("quads")) << scene.name;
  }
  EXPECT_EQ(names.size(), 12U);
}

// The others by benchmarks/measured_gpu --synthetic, which docs/silicon.md quotes.
TEST(MeasuredScenes, TheStandInForTheSmallestHasItsCounts) {
  const testing::MeasuredScene scene = scene_named("sweep-50k");
  const Draw draw = scene.draw();
  ASSERT_EQ(draw.splats.size(), 50'000U);
  const auto counts_of = [&](const std::string& variant) {
    return testing::run(testing::request_of(variant, Fidelity::functional,
                                            [](RunRequest& request) {
                                              request.platform = &platform_named("gh100-gpc");
                                              request.settings = {{"state", "obb_padding", "0"}};
                                              testing::strictly(request);
                                            }),
                        draw)
        .counts;
  };
  const auto expect_near = [&](std::uint64_t got, const std::string& column) {
    const auto measured = static_cast<double>(scene.count(column));
    EXPECT_NEAR(static_cast<double>(got), measured, 0.01 * measured) << column;
  };
  const Counts counts = counts_of("baseline");
  expect_near(counts.fragments_shaded, "fragments");
  expect_near(counts.fragments_blended, "fragments_blended");
  expect_near(counts.quads_shaded, "quads");
  expect_near(counts.quads_blended, "quads_blended");
  expect_near(counts.warps, "warps");
  expect_near(counts_of("het").fragments_shaded, "fragments_until_termination");
}

}  // namespace
}  // namespace vrpipe
