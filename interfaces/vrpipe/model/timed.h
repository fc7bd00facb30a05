#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <vrpipe/arithmetic/divisor.h>
#include <vrpipe/kernel/link.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/timed_memory_port.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/batch.h>

/// Units and ports of the fidelities `lt` and `at`: the behaviours, latencies and queue depths of `cycle`, but the passage
/// of an item is computed instead of clocked, and a batch moves in one piece (batch.h). A unit has a handler for each
/// input, which is given an item and the cycles in which it becomes visible, reserves the unit's resources from then on,
/// sends what comes of the item, and returns the cycles in which the item leaves the queue. One handler serves both
/// fidelities; the ports differ:
///
/// - `lt`, blocking: a transfer is a b_transport call annotated (in its payload, in cycles) with when the item is offered
///   and, on return, when it was taken: as soon as the item as many places ahead as the queue is deep has left it. Calls
///   nest, so that what one vertex warp leads to runs down to its last blend at once; only termination updates wait for
///   their time.
/// - `at`, non-blocking: transfers and credits are nb_transport calls annotated with their cycle. An item waits in its
///   queue until its cycle comes and whatever its unit sends has found room. Units are activated in the order of time.

namespace vrpipe {

enum class Transport : std::uint8_t { blocking, non_blocking };

/// At `at`, units are activated in cycles so far apart, and take what becomes visible until the next: bursts cost one
/// activation. Times stay exact; what depends on their order (a termination update before a test) may be off by as much.
/// Shallower queues, which would move no more than their depth in that time, are served as items and credits come.
constexpr Cycle activation_cycles = 8;
/// The cycle in which what is wanted for a cycle is activated; later than `now`.
constexpr Cycle activation_for(Cycle wanted, Cycle now) {
  return wanted == never ? never : std::max(wanted, now + activation_cycles) / activation_cycles * activation_cycles;
}

/// The cycles in which the first and the last part of an item move.
struct CycleInterval {
  CycleInterval() = default;
  CycleInterval(Cycle cycle) : first(cycle), last(cycle) {}  ///< an item that moves in one cycle
  CycleInterval(Cycle begin, Cycle end) : first(begin), last(end) {}
  /// When part `index` of `parts` moves, if they are spread evenly.
  Cycle of_part(unsigned index, unsigned parts) const {
    if (last == first || index == 0) return first;
    if (last - first + 1 == parts) return first + index;
    return first + (last - first) * index / (parts - 1);
  }
  Cycle first = 0;
  Cycle last = 0;
};

/// A resource that takes so many items a cycle, in order. An item that is wider than a cycle takes several.
class IssuePort {
 public:
  explicit IssuePort(unsigned per_cycle = 1) : per_cycle_(std::max(per_cycle, 1U)), left_(per_cycle_.value()) {}
  /// Reserves; returns the cycle in which the item goes.
  Cycle take(Cycle earliest, unsigned width = 1) {
    hold(earliest);
    if (width > left_ && left_ < per_cycle_.value()) next_cycle(1);
    const Cycle taken = cycle_;
    if (width < left_) {
      left_ -= width;
    } else {
      next_cycle(per_cycle_.quotient_up(width));
    }
    return taken;
  }
  /// Nothing goes before this cycle any more.
  void hold(Cycle cycle) {
    if (cycle > cycle_) next_cycle(cycle - cycle_);
  }
  /// Reserves a whole cycle; returns it.
  Cycle take_cycle(Cycle earliest) { return take(earliest, static_cast<unsigned>(per_cycle_.value())); }
  /// The first cycle of which nothing is taken.
  Cycle next_free() const { return cycle_ + (left_ < per_cycle_.value() ? 1 : 0); }

 private:
  void next_cycle(Cycle cycles) {
    cycle_ += cycles;
    left_ = per_cycle_.value();
  }
  Divisor per_cycle_;
  std::uint64_t left_;
  Cycle cycle_ = 0;
};

/// A resource that takes so many parts a cycle; the parts of an item may go in neighbouring cycles.
class ThroughputPort {
 public:
  explicit ThroughputPort(unsigned per_cycle) : per_cycle_(std::max(per_cycle, 1U)) {}
  /// Reserves; returns the cycles in which the first and the last part go.
  CycleInterval take(Cycle earliest, unsigned parts) {
    hold(earliest);
    if (parts == 0) return cycle_;
    const Cycle first = next();
    used_ += parts;
    const std::uint64_t cycles = per_cycle_.quotient(used_ - 1);
    cycle_ += cycles;
    used_ -= cycles * per_cycle_.value();
    return {first, cycle_};
  }
  /// Nothing goes before this cycle any more.
  void hold(Cycle cycle) {
    if (cycle <= cycle_) return;
    cycle_ = cycle;
    used_ = 0;
  }
  /// Cycles that so many parts fill, from the beginning of one.
  unsigned cycles(unsigned parts) const { return static_cast<unsigned>(per_cycle_.quotient_up(parts)); }
  /// The cycle in which the next part goes.
  Cycle next() const { return cycle_ + (used_ == per_cycle_.value() ? 1 : 0); }
  /// Parts that have gone in a cycle, which is `next()` or later.
  std::uint64_t taken_of(Cycle cycle) const { return cycle == cycle_ ? used_ : 0; }

