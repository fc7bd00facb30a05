#include "draw/draw.h"

#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/draw.h>

namespace vrpipe {

namespace {

/// DRAW without time. Ports as in draw_unit.cpp.
class UntimedDraw : public UntimedUnit {
 public:
  UntimedDraw(const std::string& name, std::unique_ptr<DrawBehaviour> behaviour, const RenderContext& context,
              unsigned gpcs)
      : UntimedUnit(name, {{"warps", 0, 1024.0 / behaviour->warps_per_1024_cycles(), true},
                           {"warps of rectangles", 0, 1024.0 / behaviour->rectangle_warps_per_1024_cycles(), true}}),
        context_(context),
        behaviour_(std::move(behaviour)) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      outs_.push_back(std::make_unique<UntimedOut<VertexWarp>>(*this, "out_vertices_" + std::to_string(gpc)));
      // Here all that a warp leads to is done before the next.
      in_done_.push_back(input<BlendsDone>("in_done_" + std::to_string(gpc), [](const BlendsDone&) {}));
      in_done_.back()->set_optional();
    }
    leave_out_drawn(*behaviour_, *context.frame);
  }

  Behaviour& behaviour() override { return *behaviour_; }

  bool run_piece() override {
    VertexWarp warp;
    if (behaviour_->next(warp)) {
      if (warp.mark == Mark::none)
        did(draws_rectangles(context_.draw(warp.draw)) ? DrawWork::rectangle_warps : DrawWork::warps, 1);
      outs_[turn_]->send(warp);
      turn_ = turn_ + 1 == outs_.size() ? 0 : turn_ + 1;
      return true;
    }
    VertexWarp end;
    end.mark = Mark::end_of_frame;
    for (const auto& out : outs_) out->send(end);
    return false;
  }

 private:
  const RenderContext& context_;
  std::unique_ptr<DrawBehaviour> behaviour_;
  std::vector<std::unique_ptr<UntimedOut<VertexWarp>>> outs_;
  std::vector<std::unique_ptr<UntimedIn<BlendsDone>>> in_done_;
  std::size_t turn_ = 0;
};

[[maybe_unused]] const bool draw_untimed_registered = [] {
  register_untimed_unit_maker("draw", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                         const RenderContext& context, unsigned gpcs) {
    return std::make_unique<UntimedDraw>(name, behaviour_as<DrawBehaviour>(std::move(behaviour)), context, gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
