// Early termination in passes, through whole frames: the image is that of the splats up to the batch in which a pixel passes
// the threshold, and no pass looks before the blends of the one before are done.
#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/batch.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/multi_pass.h>

#include "support/mixed_reference.h"
#include "support/pixel_oracle.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::request_of;
using testing::run;
using testing::same_image;

constexpr std::uint32_t passes_width = 80;
constexpr std::uint32_t passes_height = 56;

/// Front to back, many to a pixel.
Draw dense_splats(std::uint64_t seed, std::uint32_t splats = 90) {
  Draw draw = testing::draw_of(passes_width, passes_height);
  for (std::uint32_t i = 0; i < splats; ++i) {
    const std::uint64_t k = 16ULL * i;
    draw.splats.push_back(
        testing::splat_at(testing::uniform(seed, k, 0, passes_width), testing::uniform(seed, k + 1, 0, passes_height),
                          testing::uniform(seed, k + 2, 2, 14), testing::uniform(seed, k + 3, 2, 14),
                          testing::uniform(seed, k + 4, 0, 6.2F), testing::uniform(seed, k + 5, 0.1F, 0.9F),
                          testing::uniform(seed, k + 6, 0, 1), testing::uniform(seed, k + 7, 0, 1),
                          testing::uniform(seed, k + 8, 0, 1)));
  }
  return draw;
}

RunResult run_passes(const RunRequest& request, const Draw& draw, std::uint32_t passes) {
  return run(request, *multi_pass_frame(draw, draw_state_of(request), passes));
}

/// What the first splats come to, in double.
testing::MixedReference reference_of(const Draw& draw, std::size_t splats, const DrawState& state) {
  Draw front = draw;
  front.splats.resize(splats);
  return testing::render_mixed(testing::context_of(front, state));
}

class MultiPass : public ::testing::TestWithParam<std::tuple<Fidelity, std::string, std::string>> {
 protected:
  RunRequest request() const {
    RunRequest request = request_of(std::get<1>(GetParam()), std::get<0>(GetParam()));
    request.platform = &platform_named(std::get<2>(GetParam()));
    request.settings = {{"state", "exponential", "exact"}, {"state", "termination_threshold", "0.9"}};
    return request;
  }
};
std::string name_of_case(const ::testing::TestParamInfo<MultiPass::ParamType>& each) {
  std::string name =
      std::string(name_of(std::get<0>(each.param))) + "_" + std::get<1>(each.param) + "_" + std::get<2>(each.param);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '-' || c == '+'; }, '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Frame, MultiPass,
                         ::testing::Combine(::testing::ValuesIn(fidelities()), ::testing::Values("baseline", "qm"),
                                            ::testing::Values("agx-orin-ideal-memory", "desktop")),
                         name_of_case);

// Neither stencils nor shaders are in what this is compared with: plain draws of the first batches, and the threshold.
TEST_P(MultiPass, IsTheSplatsUpToTheEndOfTheBatchInWhichAPixelPassesTheThreshold) {
  for (const std::uint32_t passes : {2U, 3U, 7U}) {
    const Draw draw = dense_splats(passes);
    const DrawState state = draw_state_of(request());
    std::vector<testing::MixedReference> after;
    for (std::uint32_t pass = 1; pass <= passes; ++pass)
      after.push_back(reference_of(draw, std::size_t{pass} * draw.splats.size() / passes, state));
    const RunResult result = run_passes(request(), draw, passes);
    std::vector<unsigned> ends(passes, 0);  // pixels that end with each pass
    unsigned undecided = 0;
    unsigned wrong = 0;
    for (std::uint32_t y = 0; y < passes_height; ++y) {
      for (std::uint32_t x = 0; x < passes_width; ++x) {
        const std::size_t index = std::size_t{y} * passes_width + x;
        const double threshold = 0.9;
        std::uint32_t pass = 0;
        bool near = false;
        for (; pass + 1 < passes; ++pass) {
          const double alpha = after[pass].rgba[index][3];
          near = near || std::fabs(alpha - threshold) <= after[pass].bound[index].alpha + 2e-5;
          if (alpha >= threshold) break;
        }
        if (near) {
          ++undecided;  // rounding decides
          continue;
        }
        ++ends[pass];
        const auto pixel = result.framebuffer.color.pixel(x, y);
        for (unsigned channel = 0; channel < 4; ++channel) {
          const double bound = (channel == 3 ? after[pass].bound[index].alpha : after[pass].bound[index].color) + 2e-5 +
                               1.0 / 255;  // at an edge of pruning
          wrong += std::fabs(static_cast<double>(pixel[channel]) - after[pass].rgba[index][channel]) > bound ? 1U : 0U;
        }
      }
    }
    EXPECT_EQ(wrong, 0U) << passes << " passes";
    EXPECT_LT(undecided, passes_width * passes_height / 20) << passes << " passes";
    EXPECT_GT(ends.front(), 50U) << "some end at once";
    EXPECT_GT(ends.back(), 50U) << "and some never";
  }
}

