#include <vrpipe/clock_domain.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include <vrpipe/error.h>

namespace vrpipe {

ClockDomain::ClockDomain(const sc_core::sc_module_name& name, std::uint64_t period_ps)
    : sc_module(name), period_(static_cast<double>(period_ps), sc_core::SC_PS) {
  SC_METHOD(edge);
  sensitive << event_;
  dont_initialize();
}

unsigned ClockDomain::attach(Clocked& unit) {
  slots_.push_back({&unit, 0});
  active_.push_back(0);
  order_.push_back(static_cast<unsigned>(order_.size()));
  return order_.back();
}

void ClockDomain::set_tick_order(std::vector<unsigned> order) {
  std::vector<unsigned> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  std::vector<unsigned> all(slots_.size());
  std::iota(all.begin(), all.end(), 0U);
  if (sorted != all) throw SimulationFault(name(), now_, "the tick order is not a permutation of the units");
  order_ = std::move(order);
}

void ClockDomain::start_of_simulation() { event_.notify(sc_core::SC_ZERO_TIME); }

void ClockDomain::run(const sc_core::sc_time& duration) {
  sc_core::sc_start(duration);
  if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
}

void ClockDomain::edge() {
  running_ = true;
  in_edge_ = true;
  ++activations_;
  const Cycle present = next_;
  // Through the kernel an exception would come out as a report of the kernel's.
  try {
    do {
      now_ = std::exchange(next_, never);
      ++edges_;
      tick_all();
    } while (!finished_ && next_ - present < cycles_per_activation_);
  } catch (...) {
    thrown_ = std::current_exception();
    finished_ = true;
  }
  in_edge_ = false;
  if (!finished_ && next_ != never) event_.notify(sc_core::sc_time::from_value((next_ - present) * period_.value()));
}

void ClockDomain::tick_all() {
  // First all that are due, then all ticks: a wake-up in this cycle is for a later one, also for a unit yet to tick.
  // Without branches, since which units are due changes from edge to edge.
  const Cycle now = now_;
  Cycle next_due = never;
  std::size_t active = 0;
  for (const unsigned index : order_) {
    Cycle& due = slots_[index].due;
    active_[active] = index;
    active += due <= now ? 1 : 0;
    due = due <= now ? never : due;
    next_due = std::min(next_due, due);
  }
  next_ = next_due;
  for (std::size_t i = 0; i < active; ++i) {
    Slot& slot = slots_[active_[i]];
    const Cycle next = slot.unit->tick(now_);
    slot.due = std::min(slot.due, next);
    next_ = std::min(next_, next);
  }
  if (next_ <= now_) throw SimulationFault(name(), now_, "a unit asked for an edge in the past");
}

void ClockDomain::wake_from_outside(unsigned handle, Cycle at) {
  if (finished_) return;
  at = std::max(at, edge_after(sc_core::SC_ZERO_TIME));
  slots_[handle].due = std::min(slots_[handle].due, at);
  if (at >= next_) return;
  next_ = at;
  event_.notify(sc_core::sc_time::from_value(at * period_.value()) - sc_core::sc_time_stamp());
}

}  // namespace vrpipe

// libsystemc refers to sc_main; programs that call sc_start from their own main, as ours do, need not have one.

extern "C" __attribute__((weak)) int sc_main(int, char**) { return 0; }
