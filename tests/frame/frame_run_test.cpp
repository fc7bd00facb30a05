// Frames of several draws, through the whole pipeline.
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

#include "support/builders.h"
#include "support/pixel_oracle.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::request_of;
using testing::run;
using testing::same_image;
using testing::strictly;

/// Behind a wall that closes the left half: so draws have what terminates, and what does not.
std::shared_ptr<const Draw> half_closed(std::uint32_t splats, std::uint64_t seed) {
  auto draw = std::make_shared<Draw>(testing::random_draw(96, 80, splats, seed));
  for (unsigned i = 0; i < 6; ++i) draw->splats[5 * i] = testing::flat_box(0, 0, 48, 80, 0.8F);
  return draw;
}

/// In parts of random sizes, some of which are empty.
Frame split(const std::shared_ptr<const Draw>& draw, unsigned parts, std::uint64_t seed, const DrawState& state) {
  const auto splats = static_cast<std::uint32_t>(draw->splats.size());
  std::vector<std::uint32_t> cuts{0, splats};
  for (unsigned i = 1; i < parts; ++i) cuts.push_back(static_cast<std::uint32_t>(mix(seed + i) % splats));
  std::sort(cuts.begin(), cuts.end());
  Frame frame(draw->width, draw->height);
  for (unsigned i = 0; i < parts; ++i) {
    frame.draw(draw, state, "part " + std::to_string(i), cuts[i], cuts[i + 1] - cuts[i]);
  }
  return frame;
}

std::map<std::string, std::uint64_t> sums(const std::vector<DrawReport>& draws) {
  std::map<std::string, std::uint64_t> sum;
  for (const DrawReport& draw : draws) {
    for (const auto& [name, count] : draw.counts) sum[name] += count;
  }
  return sum;
}

std::map<std::string, std::uint64_t> counts_of(const DrawReport& draw) {
  return {draw.counts.begin(), draw.counts.end()};
}

/// That a draw counts what a run of it alone does.
void expect_counts(const DrawReport& draw, const Counts& alone) {
  const auto counts = counts_of(draw);
  for (const auto& [name, count] : alone.named()) {
    if (counts.count(name) != 0) {
      EXPECT_EQ(counts.at(name), count) << name << " of " << draw.name;
    }
  }
}

class EveryFidelity : public ::testing::TestWithParam<std::tuple<Fidelity, std::string>> {
 protected:
  RunRequest request(const std::string& platform = "agx-orin-ideal-memory") const {
    RunRequest request = request_of(std::get<1>(GetParam()), std::get<0>(GetParam()), strictly);
    request.platform = &platform_named(platform);
    return request;
  }
};

INSTANTIATE_TEST_SUITE_P(Frame, EveryFidelity,
                         ::testing::Combine(::testing::ValuesIn(fidelities()),
                                            ::testing::Values("baseline", "qm", "het", "het+qm")),
                         [](const auto& each) {
                           std::string name = name_of(std::get<0>(each.param)) + ("_" + std::get<1>(each.param));
                           return name.replace(std::min(name.find('+'), name.size() - 1), 1,
                                               name.find('+') < name.size() ? "_" : name.substr(name.size() - 1));
                         });

TEST_P(EveryFidelity, DrawsOfOneStateComeToTheirSingleDrawBitForBit) {
  for (const char* platform : {"agx-orin-ideal-memory", "desktop"}) {
    const auto draw = half_closed(400, 7);
    const RunRequest whole = request(platform);
    const DrawState state = draw_state_of(whole);
    const RunResult single = testing::run(whole, *draw);
    for (const unsigned parts : {2U, 3U, 100U}) {
      RunRequest split_request = whole;
      split_request.stall_seed = parts;
      split_request.stall_per_256 = parts == 3 ? 0 : 64;
      const RunResult frame = run(split_request, split(draw, parts, parts, state));
      EXPECT_TRUE(same_image(frame.framebuffer.color, single.framebuffer.color)) << platform << " in " << parts;
      EXPECT_EQ(frame.counts.named(), single.counts.named()) << platform << " in " << parts;
    }
  }
}

