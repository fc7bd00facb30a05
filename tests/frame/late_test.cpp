// Tests of depth and stencil after shading, in whole frames: what the shader discards leaves no trace, and what comes behind
// sees what was stored.
#include <memory>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/platforms/wiring.h>

#include "support/mixed_frames.h"
#include "support/mixed_reference.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::count;
using testing::expect_depth_stencil;
using testing::mixed_frame_height;
using testing::mixed_frame_width;
using testing::random_mesh;
using testing::random_splats;
using testing::request_of;
using testing::statistic;

/// Splats that store their depth and count in the stencil what they leave, between meshes that are tested before they are
/// shaded, and behind a clear once more.
Frame late_frame(std::uint64_t seed, const RunRequest& request) {
  Frame frame(mixed_frame_width, mixed_frame_height);
  frame.set_depth_format(static_cast<DepthFormat>(seed % 3));
  DrawState wall;
  wall.shader = FragmentShader::none;
  wall.depth = {true, Compare::less, true};
  frame.draw(random_mesh(6, seed), wall, "walls");
  DrawState splats = draw_state_of(request);
  splats.depth = {true, seed % 2 == 0 ? Compare::less : Compare::less_equal, true};
  splats.stencil.test = true;
  splats.stencil.front.pass = StencilOperation::increment;
  splats.stencil.front.depth_fail = seed % 4 == 0 ? StencilOperation::invert : StencilOperation::keep;
  frame.draw(random_splats(60, seed + 1000), splats, "late");
  DrawState under;
  under.shader = FragmentShader::lit;
  under.light = {0, 0, 1, 0.5F};
  under.depth = {true, Compare::less, true};
  under.stencil.test = true;
  under.stencil.front.compare = Compare::less_equal;
  under.stencil.front.reference = static_cast<std::uint8_t>(seed % 3);
  frame.draw(random_mesh(8, seed + 2000), under, "early behind it");
  splats.stencil.front.depth_fail = StencilOperation::keep;
  splats.pruning_threshold = 0.05F;
  frame.draw(random_splats(40, seed + 3000), splats, "late again");
  Clear clear;
  clear.depth = true;
  clear.stencil = seed % 2 == 0;
  clear.depth_value = 0.75F;
  clear.stencil_value = 3;
  frame.clear(clear);
  splats.depth.compare = Compare::greater;
  frame.draw(random_splats(20, seed + 4000), splats, "late behind a clear");
  return frame;
}

class LateFrame : public testing::FidelityAndVariant {};
INSTANTIATE_TEST_SUITE_P(Frame, LateFrame, testing::every_fidelity_and_variant(),
                         testing::name_of_fidelity_and_variant);

// Whatever terminates, and when: depth and stencil are the reference's to the bit.
TEST_P(LateFrame, IsThatOfTheReference) {
  const bool terminates = request().variant.early_termination;
  static testing::MixedReferences references;
  unsigned frames = 0;
  for (std::uint64_t seed = 1; frames < 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Frame frame = late_frame(seed, request());
    const testing::MixedReference& reference = references.of(seed, testing::context_of(frame));
    if (reference.near_prune_edge > 0) continue;
    ++frames;
    EXPECT_GT(reference.of_draw[1].late_failed, 0U);
    EXPECT_GT(reference.of_draw[2].failed, 0U);
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      for (const char* hi_z : {"off", "on"}) {
        SCOPED_TRACE(std::string(name_of(termination)) + ", Hi-Z " + hi_z);
        RunRequest wanted = request();
        wanted.termination = termination;
        wanted.settings.push_back({"raster", "hi_z", hi_z});
        const RunResult result = run(wanted, frame);
        expect_depth_stencil(result, reference);
        testing::expect_image(result, reference, terminates ? 1 - 0.996 : 0);
        EXPECT_GT(result.counts.fragments_late_failed, 0U);
        for (const std::size_t draw : {1U, 3U, 4U}) EXPECT_EQ(count(result.draws.at(draw), "quads_merged"), 0U);
        if (terminates || std::string(hi_z) == "on") continue;
        for (std::size_t draw = 0; draw < reference.of_draw.size(); ++draw) {
          EXPECT_EQ(count(result.draws.at(draw), "fragments_late_failed"), reference.of_draw[draw].late_failed);
          EXPECT_EQ(count(result.draws.at(draw), "fragments_depth_stencil_failed"), reference.of_draw[draw].failed);
          EXPECT_EQ(count(result.draws.at(draw), "fragments_pruned"), reference.of_draw[draw].pruned);
          EXPECT_EQ(count(result.draws.at(draw), "fragments_blended") +
                        count(result.draws.at(draw), "fragments_merged"),
                    reference.of_draw[draw].blended);
        }
      }
    }
  }
}

