// What holds for every scene. RC_PARAMS in the environment replaces the seed and the number of scenes, and replays a
// failure: RC_PARAMS="reproduce=..." as the failing run prints it.
#include <cstdlib>
#include <iostream>

#include <vrpipe/component/error.h>

#include "scenes.h"
#include "support/pixel_oracle.h"

namespace vrpipe {
namespace {

using namespace testing;

class Parameters : public ::testing::Environment {
 public:
  void SetUp() override {
#ifdef VRPIPE_SANITIZED
    setenv("RC_PARAMS", "seed=20250301 max_success=100", 0);
#else
    setenv("RC_PARAMS", "seed=20250301 max_success=500", 0);
#endif
    std::cout << "RC_PARAMS=\"" << std::getenv("RC_PARAMS") << "\"\n";
  }
};
[[maybe_unused]] ::testing::Environment* const parameters_environment =
    ::testing::AddGlobalTestEnvironment(new Parameters);

std::uint64_t statistic(const RunResult& result, const std::string& name) {
  for (const StatisticReport& report : result.statistics) {
    if (report.name == name) return report.value;
  }
  return 0;
}

RC_GTEST_PROP(Pipeline, NoNanAndNoInfinityReachesTheTarget, ()) {
  const Draw draw = *scene(60, 70000.0F);
  RunRequest r = drawn_request();
  r.settings = *bins();
  r.settings.push_back({"state", "blend_rounding", *rounding(r.format)});
  r.settings.push_back({"state", "exponential", *rc::gen::element("ex2", "exact", "fp16", "table256", "table16")});
  r.settings.push_back({"state", "splat_extent", *rc::gen::element("obb", "aabb", "three_sigma", "fill_rectangle")});
  r.settings.push_back({"state", "subpixel_bits", *rc::gen::element("8", "4", "12")});
  const RunResult result = run_trapped(r, draw);
  // A binary16 target keeps growing once its alpha is stuck, up to twice the colour; nearest rounding overflows.
  const bool may_overflow = r.format == ColorFormat::rgba16f && largest_color(draw) > half_max / 4;
  bool overflowed = false;
  for (std::uint32_t y = 0; y < draw.height; ++y) {
    for (std::uint32_t x = 0; x < draw.width; ++x) {
      const std::array<float, 4> pixel = result.framebuffer.color.pixel(x, y);
      for (const float value : pixel) {
        RC_ASSERT(!std::isnan(value));
        RC_ASSERT(value >= 0.0F);
        RC_ASSERT(std::isfinite(value) || may_overflow);
        overflowed = overflowed || std::isinf(value);
      }
      RC_ASSERT(pixel[3] <= 1.0F);
    }
  }
  RC_CLASSIFY(statistic(result, "crop.colors_saturated") > 0, "some colours saturate");
  RC_CLASSIFY(statistic(result, "crop.pixels_stuck") > 0, "some pixels are stuck");
  RC_CLASSIFY(statistic(result, "raster.wide_edges") > 0, "some edges are wide");
  RC_ASSERT(!overflowed || statistic(result, "crop.colors_saturated") > 0);
}

RC_GTEST_PROP(Pipeline, WithoutTerminationEveryVariantIsWithinTheRunningBound, ()) {
  const Draw draw = *scene(50, 1.0F);
  const ColorFormat target = *format();
  const char* const rounds = *rc::gen::element("rne", "rtz");
  RenderContext context = context_of(draw);
  context.format = target;
  if (rounds[1] == 't') context.precision.blend_rounding = BlendRounding::rtz;
  const auto fragments = fragments_of(context);
  const std::vector<Setting> sizes = *bins();
  for (const char* name : {"baseline", "qm"}) {
    RunRequest r = request(variant_named(name), target);
    r.settings = sizes;
    r.settings.push_back({"state", "blend_rounding", rounds});
    const RunResult result = run_trapped(r, draw);
    std::uint64_t total = 0;
    for (std::uint32_t y = 0; y < draw.height; ++y) {
      for (std::uint32_t x = 0; x < draw.width; ++x) {
        const OraclePixel exact = blend_exactly(fragments[std::size_t{y} * draw.width + x], context);
        const std::array<float, 4> pixel = result.framebuffer.color.pixel(x, y);
        for (unsigned i = 0; i < 3; ++i) RC_ASSERT(std::fabs(pixel[i] - exact.rgba[i]) <= exact.color_bound[i]);
        RC_ASSERT(std::fabs(pixel[3] - exact.rgba[3]) <= exact.alpha_bound);
        total += exact.fragments;
      }
    }
    RC_ASSERT(total == result.counts.fragments_blended + result.counts.fragments_merged);
  }
}

RC_GTEST_PROP(Pipeline, TerminationChangesAPixelByAtMostWhatTheThresholdLeaves, ()) {
  const Draw draw = *scene(80, 1.0F);
  const ColorFormat target = *format();
  RenderContext context = context_of(draw);
  context.format = target;
  const auto fragments = fragments_of(context);
  const double brightest = largest_color(draw);
  const std::vector<Setting> sizes = *bins();
  bool terminates = false;
  for (const char* name : {"het", "het+qm"}) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      RunRequest r = request(variant_named(name), target);
      r.termination = termination;
      r.settings = sizes;
      const RunResult result = run_trapped(r, draw);
      for (std::uint32_t y = 0; y < draw.height; ++y) {
        for (std::uint32_t x = 0; x < draw.width; ++x) {
          const OraclePixel exact = blend_exactly(fragments[std::size_t{y} * draw.width + x], context);
          const std::array<float, 4> pixel = result.framebuffer.color.pixel(x, y);
          const double left = (1.0 - 0.996 + exact.alpha_bound) * brightest + 1e-6;
          for (unsigned i = 0; i < 3; ++i) {
            RC_ASSERT(std::fabs(pixel[i] - exact.rgba[i]) <= exact.color_bound[i] + left);
          }
          // Passed or not, alpha is that of a prefix.
          RC_ASSERT(pixel[3] <= exact.rgba[3] + exact.alpha_bound);
          RC_ASSERT(pixel[3] >= std::fmin(exact.rgba[3], 0.996) - exact.alpha_bound);
        }
      }
      terminates = terminates || result.counts.fragments_terminated > 0;
      RC_ASSERT(result.counts.fragments_blended <= result.counts.fragments_rasterized);
    }
  }
  RC_CLASSIFY(terminates, "some fragments are terminated");
}

