// What frame facts bound holds for any geometry, by brute force over what is set up and every sample.
#include <vrpipe/pipeline/frame_facts.h>

#include <cstdlib>
#include <set>

#include <vrpipe/pipeline/geometry.h>

#include "scenes.h"
#include "support/coverage.h"
#include "support/mixed_frames.h"

namespace vrpipe {
namespace {

using testing::coordinate;
using testing::covers;
using testing::draw_of;
using testing::mixed_frame;
using testing::random_frame;
using testing::round_splat;
using testing::splat_in;
using testing::whole;

/// In pixels: of what is set up, |x| + |y| from corner to corner.
double widest_edge(const SnappedTriangle& t, unsigned subpixel_bits) {
  double widest = 0;
  for (unsigned i = 0; i < 3; ++i) {
    const unsigned j = (i + 1) % 3;
    const std::int64_t across = std::int64_t{t.x[j]} - t.x[i];
    const std::int64_t down = std::int64_t{t.y[j]} - t.y[i];
    widest = std::max(widest, std::ldexp(static_cast<double>(std::abs(across) + std::abs(down)),
                                         -static_cast<int>(subpixel_bits)));
  }
  return widest;
}

void check(const RenderContext& context) {
  const FrameFacts facts(context);
  const Frame& frame = *context.frame;
  const unsigned bits = context.precision.subpixel_bits;
  std::set<std::pair<std::uint32_t, std::uint32_t>> covered;
  std::uint64_t primitives = 0;
  for (const Frame::Command& command : frame.commands()) {
    if (!command.is_draw) continue;
    const DrawCall& call = frame.draw_call(command.draw);
    for (std::uint32_t number = call.base; number < call.base + call.splats; ++number) {
      ++primitives;
      for (unsigned triangle = 0; triangle < primitives_per_splat(call); ++triangle) {
        PixelRect bounds;
        SnappedTriangle snapped;
        if (!is_finite(call, number)) continue;
        if (cull_triangle(context, command.draw, number, triangle, bounds) == Culling::not_finite) continue;
        RC_ASSERT(snap_triangle(context, command.draw, number, triangle, snapped));
        RC_ASSERT(widest_edge(snapped, bits) <= facts.widest_edge);
        for (std::int32_t y = bounds.y0; y < bounds.y1; ++y) {
          for (std::int32_t x = bounds.x0; x < bounds.x1; ++x) {
            if (draws_rectangles(call) || covers(snapped, bits, x, y)) covered.emplace(x / 16, y / 16);
          }
        }
      }
      if (call.geometry->is_mesh()) continue;
      const Splat& splat = call.splat(number);
      if (!is_finite(splat)) continue;
      RC_ASSERT(std::max({splat.red, splat.green, splat.blue}) <= facts.largest_color);
      RC_ASSERT(splat.opacity <= facts.largest_opacity);
    }
  }
  RC_CLASSIFY(!covered.empty() && facts.tiles > facts.tiles_touched, "some tiles are touched, and some are not");
  RC_CLASSIFY(covered.size() == facts.tiles_touched && facts.tiles > facts.tiles_touched, "the bound is met");
  RC_ASSERT(primitives == facts.primitives);
  RC_ASSERT(covered.size() <= facts.tiles_touched);
  RC_ASSERT(facts.tiles_touched <= facts.tiles);
}

RC_GTEST_PROP(FrameFacts, BoundSplatsOfAnyExtent, ()) {
  Draw draw = draw_of(100, 65);
  const int count = *whole(1, 4);
  for (int i = 0; i < count; ++i) draw.splats.push_back(*splat_in(draw.width, draw.height, 70000.0F));
  if (*whole(0, 4) == 0)
    draw.splats.front().ax =
        *rc::gen::element(std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 3e38F);
  DrawState state;
  state.splat_extent = *rc::gen::element(SplatExtent::oriented_box, SplatExtent::axis_aligned_box,
                                         SplatExtent::three_sigma, SplatExtent::fill_rectangle);
  state.obb_padding = *rc::gen::element(0.0F, 0.75F, 16.0F);
  RenderContext context = testing::context_of(draw, state);
  context.precision.subpixel_bits = *rc::gen::element(8U, 4U, 12U);
  check(context);
}

RC_GTEST_PROP(FrameFacts, BoundMeshesAndSplatsOfSeveralDraws, ()) {
  const auto seed = static_cast<std::uint64_t>(*whole(1, 1 << 20));
  RunRequest request;
  request.platform = &platform_named("agx-orin-ideal-memory");
  request.variant = *rc::gen::elementOf(variants());
  RenderContext context =
      testing::context_of(*whole(0, 2) == 0 ? mixed_frame(seed, request) : random_frame(seed, request));
  context.precision.subpixel_bits = *rc::gen::element(8U, 4U, 12U);
  check(context);
}

RC_GTEST_PROP(FrameFacts, BoundTriangles, ()) {
  const std::uint32_t side = *rc::gen::element(16U, 33U, 64U);
  Draw draw = draw_of(side, side);
  const int count = *whole(1, 6);
  for (int i = 0; i < count; ++i) {
    draw.splats.push_back(round_splat(8, 8, 2, 0.5F));
    ScreenTriangle& triangle = draw.triangles.emplace_back();
    for (unsigned vertex = 0; vertex < 3; ++vertex) {
      triangle.x[vertex] = *coordinate(side);
      triangle.y[vertex] = *coordinate(side);
    }
  }
  check(testing::context_of(draw));
}

}  // namespace
}  // namespace vrpipe
