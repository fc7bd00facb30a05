#include <vrpipe/clock_domain.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

#include <vrpipe/error.h>

namespace vrpipe {

namespace {

using CycleVector = Cycle __attribute__((vector_size(32)));
constexpr std::size_t cycles_per_vector = sizeof(CycleVector) / sizeof(Cycle);

/// A bit for each lane that is all ones; the others are 0.
unsigned mask_of(const CycleVector& lanes) {
#if defined(__AVX__)
  using Doubles = double __attribute__((vector_size(32)));
  return static_cast<unsigned>(__builtin_ia32_movmskpd256(reinterpret_cast<Doubles>(lanes)));
#else
  unsigned mask = 0;
  for (std::size_t lane = 0; lane < cycles_per_vector; ++lane) mask |= static_cast<unsigned>(lanes[lane] & 1U) << lane;
  return mask;
#endif
}

}  // namespace

ClockDomain::ClockDomain(const sc_core::sc_module_name& name, std::uint64_t period_ps)
    : sc_module(name),
      period_(static_cast<double>(period_ps), sc_core::SC_PS),
      period_value_(period_.value()),
      due_(cycles_per_vector, never) {
  SC_METHOD(edge);
  sensitive << event_;
  dont_initialize();
}

unsigned ClockDomain::attach(Clocked& unit) {
  const auto handle = static_cast<unsigned>(units_.size());
  units_.push_back(&unit);
  place_of_.push_back(handle);
  if (handle == due_.size()) due_.resize(due_.size() + cycles_per_vector, never);
  due_[handle] = 0;
  return handle;
}

void ClockDomain::set_tick_order(std::vector<unsigned> order) {
  std::vector<unsigned> all(units_.size());
  std::iota(all.begin(), all.end(), 0U);
  if (!std::is_permutation(order.begin(), order.end(), all.begin(), all.end())) {
    throw SimulationFault(name(), now_, "the tick order is not a permutation of the units");
  }
  if (running_) throw SimulationFault(name(), now_, "the tick order is set after the first edge");
  std::vector<Clocked*> units;
  for (unsigned place = 0; place < order.size(); ++place) {
    units.push_back(units_[place_of_[order[place]]]);
    all[order[place]] = place;
  }
  units_ = std::move(units);
  place_of_ = std::move(all);
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
      now_ = next_;
      ++edges_;
      some_soon_ = false;
      tick_due();
      next_ = some_soon_ ? now_ + 1 : *std::min_element(due_.begin(), due_.end());
      if (next_ <= now_) throw SimulationFault(name(), now_, "a unit asked for an edge in the past");
    } while (!finished_ && next_ - present < cycles_per_activation_);
  } catch (...) {
    thrown_ = std::current_exception();
    finished_ = true;
  }
  in_edge_ = false;
  if (!finished_ && next_ != never) event_.notify(sc_core::sc_time::from_value((next_ - present) * period_.value()));
}

void ClockDomain::tick_due() {
  // Several units are looked at together and without branches, since which of them are due changes from edge to edge. A
  // wake-up in this cycle is for a later one, so it does not matter who has ticked before it.
  const Cycle now = now_;
  Cycle* const due = due_.data();
  Clocked* const* const units = units_.data();
  bool soon = false;
  for (std::size_t first = 0, end = 0; first < due_.size(); first = end) {
    end = std::min(first + 64, due_.size());
    std::uint64_t active = 0;
    for (std::size_t place = end; place > first;) {
      place -= cycles_per_vector;
      CycleVector wanted;
      std::memcpy(&wanted, due + place, sizeof wanted);
      const auto is_due = reinterpret_cast<CycleVector>(wanted == now);
      wanted |= is_due;  // `never` has all bits set
      std::memcpy(due + place, &wanted, sizeof wanted);
      active = active << cycles_per_vector | mask_of(is_due);
    }
    for (; active != 0; active &= active - 1) {
      const std::size_t place = first + static_cast<unsigned>(__builtin_ctzll(active));
      const Cycle next = units[place]->tick(now);
      due[place] = std::min(due[place], next);
      soon |= next == now + 1;
    }
  }
  some_soon_ |= soon;
}

void ClockDomain::wake_from_outside(unsigned handle, Cycle at) {
  if (finished_ || !running_) return;  // before the first edge all are due
  at = std::max(at, edge_after(sc_core::SC_ZERO_TIME));
  Cycle& due = due_[place_of_[handle]];
  due = std::min(due, at);
  if (at >= next_) return;
  next_ = at;
  event_.notify(sc_core::sc_time::from_value(at * period_.value()) - sc_core::sc_time_stamp());
}

}  // namespace vrpipe

// libsystemc refers to sc_main; programs that call sc_start from their own main, as ours do, need not have one.

extern "C" __attribute__((weak)) int sc_main(int, char**) { return 0; }
