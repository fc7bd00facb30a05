#include "draw/draw.h"

#include <algorithm>

#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

VertexIssue::VertexIssue(const Parameters& parameters, const RenderContext& context)
    : frame_(*context.frame), rate_(parameters.warps_per_1024_cycles) {}

bool VertexIssue::next(VertexWarp& out) {
  for (; command_ < frame_.commands().size(); ++command_, marked_ = false, issued_ = 0) {
    const Frame::Command& command = frame_.commands()[command_];
    out = {};
    if (!marked_ && (!command.is_draw || command.changes_state)) {
      out.mark = Frame::mark_of(command_);
      marked_ = true;
      return true;
    }
    if (!command.is_draw) continue;
    const DrawCall& call = frame_.draw_call(command.draw);
    if (issued_ == call.splats) continue;
    out.draw = command.draw;
    out.first_splat = call.base + issued_;
    out.splats = std::min(splats_per_vertex_warp, call.splats - issued_);
    issued_ += out.splats;
    splats += out.splats;
    return true;
  }
  return false;
}

namespace {
const SlotRegistrar slot{{"draw", 10, "vertex-issue", "", false, check_draw}};
const Registrar<VertexIssue, DrawBehaviour> registrar("draw", "vertex-issue", "issues sorted splats as vertex warps",
                                                      false, Trust::trusted);
}  // namespace

}  // namespace vrpipe
