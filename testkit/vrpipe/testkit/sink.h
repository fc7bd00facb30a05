#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include <systemc>

#include <vrpipe/component/error.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/kernel/link.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/testkit/source.h>

namespace vrpipe::testkit {

/// Takes items from a port and keeps each with the cycle in which it was taken. As fast as they come, unless paced or
/// closed for a while.
template <class Item>
class Sink {
 public:
  struct Record {
    Cycle cycle;  ///< in which it, or its first part, was taken
    Item item;
    Cycle last;  ///< in which its last part was taken; several cycles only at `lt`
  };

  virtual ~Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  /// At most so many items in a cycle.
  void set_rate(unsigned items_per_cycle) { rate_ = items_per_cycle; }
  /// Takes nothing in the cycles [from, until); `never` for good. At `lt`, where a call has to return, an item that comes to
  /// a sink that is closed for good is a fault.
  void close(Cycle from, Cycle until = never) { closed_.push_back({from, until}); }
  /// Called with each item when all of it is taken, for instance to answer through a source.
  void on_take(std::function<void(const Item&, Cycle)> action) { action_ = std::move(action); }

  const std::vector<Record>& records() const { return records_; }

  virtual InEnd<Item>& in() = 0;

 protected:
  Sink() = default;
  /// The first cycle from this one on in which it is not closed.
  Cycle open_from(Cycle cycle) const {
    for (std::size_t i = 0; i < closed_.size(); ++i) {
      if (closed_[i].from > cycle || cycle >= closed_[i].until) continue;
      cycle = closed_[i].until;
      i = ~std::size_t{0};  // one that was asked before may follow
    }
    return cycle;
  }
  void record(const Item& item, CycleInterval at) {
    records_.push_back({at.first, item, at.last});
    if (action_) action_(item, at.last);
  }

  std::vector<Record> records_;
  unsigned rate_ = ~0U;

 private:
  struct Range {
    Cycle from, until;
  };
  std::vector<Range> closed_;
  std::function<void(const Item&, Cycle)> action_;
};

/// At `cycle`.
template <class Item>
class ClockedSink : public sc_core::sc_module, public Clocked, public PortOwner, public Sink<Item> {
 public:
  ClockedSink(const sc_core::sc_module_name& name, ClockDomain& domain)
      : sc_module(name), PortOwner({&domain, domain.attach(*this)}), in_(*this, "in") {}

  InEnd<Item>& in() override { return in_; }

 private:
  Cycle tick(Cycle now) override {
    if (const Cycle open = this->open_from(now); open > now) return open;
    for (unsigned taken = 0; in_.ready(); ++taken) {
      if (taken == this->rate_) return now + 1;
      const Item item = in_.front();
      in_.pop();
      this->record(item, now);
    }
    return in_.next_ready();
  }

  StreamIn<Item> in_;
};

/// At `lt`.
template <class Item>
class TimedSink : public TimedUnit, public Sink<Item> {
 public:
  TimedSink(const sc_core::sc_module_name& name, ClockDomain& domain)
      : TimedUnit(name, domain, {}),
        in_(*this, "in", [this](const Item& item, CycleInterval visible) { return take(item, visible); }) {}

  InEnd<Item>& in() override { return in_; }
  Behaviour& behaviour() override { return behaviour_; }

 private:
  /// When an item that is visible from a cycle on is taken, after those before it.
  Cycle taken_from(Cycle visible) const {
    if (this->records_.empty()) return this->open_from(visible);
    const Cycle last = this->records_.back().last;
    return this->open_from(std::max(visible, in_cycle_ == this->rate_ ? last + 1 : last));
  }
  CycleInterval take(const Item& item, CycleInterval visible) {
    CycleInterval at(taken_from(visible.first));
    if (at.first == never) {
      throw SimulationFault(name(), visible.first, "a blocking call comes to a sink that is closed for good");
    }
    at.last = this->open_from(std::max(at.first, visible.last));
    in_cycle_ = !this->records_.empty() && at.first == this->records_.back().last ? in_cycle_ + 1 : 1;
    this->record(item, at);
    return at;
  }

  TimedIn<Item> in_;
  NoBehaviour behaviour_;
  unsigned in_cycle_ = 0;  ///< items taken in the cycle of the last
};

}  // namespace vrpipe::testkit
