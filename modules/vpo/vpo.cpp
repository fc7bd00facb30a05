#include "vpo/vpo.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

/// In millionths of a square pixel.
std::uint64_t determinant(const Splat& splat) {
  const double area = std::fabs(static_cast<double>(splat.ax) * static_cast<double>(splat.by) -
                                static_cast<double>(splat.ay) * static_cast<double>(splat.bx));
  const double squared_extent = static_cast<double>(splat.r) * static_cast<double>(splat.r);
  if (!(area > 0) || !(squared_extent > 0)) return 0;
  return static_cast<std::uint64_t>(std::min(area / squared_extent * 1e6, 1e18));
}

}  // namespace

PrimitiveAssembly::PrimitiveAssembly(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      triangles_per_cycle_(parameters.triangles_per_cycle),
      latency_cycles_(parameters.latency_cycles),
      face_culling_gate_(context, "vpo.face_culling") {}

unsigned PrimitiveAssembly::assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) {
  const DrawCall& call = context_.draw(draw);
  if (!is_finite(call, splat)) {
    ++dropped_not_finite;
    return 0;
  }
  // A splat at opacity 1/255 has no extent by design, and triangles of their own have no axes.
  if (call.geometry->triangles.empty() && !call.geometry->is_mesh()) {
    const Splat& given = call.splat(splat);
    if (given.r > 0) smallest_determinant.see(determinant(given));
  }
  TriangleSnapper snapper(context_);
  unsigned count = 0;
  for (unsigned triangle = 0; triangle < primitives_per_splat(call); ++triangle) {
    PixelRect bounds;
    switch (cull_triangle(context_, snapper, draw, splat, triangle, bounds)) {
      case Culling::not_finite: ++dropped_not_finite; return 0;
      case Culling::zero_area: ++culled_zero_area; continue;
      case Culling::facing:
        if (!face_culling_gate_.enter() && !bounds.empty()) break;
        ++culled_facing;
        continue;
      case Culling::outside: ++culled_outside; continue;
      case Culling::none: break;
    }
    out[count].splat = splat;
    out[count].triangle = static_cast<std::uint8_t>(triangle);
    out[count].draw = draw;
    out[count].bounds = bounds;
    ++count;
  }
  primitives.add(draw, count);
  return count;
}

namespace {
const SlotRegistrar vpo_slot{{"vpo", 20, "primitive-assembly", "", false, check_vpo}};
const Registrar<PrimitiveAssembly, VpoBehaviour> registrar("vpo", "primitive-assembly",
                                                           "two triangles per splat, culled and boxed", false,
                                                           Trust::trusted);
const EffectRegistrar face_culling_effect{{"vpo",
                                           "face_culling",
                                           "",
                                           EffectKind::functional,
                                           "triangles of meshes that face away are dropped",
                                           "no draw of a mesh culls",
                                           "the facing of each triangle",
                                           "where a triangle is to be dropped",
                                           {},
                                           [](const EffectQuestion& asked) {
                                             const FrameFacts& facts = asked.facts;
                                             if (facts.culling_faces == 0)
                                               return EffectDecision::omit("no draw of a mesh culls");
                                             return EffectDecision::keep(
                                                 fmt::format("{} of {} draws cull", facts.culling_faces, facts.draws));
                                           }}};

// Not decided: why stands in place of a predicate.
const EffectRegistrar clipping_effect{{"vpo",
                                       "clipping",
                                       "",
                                       EffectKind::functional,
                                       "splats beyond the guard band are cut to it",
                                       "whether a corner is outside is what is tested for anyway; only what is, is cut",
                                       "a comparison for each corner",
                                       "",
                                       {},
                                       nullptr}};
const EffectRegistrar not_finite_effect{
    {"vpo",
     "not_finite",
     "",
     EffectKind::functional,
     "splats with a NaN or an infinity are dropped",
     "the test is the tripwire; a frame of them is rare, and a picture of them wrong",
     "a test of a splat's eleven numbers",
     "",
     {},
     nullptr}};
}  // namespace

}  // namespace vrpipe