TEST_P(MultiPass, InOnePassItIsThePlainDraw) {
  const Draw draw = dense_splats(5);
  const RunResult plain = run(request(), *Frame::of(draw, draw_state_of(request())));
  EXPECT_EQ(run_passes(request(), draw, 1).result_hash, plain.result_hash);
}

/// Blended, or merged before that: smaller batches have fewer pairs.
std::uint64_t visible(const RunResult& result) {
  return result.counts.fragments_blended + result.counts.fragments_merged;
}

// Where the batches of more passes lie in those of fewer.
TEST_P(MultiPass, TheMorePassesTheFewerFragmentsAreLeft) {
  const Draw draw = dense_splats(6, 96);
  std::uint64_t before = visible(run_passes(request(), draw, 1));
  for (const std::uint32_t passes : {2U, 4U, 8U, 16U, 32U, 96U}) {
    const RunResult result = run_passes(request(), draw, passes);
    EXPECT_LT(visible(result), before) << passes;
    before = visible(result);
    // Two triangles over every pixel, once for each pass but the last.
    std::uint64_t at_ends = 0;
    for (std::size_t i = 1; i < result.draws.size(); i += 2) {
      const auto& counts = result.draws[i].counts;
      const auto count = [&](const char* name) {
        return std::find_if(counts.begin(), counts.end(), [&](const auto& each) { return each.first == name; })->second;
      };
      EXPECT_EQ(count("fragments_shaded"), passes_width * passes_height);
      EXPECT_EQ(count("fragments_blended"), 0U);
      EXPECT_EQ(count("fragments_shaded"), count("fragments_pruned") + count("fragments_unblended"));
      at_ends += count("fragments_shaded");
    }
    EXPECT_EQ(at_ends, std::uint64_t{passes - 1} * passes_width * passes_height);
  }
}

class MultiPassInOrder : public MultiPass {};
INSTANTIATE_TEST_SUITE_P(Frame, MultiPassInOrder,
                         ::testing::Combine(::testing::ValuesIn(fidelities()),
                                            ::testing::Values("baseline", "qm", "het", "het+qm"),
                                            ::testing::Values("agx-orin-ideal-memory", "desktop")),
                         name_of_case);

TEST_P(MultiPassInOrder, StallsAndGpcsChangeNothing) {
  const Draw draw = dense_splats(7);
  RunRequest strict = request();
  strict.termination = Termination::strict;
  RunRequest elsewhere = strict;
  elsewhere.platform = &platform_named("agx-orin-ideal-memory");
  elsewhere.fidelity = Fidelity::functional;
  const RunResult expected = run_passes(elsewhere, draw, 5);
  for (const std::uint64_t seed : {0U, 1U, 2U}) {
    strict.stall_seed = seed;
    strict.stall_per_256 = seed == 0 ? 0 : 80;
    const RunResult result = run_passes(strict, draw, 5);
    // Which quads share a bin, and so merge, depends on how many GPCs there are.
    if (!strict.variant.quad_merging || std::get<2>(GetParam()) == "agx-orin-ideal-memory") {
      EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << seed;
      EXPECT_EQ(result.counts.fragments_blended, expected.counts.fragments_blended) << seed;
    }
    EXPECT_EQ(result.counts.fragments_shaded - result.counts.fragments_merged,
              expected.counts.fragments_shaded - expected.counts.fragments_merged)
        << seed;
  }
}

