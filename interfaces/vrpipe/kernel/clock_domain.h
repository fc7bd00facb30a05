#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <systemc>

#include <vrpipe/arithmetic/divisor.h>
#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// A unit that does something at clock edges.
class Clocked {
 public:
  virtual ~Clocked() = default;
  /// One clock edge. Sees only what other units did in earlier cycles. Returns the next cycle at which the unit wants
  /// an edge even if nothing arrives: now + 1 while it works, `never` to sleep until a link wakes it.
  virtual Cycle tick(Cycle now) = 0;
};

/// Where a unit meets what may have time of its own: a memory port.
class OutsidePort {
 public:
  virtual ~OutsidePort() = default;
  /// Whether what it is bound to has time of its own, so that the kernel's must keep step with the clock. Asked
  /// when all is bound.
  virtual bool meets_own_time() = 0;
  struct Unanswered {
    Cycle since = never;
    std::string port;
    std::string request;  ///< in words
  };
  /// The oldest of the requests that have no answer yet; since `never`, if there is none.
  virtual Unanswered oldest_unanswered() const = 0;
};

class LocalClock;

/// One clock for many units: a single event, armed for the next cycle at which a unit has something to do.
/// Cycles in which every unit sleeps cost nothing. Cycles are counted as integers; sc_time only carries them.
class ClockDomain : public sc_core::sc_module {
 public:
  /// @param period_ps length of a cycle on the SystemC time axis, picoseconds (rounded; cycle counts are exact)
  ClockDomain(const sc_core::sc_module_name& name, std::uint64_t period_ps);
  ~ClockDomain() override;
  SC_HAS_PROCESS(ClockDomain);

  /// Returns the handle for `wake`. Units tick in the order of attachment; the order does not change results.
  unsigned attach(Clocked& unit);
  /// How many units are attached.
  std::size_t attached() const { return units_.size(); }
  /// The cycle of this edge; between edges, of the last one.
  Cycle now() const { return now_; }
  sc_core::sc_time period() const { return period_; }
  /// Cycles in a time, rounded down or up.
  Cycle whole_cycles(const sc_core::sc_time& time) const { return period_value_.quotient(time.value()); }
  Cycle cycles_up(const sc_core::sc_time& time) const { return period_value_.quotient_up(time.value()); }

  /// Asks for an edge of a unit at cycle `at`, later than now while the simulation runs. Also from outside an edge, by
  /// a module with time of its own: the edge is then one that is yet to come. Of several wishes of a unit the earliest
  /// counts.
  void wake(unsigned handle, Cycle at) {
    if (!in_edge_) return wake_from_outside(handle, at);
    Cycle& due = due_[handle];
    due = std::min(due, at);
  }

  /// The first edge that is later than the present time, and not before `delay` has passed.
  Cycle edge_after(const sc_core::sc_time& delay) const {
    if (in_edge_) return now_ + std::max<Cycle>(1, cycles_up(delay));
    const sc_core::sc_time& present = sc_core::sc_time_stamp();
    return std::max<Cycle>(whole_cycles(present) + 1, cycles_up(present + delay));
  }

  /// A port whose requests may be answered from outside the clock. It outlives the simulation.
  void attach(OutsidePort& port) { outside_ports_.push_back(&port); }
  /// A unit waits for one answer more, or less, that comes from outside the clock; until then the clock is not at rest.
  void await_answer() { ++awaited_; }
  void answered() { --awaited_; }
  bool awaits_answers() const { return awaited_ > 0; }

  /// Runs for a time, as sc_start does; what a unit throws comes out as it is.
  void run(const sc_core::sc_time& duration);
  /// Runs until the clock is at rest, at most for a time; returns whether it is. What else has time of its own may go on
  /// for ever. Throws SimulationFault as `check_answers` does.
  bool run_to_rest(const sc_core::sc_time& at_most);
  /// Whether no unit wants an edge and none waits for an answer, so that no edge will come; or an edge has thrown, or
  /// `finish` was called.
  bool at_rest() const { return running_ && (finished_ || (next_ == never && awaited_ == 0)); }
  /// While all units sleep and some wait for answers from outside: throws SimulationFault that names a port and its
  /// oldest request, once nothing is left that could answer, or no edge has come for `longest_silence()`.
  void check_answers() const;
  /// 10 ms. DRAM answers in 0.1 us, after a refresh in 1 us, and after it was powered up in 2 ms (LPDDR4, tINIT3).
  static sc_core::sc_time longest_silence() { return {10, sc_core::SC_MS}; }

  /// Ends the simulation with what was thrown by code that the kernel called, not this clock; `run` throws it.
  void fail(std::exception_ptr thrown);

  /// Where the draw ends that the units of this clock work on; they say what they know.
  FrameEnd& frame_end() { return global_->frame_end_; }