 private:
  Divisor per_cycle_;
  std::uint64_t used_ = 0;  ///< parts of `cycle_`
  Cycle cycle_ = 0;
};

/// The way of batches through a unit, so many items a cycle: a batch begins in a cycle of its own, when its first items
/// have come, and does not end before its last.
class BatchServer {
 public:
  explicit BatchServer(unsigned per_cycle) : per_cycle_(std::max(per_cycle, 1U)) {}
  /// Cycles that so many items take.
  unsigned cycles(unsigned items) const { return std::max(static_cast<unsigned>(per_cycle_.quotient_up(items)), 1U); }
  CycleInterval take(CycleInterval visible, unsigned items) {
    const Cycle first = std::max(visible.first, free_at_);
    const CycleInterval span(first, std::max(first + cycles(items) - 1, visible.last));
    free_at_ = span.last + 1;
    return span;
  }
  /// Nothing goes before this cycle any more.
  void hold(Cycle cycle) { free_at_ = std::max(free_at_, cycle); }

 private:
  Divisor per_cycle_;
  Cycle free_at_ = 0;
};

/// So many places, each taken until a cycle that is known, and freed in the order in which they were taken.
class SlotPool {
 public:
  explicit SlotPool(unsigned places) : free_(places) {}
  /// The first cycle from `at` on in which so many are free, at most as many as there are.
  Cycle free_from(Cycle at, unsigned places) {
    for (; free_ < places; taken_.pop()) {
      free_ += taken_.front().places;
      at = std::max(at, taken_.front().until);
    }
    return at;
  }
  void take(unsigned places, Cycle until) {
    free_ -= places;
    taken_.push({places, until});
  }

 private:
  struct Taken {
    unsigned places = 0;
    Cycle until = 0;
  };
  unsigned free_;
  Ring<Taken> taken_;
};

/// What a unit's activation sees of its inputs.
class TimedInput {
 public:
  virtual ~TimedInput() = default;
  /// Handles the items visible up to a cycle, as long as they can be; false if there was none.
  virtual bool serve(Cycle until) = 0;
  /// Whether the first item can be handled.
  virtual bool may_serve() const = 0;
  /// When the first item is visible; `never` if none is there.
  Cycle front() const { return front_; }

 protected:
  Cycle front_ = never;
};

/// What a unit's activation sees of its outputs.
class TimedOutput {
 public:
  virtual ~TimedOutput() = default;
  /// Whether as much that was sent waits for room as may.
  bool blocked() const { return waiting_items_ > may_wait_; }
  /// Whether one more would be too many: then what was sent before all that waits has gone.
  bool full() const { return waiting_items_ == may_wait_; }
  /// Whether nothing waits.
  bool clear() const { return waiting_items_ == 0; }
  /// The unit may send so many more items while one waits: a buffer of its own in front of the port.
  void set_buffer(std::size_t items) { may_wait_ = items; }

 protected:
  std::size_t waiting_items_ = 0;

 private:
  std::size_t may_wait_ = 0;
};

class TimedUnit : public Unit {
 public:
  TimedUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::vector<WorkKind> work, Transport transport)
      : Unit(name, domain, std::move(work)), transport_(transport) {}

  Transport transport() const { return transport_; }
  bool blocking() const { return transport_ == Transport::blocking; }
  bool idle() const override;
  void close_account(Cycle end) override;

 protected:
  template <class>
  friend class TimedIn;
  template <class>
  friend class TimedOut;