// A target that does not round, without merging: every bit is known.
TEST_P(MultiPassInOrder, EveryPixelIsAsOrderMakesIt) {
  RunRequest strict = request();
  strict.termination = Termination::strict;
  strict.format = ColorFormat::rgba32f;
  strict.settings = {{"state", "termination_threshold", "0.8"}, {"state", "termination_compare", "gt"}};
  if (strict.variant.quad_merging) GTEST_SKIP() << "merging rounds otherwise";
  for (const std::uint32_t passes : {2U, 5U, 30U}) {
    const Draw draw = dense_splats(passes);
    const Frame frame = *multi_pass_frame(draw, draw_state_of(strict), passes);
    const auto expected = testing::pixels_in_order(frame, strict.variant.early_termination);
    const RunResult result = run(strict, frame);
    std::size_t wrong = 0;
    for (std::uint32_t i = 0; i < expected.size(); ++i)
      wrong += result.framebuffer.color.pixel(i % passes_width, i / passes_width) != expected[i] ? 1U : 0U;
    EXPECT_EQ(wrong, 0U) << passes;
  }
}

// What early termination by hardware has ended, the stencil cannot end earlier.
TEST_P(MultiPassInOrder, WithHardwareEarlyTerminationEveryNumberOfPassesHasTheSameImage) {
  RunRequest strict = request();
  strict.termination = Termination::strict;
  if (!strict.variant.early_termination || strict.variant.quad_merging) GTEST_SKIP() << "merging rounds otherwise";
  const Draw draw = dense_splats(8);
  const RunResult plain = run_passes(strict, draw, 1);
  for (const std::uint32_t passes : {2U, 9U, 90U}) {
    EXPECT_TRUE(same_image(run_passes(strict, draw, passes).framebuffer.color, plain.framebuffer.color)) << passes;
  }
}

class MultiPassBarrier : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Frame, MultiPassBarrier, ::testing::Values("agx-orin-ideal-memory", "desktop"),
                         [](const auto& each) { return each.param == "desktop" ? "several_gpcs" : "one_gpc"; });

TEST_P(MultiPassBarrier, NoWarpThatReadsIsLaunchedBeforeTheLastBlendBeforeItAndNoneIsBlendedAfter) {
  const Draw draw = dense_splats(9, 300);
  RunRequest request = request_of("baseline", Fidelity::cycle);
  request.platform = &platform_named(GetParam());
  const Frame frame = *multi_pass_frame(draw, draw_state_of(request), 4);
  struct Times {
    Cycle first_launch = never;
    Cycle last_color = 0;
  };
  std::map<unsigned, Times> of_draw;
  auto observers = std::make_shared<Observers>();
  observers->on_link<Warp>("qru.warps", [&](const auto& passed) {
    if (passed.item.count == 0) return;
    Times& times = of_draw[passed.item.quads[0].draw];
    times.first_launch = std::min(times.first_launch, passed.first);
  });
  observers->on_link<ColorBeat>("prop.color", [&](const auto& passed) {
    for (unsigned i = 0; i < passed.item.count; ++i) {
      const ColorQuad& quad = passed.item.quads[i];
      Times& times = of_draw[quad.warp->draw[quad.index]];
      times.last_color = std::max(times.last_color, passed.first);
    }
  });
  std::vector<Cycle> told;
  observers->on_link<BlendsDone>("crop.done", [&](const auto& passed) { told.push_back(passed.first); });
  request.observers = observers;
  run(request, frame);
  ASSERT_EQ(of_draw.size(), 7U);
  EXPECT_EQ(told.size(), 3U * request.platform->gpcs);
  for (unsigned reading = 1; reading < 7; reading += 2) {
    for (unsigned before = 0; before < reading; ++before)
      EXPECT_GT(of_draw[reading].first_launch, of_draw[before].last_color) << reading << " reads " << before;
    EXPECT_EQ(of_draw[reading].last_color, 0U) << "writes no colour";
    const std::ptrdiff_t gpcs = request.platform->gpcs;
    const auto last = told.begin() + (reading / 2 + 1) * gpcs;
    EXPECT_GT(of_draw[reading].first_launch, *std::max_element(told.begin(), last));
    EXPECT_GT(of_draw[reading].first_launch, 0U);
  }
}

