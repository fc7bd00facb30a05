#include <vrpipe/model/unit.h>

namespace vrpipe {

namespace {

/// DRAW at cycle fidelity. Warps go to the GPCs in turn.
/// Ports: out_vertices_<gpc> (VertexWarp).
class DrawUnit : public Unit {
 public:
  DrawUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<DrawBehaviour> behaviour,
           unsigned gpcs)
      : Unit(name, domain, DrawWork::kinds()), behaviour_(std::move(behaviour)) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      outs_.push_back(std::make_unique<StreamOut<VertexWarp>>(*this, "out_vertices_" + std::to_string(gpc)));
    }
    have_ = behaviour_->next(warp_);
  }

  bool idle() const override { return ended_ == outs_.size(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  /// When a warp may be issued.
  Cycle due(std::uint64_t warp) const { return warp * 1024 / behaviour_->warps_per_1024_cycles(); }

  Cycle tick(Cycle now) override {
    if (idle()) {
      enter(UnitState::starved, now);
      return never;
    }
    if (have_ && warp_.mark == Mark::none && now < due(issued_)) {
      enter(UnitState::latency, now);
      return due(issued_);
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
        const Cycle interval = due(issued_ + 1) - due(issued_);
        if (interval > 0) did(DrawWork::warps, interval, now, now + interval);
        ++issued_;
      }
      have_ = behaviour_->next(warp_);
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
  VertexWarp warp_;
  bool have_ = false;
  std::size_t turn_ = 0;
  std::size_t ended_ = 0;
  std::uint64_t issued_ = 0;
};

[[maybe_unused]] const bool registered = [] {
  register_unit_maker("draw", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                 const RenderContext&, unsigned gpcs) {
    return std::make_unique<DrawUnit>(name.c_str(), domain, behaviour_as<DrawBehaviour>(std::move(behaviour)), gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
