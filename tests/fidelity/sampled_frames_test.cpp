// Windows of frames of several draws and clears, of meshes and triangles: they go on with what the frame has come to.
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/multi_pass.h>

#include "fidelity/sampled_draws.h"
#include "support/mixed_frames.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

constexpr std::uint32_t sampled_width = 256, sampled_height = 192;

/// Farther and farther.
std::shared_ptr<const Draw> receding_draw(std::uint32_t splats, std::uint64_t seed) {
  auto draw = std::make_shared<Draw>(changing_draw(splats, seed));
  for (std::uint32_t i = 0; i < splats; ++i) draw->splats[i].depth = static_cast<float>(i) / static_cast<float>(splats);
  return draw;
}

/// A wall at a depth, from the left edge to `right`, of columns 16 pixels wide.
std::shared_ptr<const Draw> wall(float right, float depth) {
  auto draw = std::make_shared<Draw>(draw_of(sampled_width, sampled_height));
  for (float x = 0; x < right; x += 16) {
    const auto corner = [&](float dx, float y) {
      MeshVertex vertex{};
      vertex.x = x + dx;
      vertex.y = y;
      vertex.depth = depth;
      vertex.inverse_w = 1;
      vertex.green = 0.5F;
      return vertex;
    };
    const float height = sampled_height;
    draw->mesh.push_back({{corner(0, 0), corner(16, 0), corner(0, height)}});
    draw->mesh.push_back({{corner(16, 0), corner(16, height), corner(0, height)}});
  }
  return draw;
}

DrawState of_wall() {
  DrawState state;
  state.shader = FragmentShader::vertex;
  state.depth = {true, Compare::less, true};
  state.cull = CullMode::none;
  return state;
}

/// Splats of which three quarters are behind a wall over two thirds of the frame.
Frame walled(const DrawState& state) {
  Frame frame(sampled_width, sampled_height);
  frame.draw(wall(176, 0.25F), of_wall());
  frame.draw(receding_draw(40000, 2), tested_splats(state));
  return frame;
}

/// Draws of several states, and all of them again with the termination bits and the depth cleared.
Frame cleared(const DrawState& state) {
  Frame frame(sampled_width, sampled_height);
  Clear clear;
  clear.color = clear.termination = clear.depth = true;
  DrawState pruned = state;
  pruned.pruning_threshold = 0.02F;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    if (seed > 1) frame.clear(clear);
    frame.draw(receding_draw(9000, seed), tested_splats(state));
    frame.draw(receding_draw(9000, seed + 3), pruned);
  }
  return frame;
}

Frame terminating(const DrawState& state) {
  Frame frame(sampled_width, sampled_height);
  Clear clear;
  clear.color = clear.termination = true;
  for (const std::uint64_t seed : {2U, 4U}) {
    frame.draw(receding_draw(30000, seed), state);
    frame.clear(clear);
  }
  return frame;
}

Frame in_passes(const DrawState& state) {
  Frame frame(sampled_width, sampled_height);
  draw_in_passes(frame, receding_draw(30000, 4), state, 6);
  return frame;
}

Frame with_preset_stencil(const DrawState& state) {
  Frame frame(sampled_width, sampled_height);
  std::vector<std::uint8_t> values(sampled_width * sampled_height);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = i % sampled_width < 80 ? 1 : 0;
  frame.preset_stencil(std::move(values));
  DrawState tested = state;
  tested.stencil.test = true;
  tested.stencil.front.compare = tested.stencil.back.compare = Compare::equal;
  frame.draw(receding_draw(26000, 2), tested);
  return frame;
}

/// Triangles in place of the boxes of splats, half of each.
Frame of_triangles(const DrawState& state) {
  auto draw = std::make_shared<Draw>(changing_draw(34000, 1));
  for (const Splat& splat : draw->splats) {
    draw->triangles.push_back({{splat.cx - splat.ax - splat.bx, splat.cx + splat.ax - splat.bx, splat.cx + splat.bx},
                               {splat.cy - splat.ay - splat.by, splat.cy + splat.ay - splat.by, splat.cy + splat.by}});
  }
  Frame frame(sampled_width, sampled_height);
  frame.draw(std::move(draw), state);
  return frame;
}

