#pragma once

#include <algorithm>
#include <deque>
#include <vector>

#include <systemc>

#include <vrpipe/clock_domain.h>
#include <vrpipe/link.h>

namespace vrpipe::testkit {

/// Plays items into a port, in the order in which they were added, each as soon as its cycle has come and the receiver
/// has room.
template <class Item>
class Source : public sc_core::sc_module, public Clocked, public PortOwner {
 public:
  Source(const sc_core::sc_module_name& name, ClockDomain& domain)
      : sc_module(name), PortOwner({&domain, domain.attach(*this)}), out(*this, "out") {}

  /// Adds an item that goes at cycle `earliest` or later. Also while the simulation runs: `earliest` is a later cycle.
  void add(const Item& item, Cycle earliest = 0) {
    items_.push_back({item, earliest});
    clock.domain->wake(clock.unit, clock.domain->running() ? std::max(earliest, clock.domain->now() + 1) : earliest);
  }
  /// At most so many items in a cycle; without it, as many as the receiver has room for.
  void set_rate(unsigned items_per_cycle) { rate_ = items_per_cycle; }

  /// The cycle in which each item went.
  const std::vector<Cycle>& sent() const { return sent_; }
  bool done() const { return items_.empty(); }

  StreamOut<Item> out;

 private:
  Cycle tick(Cycle now) override {
    for (unsigned pushed = 0; !items_.empty(); ++pushed) {
      if (items_.front().earliest > now) return items_.front().earliest;
      if (pushed == rate_) return now + 1;
      if (out.credits() == 0) return never;
      out.push(items_.front().item);
      sent_.push_back(now);
      items_.pop_front();
    }
    return never;
  }

  struct Entry {
    Item item;
    Cycle earliest;
  };
  std::deque<Entry> items_;
  std::vector<Cycle> sent_;
  unsigned rate_ = ~0U;
};

}  // namespace vrpipe::testkit
