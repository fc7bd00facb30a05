#include <vrpipe/clock_domain.h>

#include <algorithm>
#include <numeric>

#include <vrpipe/error.h>

namespace vrpipe {

ClockDomain::ClockDomain(const sc_core::sc_module_name& name, std::uint64_t period_ps)
    : sc_module(name), period_(static_cast<double>(period_ps), sc_core::SC_PS) {
  SC_METHOD(edge);
  sensitive << event_;
  dont_initialize();
}

unsigned ClockDomain::attach(Clocked& unit) {
  slots_.push_back({&unit, 0, false});
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

void ClockDomain::edge() {
  running_ = true;
  ++edges_;
  // First all that are due, then all ticks: a wake-up in this cycle is for a later one, also for a unit yet to tick.
  for (Slot& slot : slots_) {
    slot.active = slot.due <= now_;
    if (slot.active) slot.due = never;
  }
  for (const unsigned index : order_) {
    Slot& slot = slots_[index];
    if (!slot.active) continue;
    const Cycle next = slot.unit->tick(now_);
    if (next < slot.due) slot.due = next;
  }
  if (finished_) return;
  Cycle next = never;
  for (const Slot& slot : slots_) next = std::min(next, slot.due);
  if (next == never) return;
  if (next <= now_) throw SimulationFault(name(), now_, "a unit asked for an edge in the past");
  event_.notify(sc_core::sc_time::from_value((next - now_) * period_.value()));
  now_ = next;
}

}  // namespace vrpipe

// libsystemc refers to sc_main; programs that call sc_start from their own main, as ours do, need not have one.

extern "C" __attribute__((weak)) int sc_main(int, char**) { return 0; }