class TimeBetweenPasses : public ::testing::TestWithParam<std::string> {
 protected:
  static constexpr std::uint32_t side = 256;
  /// Of the draw between two batches: of splats, and of as many that nobody sees.
  Cycle time(Fidelity fidelity, const std::vector<Splat>& splats) const {
    Draw draw = testing::draw_of(side, side, splats);
    draw.splats.resize(2 * splats.size(), testing::round_splat(1, 1, 0.5F, 0.1F));
    RunRequest request = request_of("baseline", fidelity);
    request.platform = &platform_named(GetParam());
    return *run_passes(request, draw, 2).draws.at(1).cycles;
  }
};
INSTANTIATE_TEST_SUITE_P(Frame, TimeBetweenPasses, ::testing::Values("agx-orin", "gh100-gpc", "desktop"),
                         [](const auto& each) { return each.param.substr(0, each.param.find('-')); });

// Many warps then have quads left and many have none, which need not wait for the others' late tests. A real GPU takes as
// long whatever has terminated (tests/data/measured_passes.csv).
TEST_P(TimeBetweenPasses, DependsLittleOnWhatHasTerminated) {
  std::vector<Splat> dots, none;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    const float x = testing::uniform(1, 2 * i, 0, side), y = testing::uniform(1, 2 * i + 1, 0, side);
    for (unsigned layer = 0; layer < 3; ++layer) dots.push_back(testing::flat_box(x - 2, y - 2, x + 2, y + 2, 0.99F));
  }
  none.resize(dots.size(), testing::round_splat(1, 1, 0.5F, 0.1F));
  const auto cycles = static_cast<double>(time(Fidelity::cycle, dots));
  EXPECT_LT(cycles, 1.5 * static_cast<double>(time(Fidelity::cycle, none)));
  // What has gone from a small z-cache between look-up and change, lt does not see.
  EXPECT_NEAR(static_cast<double>(time(Fidelity::lt, dots)), cycles, 0.15 * cycles);
}

TEST(MultiPass, APlatformOnWhichCropTellsDrawNothingIsRefusedAtEveryFidelity) {
  Platform unlinked = platform_named("agx-orin-ideal-memory");
  unlinked.wire = [wire = unlinked.wire](Netlist& netlist) {
    wire(netlist);
    netlist.disconnect("gpc0.crop.out_done");
  };
  const Draw draw = dense_splats(10);
  for (const Fidelity fidelity : fidelities()) {
    RunRequest request = request_of("baseline", fidelity);
    request.platform = &unlinked;
    EXPECT_NO_THROW(run_passes(request, draw, 1)) << "there is no barrier";
    EXPECT_THROW(run_passes(request, draw, 2), UserError);
  }
}

// Conservation of bytes is checked in every run; here, who reads: CROP what its cache lacks, the rest is the shader's.
TEST(MultiPass, ReadingTheTargetIsTrafficOfColour) {
  for (const Fidelity fidelity : fidelities()) {
    SCOPED_TRACE(name_of(fidelity));
    RunRequest request = request_of("baseline", fidelity);
    request.platform = &platform_named("agx-orin");
    request.effects = EffectChoice::everything();
    const RunResult result = run_passes(request, dense_splats(11), 3);
    const std::uint64_t read = testing::statistic(result, "l2.color_bytes_read");
    const std::uint64_t by_crop = testing::statistic(result, "crop.cache.bytes_filled");
    // A sector for each quad of the target, twice where both triangles cover it, unless in one warp.
    const std::uint64_t quads = std::uint64_t{passes_width / 2} * (passes_height / 2);
    EXPECT_GE(read - by_crop, 2 * quads * 32);
    EXPECT_LE(read - by_crop, 2 * (quads + passes_width / 2 + passes_height / 2) * 32);
  }
}

}  // namespace
}  // namespace vrpipe
