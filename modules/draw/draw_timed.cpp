#include "draw/draw.h"
#include "draw/issue_schedule.h"

#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/slots/draw.h>

namespace vrpipe {

namespace {

/// DRAW at lt. Ports as in draw_unit.cpp.
class TimedDraw : public TimedUnit {
 public:
  TimedDraw(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<DrawBehaviour> behaviour,
            const RenderContext& context, unsigned gpcs)
      : TimedUnit(name, domain, DrawWork::kinds()),
        behaviour_(std::move(behaviour)),
        schedule_(*behaviour_, context),
        barriers_(context) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      outs_.push_back(std::make_unique<TimedOut<VertexWarp>>(*this, "out_vertices_" + std::to_string(gpc)));
      in_done_.push_back(std::make_unique<TimedIn<BlendsDone>>(*this, "in_done_" + std::to_string(gpc),
                                                               [this](const BlendsDone&, CycleInterval visible) {
                                                                 return take_done(visible.first);
                                                               }));
      in_done_.back()->set_optional();
      in_done_.back()->set_comes_ahead();
    }
    leave_out_drawn(*behaviour_, *context.frame);
    have_ = schedule_.next(*behaviour_, warp_);
  }

  bool idle() const override { return ended_ == outs_.size(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Cycle due() const { return have_ && warp_.mark == Mark::none ? schedule_.due() : 0; }

  Cycle take_done(Cycle visible) {
    passed_at_ = std::max(passed_at_, visible);
    if (--awaited_ == 0) schedule_.restart(passed_at_);
    return visible;
  }

  Cycle tick(Cycle now) override {
    if (idle()) return never;
    const Cycle at = std::max({due(), passed_at_, last_ == nullptr ? 0 : last_->last() + 1});
    if (at > now) return at;
    TimedOut<VertexWarp>& out = *outs_[turn_];
    charge(UnitState::latency, at);
    if (!have_) {
      warp_ = {};
      warp_.mark = Mark::end_of_frame;
    }
    const bool is_barrier = have_ && barriers_.is_barrier(warp_.mark);
    // All come to it meanwhile.
    if (is_barrier) awaited_ = static_cast<unsigned>(outs_.size());
    const Cycle taken = out.send(warp_, at).first;
    charge(UnitState::blocked, taken);
    charge(UnitState::busy, out.last() + 1);
    if (have_) {
      if (warp_.mark == Mark::none) {
        const Cycle interval = schedule_.issue();
        if (interval > 0) did(DrawWork::warps, interval, taken, taken + interval);
      }
      have_ = schedule_.next(*behaviour_, warp_);
    } else {
      ++ended_;
    }
    turn_ = (turn_ + 1) % outs_.size();
    last_ = &out;
    clock.domain->wait_until([this] { return awaited_ == 0; });
    if (awaited_ > 0) throw SimulationFault(name(), taken, "CROP has not passed a mark that is a barrier");
    return std::max({due(), out.last() + 1, now + 1});
  }

  std::unique_ptr<DrawBehaviour> behaviour_;
  std::vector<std::unique_ptr<TimedOut<VertexWarp>>> outs_;
  std::vector<std::unique_ptr<TimedIn<BlendsDone>>> in_done_;  ///< by GPC
  TimedOut<VertexWarp>* last_ = nullptr;                       ///< used
  IssueSchedule schedule_;
  const BarrierPlan barriers_;
  VertexWarp warp_;
  bool have_ = false;
  std::size_t turn_ = 0;
  std::size_t ended_ = 0;
  unsigned awaited_ = 0;  ///< GPCs that have not come to the barrier yet
  Cycle passed_at_ = 0;   ///< the last of them to the last barrier
};

[[maybe_unused]] const bool draw_timed_registered = [] {
  register_timed_unit_maker("draw", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderContext& context,
                                       unsigned gpcs) {
    return std::make_unique<TimedDraw>(name.c_str(), domain, behaviour_as<DrawBehaviour>(std::move(behaviour)), context,
                                       gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
