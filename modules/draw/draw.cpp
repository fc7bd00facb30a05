#include "draw/draw.h"

#include <algorithm>

#include <vrpipe/registry.h>

namespace vrpipe {

VertexIssue::VertexIssue(const Parameters& parameters, const RenderState& state)
    : total_(static_cast<std::uint32_t>(state.draw->splats.size())), rate_(parameters.warps_per_1024_cycles) {}

bool VertexIssue::next(VertexWarp& out) {
  if (next_ == total_) return false;
  out.first_splat = next_;
  out.splats = std::min(splats_per_vertex_warp, total_ - next_);
  out.end_of_draw = false;
  next_ += out.splats;
  splats += out.splats;
  return true;
}

namespace {
const SlotRegistrar slot{{"draw", 10, "vertex-issue"}};
const Registrar<VertexIssue, DrawBehaviour> registrar("draw", "vertex-issue", "issues sorted splats as vertex warps",
                                                      false, Trust::trusted);
}  // namespace

}  // namespace vrpipe