TEST_P(EveryFidelity, TheCountsOfDrawsSumToTheFrames) {
  const auto draw = half_closed(300, 11);
  Frame frame(draw->width, draw->height);
  DrawState state = draw_state_of(request());
  frame.draw(draw, state, "first", 0, 100);
  frame.draw(draw, state, "second", 100, 120);
  state.pruning_threshold = 0.1F;
  frame.draw(draw, state, "third", 220);
  const RunResult result = run(request(), frame);
  ASSERT_EQ(result.draws.size(), 3U);
  EXPECT_EQ(result.draws[1].name, "second");
  const auto sum = sums(result.draws);
  EXPECT_EQ(sum.size() + 3, result.counts.named().size()) << "all but warps and flushes";
  for (const auto& [name, count] : result.counts.named()) {
    if (sum.count(name) != 0) {
      EXPECT_EQ(sum.at(name), count) << name;
    }
  }
  for (const DrawReport& each : result.draws) EXPECT_GT(counts_of(each).at("quads_blended"), 0U) << each.name;
}

TEST_P(EveryFidelity, TheCyclesOfDrawsSumToTheFrames) {
  const auto draw = half_closed(300, 11);
  const DrawState state = draw_state_of(request());
  for (const char* platform : {"agx-orin-ideal-memory", "desktop"}) {
    Frame frame(draw->width, draw->height);
    frame.draw(draw, state, "first", 0, 150);
    frame.draw(draw, state, "nothing", 150, 0);
    frame.clear({true, true});
    frame.draw(draw, state, "second", 150);
    const RunResult result = run(request(platform), frame);
    ASSERT_EQ(result.draws.size(), 3U);
    EXPECT_FALSE(result.draws[1].end) << "it has no quads";
    if (!result.draws[0].cycles) {
      EXPECT_LT(request().fidelity, Fidelity::lt);
      for (const DrawReport& each : result.draws) EXPECT_FALSE(each.cycles || each.end) << each.name;
      continue;
    }
    Frame alone(draw->width, draw->height);
    alone.draw(draw, state, "first", 0, 150);
    const auto cycles_alone = static_cast<double>(*run(request(platform), alone).cycles);
    EXPECT_NEAR(static_cast<double>(*result.draws[0].cycles), cycles_alone, 0.1 * cycles_alone);
    EXPECT_EQ(result.draws[0].end, result.draws[0].cycles);
    EXPECT_EQ(result.draws[1].cycles, 0U);
    EXPECT_EQ(result.draws[2].end, result.cycles) << "it waits for the clear, which waits for the first";
    EXPECT_EQ(*result.draws[0].cycles + *result.draws[2].cycles, *result.cycles);
  }
}

TEST_P(EveryFidelity, DrawsWithAllClearedBetweenThemAreTwoRuns) {
  const auto before = half_closed(200, 3);
  const auto after = half_closed(250, 4);
  const DrawState state = draw_state_of(request());
  Frame frame(before->width, before->height);
  frame.draw(before, state, "before");
  frame.clear({true, true});
  frame.draw(after, state, "after");
  for (const char* platform : {"agx-orin-ideal-memory", "desktop"}) {
    for (const unsigned stalls : {0U, 64U}) {
      RunRequest both = request(platform);
      both.stall_seed = 5;
      both.stall_per_256 = stalls;
      const RunResult result = run(both, frame);
      const RunResult first = testing::run(request(platform), *before);
      const RunResult second = testing::run(request(platform), *after);
      EXPECT_TRUE(same_image(result.framebuffer.color, second.framebuffer.color)) << platform;
      expect_counts(result.draws[0], first.counts);
      expect_counts(result.draws[1], second.counts);
    }
  }
}

void expect_in_order(const RunRequest& request, const Frame& frame) {
  const RunResult result = run(request, frame);
  const auto expected = testing::pixels_in_order(frame, request.variant.early_termination);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto got = result.framebuffer.color.pixel(static_cast<std::uint32_t>(i % frame.width()),
                                                    static_cast<std::uint32_t>(i / frame.width()));
    if (std::memcmp(got.data(), expected[i].data(), sizeof got) != 0) ++wrong;
  }
  EXPECT_EQ(wrong, 0U) << "pixels differ";
}

class EveryFidelityUnmerged : public EveryFidelity {
 protected:
  RunRequest exact() const {
    RunRequest exact = request();
    exact.format = ColorFormat::rgba32f;
    return exact;
  }
};
INSTANTIATE_TEST_SUITE_P(Frame, EveryFidelityUnmerged,
                         ::testing::Combine(::testing::ValuesIn(fidelities()), ::testing::Values("baseline", "het")),
                         [](const auto& each) {
                           return name_of(std::get<0>(each.param)) + ("_" + std::get<1>(each.param));
                         });