  /// Of a local clock (local_clock.h) the one that it is ahead of; otherwise itself.
  const ClockDomain& global() const { return *global_; }
  /// Cycles by which it is ahead of that.
  Cycle lead() const { return now_ - std::min(now_, global_->now_); }
  /// Has local clocks go on, those of this one, until something is so or all are at rest.
  template <class Predicate>
  void wait_until(Predicate&& is_so) {
    while (!is_so() && step_locals()) continue;
  }
  /// While they go on for another's sake: then none enters a unit that waits.
  bool steps_locals() const { return steps_locals_; }

  /// Whether the first edge has come.
  bool running() const { return running_; }

  /// Up to so many cycles pass each time that the kernel activates the clock, which is not free. sc_time_stamp() is then
  /// behind now() by as much, so it stays 1 where an outside port meets time of its own. At first 1.
  void set_cycles_per_activation(unsigned cycles) { cycles_per_activation_ = cycles; }

  /// Whether items and accesses between units of this clock pass their TLM-2.0 sockets also where the ends could call
  /// each other directly. The same in every cycle; it takes the host's time. Before ends are connected.
  void set_passes_sockets() { passes_sockets_ = true; }
  bool passes_sockets() const { return global_->passes_sockets_; }
  /// Called when the simulation starts, if an outside port meets time of its own: whether the kernel's is to keep step.
  void ask_about_own_time(std::function<bool()> keeps_step) { keeps_step_ = std::move(keeps_step); }

  /// Calls `look` between two edges, those of the cycles before `at` and of `at` or later: with the first cycle whose
  /// edge may still come. It returns the next `at`, later than that. Neither edges nor activations depend on it. Where
  /// no edge comes any more there may be no call.
  void look_between_edges(Cycle at, std::function<Cycle(Cycle next_edge)> look) {
    look_at_ = at;
    look_ = std::move(look);
  }

  /// Ends the simulation after this cycle.
  void finish() { finished_ = true; }
  /// Lets no edge of this cycle or a later one come; before the first. What wants one then ends the simulation.
  void stop_at(Cycle cycle) { stop_at_ = cycle; }
  /// Whether that has ended it.
  bool stopped() const { return stopped_; }
  bool finished() const { return finished_; }
  /// Number of edges at which at least one unit was ticked.
  std::uint64_t edges() const { return edges_; }
  /// Number of times that the kernel activated the clock.
  std::uint64_t activations() const { return activations_; }

  /// Ticks in the order of this permutation of handles; for the tests that show that the order does not matter. Before
  /// the first edge.
  void set_tick_order(std::vector<unsigned> order);

 protected:
  /// Of a local clock.
  ClockDomain(const sc_core::sc_module_name& name, ClockDomain& global);
  /// The next edge that a unit wants; `never` for none.
  Cycle next_edge() const { return *std::min_element(due_.begin(), due_.end()); }

 private:
  friend class LocalClock;
  void edge();
  bool step_locals();
  /// Lets those come that are wanted from a cycle on and before `until`; returns the first cycle behind them.
  Cycle tick_until(Cycle cycle, Cycle until);
  bool tick_due(Cycle cycle);
  void tick_active(std::uint64_t active, std::size_t first, Cycle cycle);
  bool take_further_due(Cycle cycle);
  bool tick_due_in_order(Cycle cycle);
  void tick(Clocked& unit, Cycle cycle, Cycle& due);
  [[noreturn]] void fault_of_tick(const Clocked& unit) const;
  virtual void wake_from_outside(unsigned handle, Cycle at);
  void start_of_simulation() override;

  sc_core::sc_time period_;
  Divisor period_value_;  ///< in units of sc_time
  sc_core::sc_event event_;
  std::vector<Clocked*> units_;        ///< by handle
  std::vector<Cycle> due_;             ///< the edge that each wants; filled up with `never` to whole vectors
  std::vector<std::uint64_t> active_;  ///< those due at an edge, beyond the first 64: a bit each
  std::vector<unsigned> tick_order_;   ///< of handles; empty for their own order
  FrameEnd frame_end_;
  ClockDomain* const global_;
  std::vector<LocalClock*> locals_;
  Cycle now_ = 0;
  Cycle next_ = 0;  ///< the edge that is armed; `never` for none
  Cycle stop_at_ = never;
  bool stopped_ = false;
  unsigned cycles_per_activation_ = 1;
  std::uint64_t edges_ = 0;
  std::uint64_t activations_ = 0;
  std::vector<OutsidePort*> outside_ports_;
  std::uint64_t awaited_ = 0;
  Cycle look_at_ = never;
  std::function<Cycle(Cycle)> look_;
  std::function<bool()> keeps_step_;
  std::exception_ptr thrown_;
  bool in_edge_ = false;
  bool running_ = false;
  bool finished_ = false;
  bool pauses_at_rest_ = false;
  bool passes_sockets_ = false;
  bool steps_locals_ = false;
};

}  // namespace vrpipe