  /// Non-blocking: what the unit does by itself up to a cycle, for instance work that waited for room. Called at each
  /// activation, after the inputs; returns the cycle in which it is to be called again.
  virtual Cycle advance(Cycle /*until*/) { return never; }
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

template <class Item>
class TimedIn;

/// The sending end. As between clocked units, ends with nothing in between call each other directly.
template <class Item>
class TimedOut : public OutEnd<Item>, public TimedOutput {
 public:
  TimedOut(TimedUnit& owner, const std::string& name)
      : OutEnd<Item>(owner, name), blocking_(owner.transport() == Transport::blocking) {
    owner.outputs_.push_back(this);
  }

  using OutEnd<Item>::connect;
  void connect(InPort& in, const LinkOptions& options) override;

  /// Sends an item whose parts are there in the cycles `at`, and which takes the link for so many. Returns the cycles in
  /// which it is taken; `at`, if it has to wait and nobody knows yet how long: then the port is not `clear`.
  CycleInterval send(const Item& item, CycleInterval at, unsigned beats = 1) {
    for (; this->stalled_at(at.first); ++at.first) at.last = std::max(at.last, at.first + 1);
    if (rate_) at = limited(at, beats);
    if (!blocking_ && !unlimited_ && (waiting_items_ > 0 || credits_.empty())) {
      waiting_.push({item, at, beats});
      ++waiting_items_;
      return at;
    }
    return transfer(item, at, beats);
  }
  /// At `at`: the cycle in which the last item of which nothing waits was taken.
  Cycle gone() const { return gone_; }
  /// The cycle in which the last part of the last item was taken.
  Cycle last() const { return last_; }
  /// From when on there is room for another item; `never`, if nobody knows yet: then the unit is activated once it is
  /// known.
  Cycle room_from() {
    if (unlimited_) return 0;
    if (blocking_) return end_ == nullptr ? 0 : end_->free_at_[end_->place_];
    if (!credits_.empty()) return credits_.front();
    room_wanted_ = true;
    return never;
  }

 private:
  friend class TimedIn<Item>;
  using OutEnd<Item>::clock_;

  CycleInterval transfer(const Item& item, CycleInterval at, unsigned beats) {
    ++this->transferred_;
    if (blocking_) {
      at = direct_ != nullptr ? direct_->offer(item, at, beats, this->pipeline_) : call(item, at, beats);
      last_ = at.last;
      return at;
    }
    if (!unlimited_) {
      const Cycle begin = std::max(at.first, credits_.front());
      at.last = std::max(at.last, begin + (at.last - at.first));
      at.first = begin;
      // What the queue has no place for yet follows when it has: nobody knows when, but the next item waits for it.
      for (unsigned beat = 0; beat < beats; ++beat) {
        if (credits_.empty()) {
          owed_ = beats - beat;
          ++waiting_items_;
          break;
        }
        at.last = std::max(at.last, credits_.front());
        credits_.pop();
      }
    }
    last_ = at.last;
    if (owed_ == 0) gone_ = last_;
    if (direct_ != nullptr) {
      direct_->accept(item, at, beats, this->pipeline_);
    } else {
      call(item, at, beats);
    }
    return at;
  }
  /// Through the socket; returns, from a blocking call, when it is taken.
  CycleInterval call(const Item& item, CycleInterval at, unsigned beats) {
    StreamPayload<Item> payload;
    payload.item = &item;
    payload.latency = this->pipeline_;
    payload.at = at.first;
    payload.last = at.last;
    payload.beats = beats;
    sc_core::sc_time delay;
    if (blocking_) {
      this->socket->b_transport(payload, delay);
    } else {
      StreamPhase phase = StreamPhase::transfer;
      this->socket->nb_transport_fw(payload, phase, delay);
    }
    return {payload.at, payload.last};
  }

  tlm::tlm_sync_enum nb_transport_bw(StreamPayload<Item>& payload, StreamPhase&, sc_core::sc_time&) override {
    give(payload.credits, {payload.at, payload.last});
    return tlm::TLM_ACCEPTED;
  }
  void give(unsigned credits, CycleInterval at) {
    const bool was_waiting = waiting_items_ > 0 || room_wanted_;
    for (unsigned credit = 0; credit < credits; ++credit) {
      const Cycle cycle = at.of_part(credit, credits);
      if (owed_ > 0) {
        last_ = std::max(last_, cycle);
        if (--owed_ == 0) {
          --waiting_items_;
          gone_ = last_;
        }
      } else {
        credits_.push(cycle);
      }
    }
    room_wanted_ = false;
    while (!waiting_.empty() && owed_ == 0 && !credits_.empty()) {
      const Waiting& next = waiting_.front();
      transfer(next.item, next.at, next.beats);
      waiting_.pop();
      --waiting_items_;
    }
    if (was_waiting && !blocked()) {
      const Cycle now = clock_.domain->now();
      clock_.domain->wake(clock_.unit, prompt_ ? now + 1 : activation_for(now, now));
    }
  }
  void unlimited() override { unlimited_ = true; }
  /// When the link passes an item, at its rate.
  CycleInterval limited(CycleInterval at, unsigned beats) {
    const CycleInterval passes = rate_->take(at.first, beats);
    return {passes.first, std::max(passes.last, at.last + (passes.first - at.first))};
  }

