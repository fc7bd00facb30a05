#pragma once

#include <memory>

#include <vrpipe/kernel/clock_domain.h>

namespace vrpipe {

/// A clock of the same cycles as another, the global one, that has no time of the kernel's: its edges come when it is asked to
/// go on to a cycle, as in temporal decoupling (TLM-2.0). It may be ahead of the global clock, and not behind it but for a cycle.
class LocalClock : public ClockDomain {
 public:
  /// @param global  outlives it
  LocalClock(const sc_core::sc_module_name& name, ClockDomain& global);
  ~LocalClock() override;

  /// Between edges: lets those before a cycle come.
  void advance(Cycle until);
  using ClockDomain::next_edge;
  /// Does what does not wait for an edge, as behind each; it may advance the clock. False if there is nothing.
  virtual bool rouse() { return false; }

 protected:
  /// ClockDomain::step_locals of the global clock.
  bool step_locals() { return global_->step_locals(); }
  /// Rouses it when the global clock comes to a cycle.
  void call_at(Cycle cycle);
  /// Called before the ticks of an edge; it may wake units for that cycle.
  virtual void before_edge(Cycle) {}

 private:
  /// An edge of the global clock behind each of this one, so that it does not stay behind. In the same cycle it would matter
  /// which of the global clock's units ticks first.
  class Pace;
  void wake_from_outside(unsigned handle, Cycle at) final;
  void start_of_simulation() final {}

  std::unique_ptr<Pace> pace_;
};

}  // namespace vrpipe
