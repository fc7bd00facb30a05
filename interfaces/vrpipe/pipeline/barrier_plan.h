#pragma once

#include <vector>

#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// Where a frame has barriers (glTextureBarrier, vkCmdPipelineBarrier): a draw that reads the colour target begins once all
/// that was drawn into it before has been blended. DRAW, TC and CROP each have the plan, and so agree: DRAW issues nothing
/// behind a barrier's mark until every CROP has seen that and said so.
class BarrierPlan {
 public:
  explicit BarrierPlan(const RenderContext& context);
  /// Whether there is any.
  bool is_used() const { return !marks_.empty(); }
  bool is_barrier(Mark mark) const;

 private:
  std::vector<Mark> marks_;  ///< in order
};

}  // namespace vrpipe
