// Frames of meshes and splats through the whole pipeline, against a renderer that knows samples and order alone.
#include <cmath>
#include <memory>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

#include "support/builders.h"
#include "support/mixed_frames.h"
#include "support/mixed_reference.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::count;
using testing::expect_depth_stencil;
using testing::expect_image;
using testing::mixed_frame;
using testing::MixedReference;
using testing::random_frame;
using testing::request_of;

RenderContext context_of(const Frame& frame) { return testing::context_of(frame); }

/// What Hi-Z culls would have failed; of a draw that is tested late it may have been pruned before.
void expect_counts(const RunResult& result, const MixedReference& reference) {
  const std::uint64_t hi_z_culled = testing::statistic(result, "raster.hi_z_culled");
  for (std::size_t draw = 0; draw < reference.of_draw.size(); ++draw) {
    const testing::MixedCounts& expected = reference.of_draw[draw];
    const DrawReport& report = result.draws[draw];
    const std::uint64_t rasterized = count(report, "fragments_rasterized");
    const std::uint64_t failed = count(report, "fragments_depth_stencil_failed");
    const std::uint64_t pruned = count(report, "fragments_pruned");
    const std::uint64_t late_failed = count(report, "fragments_late_failed");
    EXPECT_EQ(rasterized - failed - pruned - late_failed,
              expected.rasterized - expected.failed - expected.pruned - expected.late_failed)
        << report.name;
    if (hi_z_culled == 0) {
      EXPECT_EQ(failed, expected.failed) << report.name;
      EXPECT_EQ(late_failed, expected.late_failed) << report.name;
    }
    EXPECT_EQ(count(report, "fragments_unshaded"), expected.unshaded) << report.name;
    if (hi_z_culled == 0 || expected.late_failed == 0) {
      EXPECT_EQ(pruned, expected.pruned) << report.name;
    }
    EXPECT_EQ(count(report, "fragments_blended") + count(report, "fragments_merged"), expected.blended) << report.name;
  }
}

class MixedFrame : public testing::FidelityAndVariant {};

INSTANTIATE_TEST_SUITE_P(Frame, MixedFrame, testing::every_fidelity_and_variant(),
                         testing::name_of_fidelity_and_variant);

TEST_P(MixedFrame, IsThatOfTheReference) {
  static testing::MixedReferences references;
  unsigned frames = 0;
  for (std::uint64_t seed = 1; frames < 9; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Frame frame = mixed_frame(seed, request());
    const MixedReference& reference = references.of(seed, context_of(frame));
    // Rounding would decide.
    if (reference.near_prune_edge > 0) continue;
    ++frames;
    EXPECT_GT(reference.of_draw[0].failed, 0U);
    EXPECT_GT(reference.of_draw[1].failed, 0U);
    EXPECT_GT(reference.of_draw[2].failed, 0U);
    EXPECT_GT(reference.of_draw[2].blended, 0U);
    const bool terminates = request().variant.early_termination;
    for (const char* hi_z : {"off", "on"}) {
      SCOPED_TRACE(std::string("Hi-Z ") + hi_z);
      RunRequest wanted = request();
      wanted.settings.push_back({"raster", "hi_z", hi_z});
      const RunResult result = run(wanted, frame);
      expect_depth_stencil(result, reference);
      expect_image(result, reference, terminates ? 1 - 0.996 : 0);
      if (!terminates) expect_counts(result, reference);
    }
  }
}

TEST_P(MixedFrame, OfRandomDepthAndStencilIsThatOfTheReference) {
  static testing::MixedReferences references;
  unsigned frames = 0;
  for (std::uint64_t seed = 100; frames < 12; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RunRequest wanted = request();
    wanted.variant.early_termination = false;
    const Frame frame = random_frame(seed, wanted);
    const MixedReference& reference = references.of(seed, context_of(frame));
    if (reference.near_prune_edge > 0) continue;
    ++frames;
    for (const char* hi_z : {"off", "on"}) {
      SCOPED_TRACE(std::string("Hi-Z ") + hi_z);
      wanted.settings.push_back({"raster", "hi_z", hi_z});
      const RunResult result = run(wanted, frame);
      expect_depth_stencil(result, reference);
      expect_image(result, reference, 0);
      expect_counts(result, reference);
    }
  }
}

TEST_P(MixedFrame, IsTheSameOnSeveralGpcsAndUnderStalls) {
  for (std::uint64_t seed = 100; seed < 104; ++seed) {
    const Frame frame = random_frame(seed, request());
    const RunResult calm = run(request(), frame);
    for (const char* platform : {"agx-orin-ideal-memory", "desktop"}) {
      RunRequest stalled = request();
      stalled.platform = &platform_named(platform);
      stalled.stall_seed = seed;
      stalled.stall_per_256 = 80;
      const RunResult result = run(stalled, frame);
      SCOPED_TRACE(std::string(platform) + ", seed " + std::to_string(seed));
      EXPECT_TRUE(testing::same_image(calm.framebuffer.color, result.framebuffer.color));
      EXPECT_EQ(calm.counts.fragments_depth_stencil_failed, result.counts.fragments_depth_stencil_failed);
      EXPECT_EQ(calm.counts.fragments_unshaded, result.counts.fragments_unshaded);
      EXPECT_EQ(calm.counts.quads_rasterized, result.counts.quads_rasterized);
    }
  }
}

// Depth, stencil and termination share one z-cache, of few lines here; conservation of bytes is checked in every run.
TEST_P(MixedFrame, ThroughAZCacheIsTheSame) {
  RunRequest through_memory = request();
  through_memory.platform = &platform_named("agx-orin");
  through_memory.effects = EffectChoice::everything();
  for (const unsigned lines : {1U, 3U, 128U}) {
    for (std::uint64_t seed = 100; seed < 104; ++seed) {
      const Frame frame = random_frame(seed, request());
      const RunResult ideal = run(request(), frame);
      RunRequest wanted = through_memory;
      // D32F has lines of four quads.
      wanted.settings.push_back({"zrop", "cache_bytes", std::to_string(lines * 128)});
      const RunResult cached = run(wanted, frame);
      SCOPED_TRACE(std::to_string(lines) + " lines, seed " + std::to_string(seed));
      EXPECT_TRUE(testing::same_image(ideal.framebuffer.color, cached.framebuffer.color));
      EXPECT_EQ(ideal.counts.named(), cached.counts.named());
      EXPECT_GT(testing::statistic(cached, "zrop.cache.sector_misses"), 0U);
      if (lines < 128) {
        EXPECT_GT(testing::statistic(cached, "zrop.cache.bytes_written_back"), 0U);
        EXPECT_GT(testing::statistic(cached, "zrop.cache.bytes_filled"), 0U);
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
