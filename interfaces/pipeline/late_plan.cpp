#include <vrpipe/pipeline/late_plan.h>

#include <algorithm>

#include <vrpipe/pipeline/effects.h>
#include <vrpipe/pipeline/hi_z_plan.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

LatePlan::LatePlan(const RenderContext& context) {
  const Frame& frame = *context.frame;
  if (!frame.tests_late() || !EffectGate(context, "zrop.late_tests").enter()) return;
  const HiZPlan hi_z(context);
  late_.resize(frame.draws().size());
  // Of late draws that nothing has waited for:
  bool tested = false;
  bool written = false;
  for (std::size_t at = 0; at < frame.commands().size(); ++at) {
    const Frame::Command& command = frame.commands()[at];
    const Mark mark = Frame::mark_of(at);
    bool waits = written && hi_z.waits_at(mark);
    if (command.is_draw) {
      const DrawState& state = frame.draw_call(command.draw).state;
      waits = waits || (state.tests_early() && (written || (tested && state.writes_depth_stencil())));
    } else {
      waits = waits || (tested && (command.clear.depth || command.clear.stencil));
    }
    if (waits) {
      waits_.push_back(mark);
      tested = written = false;
    }
    if (!command.is_draw) continue;
    const DrawState& state = frame.draw_call(command.draw).state;
    if (!state.tests_late()) continue;
    late_[command.draw] = 1;
    tested = true;
    written = written || state.writes_depth_stencil();
  }
}

bool LatePlan::waits_at(Mark mark) const { return std::binary_search(waits_.begin(), waits_.end(), mark); }

PortNeed way_of_late_tests() {
  return {"out_late", [](const RenderContext& context) { return LatePlan(context).is_used(); },
          "depth or stencil of a draw is tested after shading, and the port is not connected",
          "connect prop.out_late to zrop.in_late, and zrop.out_late to prop.in_late"};
}

}  // namespace vrpipe