TEST_P(LateFrame, EarlyOrLateWhereBothAreLegalTheImageIsTheSame) {
  std::uint64_t late_failed = 0;
  for (std::uint64_t seed = 50; seed < 58; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    // Without merging, which late tests forgo.
    RunRequest wanted = request();
    wanted.variant.quad_merging = false;
    RunResult results[2];
    for (const bool late : {false, true}) {
      Frame frame(mixed_frame_width, mixed_frame_height);
      DrawState wall;
      wall.shader = FragmentShader::vertex;
      wall.depth = {true, Compare::less, true};
      wall.late_tests = late;
      frame.draw(random_mesh(6, seed), wall, "walls");
      DrawState splats = draw_state_of(wanted);
      splats.depth = {true, Compare::less, false};
      splats.late_tests = late;
      frame.draw(random_splats(60, seed + 1000), splats, "splats");
      results[late] = run(wanted, frame);
    }
    EXPECT_TRUE(testing::same_image(results[0].framebuffer.color, results[1].framebuffer.color));
    for (std::size_t place = 0; place < results[0].framebuffer.depth_stencil.grid().quads(); ++place) {
      ASSERT_EQ(results[0].framebuffer.depth_stencil.quad(place).depth,
                results[1].framebuffer.depth_stencil.quad(place).depth);
    }
    EXPECT_EQ(results[0].counts.fragments_blended, results[1].counts.fragments_blended);
    EXPECT_EQ(results[0].counts.quads_late_failed, 0U);
    EXPECT_EQ(results[1].counts.quads_depth_stencil_failed, 0U);
    EXPECT_EQ(count(results[1].draws.at(1), "quads_depth_stencil_failed"), 0U);
    late_failed += results[1].counts.fragments_late_failed;
  }
  EXPECT_GT(late_failed, 0U);
}

// Which quads are tested late, and when, decides nothing.
TEST_P(LateFrame, IsTheSameOnSeveralGpcsAndUnderStalls) {
  for (std::uint64_t seed = 20; seed < 24; ++seed) {
    const Frame frame = late_frame(seed, request());
    RunRequest untimed = request();
    untimed.fidelity = Fidelity::functional;
    const RunResult expected = run(untimed, frame);
    for (const unsigned stalls : {0U, 100U}) {
      RunRequest wanted = request();
      wanted.stall_seed = seed;
      wanted.stall_per_256 = stalls;
      const RunResult result = run(wanted, frame);
      EXPECT_EQ(result.counts.named(), expected.counts.named());
      EXPECT_TRUE(testing::same_image(result.framebuffer.color, expected.framebuffer.color));
      wanted.platform = &platform_named("desktop");
      const RunResult desktop = run(wanted, frame);
      EXPECT_TRUE(testing::same_image(desktop.framebuffer.color, expected.framebuffer.color));
    }
  }
}

