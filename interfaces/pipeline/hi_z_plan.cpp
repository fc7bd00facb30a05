#include <vrpipe/pipeline/hi_z_plan.h>

#include <algorithm>

#include <vrpipe/pipeline/effects.h>

namespace vrpipe {

namespace {

/// Whether a fragment of a face that does not pass both tests may change the stencil.
bool failing_writes(const StencilFace& face) {
  if ((face.write_mask & face.bits) == 0) return false;
  return (face.compare != Compare::always && face.stencil_fail != StencilOperation::keep) ||
         (face.compare != Compare::none && face.depth_fail != StencilOperation::keep);
}

}  // namespace

bool hi_z_may_cull(const DrawState& state) {
  const Compare compare = state.depth.compare;
  const bool fails_beyond = compare == Compare::less || compare == Compare::less_equal || compare == Compare::equal;
  if (!state.depth.test || !fails_beyond) return false;
  return !state.stencil.test || (!failing_writes(state.stencil.front) && !failing_writes(state.stencil.back));
}

bool may_raise_depth(const DepthState& depth) {
  return depth.writes() && depth.compare != Compare::less && depth.compare != Compare::less_equal &&
         depth.compare != Compare::equal;
}

HiZPlan::HiZPlan(const RenderContext& context) {
  const Frame& frame = *context.frame;
  const bool is_strict = context.termination == Termination::strict;
  draws_.resize(frame.draws().size());
  OfDraw now;
  bool is_usable = true;
  bool has_stored = false;        // since the clear
  bool has_stored_since = false;  // since it was waited for
  bool any = false;
  for (std::size_t at = 0; at < frame.commands().size(); ++at) {
    const Frame::Command& command = frame.commands()[at];
    if (!command.is_draw) {
      if (!command.clear.depth) continue;
      now.cleared_to = command.clear.depth_value;
      ++now.epoch;
      is_usable = true;
      has_stored = has_stored_since = false;
      continue;
    }
    const DrawState& state = frame.draw_call(command.draw).state;
    is_usable = is_usable && !may_raise_depth(state.depth);
    now.reports = is_usable && state.depth.writes();
    now.culls = is_usable && hi_z_may_cull(state) && (now.cleared_to < 1 || has_stored || now.reports);
    if (is_strict && now.culls && has_stored_since && command.changes_state) {
      waits_.push_back(Frame::mark_of(at));
      has_stored_since = false;
    }
    has_stored = has_stored || now.reports;
    has_stored_since = has_stored_since || now.reports;
    any = any || now.culls;
    draws_[command.draw] = now;
  }
  if (any && !EffectGate(context, "raster.hi_z").enter()) {
    any = false;
    waits_.clear();
  }
  if (!any) draws_.clear();
  // What nobody can use any more is not reported.
  bool is_wanted = false;
  for (std::size_t draw = draws_.size(); draw-- > 0;) {
    if (draw + 1 < draws_.size() && draws_[draw + 1].epoch != draws_[draw].epoch) is_wanted = false;
    is_wanted = is_wanted || draws_[draw].culls;
    draws_[draw].reports = draws_[draw].reports && is_wanted;
  }
}

bool HiZPlan::waits_at(Mark mark) const { return std::binary_search(waits_.begin(), waits_.end(), mark); }

}  // namespace vrpipe