TEST_P(EveryFidelity, FilledRectanglesAreTheAxisAlignedBoxesInFewerQuads) {
  for (const char* platform : {"agx-orin-ideal-memory", "desktop"}) {
    const auto draw = half_closed(200, 31);
    DrawState state = draw_state_of(request(platform));
    state.splat_extent = SplatExtent::axis_aligned_box;
    Frame boxes(draw->width, draw->height);
    boxes.draw(draw, state);
    state.splat_extent = SplatExtent::fill_rectangle;
    Frame rectangles(draw->width, draw->height);
    rectangles.draw(draw, state);
    const RunResult two = run(request(platform), boxes);
    const RunResult one = run(request(platform), rectangles);
    EXPECT_EQ(one.counts.fragments_rasterized, two.counts.fragments_rasterized) << platform;
    EXPECT_LT(one.counts.quads_rasterized, two.counts.quads_rasterized) << platform;
    EXPECT_LT(2 * one.counts.primitives, two.counts.primitives + 200) << platform;
    // Merging pairs other quads, and rounds otherwise.
    if (!request().variant.quad_merging) {
      EXPECT_TRUE(same_image(one.framebuffer.color, two.framebuffer.color)) << platform;
    }
  }
}

TEST_P(EveryFidelityUnmerged, ADrawIsOfItsOwnState) {
  const auto draw = half_closed(240, 21);
  Frame frame(draw->width, draw->height);
  DrawState state = draw_state_of(exact());
  frame.draw(draw, state, "as usual", 0, 60);
  state.pruning_threshold = 0.2F;
  frame.draw(draw, state, "pruned", 60, 60);
  state.pruning_threshold = 0.0F;
  state.early_termination = false;
  state.splat_extent = SplatExtent::axis_aligned_box;
  frame.draw(draw, state, "not terminated", 120, 60);
  state.early_termination = true;
  state.termination_threshold = 0.5F;
  frame.draw(draw, state, "terminated at one half", 180);
  expect_in_order(exact(), frame);
}

TEST_P(EveryFidelity, WithoutBlendingTheLastFragmentStays) {
  for (const char* platform : {"agx-orin-ideal-memory", "desktop", "agx-orin-lpddr5"}) {
    RunRequest exact = request(platform);
    exact.format = ColorFormat::rgba32f;
    const auto draw = half_closed(240, 23);
    Frame frame(draw->width, draw->height);
    DrawState state = draw_state_of(exact);
    // Merging rounds otherwise, so nothing that is merged is to be seen.
    state.blend = !exact.variant.quad_merging;
    state.early_termination = false;
    frame.draw(draw, state, "below", 0, 80);
    state.blend = false;
    frame.draw(draw, state, "in place of it", 80, 80);
    state.pruning_threshold = 0;
    frame.draw(draw, state, "and of its own state", 160);
    exact.stall_seed = 3;
    exact.stall_per_256 = 32;
    expect_in_order(exact, frame);
  }
}

TEST_P(EveryFidelity, WithoutBlendingColorIsWrittenAndNotRead) {
  // Three layers, partly covered quads among them, far beyond the cache.
  auto draw = std::make_shared<Draw>(testing::draw_of(128, 128));
  for (unsigned layer = 0; layer < 3; ++layer) {
    draw->splats.push_back(testing::flat_box(0.6F, 0.6F, 126.7F, 126.7F, 0.5F, 0.1F * static_cast<float>(layer), 1, 1));
  }
  Frame frame(128, 128);
  DrawState state = draw_state_of(request());
  state.early_termination = false;
  state.splat_extent = SplatExtent::fill_rectangle;
  state.blend = false;
  frame.draw(draw, state);
  const RunResult result = run(request(), frame);
  EXPECT_EQ(result.counts.quads_blended, 3U * 64 * 64);
  EXPECT_EQ(result.counts.quads_merged, 0U);
  if (result.request.fidelity == Fidelity::functional || result.request.fidelity == Fidelity::bound) return;
  EXPECT_EQ(testing::statistic(result, "crop.cache.bytes_filled"), 0U);
  const std::uint64_t written = testing::statistic(result, "crop.cache.sectors_written_back");
  EXPECT_LE(written, 3U * 64 * 64);
  if (request().variant.quad_merging) return;  // TGC brings the layers of a grid together
  EXPECT_GE(written, 3U * 64 * 64 - 512) << "but for what is left in the cache";
  EXPECT_EQ(testing::statistic(result, "crop.cache.sector_misses"), 3U * 64 * 64);
}

