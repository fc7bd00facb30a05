#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/link.h>
#include <vrpipe/unit.h>

/// Units and ports of the fidelities `lt` and `at`: the same links, items, latencies and queue depths as at `cycle`, but
/// the passage of an item is computed instead of clocked. A unit has a handler for each input, which is given an item and
/// the cycle in which it becomes visible, reserves the unit's resources from that cycle on, sends what comes of the item,
/// and returns the cycle in which the item leaves the queue. One handler serves both fidelities; the ports differ:
///
/// - `lt`, blocking: a transfer is a b_transport call whose delay says when the item is offered and, on return, when it
///   was taken: as soon as the item as many places ahead as the queue is deep has left it. Calls nest, so that what one
///   vertex warp leads to runs down to its last blend at once; only termination updates wait for their time.
/// - `at`, non-blocking: transfers and credits are nb_transport calls annotated with their cycle. An item waits in its
///   queue until its cycle comes and whatever its unit sends has found room. Units are activated in the order of time.

namespace vrpipe {

enum class Transport : std::uint8_t { blocking, non_blocking };

/// At `at`, a unit that is activated takes also what becomes visible in the next cycles: bursts cost one activation.
/// Times stay exact; what depends on their order (a termination update before a test) may be off by as much.
constexpr Cycle lookahead_cycles = 16;

/// A resource that takes so many items a cycle, in order. An item that is wider than a cycle takes several.
class Lane {
 public:
  explicit Lane(unsigned per_cycle = 1) : per_cycle_(per_cycle > 0 ? per_cycle : 1), left_(per_cycle_) {}
  /// Reserves; returns the cycle in which the item goes.
  Cycle take(Cycle earliest, unsigned width = 1) {
    hold(earliest);
    if (width > left_ && left_ < per_cycle_) next_cycle(1);
    const Cycle taken = cycle_;
    if (width < left_) {
      left_ -= width;
    } else {
      next_cycle((width + per_cycle_ - 1) / per_cycle_);
    }
    return taken;
  }
  /// Nothing goes before this cycle any more.
  void hold(Cycle cycle) {
    if (cycle > cycle_) next_cycle(cycle - cycle_);
  }

 private:
  void next_cycle(Cycle cycles) {
    cycle_ += cycles;
    left_ = per_cycle_;
  }
  unsigned per_cycle_;
  unsigned left_;
  Cycle cycle_ = 0;
};

/// A resource that takes so many parts a cycle; the parts of an item may go in neighbouring cycles.
class Flow {
 public:
  explicit Flow(unsigned per_cycle) : per_cycle_(per_cycle) {}
  /// Reserves; returns the cycle in which the last part goes.
  Cycle take(Cycle earliest, unsigned parts) {
    position_ = std::max(position_, earliest * per_cycle_) + parts;
    return (position_ - (parts > 0 ? 1 : 0)) / per_cycle_;
  }

 private:
  Cycle per_cycle_;
  Cycle position_ = 0;
};

/// What a unit's activation sees of its inputs.
class TimedInput {
 public:
  virtual ~TimedInput() = default;
  /// Handles the items visible up to a cycle, as long as they can be; false if there was none.
  virtual bool serve(Cycle until) = 0;
  /// When an item is to be handled; `never` if none is there, or none can be.
  virtual Cycle next() const = 0;
};

/// And of its outputs.
class TimedOutput {
 public:
  virtual ~TimedOutput() = default;
  /// Whether something sent waits for room.
  virtual bool blocked() const = 0;
};

class TimedUnit : public Unit {
 public:
  TimedUnit(const sc_core::sc_module_name& name, ClockDomain& domain, Transport transport)
      : Unit(name, domain), transport_(transport) {}

  Transport transport() const { return transport_; }
  bool idle() const override;
  void close_account(Cycle end) override;

 protected:
  template <class>
  friend class TimedIn;
  template <class>
  friend class TimedOut;

  /// Non-blocking: work that waited for room. Called at each activation.
  virtual void advance() {}
  Cycle tick(Cycle now) override;
  /// Charges the cycles not charged yet, up to `until`, to a state.
  void charge(UnitState state, Cycle until) {
    if (until <= charged_) return;
    enter(state, charged_);
    charged_ = until;
  }

