// Where windows of a frame are, and what each stands for: all of the frame between the first and the last, once.
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "run/window_plan.h"

#include "fidelity/sampled_draws.h"
#include "support/mixed_frames.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

constexpr WindowPlan::Sizes few_sizes{1000, 500, 20, 1};

/// Splats of ten quads each.
std::vector<double> even_course(const Frame& frame) {
  std::vector<double> course;
  for (std::uint32_t splat = 0; splat <= frame.splats(); ++splat) course.push_back(10 * splat);
  return course;
}

void draw_splats(Frame& frame, std::uint32_t splats, float pruning_threshold) {
  frame.draw(geometry_of(64, 48, std::vector<Splat>(splats)), pruned_at(pruning_threshold));
}

/// How often quads of an even course are in strata, by splats.
std::vector<unsigned> times_in_strata(const Frame& frame, const WindowPlan& plan) {
  std::vector<unsigned> times(frame.splats());
  const double half = few_sizes.measured / 20;  // in splats
  const auto is_about_change = [&](double splat) {
    return std::any_of(plan.changes().begin(), plan.changes().end(),
                       [&](DrawIndex draw) { return std::fabs(splat - frame.draw_call(draw).base) < half; });
  };
  for (const WindowPlan::Window& window : plan.windows()) {
    for (std::uint32_t splat = 0; splat < frame.splats(); ++splat) {
      const double middle = splat + 0.37;  // where no stratum ends
      for (const DrawIndex draw : window.about_draws)
        times[splat] += std::fabs(middle - frame.draw_call(draw).base) < half ? 1 : 0;
      for (const auto& [from, to] : window.ranges)
        times[splat] += from < middle && middle < to && !is_about_change(middle) ? 1 : 0;
    }
  }
  return times;
}

void expect_all_once(const Frame& frame, const WindowPlan& plan) {
  const std::vector<unsigned> times = times_in_strata(frame, plan);
  for (std::uint32_t splat = 0; splat < frame.splats(); ++splat) {
    const bool is_between = splat + 0.37 > plan.middle().from && splat + 0.37 < plan.middle().to;
    ASSERT_EQ(times[splat], is_between ? 1 : 0) << splat;
  }
}

TEST(WindowPlan, ADrawIsPartedIntoEqualStrataWithAWindowEach) {
  Frame frame(64, 48);
  draw_splats(frame, 4000, 0.1F);
  const std::vector<double> course = even_course(frame);
  const WindowPlan plan(frame, course, few_sizes);
  ASSERT_EQ(plan.windows().size(), 22);
  expect_all_once(frame, plan);
  for (std::size_t i = 1; i <= 20; ++i) {
    const WindowPlan::Window& window = plan.windows()[i];
    const double from = (10 * window.splat + window.warm_up) / 10;  // measures
    ASSERT_EQ(window.ranges.size(), 1);
    EXPECT_EQ(window.group, 0);
    EXPECT_GE(from, window.ranges[0].from - 1e-6);
    EXPECT_LE(from + 50, window.ranges[0].to + 1e-6);
    EXPECT_NEAR(window.ranges[0].to - window.ranges[0].from, (40000 - 6000 - 500) / 200.0, 1e-6);
    EXPECT_EQ(window.splat % splats_per_vertex_warp, 0);
    EXPECT_GE(window.warm_up, std::min(few_sizes.warm_up, 10 * from)) << "or from the beginning on";
    EXPECT_LT(window.warm_up, few_sizes.warm_up + 10 * splats_per_vertex_warp);
  }
}

TEST(WindowPlan, StatesAndChangesBetweenThemHaveStrataOfTheirOwn) {
  Frame frame(64, 48);
  for (unsigned i = 0; i < 6; ++i) {
    draw_splats(frame, 500, 0.1F);
    draw_splats(frame, 203, 0.2F);
  }
  const std::vector<double> course = even_course(frame);
  const WindowPlan plan(frame, course, few_sizes);
  expect_all_once(frame, plan);
  EXPECT_EQ(plan.changes().size(), 10) << "the last is in the last window";
  for (const WindowPlan::Window& window : plan.windows()) {
    const double from = (10 * window.splat + window.warm_up) / 10;
    if (window.around) {
      EXPECT_EQ(from + 25, frame.draw_call(*window.around).base);
      EXPECT_NE(std::find(window.about_draws.begin(), window.about_draws.end(), *window.around),
                window.about_draws.end());
      for (const DrawIndex draw : window.about_draws) EXPECT_EQ(draw % 2, *window.around % 2) << "changes alike";
    }
    for (const auto& [first, last] : window.ranges) {
      const auto draw_at = [&](double splat) {
        std::size_t draw = 0;
        while (frame.draws()[draw].base + frame.draws()[draw].splats <= splat) ++draw;
        return draw;
      };
      EXPECT_EQ(draw_at(first), draw_at(std::nextafter(last, first))) << "of one state";
      EXPECT_EQ(draw_at(first) % 2, draw_at(from) % 2) << "that of what is measured";
    }
  }
}

TEST(WindowPlan, WhereChangesAreNearOneAnotherTheyAreOneStratumAmongOthers) {
  Frame frame(64, 48);
  draw_splats(frame, 1000, 0.1F);
  for (unsigned i = 0; i < 40; ++i) draw_splats(frame, 11, i % 2 == 0 ? 0.2F : 0.1F);
  draw_splats(frame, 2000, 0.2F);
  const std::vector<double> course = even_course(frame);
  const WindowPlan plan(frame, course, few_sizes);
  expect_all_once(frame, plan);
  EXPECT_TRUE(plan.changes().empty());
}

TEST(WindowPlan, DrawsOfOneStateAreNoChangeAndClearsAre) {
  Frame frame(64, 48);
  draw_splats(frame, 2000, 0.1F);
  draw_splats(frame, 1000, 0.1F);
  frame.clear({true, false});
  draw_splats(frame, 2000, 0.1F);
  const std::vector<double> course = even_course(frame);
  const WindowPlan plan(frame, course, few_sizes);
  expect_all_once(frame, plan);
  EXPECT_EQ(plan.changes(), std::vector<DrawIndex>{2});
}

TEST(WindowPlan, AFrameOfThousandsOfStatesIsPartedAsOthers) {
  Frame frame(64, 48);
  for (unsigned i = 0; i < 60; ++i) draw_splats(frame, 97, 0.01F * static_cast<float>(1 + i));
  const std::vector<double> course = even_course(frame);
  const WindowPlan plan(frame, course, few_sizes);
  expect_all_once(frame, plan);
  EXPECT_LT(plan.windows().size(), 70);
}

TEST(EstimatedCourse, IsNearWhatIsRasterized) {
  RunRequest request = request_of("baseline", Fidelity::functional);
  const auto compare = [&](const Frame& frame, double tolerance) {
    const RunResult result = run(request, frame);
    EXPECT_NEAR(100 * estimated_course(frame).back() / static_cast<double>(result.counts.quads_rasterized), 100,
                tolerance);
  };
  const DrawState state = draw_state_of(request);
  compare(*Frame::of(changing_draw(3000, 1), state), 10);
  for (const CullMode cull : {CullMode::none, CullMode::back, CullMode::front}) {
    Frame frame(mixed_frame_width, mixed_frame_height);
    DrawState mesh;
    mesh.shader = FragmentShader::vertex;
    mesh.cull = cull;
    frame.draw(random_mesh(400, 3), mesh);
    compare(frame, 10);
  }
}

}  // namespace
}  // namespace vrpipe