/// Long enough for four.
Frame of_several_gpcs(const DrawState& state) {
  Frame frame(sampled_width, sampled_height);
  frame.draw(receding_draw(90000, 2), state);
  return frame;
}

TEST(SampledFrames, TheirIntervalsHold) {
  struct Case {
    const char* name;
    Frame (*frame)(const DrawState&);
    const char* platform;
    const char* variant;
    Termination termination = Termination::paper;
  };
  const std::vector<Case> cases{
      {"a wall and splats behind it", walled, "agx-orin", "baseline"},
      {"the same, strict", walled, "mobile", "qm", Termination::strict},
      {"draws between clears", cleared, "agx-orin-ideal-memory", "baseline"},
      {"draws that terminate early, with their bits cleared between them", terminating, "agx-orin-ideal-memory", "het"},
      {"passes", in_passes, "agx-orin", "baseline"},
      {"a stencil that is preset", with_preset_stencil, "mobile", "baseline"},
      {"triangles", of_triangles, "agx-orin", "baseline"},
      {"several GPCs", of_several_gpcs, "desktop", "qm"},
  };
  unsigned inside = 0, runs = 0;
  std::string outside;
  for (const Case& c : cases) {
    RunRequest request = request_of(c.variant);
    request.platform = &platform_named(c.platform);
    request.termination = c.termination;
    const Frame frame = c.frame(draw_state_of(request));
    const auto cycles = static_cast<double>(*run(request, frame).cycles);
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const RunResult result = run(sampled(request, seed), frame);
      const double half = result.sampling->half_interval_percent;
      EXPECT_GE(result.sampling->windows, 18) << c.name << ": " << result.sampling->whole_because;
      EXPECT_LE(half, 9) << c.name;
      const double off = 100 * (static_cast<double>(*result.cycles) / cycles - 1);
      EXPECT_LE(std::fabs(off), 1.5 * half) << c.name << ", seed " << seed;
      ++runs;
      inside += std::fabs(off) <= half ? 1 : 0;
      if (std::fabs(off) > half) outside += fmt::format(" {}, seed {}: {:+.2f} of {:.2f} %", c.name, seed, off, half);
    }
  }
  EXPECT_GE(100 * inside, 95 * runs) << inside << " of " << runs << outside;
}

TEST(SampledFrames, DrawAndCountAsFunctional) {
  const RunRequest request = request_of("baseline");
  RunRequest functional = request;
  functional.fidelity = Fidelity::functional;
  const Frame frame = walled(draw_state_of(request));
  const RunResult drawn = run(functional, frame);
  const RunResult result = run(sampled(request), frame);
  ASSERT_GE(result.sampling->windows, 18);
  EXPECT_EQ(result.counts.named(), drawn.counts.named());
  EXPECT_TRUE(same_image(result.framebuffer.color, drawn.framebuffer.color));
}

TEST(SampledFrames, WhereLittleIsSeenWindowsAreSetByWhatWasDrawn) {
  const RunRequest request = request_of("baseline");
  Frame frame(sampled_width, sampled_height);
  frame.draw(receding_draw(30000, 2), draw_state_of(request));
  frame.draw(wall(sampled_width, 0), of_wall());
  frame.draw(receding_draw(60000, 4), tested_splats(draw_state_of(request)));  // of which nothing is
  const auto cycles = static_cast<double>(*run(request, frame).cycles);
  const RunResult result = run(sampled(request), frame);
  ASSERT_GE(result.sampling->windows, 18) << result.sampling->whole_because;
  EXPECT_NEAR(100 * static_cast<double>(*result.cycles) / cycles, 100, result.sampling->half_interval_percent);
}

}  // namespace
}  // namespace vrpipe
