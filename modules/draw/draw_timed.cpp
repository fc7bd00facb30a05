#include <vrpipe/model/timed.h>

namespace vrpipe {

namespace {

/// DRAW at lt and at. Ports as in draw_unit.cpp.
class TimedDraw : public TimedUnit {
 public:
  TimedDraw(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<DrawBehaviour> behaviour,
            unsigned gpcs, Transport transport)
      : TimedUnit(name, domain, DrawWork::kinds(), transport), behaviour_(std::move(behaviour)) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      outs_.push_back(std::make_unique<TimedOut<VertexWarp>>(*this, "out_vertices_" + std::to_string(gpc)));
    }
    have_ = behaviour_->next(warp_);
  }

  bool idle() const override { return ended_ == outs_.size(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Cycle due(std::uint64_t warp) const { return warp * 1024 / behaviour_->warps_per_1024_cycles(); }
  Cycle due() const { return have_ && warp_.mark == Mark::none ? due(issued_) : 0; }

  Cycle tick(Cycle now) override {
    if (last_ != nullptr) {
      if (last_->blocked()) return never;
      // At `at` it is known only now when what waited was taken.
      charge(UnitState::blocked, last_->last());
      charge(UnitState::busy, last_->last() + 1);
    }
    if (idle()) return never;
    const Cycle at = std::max(due(), last_ == nullptr ? 0 : last_->last() + 1);
    if (at > now) return at;
    TimedOut<VertexWarp>& out = *outs_[turn_];
    charge(UnitState::latency, at);
    if (!have_) {
      warp_ = {};
      warp_.mark = Mark::end_of_frame;
    }
    const Cycle taken = out.send(warp_, at).first;
    charge(UnitState::blocked, taken);
    charge(UnitState::busy, out.last() + 1);
    if (have_) {
      if (warp_.mark == Mark::none) {
        const Cycle interval = due(issued_ + 1) - due(issued_);
        if (interval > 0) did(DrawWork::warps, interval, taken, taken + interval);
        ++issued_;
      }
      have_ = behaviour_->next(warp_);
    } else {
      ++ended_;
    }
    turn_ = (turn_ + 1) % outs_.size();
    last_ = &out;
    return out.blocked() ? never : std::max({due(), out.last() + 1, now + 1});
  }

  std::unique_ptr<DrawBehaviour> behaviour_;
  std::vector<std::unique_ptr<TimedOut<VertexWarp>>> outs_;
  TimedOut<VertexWarp>* last_ = nullptr;  ///< used
  VertexWarp warp_;
  bool have_ = false;
  std::size_t turn_ = 0;
  std::size_t ended_ = 0;
  std::uint64_t issued_ = 0;
};

[[maybe_unused]] const bool registered = [] {
  register_timed_unit_maker("draw", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderContext&, unsigned gpcs,
                                       Transport transport) {
    return std::make_unique<TimedDraw>(name.c_str(), domain, behaviour_as<DrawBehaviour>(std::move(behaviour)), gpcs,
                                       transport);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