  struct Waiting {
    Item item;
    CycleInterval at;
    unsigned beats;
  };
  const bool blocking_;
  TimedIn<Item>* direct_ = nullptr;
  TimedIn<Item>* end_ = nullptr;  ///< also where a socket is between
  std::optional<ThroughputPort> rate_;
  bool unlimited_ = false;
  bool prompt_ = false;
  bool room_wanted_ = false;
  unsigned owed_ = 0;  ///< places that sent items take and the queue has not had yet
  Cycle last_ = 0;
  Cycle gone_ = 0;
  Ring<Cycle> credits_;  ///< the cycle from which each can be used
  Ring<Waiting> waiting_;
};

/// The receiving end, with its queue.
template <class Item>
class TimedIn : public InEnd<Item>, public TimedInput {
 public:
  /// Given an item and the cycles in which its parts become visible, returns those in which they leave the queue. Made
  /// of a lambda that captures little more than its unit; spans go in registers, as they do not to a std::function.
  class Handler {
   public:
    template <class Function>
    Handler(Function function)
        : call_([](const void* captured, const Item& item, CycleInterval visible) -> CycleInterval {
            return (*static_cast<const Function*>(captured))(item, visible);
          }) {
      static_assert(sizeof(Function) <= sizeof(captured_) && std::is_trivially_copyable_v<Function>);
      new (captured_) Function(function);
    }
    CycleInterval operator()(const Item& item, CycleInterval visible) const { return call_(captured_, item, visible); }

   private:
    alignas(void*) unsigned char captured_[2 * sizeof(void*)];
    CycleInterval (*call_)(const void*, const Item&, CycleInterval);
  };

  /// @param sends_to  the handler is called while none of these is blocked
  TimedIn(TimedUnit& owner, const std::string& name, Handler handler, std::vector<TimedOutput*> sends_to = {})
      : InEnd<Item>(owner, name),
        blocking_(owner.transport() == Transport::blocking),
        handler_(handler),
        sends_to_(std::move(sends_to)) {
    owner.inputs_.push_back(this);
    TimedIn::configure(4, 1);
  }

  /// A further condition for the handler to be called.
  void set_gate(std::function<bool()> gate) { gate_ = std::move(gate); }

  void configure(unsigned depth, unsigned latency) override {
    latency_ = latency;
    depth_ = depth;
    prompt_ = depth < activation_cycles;
    free_at_.assign(blocking_ ? depth : 0, 0);
    place_ = 0;
  }
  void open() override {
    if (!blocking_ && !this->is_stub()) grant(depth_, 0);
  }
  bool empty() const override { return queue_.empty(); }

  bool serve(Cycle until) override {
    bool served = false;
    while (front_ <= until && TimedIn::may_serve()) {
      const Entry& entry = queue_.front();
      const unsigned beats = entry.beats;
      const CycleInterval left = handler_(entry.item, entry.visible);
      queue_.pop();
      front_ = queue_.empty() ? never : queue_.front().visible.first;
      queued_beats_ -= beats;
      grant(beats, beats == 1 ? CycleInterval(left.last + 1) : CycleInterval(left.first + 1, left.last + 1));
      served = true;
    }
    return served;
  }
  bool may_serve() const override {
    for (const TimedOutput* out : sends_to_) {
      if (out->blocked()) return false;
    }
    return !gate_ || gate_();
  }

 private:
  friend class TimedOut<Item>;
  using InEnd<Item>::clock_;
  struct Entry {
    CycleInterval visible;
    unsigned beats = 1;
    Item item;
  };

  CycleInterval visible(CycleInterval at, Cycle pipeline) const {
    const Cycle latency = latency_ + pipeline;
    CycleInterval span(at.first + latency, at.last + latency);
    for (; this->stalled_at(span.first); ++span.first) span.last = std::max(span.last, span.first + 1);
    return span;
  }