 private:
  const Transport transport_;
  Cycle charged_ = 0;
  std::vector<TimedInput*> inputs_;
  std::vector<TimedOutput*> outputs_;
};

/// The sending end.
template <class Item>
class TimedOut : public OutEnd<Item>, public TimedOutput {
 public:
  TimedOut(TimedUnit& owner, const std::string& name)
      : OutEnd<Item>(owner, name), blocking_(owner.transport() == Transport::blocking) {
    owner.outputs_.push_back(this);
  }

  /// Sends an item that is there in cycle `at`. Returns the cycle in which it is taken; `at`, if it has to wait and
  /// nobody knows yet how long: then the port is `blocked`.
  Cycle send(const Item& item, Cycle at) {
    while (this->stalled_at(at)) ++at;
    if (!blocking_ && (!waiting_.empty() || (credits_.empty() && !unlimited_))) {
      waiting_.push_back({item, at});
      return at;
    }
    return transfer(item, at);
  }
  bool blocked() const override { return !waiting_.empty(); }
  /// The cycle in which the last item was taken.
  Cycle last() const { return last_; }

 private:
  using OutEnd<Item>::clock_;

  Cycle transfer(const Item& item, Cycle at) {
    ++this->transferred_;
    StreamPayload<Item> payload;
    payload.item = &item;
    payload.latency = this->pipeline_;
    payload.at = at;
    if (blocking_) {
      const Cycle now = clock_.domain->now();
      sc_core::sc_time delay = sc_core::sc_time::from_value((at - now) * clock_.domain->period().value());
      this->socket->b_transport(payload, delay);
      return last_ = payload.at;
    }
    if (!unlimited_) {
      payload.at = std::max(at, credits_.front());
      credits_.pop_front();
    }
    last_ = payload.at;
    StreamPhase phase = StreamPhase::transfer;
    sc_core::sc_time delay;
    this->socket->nb_transport_fw(payload, phase, delay);
    return last_;
  }

  tlm::tlm_sync_enum nb_transport_bw(StreamPayload<Item>& payload, StreamPhase&, sc_core::sc_time&) override {
    credits_.insert(credits_.end(), payload.credits, payload.at);
    const bool was_blocked = blocked();
    while (!waiting_.empty() && !credits_.empty()) {
      transfer(waiting_.front().item, waiting_.front().at);
      waiting_.pop_front();
    }
    if (was_blocked && !blocked()) clock_.domain->wake(clock_.unit, clock_.domain->now() + 1);
    return tlm::TLM_ACCEPTED;
  }
  void unlimited() override { unlimited_ = true; }

  struct Waiting {
    Item item;
    Cycle at;
  };
  const bool blocking_;
  bool unlimited_ = false;
  Cycle last_ = 0;
  std::deque<Cycle> credits_;  ///< the cycle from which each can be used
  std::deque<Waiting> waiting_;
};

/// The receiving end, with its queue.
template <class Item>
class TimedIn : public InEnd<Item>, public TimedInput {
 public:
  /// Given an item and the cycle in which it becomes visible, returns the cycle in which it leaves the queue.
  using Handler = std::function<Cycle(const Item&, Cycle)>;

  /// @param sends_to  the handler is called while none of these is blocked
  TimedIn(TimedUnit& owner, const std::string& name, Handler handler, std::vector<TimedOutput*> sends_to = {})
      : InEnd<Item>(owner, name),
        blocking_(owner.transport() == Transport::blocking),
        handler_(std::move(handler)),
        sends_to_(std::move(sends_to)) {
    owner.inputs_.push_back(this);
    TimedIn::configure(4, 1);
  }

  /// A further condition for the handler to be called.
  void set_gate(std::function<bool()> gate) { gate_ = std::move(gate); }

  void configure(unsigned depth, unsigned latency) override {
    latency_ = latency;
    queue_.assign(blocking_ ? 0 : depth, {});
    free_at_.assign(blocking_ ? depth : 0, 0);
  }
  void open() override {
    if (!blocking_ && !this->is_stub()) grant(static_cast<unsigned>(queue_.size()), 0);
  }
  bool empty() const override { return queued_ == 0; }

  bool serve(Cycle until) override {
    bool served = false;
    while (next() <= until) {
      const Cycle left = handler_(queue_[head_].item, queue_[head_].visible);
      head_ = head_ + 1 == queue_.size() ? 0 : head_ + 1;
      --queued_;
      grant(1, left + 1);
      served = true;
    }
    return served;
  }
  Cycle next() const override {
    if (queued_ == 0 || (gate_ && !gate_())) return never;
    for (const TimedOutput* out : sends_to_) {
      if (out->blocked()) return never;
    }
    return queue_[head_].visible;
  }

