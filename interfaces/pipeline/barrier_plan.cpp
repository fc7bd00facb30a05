#include <vrpipe/pipeline/barrier_plan.h>

#include <algorithm>

namespace vrpipe {

BarrierPlan::BarrierPlan(const RenderContext& context) {
  const Frame& frame = *context.frame;
  Mark last = Mark::none;   // the mark before the command, or one before that
  bool is_written = false;  // since the last barrier
  for (std::size_t at = 0; at < frame.commands().size(); ++at) {
    const Frame::Command& command = frame.commands()[at];
    if (!command.is_draw || command.changes_state) last = Frame::mark_of(at);
    if (!command.is_draw) {
      is_written = is_written || command.clear.color;
      continue;
    }
    const FragmentShader shader = frame.draw_call(command.draw).state.shader;
    // A draw that writes has another state than one that reads, and a clear has a mark: so there is one between them.
    if (reads_color(shader) && is_written) {
      marks_.push_back(last);
      is_written = false;
    }
    is_written = is_written || writes_color(shader);
  }
  if (is_used() && !EffectGate(context, "draw.barriers").enter()) marks_.clear();
}

bool BarrierPlan::is_barrier(Mark mark) const { return std::binary_search(marks_.begin(), marks_.end(), mark); }

}  // namespace vrpipe