  void grant(unsigned credits, CycleInterval at) {
    if (direct_ != nullptr) return direct_->give(credits, at);
    StreamPayload<Item> payload;
    payload.credits = credits;
    payload.at = at.first;
    payload.last = at.last;
    StreamPhase phase = StreamPhase::credit;
    sc_core::sc_time delay;
    this->socket->nb_transport_bw(payload, phase, delay);
  }

  void b_transport(StreamPayload<Item>& payload, sc_core::sc_time&) override {
    const CycleInterval taken = offer(*payload.item, {payload.at, payload.last}, payload.beats, payload.latency);
    payload.at = taken.first;
    payload.last = taken.last;
  }
  /// Blocking: takes an item; returns when.
  CycleInterval offer(const Item& item, CycleInterval at, unsigned beats, Cycle pipeline) {
    std::size_t place = place_;
    if (free_at_[place] > at.first) {
      at.last += free_at_[place] - at.first;
      at.first = free_at_[place];
    }
    if (beats == 1) {
      place_ = place + 1 == depth_ ? 0 : place + 1;
      free_at_[place] = handler_(item, visible(at, pipeline)).last + 1;
      return at;
    }
    // Parts that the queue has no place for at first follow when the item's own first parts have left.
    std::size_t last_place = place + std::min(beats, depth_) - 1;
    if (last_place >= depth_) last_place -= depth_;
    at.last = std::max(at.last, free_at_[last_place]);
    const CycleInterval left = handler_(item, visible(at, pipeline));
    for (unsigned beat = 0; beat < beats; ++beat) {
      free_at_[place] = left.of_part(beat, beats) + 1;
      place = place + 1 == depth_ ? 0 : place + 1;
    }
    place_ = place;
    if (beats > depth_) at.last = std::max(at.last, left.of_part(beats - depth_ - 1, beats) + 1);
    return at;
  }

  tlm::tlm_sync_enum nb_transport_fw(StreamPayload<Item>& payload, StreamPhase&, sc_core::sc_time&) override {
    accept(*payload.item, {payload.at, payload.last}, payload.beats, payload.latency);
    return tlm::TLM_ACCEPTED;
  }
  /// Non-blocking: queues an item.
  void accept(const Item& item, CycleInterval at, unsigned beats, Cycle pipeline) {
    if (queued_beats_ >= depth_) this->fault(this->socket, "an item arrived at a full queue");
    queued_beats_ += beats;
    const CycleInterval seen = visible(at, pipeline);
    Entry& entry = queue_.push();
    entry.visible = seen;
    entry.beats = beats;
    entry.item = item;
    if (front_ == never) front_ = seen.first;
    const Cycle now = clock_.domain->now();
    clock_.domain->wake(clock_.unit, prompt_ ? std::max(seen.first, now + 1) : activation_for(seen.first, now));
  }

  const bool blocking_;
  TimedOut<Item>* direct_ = nullptr;
  Handler handler_;
  std::vector<TimedOutput*> sends_to_;
  std::function<bool()> gate_;
  bool prompt_ = true;
  unsigned depth_ = 4;
  unsigned latency_ = 1;
  std::vector<Cycle> free_at_;  ///< blocking: when each place of the queue can be filled, a ring
  std::size_t place_ = 0;
  Ring<Entry> queue_;  ///< non-blocking
  unsigned queued_beats_ = 0;
};

template <class Item>
void TimedOut<Item>::connect(InPort& in, const LinkOptions& options) {
  OutEnd<Item>::connect(in, options);
  if (options.items_per_cycle != 0) rate_.emplace(options.items_per_cycle);
  // What is on its way through the pipeline in front of the link takes no place of the queue.
  prompt_ = options.depth < activation_cycles;
  auto* const end = dynamic_cast<TimedIn<Item>*>(&in);
  if (end == nullptr) return;
  end->prompt_ = prompt_;
  end_ = end;
  if (!options.observers.empty() || clock_.domain->passes_sockets()) return;
  direct_ = end;
  end->direct_ = this;
}

/// Makes the timing model of a slot for `lt` or `at` around a functional model.
using TimedUnitMaker =
    std::function<std::unique_ptr<Unit>(const std::string& name, ClockDomain& domain,
                                        std::unique_ptr<Behaviour> behaviour, const RenderContext& context,
                                        unsigned gpcs, Transport transport)>;

/// Registered by each timing model for its slot. A second one for a slot is a problem of the registry's.
void register_timed_unit_maker(const std::string& slot, TimedUnitMaker maker);
const TimedUnitMaker& timed_unit_maker(const std::string& slot);

}  // namespace vrpipe
