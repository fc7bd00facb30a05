// Frames of meshes and splats through the whole pipeline, against a renderer that knows samples and order alone.
#include <cmath>
#include <memory>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

#include "support/builders.h"
#include "support/mixed_reference.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::MixedReference;
using testing::request_of;
using testing::uniform;

constexpr std::uint32_t width = 80;
constexpr std::uint32_t height = 56;

MeshVertex random_vertex(std::uint64_t seed, std::uint64_t k) {
  return {uniform(seed, k, -20, width + 20.0F), uniform(seed, k + 1, -20, height + 20.0F),
          uniform(seed, k + 2, 0, 1),           uniform(seed, k + 3, 0.1F, 2),
          uniform(seed, k + 4, 0, 1),           uniform(seed, k + 5, 0, 1),
          uniform(seed, k + 6, 0, 1),           uniform(seed, k + 7, -1, 1),
          uniform(seed, k + 8, -1, 1),          uniform(seed, k + 9, -1, 1)};
}

/// Triangles that face either way and cut one another.
std::shared_ptr<Draw> random_mesh(std::uint32_t triangles, std::uint64_t seed) {
  auto draw = std::make_shared<Draw>(testing::draw_of(width, height));
  for (std::uint32_t i = 0; i < triangles; ++i) {
    MeshTriangle& triangle = draw->mesh.emplace_back();
    for (unsigned vertex = 0; vertex < 3; ++vertex)
      triangle.vertices[vertex] = random_vertex(seed, 100 * i + 20 * vertex);
  }
  return draw;
}

/// Front to back.
std::shared_ptr<Draw> random_splats(std::uint32_t splats, std::uint64_t seed) {
  auto draw = std::make_shared<Draw>(testing::random_draw(width, height, splats, seed));
  for (std::uint32_t i = 0; i < splats; ++i)
    draw->splats[i].depth = (static_cast<float>(i) + 0.5F) / static_cast<float>(splats);
  return draw;
}

DrawState depth_alone(CullMode cull) {
  DrawState state;
  state.shader = FragmentShader::none;
  state.depth = {true, Compare::less, true};
  state.cull = cull;
  return state;
}
DrawState tested_splats(const DrawState& of_request) {
  DrawState state = of_request;
  state.depth = {true, Compare::less, false};
  return state;
}
DrawState color_of_mesh(CullMode cull, bool lit) {
  DrawState state;
  state.shader = lit ? FragmentShader::lit : FragmentShader::vertex;
  state.light = {0.6F, 0, 0.8F, 0.25F};
  state.depth = {true, Compare::equal, false};
  state.cull = cull;
  return state;
}

/// Depth of the mesh, splats in front of it, its colour under what they leave.
Frame mixed_frame(std::uint64_t seed, const RunRequest& request) {
  Frame frame(width, height);
  frame.set_depth_format(static_cast<DepthFormat>(seed % 3));
  const CullMode cull = static_cast<CullMode>(seed / 3 % 3);
  const auto mesh = random_mesh(12, seed);
  frame.draw(mesh, depth_alone(cull), "depth");
  frame.draw(random_splats(60, seed + 1000), tested_splats(draw_state_of(request)), "splats");
  frame.draw(mesh, color_of_mesh(cull, seed % 2 == 0), "mesh");
  return frame;
}

/// Stencil and depth of any kind, in several draws and clears.
Frame random_frame(std::uint64_t seed, const RunRequest& request) {
  Frame frame(width, height);
  frame.set_depth_format(static_cast<DepthFormat>(mix(seed) % 3));
  auto pick = [&, k = std::uint64_t{0}](unsigned choices) mutable {
    return static_cast<unsigned>(mix(seed ^ mix(++k)) % choices);
  };
  const unsigned draws = 3 + pick(5);
  for (unsigned i = 0; i < draws; ++i) {
    if (pick(5) == 0) {
      Clear clear;
      clear.color = pick(4) == 0;
      clear.depth = pick(2) == 0;
      clear.stencil = pick(2) == 0;
      clear.depth_value = 0.25F * static_cast<float>(pick(5));
      clear.stencil_value = static_cast<std::uint8_t>(pick(128));
      frame.clear(clear);
    }
    const bool is_mesh = pick(2) == 0;
    DrawState state = draw_state_of(request);
    state.early_termination = state.early_termination && pick(2) == 0;
    state.depth = {pick(4) != 0, static_cast<Compare>(pick(compares)), pick(2) == 0};
    state.stencil.test = pick(2) == 0;
    for (StencilFace* face : {&state.stencil.front, &state.stencil.back}) {
      face->compare = static_cast<Compare>(pick(compares));
      face->stencil_fail = static_cast<StencilOperation>(pick(stencil_operations));
      face->depth_fail = static_cast<StencilOperation>(pick(stencil_operations));
      face->pass = static_cast<StencilOperation>(pick(stencil_operations));
      face->reference = static_cast<std::uint8_t>(pick(128));
      face->read_mask = static_cast<std::uint8_t>(pick(256));
      face->write_mask = static_cast<std::uint8_t>(pick(256));
    }
    if (is_mesh) {
      state.shader = std::array{FragmentShader::vertex, FragmentShader::lit, FragmentShader::none}[pick(3)];
      state.light = {0, 1, 0, 0.5F};
      state.cull = static_cast<CullMode>(pick(3));
    } else if (pick(4) == 0) {
      state.shader = FragmentShader::none;
    }
    frame.draw(is_mesh ? random_mesh(1 + pick(10), seed + i) : random_splats(1 + pick(40), seed + i), state,
               "draw " + std::to_string(i));
  }
  return frame;
}

RenderContext context_of(const Frame& frame) { return testing::context_of(frame); }

