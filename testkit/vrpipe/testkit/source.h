#pragma once

#include <algorithm>
#include <deque>
#include <vector>

#include <systemc>

#include <vrpipe/component/error.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/kernel/link.h>
#include <vrpipe/model/timed.h>

namespace vrpipe::testkit {

/// Plays items into a port, in the order in which they were added, each as soon as its cycle has come and the receiver
/// has room.
template <class Item>
class Source {
 public:
  virtual ~Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// Adds an item that goes at cycle `at.first` or later. At `lt` a batch takes the link for several `beats`, the last
  /// of which is there `at.last - at.first` cycles after the first. Also while the simulation runs: `at` is later
  /// then; at `lt` the item goes at once, by a call that is annotated with its cycle, as the answers of units do.
  void add(const Item& item, CycleInterval at = Cycle{0}, unsigned beats = 1) {
    items_.push_back({item, at, beats});
    added(at.first);
  }
  /// At most so many items in a cycle; without it, as many as the receiver has room for.
  void set_rate(unsigned items_per_cycle) { rate_ = items_per_cycle; }

  /// The cycle in which each item, or its first part, went.
  const std::vector<Cycle>& sent() const { return sent_; }
  bool done() const { return items_.empty(); }

  virtual OutEnd<Item>& out() = 0;

 protected:
  struct Entry {
    Item item;
    CycleInterval at;
    unsigned beats;
  };
  Source() = default;
  virtual void added(Cycle earliest) = 0;

  std::deque<Entry> items_;  ///< to be sent
  std::vector<Cycle> sent_;
  unsigned rate_ = ~0U;
};

/// At `cycle`.
template <class Item>
class ClockedSource : public sc_core::sc_module, public Clocked, public PortOwner, public Source<Item> {
 public:
  ClockedSource(const sc_core::sc_module_name& name, ClockDomain& domain)
      : sc_module(name), PortOwner({&domain, domain.attach(*this)}), out_(*this, "out") {}

  OutEnd<Item>& out() override { return out_; }

 private:
  void added(Cycle earliest) override {
    if (this->items_.back().beats != 1) throw SimulationFault(name(), earliest, "at cycle an item takes one beat");
    clock.domain->wake(clock.unit, clock.domain->running() ? std::max(earliest, clock.domain->now() + 1) : earliest);
  }
  Cycle tick(Cycle now) override {
    for (unsigned pushed = 0; !this->done(); ++pushed) {
      const auto& next = this->items_.front();
      if (next.at.first > now) return next.at.first;
      if (pushed == this->rate_) return now + 1;
      if (out_.credits() == 0) return never;
      out_.push(next.item);
      this->sent_.push_back(now);
      this->items_.pop_front();
    }
    return never;
  }

  StreamOut<Item> out_;
};

/// What sources and sinks have for a behaviour, being units at `lt`.
class NoBehaviour : public Behaviour {};

/// At `lt`.
template <class Item>
class TimedSource : public TimedUnit, public Source<Item> {
 public:
  TimedSource(const sc_core::sc_module_name& name, ClockDomain& domain)
      : TimedUnit(name, domain, {}), out_(*this, "out") {}

  OutEnd<Item>& out() override { return out_; }
  Behaviour& behaviour() override { return behaviour_; }

 private:
  void added(Cycle earliest) override {
    if (!clock.domain->running()) return clock.domain->wake(clock.unit, earliest);
    if (!sending_ && this->items_.size() == 1) {
      send_until(never);
    } else {
      clock.domain->wake(clock.unit, std::max(earliest, now() + 1));
    }
  }
  Cycle tick(Cycle now) override { return send_until(now); }

  /// Sends what can go up to a cycle; returns the one in which the next can.
  Cycle send_until(Cycle until) {
    if (sending_) return never;
    while (!this->done()) {
      const auto next = this->items_.front();
      const Cycle at = std::max({next.at.first, out_.room_from(), turn()});
      if (at > until) return at;
      this->items_.pop_front();
      sending_ = true;
      const Cycle taken = out_.send(next.item, {at, at + (next.at.last - next.at.first)}, next.beats).first;
      sending_ = false;
      in_cycle_ = !this->sent_.empty() && taken == this->sent_.back() ? in_cycle_ + 1 : 1;
      was_batch_ = next.beats > 1;
      this->sent_.push_back(taken);
    }
    return never;
  }
  /// When the next may go for those before it.
  Cycle turn() const {
    if (this->sent_.empty()) return 0;
    return was_batch_ || in_cycle_ == this->rate_ ? out_.last() + 1 : out_.last();
  }

  TimedOut<Item> out_;
  NoBehaviour behaviour_;
  bool sending_ = false;  ///< what an item leads to may add another
  bool was_batch_ = false;
  unsigned in_cycle_ = 0;  ///< items that went in the cycle of the last
};

}  // namespace vrpipe::testkit
