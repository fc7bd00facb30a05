#include "draw/draw.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

VertexIssue::VertexIssue(const Parameters& parameters, const RenderContext& context)
    : frame_(*context.frame),
      rate_(parameters.warps_per_1024_cycles * context.placement.gpcs),
      rate_of_rectangles_(parameters.rectangle_warps_per_1024_cycles > 0
                              ? parameters.rectangle_warps_per_1024_cycles * context.placement.gpcs
                              : rate_) {}

/// Vertices fill warps; where those of a rectangle lie in two, it goes with the second.
std::uint32_t VertexIssue::splats_that_fit(const DrawCall& call) const {
  if (call.state.splat_extent != SplatExtent::fill_rectangle) return splats_per_vertex_warp;
  constexpr std::uint64_t threads = std::uint64_t{splats_per_vertex_warp} * vertices_per_splat;
  const std::uint64_t warps = (std::uint64_t{issued_} * vertices_per_rectangle + threads - 1) / threads;
  return static_cast<std::uint32_t>((warps + 1) * threads / vertices_per_rectangle - issued_);
}

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
    out.splats = std::min(splats_that_fit(call), call.splats - issued_);
    issued_ += out.splats;
    splats += out.splats;
    return true;
  }
  return false;
}

void leave_out_drawn(DrawBehaviour& draw, const Frame& frame) {
  VertexWarp warp;
  while (warp.first_splat + warp.splats < frame.drawn() && draw.next(warp)) continue;
}

namespace {
const SlotRegistrar draw_slot{{"draw", 10, "vertex-issue", "", false, check_draw}};
const Registrar<VertexIssue, DrawBehaviour> registrar("draw", "vertex-issue", "issues sorted splats as vertex warps",
                                                      false, Trust::trusted);
const EffectRegistrar barriers_effect{
    {"draw",
     "barriers",
     "",
     EffectKind::functional,
     "a draw that reads the colour target waits until all before it is blended",
     "no draw reads what another has written (BarrierPlan)",
     "the link crop.done",
     "in BarrierPlan, of which DRAW, TC and CROP each have one",
     {"crop.done"},
     [](const EffectQuestion& asked) {
       if (BarrierPlan(asked.context).is_used())
         return EffectDecision::keep(fmt::format("{} draws read the colour target", asked.facts.reading_color));
       return EffectDecision::omit("no draw reads what another has written");
     }}};
const EffectRegistrar several_draws_effect{
    {"draw",
     "several_draws",
     "",
     EffectKind::functional,
     "quads of several draws in a warp, of a state each, and counts by draw",
     "the frame has one draw",
     "the number of its draw with each shaded quad",
     "at elaboration, where there are more",
     {},
     [](const EffectQuestion& asked) {
       const std::string draws = fmt::format("{} draw{}", asked.facts.draws, asked.facts.draws == 1 ? "" : "s");
       return asked.facts.draws <= 1 ? EffectDecision::omit(draws) : EffectDecision::keep(draws);
     }}};
}  // namespace

}  // namespace vrpipe