TEST_P(EveryFidelityUnmerged, ClearedTerminationOpensPixelsWhoseColorStays) {
  const auto draw = half_closed(240, 22);
  Frame frame(draw->width, draw->height);
  const DrawState state = draw_state_of(exact());
  frame.draw(draw, state, "before", 0, 120);
  frame.clear({false, true});
  frame.draw(draw, state, "after", 120);
  expect_in_order(exact(), frame);
}

TEST_P(EveryFidelityUnmerged, ClearedColorKeepsPixelsClosed) {
  const auto draw = half_closed(240, 23);
  Frame frame(draw->width, draw->height);
  const DrawState state = draw_state_of(exact());
  frame.draw(draw, state, "before", 0, 120);
  frame.clear({true, false});
  frame.draw(draw, state, "after", 120);
  expect_in_order(exact(), frame);
}

class EveryFidelityWithTime : public ::testing::TestWithParam<Fidelity> {};
INSTANTIATE_TEST_SUITE_P(Frame, EveryFidelityWithTime, ::testing::Values(Fidelity::lt, Fidelity::cycle),
                         [](const auto& each) { return name_of(each.param); });

TEST_P(EveryFidelityWithTime, ALateSignalDoesNotTouchADrawAfterAClear) {
  // Signals of the wall take a thousand cycles; the veil behind the clear is far too thin to terminate anything.
  auto wall = std::make_shared<Draw>(testing::draw_of(64, 64));
  auto veil = std::make_shared<Draw>(testing::draw_of(64, 64));
  for (unsigned i = 0; i < 4; ++i) wall->splats.push_back(testing::flat_box(0, 0, 64, 64, 0.99F));
  for (unsigned i = 0; i < 20; ++i) veil->splats.push_back(testing::flat_box(0, 0, 64, 64, 0.01F));
  RunRequest request = request_of("het", GetParam());
  request.settings = {{"crop", "latency_cycles", "1000"}};
  const DrawState state = draw_state_of(request);
  Frame frame(64, 64);
  frame.draw(wall, state, "wall");
  frame.clear({true, true});
  frame.draw(veil, state, "veil");
  const RunResult result = run(request, frame);
  EXPECT_GT(counts_of(result.draws[0]).at("termination_updates"), 0U);
  EXPECT_EQ(counts_of(result.draws[1]).at("fragments_terminated"), 0U);
  EXPECT_GT(testing::statistic(result, "zrop.updates_void"), 0U) << "that came after the clear";
  EXPECT_TRUE(same_image(result.framebuffer.color, testing::run(request, *veil).framebuffer.color));
}

TEST_P(EveryFidelityWithTime, DrawsOverlap) {
  const auto draw = half_closed(400, 31);
  const RunRequest request = request_of("baseline", GetParam());
  DrawState state = draw_state_of(request);
  const auto cycles = [&](const Frame& frame) { return run(request, frame).cycles.value(); };
  Frame first(draw->width, draw->height);
  first.draw(draw, state, "first", 0, 200);
  Frame both = first;
  state.pruning_threshold = 0.01F;
  Frame second(draw->width, draw->height);
  second.draw(draw, state, "second", 200);
  both.draw(draw, state, "second", 200);
  EXPECT_LT(cycles(both), cycles(first) + cycles(second));
  EXPECT_GT(cycles(both), std::max(cycles(first), cycles(second)));
}

TEST_P(EveryFidelityWithTime, ClearsTakeNextToNoTime) {
  const auto draw = std::make_shared<const Draw>(testing::random_draw(320, 240, 600, 5));
  const RunRequest request = request_of("baseline", GetParam());
  const DrawState state = draw_state_of(request);
  Frame frame(320, 240);
  for (std::uint32_t part = 0; part < 60; ++part) {
    frame.draw(draw, state, "", 10 * part, 10);
    frame.clear({false, true});
  }
  const auto alone = static_cast<double>(testing::run(request, *draw).cycles.value());
  EXPECT_NEAR(static_cast<double>(run(request, frame).cycles.value()), alone, 0.01 * alone);
}

TEST_P(EveryFidelityWithTime, AFrameOfNothingButClearsEnds) {
  Frame frame(32, 32);
  frame.clear({true, true});
  frame.clear({true, false});
  const RunResult result = run(request_of("het+qm", GetParam()), frame);
  EXPECT_EQ(result.counts.quads_blended, 0U);
}

}  // namespace
}  // namespace vrpipe