std::uint64_t count(const DrawReport& draw, const std::string& name) {
  for (const auto& [each, value] : draw.counts) {
    if (each == name) return value;
  }
  ADD_FAILURE() << "no count " << name;
  return 0;
}

/// `slack`: of what termination leaves out.
void expect_image(const RunResult& result, const MixedReference& reference, double slack) {
  unsigned wrong = 0;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const std::size_t index = std::size_t{y} * width + x;
      const auto pixel = result.framebuffer.color.pixel(x, y);
      for (unsigned channel = 0; channel < 4; ++channel) {
        const double bound = reference.bound[index][channel == 3 ? 1 : 0] + slack + 2e-5;
        const double off = std::fabs(static_cast<double>(pixel[channel]) - reference.rgba[index][channel]);
        if (off > bound && ++wrong < 4) {
          ADD_FAILURE() << "pixel " << x << "," << y << " channel " << channel << ": " << pixel[channel] << " for "
                        << reference.rgba[index][channel] << ", " << bound << " is allowed";
        }
      }
    }
  }
}

void expect_depth_stencil(const RunResult& result, const MixedReference& reference) {
  const DepthStencilSurface& surface = result.framebuffer.depth_stencil;
  unsigned wrong = 0;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const TileId tile{static_cast<std::uint16_t>(x / 16), static_cast<std::uint16_t>(y / 16)};
      const DepthStencilQuad& quad = surface.quad(surface.grid().place(tile, (y % 16) / 2 * 8 + (x % 16) / 2));
      const unsigned lane = y % 2 * 2 + x % 2;
      const std::size_t index = std::size_t{y} * width + x;
      wrong += quad.depth[lane] != reference.depth[index] || quad.stencil[lane] != reference.stencil[index];
    }
  }
  EXPECT_EQ(wrong, 0U);
}

void expect_counts(const RunResult& result, const MixedReference& reference) {
  for (std::size_t draw = 0; draw < reference.of_draw.size(); ++draw) {
    const testing::MixedCounts& expected = reference.of_draw[draw];
    const DrawReport& report = result.draws[draw];
    EXPECT_EQ(count(report, "fragments_rasterized"), expected.rasterized) << report.name;
    EXPECT_EQ(count(report, "fragments_depth_stencil_failed"), expected.failed) << report.name;
    EXPECT_EQ(count(report, "fragments_unshaded"), expected.unshaded) << report.name;
    EXPECT_EQ(count(report, "fragments_pruned"), expected.pruned) << report.name;
    EXPECT_EQ(count(report, "fragments_blended") + count(report, "fragments_merged"), expected.blended) << report.name;
  }
}

class MixedFrame : public ::testing::TestWithParam<std::tuple<Fidelity, std::string>> {
 protected:
  RunRequest request() const {
    RunRequest request = request_of(std::get<1>(GetParam()), std::get<0>(GetParam()), testing::strictly);
    // The fragment shader's, so that no fragment's fate depends on it.
    request.settings = {{"state", "exponential", "exact"}};
    return request;
  }
  static RunResult run(const RunRequest& request, const Frame& frame) {
    fresh_simulation();
    return simulate(request, frame);
  }
};

INSTANTIATE_TEST_SUITE_P(Frame, MixedFrame,
                         ::testing::Combine(::testing::ValuesIn(fidelities()),
                                            ::testing::Values("baseline", "qm", "het", "het+qm")),
                         [](const auto& each) {
                           const std::string& variant = std::get<1>(each.param);
                           return name_of(std::get<0>(each.param)) +
                                  ("_" + (variant == "het+qm" ? std::string("both") : variant));
                         });

TEST_P(MixedFrame, IsThatOfTheReference) {
  unsigned frames = 0;
  for (std::uint64_t seed = 1; frames < 9; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Frame frame = mixed_frame(seed, request());
    const MixedReference reference = testing::render_mixed(context_of(frame));
    // Rounding would decide.
    if (reference.near_prune_edge > 0) continue;
    ++frames;
    EXPECT_GT(reference.of_draw[0].failed, 0U);
    EXPECT_GT(reference.of_draw[1].failed, 0U);
    EXPECT_GT(reference.of_draw[2].failed, 0U);
    EXPECT_GT(reference.of_draw[2].blended, 0U);
    const RunResult result = run(request(), frame);
    expect_depth_stencil(result, reference);
    const bool terminates = request().variant.early_termination;
    expect_image(result, reference, terminates ? 1 - 0.996 : 0);
    if (!terminates) expect_counts(result, reference);
  }
}

TEST_P(MixedFrame, OfRandomDepthAndStencilIsThatOfTheReference) {
  unsigned frames = 0;
  for (std::uint64_t seed = 100; frames < 12; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RunRequest wanted = request();
    wanted.variant.early_termination = false;
    const Frame frame = random_frame(seed, wanted);
    const MixedReference reference = testing::render_mixed(context_of(frame));
    if (reference.near_prune_edge > 0) continue;
    ++frames;
    const RunResult result = run(wanted, frame);
    expect_depth_stencil(result, reference);
    expect_image(result, reference, 0);
    expect_counts(result, reference);
  }
}

TEST_P(MixedFrame, IsTheSameOnSeveralGpcsAndUnderStalls) {
  for (std::uint64_t seed = 100; seed < 104; ++seed) {
    const Frame frame = random_frame(seed, request());
    const RunResult calm = run(request(), frame);
    for (const char* platform : {"agx-orin", "desktop"}) {
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
  through_memory.platform = &platform_named("agx-orin-lpddr3");
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
      EXPECT_GT(testing::statistic(cached, "zrop.cache.bytes_filled"), 0U);
      if (lines < 128) {
        EXPECT_GT(testing::statistic(cached, "zrop.cache.bytes_written_back"), 0U);
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
