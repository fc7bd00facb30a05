#include "draw/draw.h"
#include "draw/issue_schedule.h"

#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/slots/draw.h>

namespace vrpipe {

namespace {

/// DRAW at cycle fidelity. Warps go to the GPCs in turn.
/// Ports: out_vertices_<gpc> (VertexWarp), in_done_<gpc> (BlendsDone; optional).
class DrawUnit : public Unit {
 public:
  DrawUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<DrawBehaviour> behaviour,
           const RenderContext& context, unsigned gpcs)
      : Unit(name, domain, DrawWork::kinds()),
        behaviour_(std::move(behaviour)),
        schedule_(*behaviour_, context),
        barriers_(context) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      outs_.push_back(std::make_unique<StreamOut<VertexWarp>>(*this, "out_vertices_" + std::to_string(gpc)));
      in_done_.push_back(std::make_unique<StreamIn<BlendsDone>>(*this, "in_done_" + std::to_string(gpc)));
      in_done_.back()->set_optional();
      in_done_.back()->set_answers();
    }
    leave_out_drawn(*behaviour_, *context.frame);
    have_ = schedule_.next(*behaviour_, warp_);
  }

  bool idle() const override { return ended_ == outs_.size(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  [[gnu::noinline]] void take_done(Cycle now) {
    for (const auto& in : in_done_) {
      for (; in->ready(); in->pop()) --awaited_;
    }
    if (awaited_ == 0) schedule_.restart(now);
  }

  Cycle tick(Cycle now) override {
    if (idle()) {
      enter(UnitState::starved, now);
      return never;
    }
    if (awaited_ > 0) take_done(now);
    if (awaited_ > 0) {
      enter(UnitState::latency, now);
      Cycle next = never;
      for (const auto& in : in_done_) next = std::min(next, in->next_ready());
      return next;
    }
    if (have_ && warp_.mark == Mark::none && now < schedule_.due()) {
      enter(UnitState::latency, now);
      return schedule_.due();
    }
    StreamOut<VertexWarp>& out = *outs_[turn_];
    if (out.credits() == 0) {
      enter(UnitState::blocked, now);
      return never;
    }
    enter(UnitState::busy, now);
    turn_ = (turn_ + 1) % outs_.size();
    if (have_) {
      out.push(warp_);
      if (warp_.mark == Mark::none) {
        const Cycle interval = schedule_.issue();
        if (interval > 0) did(DrawWork::warps, interval, now, now + interval);
      } else if (barriers_.is_barrier(warp_.mark)) {
        awaited_ = static_cast<unsigned>(outs_.size());
      }
      have_ = schedule_.next(*behaviour_, warp_);
    } else {
      VertexWarp end;
      end.mark = Mark::end_of_frame;
      out.push(end);
      ++ended_;
    }
    return now + 1;
  }

  std::unique_ptr<DrawBehaviour> behaviour_;
  std::vector<std::unique_ptr<StreamOut<VertexWarp>>> outs_;
  std::vector<std::unique_ptr<StreamIn<BlendsDone>>> in_done_;  ///< by GPC
  IssueSchedule schedule_;
  const BarrierPlan barriers_;
  VertexWarp warp_;
  bool have_ = false;
  std::size_t turn_ = 0;
  std::size_t ended_ = 0;
  unsigned awaited_ = 0;  ///< GPCs that have not come to the barrier yet
};

[[maybe_unused]] const bool draw_unit_registered = [] {
  register_unit_maker("draw", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                 const RenderContext& context, unsigned gpcs) {
    return std::make_unique<DrawUnit>(name.c_str(), domain, behaviour_as<DrawBehaviour>(std::move(behaviour)), context,
                                      gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
