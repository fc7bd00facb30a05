#include <vrpipe/kernel/local_clock.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

class LocalClock::Pace final : public Clocked {
 public:
  Pace(LocalClock& local, ClockDomain& global) : local_(local), global_(global), handle_(global.attach(*this)) {}
  Cycle tick(Cycle now) override {
    local_.advance(now);
    local_.rouse();
    const Cycle next = local_.next_edge();
    return next == never ? never : std::max(next, now) + 1;
  }
  void wake_behind(Cycle at) { global_.wake(handle_, std::max(at, global_.now()) + 1); }

 private:
  LocalClock& local_;
  ClockDomain& global_;
  const unsigned handle_;
};

LocalClock::LocalClock(const sc_core::sc_module_name& name, ClockDomain& global)
    : ClockDomain(name, global), pace_(std::make_unique<Pace>(*this, global)) {
  global.locals_.push_back(this);
}

LocalClock::~LocalClock() = default;

void LocalClock::advance(Cycle until) {
  running_ = true;
  for (Cycle cycle = next_edge(); cycle < until; cycle = next_edge()) {
    before_edge(cycle);
    cycle = next_edge();
    if (cycle >= until) return;
    in_edge_ = true;
    tick_until(cycle, cycle + 1);
    in_edge_ = false;
    rouse();
  }
}

void LocalClock::wake_from_outside(unsigned handle, Cycle at) {
  if (!running_) return;  // before the first edge all are due
  at = std::max(at, now_ + 1);
  due_[handle] = std::min(due_[handle], at);
  pace_->wake_behind(at);
}

void LocalClock::call_at(Cycle cycle) { pace_->wake_behind(cycle); }

}  // namespace vrpipe
