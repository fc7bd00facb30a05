#pragma once

#include <functional>
#include <vector>

#include <systemc>

#include <vrpipe/clock_domain.h>
#include <vrpipe/link.h>

namespace vrpipe::testkit {

/// Takes items from a port and keeps each with the cycle in which it was taken. As fast as they come, unless paced or
/// closed for a while.
template <class Item>
class Sink : public sc_core::sc_module, public Clocked, public PortOwner {
 public:
  struct Record {
    Cycle cycle;
    Item item;
  };

  Sink(const sc_core::sc_module_name& name, ClockDomain& domain)
      : sc_module(name), PortOwner({&domain, domain.attach(*this)}), in(*this, "in") {}

  /// At most so many items in a cycle.
  void set_rate(unsigned items_per_cycle) { rate_ = items_per_cycle; }
  /// Takes nothing in the cycles [from, until); `never` for good.
  void close(Cycle from, Cycle until = never) { closed_.push_back({from, until}); }
  /// Called with each item when it is taken, for instance to answer through a source.
  void on_take(std::function<void(const Item&, Cycle)> action) { action_ = std::move(action); }

  const std::vector<Record>& records() const { return records_; }

  StreamIn<Item> in;

 private:
  struct Range {
    Cycle from, until;
  };

  Cycle tick(Cycle now) override {
    for (const Range& range : closed_) {
      if (range.from <= now && now < range.until) return range.until;
    }
    for (unsigned taken = 0; in.ready(); ++taken) {
      if (taken == rate_) return now + 1;
      records_.push_back({now, in.front()});
      in.pop();
      if (action_) action_(records_.back().item, now);
    }
    return in.next_ready();
  }

  std::vector<Record> records_;
  std::vector<Range> closed_;
  std::function<void(const Item&, Cycle)> action_;
  unsigned rate_ = ~0U;
};

}  // namespace vrpipe::testkit