 private:
  using InEnd<Item>::clock_;
  struct Entry {
    Cycle visible = 0;
    Item item;
  };

  Cycle visible(const StreamPayload<Item>& payload) const {
    Cycle cycle = payload.at + latency_ + payload.latency;
    while (this->stalled_at(cycle)) ++cycle;
    return cycle;
  }

  void grant(unsigned credits, Cycle at) {
    StreamPayload<Item> payload;
    payload.credits = credits;
    payload.at = at;
    StreamPhase phase = StreamPhase::credit;
    sc_core::sc_time delay;
    this->socket->nb_transport_bw(payload, phase, delay);
  }

  void b_transport(StreamPayload<Item>& payload, sc_core::sc_time& delay) override {
    const std::size_t place = place_;
    place_ = place_ + 1 == free_at_.size() ? 0 : place_ + 1;
    if (free_at_[place] > payload.at) {
      payload.at = free_at_[place];
      delay = sc_core::sc_time::from_value((payload.at - clock_.domain->now()) * clock_.domain->period().value());
    }
    free_at_[place] = handler_(*payload.item, visible(payload)) + 1;
  }

  tlm::tlm_sync_enum nb_transport_fw(StreamPayload<Item>& payload, StreamPhase&, sc_core::sc_time&) override {
    if (queued_ == queue_.size()) {
      throw SimulationFault(this->socket.name(), clock_.domain->now(), "an item arrived at a full queue");
    }
    const std::size_t place = head_ + queued_;
    Entry& entry = queue_[place < queue_.size() ? place : place - queue_.size()];
    entry.visible = visible(payload);
    entry.item = *payload.item;
    ++queued_;
    clock_.domain->wake(clock_.unit, std::max(entry.visible, clock_.domain->now() + 1));
    return tlm::TLM_ACCEPTED;
  }

  const bool blocking_;
  Handler handler_;
  std::vector<TimedOutput*> sends_to_;
  std::function<bool()> gate_;
  unsigned latency_ = 1;
  std::vector<Cycle> free_at_;  ///< blocking: when each place of the queue can be filled, a ring
  std::size_t place_ = 0;
  std::vector<Entry> queue_;  ///< non-blocking, a ring
  std::size_t head_ = 0;
  std::size_t queued_ = 0;
};

/// An initiator on the TLM-2.0 base protocol, for timing only, whose accesses are b_transport calls that return when the
/// data is there. The memory must annotate its time, not wait: units are not threads.
class TimedMemoryPort : private tlm::tlm_bw_transport_if<> {
 public:
  TimedMemoryPort(PortOwner& owner, const std::string& name);
  ~TimedMemoryPort() override;

  tlm::tlm_initiator_socket<32> socket;

  /// An access in cycle `at`; returns the cycle in which it is complete.
  Cycle read(std::uint64_t address, unsigned bytes, Cycle at) {
    return access(tlm::TLM_READ_COMMAND, address, bytes, at);
  }
  Cycle write(std::uint64_t address, unsigned bytes, Cycle at) {
    return access(tlm::TLM_WRITE_COMMAND, address, bytes, at);
  }

 private:
  Cycle access(tlm::tlm_command command, std::uint64_t address, unsigned bytes, Cycle at);
  tlm::tlm_sync_enum nb_transport_bw(tlm::tlm_generic_payload&, tlm::tlm_phase&, sc_core::sc_time&) override {
    return tlm::TLM_ACCEPTED;
  }
  void invalidate_direct_mem_ptr(sc_dt::uint64, sc_dt::uint64) override {}

  const ClockHandle& clock_;
  tlm::tlm_generic_payload payload_;
  std::vector<unsigned char> data_;
};

/// Makes the module of a slot for `lt` or `at` around a behaviour.
using TimedUnitMaker =
    std::function<std::unique_ptr<Unit>(const std::string& name, ClockDomain& domain,
                                        std::unique_ptr<Behaviour> behaviour, const RenderState& state, unsigned gpcs,
                                        Transport transport)>;

/// Registered by each module for its slot.
void register_timed_unit_maker(const std::string& slot, TimedUnitMaker maker);
const TimedUnitMaker& timed_unit_maker(const std::string& slot);

}  // namespace vrpipe
