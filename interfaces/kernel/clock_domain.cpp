#include <vrpipe/kernel/clock_domain.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

#include <vrpipe/arithmetic/lanes.h>
#include <vrpipe/component/error.h>
#include <vrpipe/kernel/local_clock.h>

namespace vrpipe {

namespace {

constexpr std::size_t cycles_per_vector = sizeof(Words) / sizeof(Cycle);
constexpr std::size_t at_a_time = 64;

/// Which of up to 64 are due, a bit each; they are due no longer. Several are looked at together and without branches,
/// since which of them are due changes from edge to edge. Out of line, to leave the ticks the registers.
[[gnu::noinline]] std::uint64_t take_due(Cycle* due, std::size_t count, Cycle cycle) {
  std::uint64_t active = 0;
  for (std::size_t place = count; place > 0;) {
    place -= cycles_per_vector;
    Words wanted;
    std::memcpy(&wanted, due + place, sizeof wanted);
    const auto is_due = reinterpret_cast<Words>(wanted == cycle);
    wanted |= is_due;  // `never` has all bits set
    std::memcpy(due + place, &wanted, sizeof wanted);
    active = active << cycles_per_vector | sign_mask(is_due);
  }
  return active;
}

}  // namespace

ClockDomain::ClockDomain(const sc_core::sc_module_name& name, std::uint64_t period_ps)
    : sc_module(name),
      period_(static_cast<double>(period_ps), sc_core::SC_PS),
      period_value_(period_.value()),
      due_(cycles_per_vector, never),
      global_(this) {
  SC_METHOD(edge);
  sensitive << event_;
  dont_initialize();
}

ClockDomain::ClockDomain(const sc_core::sc_module_name& name, ClockDomain& global)
    : sc_module(name),
      period_(global.period_),
      period_value_(period_.value()),
      due_(cycles_per_vector, never),
      global_(&global) {}

ClockDomain::~ClockDomain() = default;

/// Lets the earliest edge of the local clocks come, or what they do at rest; false if there is nothing.
bool ClockDomain::step_locals() {
  const auto earliest = std::min_element(locals_.begin(), locals_.end(), [](const LocalClock* a, const LocalClock* b) {
    return a->next_edge() < b->next_edge();
  });
  if (earliest == locals_.end()) return false;
  const bool stepped = std::exchange(steps_locals_, true);
  const Cycle next = (*earliest)->next_edge();
  if (next != never) (*earliest)->advance(next + 1);
  const bool any =
      next != never || std::any_of(locals_.begin(), locals_.end(), [](LocalClock* local) { return local->rouse(); });
  steps_locals_ = stepped;
  return any;
}

unsigned ClockDomain::attach(Clocked& unit) {
  const auto handle = static_cast<unsigned>(units_.size());
  units_.push_back(&unit);
  if (handle == due_.size()) due_.resize(due_.size() + cycles_per_vector, never);
  due_[handle] = 0;
  active_.resize(due_.size() / at_a_time + 1);
  return handle;
}

void ClockDomain::set_tick_order(std::vector<unsigned> order) {
  std::vector<unsigned> all(units_.size());
  std::iota(all.begin(), all.end(), 0U);
  if (!std::is_permutation(order.begin(), order.end(), all.begin(), all.end())) {
    throw SimulationFault(name(), now_, "the tick order is not a permutation of the units");
  }
  if (running_) throw SimulationFault(name(), now_, "the tick order is set after the first edge");
  tick_order_ = std::move(order);
}

void ClockDomain::start_of_simulation() {
  const bool any_own_time = std::any_of(outside_ports_.begin(), outside_ports_.end(),
                                        [](OutsidePort* port) { return port->meets_own_time(); });
  if (any_own_time && (!keeps_step_ || keeps_step_())) cycles_per_activation_ = 1;
  event_.notify(sc_core::SC_ZERO_TIME);
}

void ClockDomain::run(const sc_core::sc_time& duration) {
  sc_core::sc_start(duration);
  if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
}

bool ClockDomain::run_to_rest(const sc_core::sc_time& at_most) {
  if (at_rest()) return true;
  pauses_at_rest_ = true;
  run(at_most);
  pauses_at_rest_ = false;
  if (at_rest()) return true;
  check_answers();
  return false;
}

void ClockDomain::check_answers() const {
  if (awaited_ == 0 || next_ != never) return;
  const sc_core::sc_time silence = sc_core::sc_time_stamp() - sc_core::sc_time::from_value(now_ * period_.value());
  if (silence < longest_silence() && sc_core::sc_pending_activity()) return;
  OutsidePort::Unanswered oldest{never, name(), "something outside the clock"};
  for (OutsidePort* port : outside_ports_) {
    if (!port->meets_own_time()) continue;  // what it is bound to waits for another port's answer
    OutsidePort::Unanswered request = port->oldest_unanswered();
    if (request.since < oldest.since) oldest = std::move(request);
  }
  throw SimulationFault(oldest.port, now_,
                        "all units sleep, and there is no answer to " + oldest.request + ", the oldest of " +
                            std::to_string(awaited_) + " that are awaited; " +
                            (sc_core::sc_pending_activity() ? "so for " + silence.to_string() + " now"
                                                            : "nothing is left that could answer"));
}

void ClockDomain::fail(std::exception_ptr thrown) {
  thrown_ = std::move(thrown);
  finished_ = true;
  if (pauses_at_rest_) sc_core::sc_pause();
}

void ClockDomain::edge() {
  running_ = true;
  in_edge_ = true;
  ++activations_;
  const Cycle present = next_;
  // Through the kernel an exception would come out as a report of the kernel's.
  try {
    const Cycle end = std::min(present + cycles_per_activation_, stop_at_);
    for (Cycle cycle = present; !finished_ && cycle < end;) {
      if (cycle >= look_at_) look_at_ = look_(cycle);
      cycle = tick_until(cycle, std::min(end, look_at_));
    }
    do next_ = next_edge();
    while (next_ == never && step_locals());
    if (next_ <= now_) throw SimulationFault(name(), now_, "a unit was woken for an edge in the past");
    if (next_ != never && next_ >= stop_at_) stopped_ = finished_ = true;
  } catch (...) {
    thrown_ = std::current_exception();
    finished_ = true;
  }
  in_edge_ = false;
  if (pauses_at_rest_ && at_rest()) sc_core::sc_pause();
  if (!finished_ && next_ != never) event_.notify(sc_core::sc_time::from_value((next_ - present) * period_.value()));
}

void ClockDomain::fault_of_tick(const Clocked& unit) const {
  const auto* const named = dynamic_cast<const sc_core::sc_object*>(&unit);
  throw SimulationFault(named == nullptr ? name() : named->name(), now_, "it asked for an edge in the past");
}

inline void ClockDomain::tick(Clocked& unit, Cycle cycle, Cycle& due) {
  const Cycle next = unit.tick(cycle);
  if (next <= cycle) fault_of_tick(unit);
  due = std::min(due, next);
}

inline bool ClockDomain::tick_due(Cycle cycle) {
  // A wake-up in this cycle is for a later one: who is due is known before any of them ticks.
  const std::size_t count = due_.size();
  const std::uint64_t active = take_due(due_.data(), std::min(at_a_time, count), cycle);
  const bool any_further = count > at_a_time && take_further_due(cycle);
  if (active == 0 && !any_further) return false;
  now_ = cycle;
  tick_active(active, 0, cycle);
  for (std::size_t first = at_a_time; any_further && first < count; first += at_a_time)
    tick_active(active_[first / at_a_time], first, cycle);
  return true;
}

inline void ClockDomain::tick_active(std::uint64_t active, std::size_t first, Cycle cycle) {
  Cycle* const due = due_.data() + first;
  Clocked* const* const units = units_.data() + first;
  for (; active != 0; active &= active - 1) {
    const auto place = static_cast<std::size_t>(__builtin_ctzll(active));
    tick(*units[place], cycle, due[place]);
  }
}

[[gnu::noinline]] bool ClockDomain::take_further_due(Cycle cycle) {
  bool any = false;
  for (std::size_t first = at_a_time; first < due_.size(); first += at_a_time) {
    std::uint64_t& active = active_[first / at_a_time];
    active = take_due(due_.data() + first, std::min(at_a_time, due_.size() - first), cycle);
    any = any || active != 0;
  }
  return any;
}

bool ClockDomain::tick_due_in_order(Cycle cycle) {
  std::vector<unsigned> active;
  for (const unsigned handle : tick_order_) {
    if (due_[handle] != cycle) continue;
    due_[handle] = never;
    active.push_back(handle);
  }
  if (active.empty()) return false;
  now_ = cycle;
  for (const unsigned handle : active) tick(*units_[handle], cycle, due_[handle]);
  return true;
}

Cycle ClockDomain::tick_until(Cycle cycle, Cycle until) {
  while (!finished_ && cycle < until) {
    const bool ticked = tick_order_.empty() ? tick_due(cycle) : tick_due_in_order(cycle);
    if (ticked) ++edges_;
    // Mostly someone wants the very next cycle.
    cycle = ticked ? cycle + 1 : next_edge();
  }
  return cycle;
}

void ClockDomain::wake_from_outside(unsigned handle, Cycle at) {
  if (finished_ || !running_) return;  // before the first edge all are due
  at = std::max(at, edge_after(sc_core::SC_ZERO_TIME));
  Cycle& due = due_[handle];
  due = std::min(due, at);
  if (at >= next_) return;
  next_ = at;
  event_.notify(sc_core::sc_time::from_value(at * period_.value()) - sc_core::sc_time_stamp());
}

}  // namespace vrpipe

// libsystemc refers to sc_main; programs that call sc_start from their own main, as ours do, need not have one.

extern "C" __attribute__((weak)) int sc_main(int, char**) { return 0; }