RC_GTEST_PROP(Pipeline, WhereOrderAloneDecidesBinSizesChangeNoBit, ()) {
  const Draw draw = *scene(60, 1.0F);
  const ColorFormat target = *format();
  for (const char* name : {"baseline", "het"}) {
    RunRequest r = request(variant_named(name), target);
    r.termination = Termination::strict;
    const RunResult plain = run_trapped(r, draw);
    r.settings = *bins();
    const RunResult other = run_trapped(r, draw);
    RC_ASSERT(same_bits(plain.framebuffer.color, other.framebuffer.color));
    RC_ASSERT(plain.counts.fragments_blended == other.counts.fragments_blended);
  }
}

RC_GTEST_PROP(Pipeline, MergingTakesNothingAwayAndAddsNothing, ()) {
  const Draw draw = *scene(60, 1.0F);
  const ColorFormat target = *format();
  const RunResult plain = run_trapped(request(variant_named("baseline"), target), draw);
  RunRequest r = request(variant_named("qm"), target);
  r.settings = *bins();
  const RunResult merged = run_trapped(r, draw);
  RC_ASSERT(plain.counts.fragments_rasterized == merged.counts.fragments_rasterized);
  RC_ASSERT(plain.counts.fragments_pruned == merged.counts.fragments_pruned);
  RC_ASSERT(plain.counts.quads_blended == merged.counts.quads_blended + merged.counts.quads_merged);
  RC_ASSERT(plain.counts.fragments_blended == merged.counts.fragments_blended + merged.counts.fragments_merged);
  RC_CLASSIFY(merged.counts.fragments_merged > 0, "some fragments are merged");
}

RC_GTEST_PROP(Pipeline, InStrictModeEveryFidelityIsTheUntimedOneBitForBit, ()) {
  const Draw draw = *scene(30, 1.0F);
  RunRequest r = drawn_request();
  r.termination = Termination::strict;
  r.settings = *bins();
  const RunResult untimed = run_trapped(r, draw);
  for (const char* name : {"bound", "lt", "cycle"}) {
    try {
      r.fidelity = fidelity_named(name);
    } catch (const UserError&) {
      continue;
    }
    r.stall_seed = static_cast<std::uint64_t>(*whole(1, 1000));
    r.stall_per_256 = *rc::gen::element(0U, 64U);
    const RunResult timed = run_trapped(r, draw);
    RC_ASSERT(same_bits(untimed.framebuffer.color, timed.framebuffer.color));
    RC_ASSERT(untimed.counts.named() == timed.counts.named());
  }
}

RC_GTEST_PROP(Pipeline, AtCycleFidelityThePapersModeStaysWithinTheBound, ()) {
  const Draw draw = *scene(40, 1.0F);
  const ColorFormat target = *format();
  RenderContext context = context_of(draw);
  context.format = target;
  const auto fragments = fragments_of(context);
  RunRequest r = request(variant_named(*rc::gen::element("het", "het+qm")), target, Fidelity::cycle);
  r.settings = *bins();
  r.stall_seed = static_cast<std::uint64_t>(*whole(1, 1000));
  r.stall_per_256 = *rc::gen::element(0U, 64U);
  const RunResult result = run_trapped(r, draw);
  for (std::uint32_t y = 0; y < draw.height; ++y) {
    for (std::uint32_t x = 0; x < draw.width; ++x) {
      const OraclePixel exact = blend_exactly(fragments[std::size_t{y} * draw.width + x], context);
      const std::array<float, 4> pixel = result.framebuffer.color.pixel(x, y);
      const double left = (1.0 - 0.996 + exact.alpha_bound) * static_cast<double>(largest_color(draw)) + 1e-6;
      for (unsigned i = 0; i < 3; ++i) RC_ASSERT(std::fabs(pixel[i] - exact.rgba[i]) <= exact.color_bound[i] + left);
    }
  }
}

RC_GTEST_PROP(Pipeline, SplatsThatShowNothingChangeNoBit, ()) {
  const Draw draw = *scene(40, 1.0F);
  RunRequest r = request(variant_named("baseline"), *format());
  const RunResult plain = run_trapped(r, draw);
  Draw padded = draw;
  Splat invisible = round_splat(8, 8, 4, 0.5F);
  invisible.opacity = 0;
  Splat outside = round_splat(-500, 8, 4, 0.5F);
  Splat broken = round_splat(8, 8, 4, 0.5F);
  broken.red = std::numeric_limits<float>::quiet_NaN();
  for (const Splat& extra : {invisible, outside, broken}) {
    const int at = *whole(0, static_cast<int>(padded.splats.size()) + 1);
    padded.splats.insert(padded.splats.begin() + at, extra);
  }
  fresh_simulation();
  const RunResult result = simulate(r, padded);
  RC_ASSERT(same_bits(plain.framebuffer.color, result.framebuffer.color));
  RC_ASSERT(statistic(result, "vpo.dropped_not_finite") == statistic(plain, "vpo.dropped_not_finite") + 1);
}

}  // namespace
}  // namespace vrpipe
