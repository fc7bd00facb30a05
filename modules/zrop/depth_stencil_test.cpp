#include "zrop/depth_stencil_test.h"

namespace vrpipe {

const DepthStencilTest::Entry& DepthStencilTest::entry_of(const Quad& quad, DepthFormat format) {
  const std::uint32_t primitive = primitive_order(quad);
  Entry& entry = entries_[primitive % entries_.size()];
  if (entry.primitive == primitive) return entry;
  entry.primitive = primitive;
  entry.plane = DepthPlane(context_, quad.draw, quad.splat, quad.triangle);
  if (entry.plane.is_flat()) entry.flat_depth = store_depth(format, entry.plane.nearest());
  return entry;
}

DepthStencilTest::Outcome DepthStencilTest::test(const Quad& quad, std::int32_t x, std::int32_t y, DepthFormat format,
                                                 DepthStencilQuad& stored) {
  const DrawState& state = context_.state(quad.draw);
  const Entry& entry = entry_of(quad, format);
  const StencilFace& face = state.stencil.face(entry.plane.is_back_face());
  Outcome outcome{0, false};
  for (unsigned lane = 0; lane < 4; ++lane) {
    if ((quad.coverage >> lane & 1U) == 0) continue;
    std::uint32_t& stored_depth = stored.depth[lane];
    std::uint8_t& stored_stencil = stored.stencil[lane];
    const bool passes_stencil = !state.stencil.test || face.test(stored_stencil);
    bool passes_depth = true;
    if (passes_stencil && state.depth.test) {
      const std::uint32_t depth = entry.plane.is_flat()
                                      ? entry.flat_depth
                                      : store_depth(format, entry.plane.at(x + static_cast<std::int32_t>(lane & 1U),
                                                                           y + static_cast<std::int32_t>(lane >> 1U)));
      passes_depth = passes(state.depth.compare, depth, stored_depth);
      if (passes_depth && state.depth.write) {
        outcome.wrote = outcome.wrote || stored_depth != depth;
        stored_depth = depth;
      }
    }
    if (state.stencil.test) {
      const StencilOperation operation = !passes_stencil ? face.stencil_fail
                                         : passes_depth  ? face.pass
                                                         : face.depth_fail;
      const std::uint8_t value = face.apply(operation, stored_stencil);
      outcome.wrote = outcome.wrote || value != stored_stencil;
      stored_stencil = value;
    }
    if (passes_stencil && passes_depth) outcome.passed = static_cast<LaneMask>(outcome.passed | 1U << lane);
  }
  return outcome;
}

}  // namespace vrpipe