// Queues of one place and caches of one line: everybody waits for everybody, and nobody for ever.
TEST_P(LateFrame, ComesToItsEndWithTheLeastOfRoom) {
  RunRequest least = request();
  least.platform = &platform_named("agx-orin");
  least.effects = EffectChoice::everything();
  for (const char* link : {"prop.late", "zrop.late", "zrop.quads", "prop.test", "prop.survivors", "prop.color",
                           "qru.warps", "sm.shaded", "crop.terminations", "tc.bins"}) {
    least.settings.push_back({std::string("link.") + link, "depth", "1"});
  }
  for (const char* parameter : {"mshrs", "input_quads", "input_updates"}) {
    least.settings.push_back({"zrop", parameter, "1"});
  }
  least.settings.push_back({"zrop", "quads_per_cycle", "3"});
  least.settings.push_back({"sm", "warps_per_core", "1"});
  least.settings.push_back({"sm", "cores", "1"});
  for (std::uint64_t seed = 30; seed < 33; ++seed) {
    const Frame frame = late_frame(seed, request());
    const RunResult expected = run(request(), frame);
    for (const char* bytes : {"128", "512"}) {
      RunRequest wanted = least;
      wanted.settings.push_back({"zrop", "cache_bytes", bytes});
      const RunResult result = run(wanted, frame);
      EXPECT_EQ(result.counts.named(), expected.counts.named());
      EXPECT_TRUE(testing::same_image(result.framebuffer.color, expected.framebuffer.color));
      EXPECT_GT(statistic(result, "zrop.cache.bytes_written_back"), 0U);
    }
  }
}

TEST_P(LateFrame, AnEarlyDrawSeesWhatALateOneBeforeItHasStored) {
  // A splat whose alpha falls below the threshold within its box, and a wall behind it.
  constexpr float threshold = 0.3F;
  auto splat = std::make_shared<Draw>(
      testing::draw_of(mixed_frame_width, mixed_frame_height, {testing::round_splat(40, 28, 6, 0.9F)}));
  splat->splats[0].depth = 0.5F;
  auto wall = std::make_shared<Draw>(testing::draw_of(mixed_frame_width, mixed_frame_height));
  const auto corner = [](float x, float y) { return MeshVertex{x, y, 0.75F, 1, 0.5F, 0.5F, 0.5F, 0, 0, 1}; };
  wall->mesh.push_back({{corner(-9, -9), corner(-9, 300), corner(300, -9)}});
  DrawState stores = draw_state_of(request());
  stores.depth = {true, Compare::less, true};
  stores.pruning_threshold = threshold;
  DrawState tests;
  tests.shader = FragmentShader::vertex;
  tests.depth = {true, Compare::less, false};
  for (const bool clears : {false, true}) {
    Frame frame(mixed_frame_width, mixed_frame_height);
    frame.draw(splat, stores, "splat");
    Clear clear;
    clear.depth = true;
    if (clears) frame.clear(clear);
    frame.draw(wall, tests, "wall");
    RunRequest wanted = request();
    wanted.settings.push_back({"raster", "hi_z", "off"});
    const RunResult result = run(wanted, frame);
    const std::uint64_t stored =
        count(result.draws.at(0), "fragments_blended") + count(result.draws.at(0), "fragments_dropped_late");
    EXPECT_GT(stored, 0U);
    EXPECT_GT(count(result.draws.at(0), "fragments_pruned"), 0U);
    EXPECT_EQ(count(result.draws.at(1), "fragments_depth_stencil_failed"), clears ? 0U : stored)
        << "what was discarded has left no depth";
  }
}

TEST_P(LateFrame, APlatformWithoutTheWayIsRefusedWhereADrawNeedsIt) {
  for (const char* port : {"gpc0.prop.out_late", "gpc0.zrop.out_late"}) {
    Platform unlinked = platform_named("agx-orin-ideal-memory");
    unlinked.wire = [wire = unlinked.wire, port](Netlist& netlist) {
      wire(netlist);
      netlist.disconnect(port);
    };
    RunRequest wanted = request();
    wanted.platform = &unlinked;
    Frame early(mixed_frame_width, mixed_frame_height);
    early.draw(random_splats(5, 1), draw_state_of(wanted));
    EXPECT_GT(run(wanted, early).counts.quads_blended, 0U);
    try {
      run(wanted, late_frame(1, wanted));
      ADD_FAILURE() << "accepted without " << port;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find(port), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace vrpipe
