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

/// Units and ports of the fidelity `lt`: the behaviours, latencies and queue depths of `cycle`, but the passage of an item
/// is computed instead of clocked, and a batch moves in one piece (batch.h). A unit has a handler for each input, which is
/// given an item and the cycles in which it becomes visible, reserves the unit's resources from then on, sends what comes
/// of the item, and returns the cycles in which the item leaves the queue.
///
/// A transfer is a b_transport call annotated (in its payload, in cycles) with when the item is offered and, on return,
/// when it was taken: as soon as the item as many places ahead as the queue is deep has left it. Calls nest, so that what
/// one vertex warp leads to runs down to its last blend at once; only termination updates wait for their time.

namespace vrpipe {

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
    if (used_ > per_cycle_.value()) {
      const std::uint64_t cycles = per_cycle_.quotient(used_ - 1);
      cycle_ += cycles;
      used_ -= cycles * per_cycle_.value();
    }
    return {first, cycle_};
  }
  /// Nothing goes before this cycle any more.
  void hold(Cycle cycle) {
    if (cycle <= cycle_) return;
    cycle_ = cycle;
    used_ = 0;
  }
  /// What was taken last goes in this cycle instead, if it is later.
  void postpone(Cycle cycle) { cycle_ = std::max(cycle_, cycle); }
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

/// So many places, each taken until a cycle that is known.
class SlotPool {
 public:
  explicit SlotPool(unsigned places) : free_(places) {}
  /// The first cycle from `at` on in which so many are free, at most as many as there are.
  Cycle free_from(Cycle at, unsigned places) {
    for (; free_ < places; taken_.pop()) {
      const Taken& next = taken_.front();
      if (const auto lacking = static_cast<unsigned>(places - free_); lacking < next.places)
        return std::max(at, CycleInterval(next.first, next.last).of_part(lacking - 1, next.places));
      free_ += next.places;
      at = std::max(at, next.last);
    }
    return at;
  }
  /// How many are free in a cycle, up to `most`.
  unsigned free_at(Cycle at, unsigned most) {
    for (; free_ < most && !taken_.empty() && taken_.front().last <= at; taken_.pop()) free_ += taken_.front().places;
    return static_cast<unsigned>(std::clamp<std::int64_t>(free_, 0, most));
  }
  /// Takes them, which `free_from` has said are free, until cycles that are spread over an interval.
  void take(unsigned places, CycleInterval until) {
    free_ -= places;
    taken_.push_in_order({places, until.first, until.last}, &Taken::last);
  }

 private:
  struct Taken {
    unsigned places = 0;
    Cycle first = 0;
    Cycle last = 0;
  };
  std::int64_t free_;  ///< less those of `taken_` that are free already
  Ring<Taken> taken_;  ///< in the order in which they are free
};

class TimedUnit : public Unit {
 public:
  using Unit::Unit;
  bool idle() const override { return true; }
  void close_account(Cycle end) override;

 protected:
  Cycle tick(Cycle) override { return never; }
  /// Charges the cycles not charged yet, up to `until`, to a state.
  void charge(UnitState state, Cycle until) {
    if (until <= charged_) return;
    enter(state, charged_);
    charged_ = until;
  }

 private:
  Cycle charged_ = 0;
};

template <class Item>
class TimedIn;

/// The sending end. As between clocked units, ends with nothing in between call each other directly.
template <class Item>
class TimedOut : public OutEnd<Item> {
 public:
  using OutEnd<Item>::OutEnd;
  using OutEnd<Item>::connect;
  void connect(InPort& in, const LinkOptions& options) override;

  /// Sends an item whose parts are there in the cycles `at`, and which takes the link for so many. `joins`: its first part
  /// goes with the last one of the item before it, beside which it takes the link; with 0 beats all of it. Returns the cycles in
  /// which it is taken.
  [[gnu::always_inline]] CycleInterval send(const Item& item, CycleInterval at, unsigned beats = 1,
                                            bool joins = false) {
    if (this->limited_) at = limited(at, beats, joins);
    ++this->transferred_;
    at = direct_ != nullptr ? direct_->offer(item, at, beats, joins, this->pipeline_.cycles)
                            : call(item, at, beats, joins);
    last_ = at.last;
    return at;
  }
  /// Sends an item out of the order of time, which takes no place of the queue: it neither waits for others, nor do they for it.
  void send_beside(const Item& item, CycleInterval at) {
    if (this->limited_) at = limited(at, 0, false);
    ++this->transferred_;
    direct_ != nullptr ? direct_->offer(item, at, 0, false, this->pipeline_.cycles) : call(item, at, 0, false);
  }
  /// The cycle in which the last part of the last item was taken.
  Cycle last() const { return last_; }
  /// From when on there is room for another item.
  Cycle room_from() const { return end_ == nullptr ? 0 : end_->free_at_[end_->place_]; }
  /// The same for the one that comes so many later.
  Cycle room_from(std::uint64_t later) const {
    return end_ == nullptr ? 0 : end_->free_at_[(end_->place_ + later) % end_->depth_];
  }
  /// Whether that is known: the receiver is at lt.
  bool knows_room() const { return end_ != nullptr; }
  /// Of a unit that keeps items until it knows all that could go before them: sends those that go before a cycle, up to
  /// which the receiver knows that.
  void on_asked(std::function<void(Cycle until)> send) { asked_ = std::move(send); }
  bool can_be_asked() const { return asked_ != nullptr; }
  void ask(Cycle until) { asked_(until); }

 private:
  friend class TimedIn<Item>;
  using OutEnd<Item>::clock_;

  /// Through the socket; returns when it is taken.
  CycleInterval call(const Item& item, CycleInterval at, unsigned beats, bool joins) {
    StreamPayload<Item> payload;
    payload.item = &item;
    payload.latency = this->pipeline_.cycles;
    payload.at = at.first;
    payload.last = at.last;
    payload.beats = beats;
    payload.joins = joins;
    sc_core::sc_time delay;
    this->socket->b_transport(payload, delay);
    return {payload.at, payload.last};
  }
  /// When the link passes an item, between random stalls and at its rate, of which a part that joins another item takes nothing.
  [[gnu::noinline]] CycleInterval limited(CycleInterval at, unsigned beats, bool joins) {
    for (; this->stalled_at(at.first); ++at.first) at.last = std::max(at.last, at.first + 1);
    if (!rate_ || beats == 0) return at;
    const Cycle earliest = at.first + (joins ? 1 : 0);
    const CycleInterval passes = rate_->take(earliest, beats);
    const Cycle later = passes.first - earliest;
    return {joins ? at.first : passes.first, std::max(passes.last, at.last + later)};
  }
  tlm::tlm_sync_enum nb_transport_bw(StreamPayload<Item>&, StreamPhase&, sc_core::sc_time&) override {
    this->fault(this->socket, "nb_transport on a link of a unit at lt");
    return tlm::TLM_ACCEPTED;
  }
  void unlimited() override {}

  TimedIn<Item>* direct_ = nullptr;
  TimedIn<Item>* end_ = nullptr;  ///< also where a socket is between
  std::function<void(Cycle until)> asked_;
  std::optional<ThroughputPort> rate_;
  Cycle last_ = 0;
};

/// The receiving end, with its queue.
template <class Item>
class TimedIn : public InEnd<Item> {
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

  /// The parts of an item, where its unit takes them one by one: each comes when there is a place for it, as those before it
  /// leave.
  class Parts {
   public:
    unsigned count() const { return beats_; }
    /// When part `index` becomes visible; those before it have left.
    Cycle visible(unsigned index) {
      if (index == 0) {
        taken_.first = taken_.last = std::max(at_.first, free_at());
      } else {
        taken_.last = std::max({taken_.last + 1, at_.of_part(index, beats_), free_at()});
      }
      return in_.visible(taken_.last, pipeline_).first;
    }
    /// The part that was asked for last leaves the queue.
    void leave(Cycle at) {
      in_.free_at_[in_.place_] = at + 1;
      in_.place_ = in_.place_ + 1 == in_.depth_ ? 0 : in_.place_ + 1;
    }

   private:
    friend class TimedIn;
    Parts(TimedIn& in, CycleInterval at, unsigned beats, Cycle pipeline)
        : in_(in), at_(at), beats_(beats), pipeline_(pipeline) {}
    Cycle free_at() const { return in_.free_at_[in_.place_]; }
    TimedIn& in_;
    const CycleInterval at_;
    const unsigned beats_;
    const Cycle pipeline_;
    CycleInterval taken_;
  };

  TimedIn(TimedUnit& owner, const std::string& name, Handler handler) : InEnd<Item>(owner, name), handler_(handler) {
    TimedIn::configure(4, 1);
  }
  /// Of a unit that takes items by parts, all of them, one after the other.
  using ByParts = std::function<void(const Item&, Parts&)>;
  TimedIn(TimedUnit& owner, const std::string& name, ByParts take)
      : TimedIn(owner, name, Handler([](const Item&, CycleInterval visible) { return visible; })) {
    take_ = std::move(take);
  }

  void configure(unsigned depth, unsigned latency) override {
    depth_ = depth;
    latency_ = latency;
    free_at_.assign(depth, 0);
    place_ = 0;
  }
  void open() override {}
  bool empty() const override { return true; }
  /// Asks for what goes before a cycle, if the other end keeps anything (TimedOut::on_asked).
  void ask(Cycle until) {
    if (begin_ != nullptr && begin_->asked_) begin_->asked_(until);
  }

 private:
  friend class TimedOut<Item>;

  [[gnu::always_inline]] CycleInterval visible(CycleInterval at, Cycle pipeline) const {
    const Cycle latency = latency_ + pipeline;
    CycleInterval span(at.first + latency, at.last + latency);
    for (; this->stalled_at(span.first); ++span.first) span.last = std::max(span.last, span.first + 1);
    return span;
  }

  void b_transport(StreamPayload<Item>& payload, sc_core::sc_time&) override {
    const CycleInterval taken =
        offer(*payload.item, {payload.at, payload.last}, payload.beats, payload.joins, payload.latency);
    payload.at = taken.first;
    payload.last = taken.last;
  }
  /// Takes an item; returns when.
  [[gnu::always_inline]] CycleInterval offer(const Item& item, CycleInterval at, unsigned beats, bool joins,
                                             Cycle pipeline) {
    if (take_) return offer_parts(item, at, beats, pipeline);
    std::size_t place = place_;
    if (beats == 0) {
      const Cycle left = handler_(item, visible(at, pipeline)).last;
      Cycle& free_at = free_at_[place == 0 ? depth_ - 1 : place - 1];
      if (joins) free_at = std::max(free_at, left + 1);
      return at;
    }
    if (joins) {
      at.last = std::max(at.last, free_at_[place]);
    } else if (free_at_[place] > at.first) {
      at.last += free_at_[place] - at.first;
      at.first = free_at_[place];
    }
    if (beats == 1) {
      place_ = place + 1 == depth_ ? 0 : place + 1;
      free_at_[place] = handler_(item, visible(at, pipeline)).last + 1;
      return at;
    }
    if (beats > depth_) return offer_in_rounds(item, at, beats, pipeline);
    std::size_t last_place = place + beats - 1;
    if (last_place >= depth_) last_place -= depth_;
    at.last = std::max(at.last, free_at_[last_place]);
    const CycleInterval left = handler_(item, visible(at, pipeline));
    const bool one_a_cycle = left.last - left.first + 1 == beats;
    for (unsigned beat = 0; beat < beats; ++beat) {
      free_at_[place] = (one_a_cycle ? left.first + beat : left.of_part(beat, beats)) + 1;
      place = place + 1 == depth_ ? 0 : place + 1;
    }
    place_ = place;
    return at;
  }
  CycleInterval offer_parts(const Item& item, CycleInterval at, unsigned beats, Cycle pipeline) {
    Parts parts(*this, at, beats, pipeline);
    take_(item, parts);
    return parts.taken_;
  }
  /// Parts that the queue has no place for at first follow when the item's own first parts have left: at best at once.
  [[gnu::noinline]] CycleInterval offer_in_rounds(const Item& item, CycleInterval at, unsigned beats, Cycle pipeline) {
    const CycleInterval offered = at;
    const std::size_t first = place_;
    Cycle last = at.first;
    for (unsigned beat = 0; beat < beats; ++beat) {
      last = std::max({last, offered.of_part(beat, beats), free_at_[place_]});
      free_at_[place_] = last + latency_ + pipeline + 1;
      place_ = place_ + 1 == depth_ ? 0 : place_ + 1;
    }
    at.last = last;
    const CycleInterval left = handler_(item, visible(at, pipeline));
    std::size_t place = first;
    for (unsigned beat = 0; beat < beats; ++beat) {
      free_at_[place] = std::max(free_at_[place], left.of_part(beat, beats) + 1);
      place = place + 1 == depth_ ? 0 : place + 1;
    }
    at.last = std::max(at.last, left.of_part(beats - depth_ - 1, beats) + 1);
    return at;
  }

  tlm::tlm_sync_enum nb_transport_fw(StreamPayload<Item>&, StreamPhase&, sc_core::sc_time&) override {
    this->fault(this->socket, "nb_transport on a link of a unit at lt");
    return tlm::TLM_ACCEPTED;
  }

  Handler handler_;
  ByParts take_;  ///< instead
  TimedOut<Item>* begin_ = nullptr;
  unsigned depth_ = 4;
  unsigned latency_ = 1;
  std::vector<Cycle> free_at_;  ///< when each place of the queue can be filled, a ring
  std::size_t place_ = 0;
};

template <class Item>
void TimedOut<Item>::connect(InPort& in, const LinkOptions& options) {
  OutEnd<Item>::connect(in, options);
  if (options.items_per_cycle != 0) rate_.emplace(options.items_per_cycle);
  this->limited_ = this->limited_ || rate_;
  end_ = dynamic_cast<TimedIn<Item>*>(&in);
  if (end_ != nullptr) end_->begin_ = this;
  if (end_ != nullptr && options.observers.empty() && !clock_.domain->passes_sockets()) direct_ = end_;
}

/// As for `cycle` (unit.h): registered by each timing model for its slot.
void register_timed_unit_maker(const std::string& slot, UnitMaker maker);
const UnitMaker& timed_unit_maker(const std::string& slot);
/// Whether a slot has one. At lt a unit of another is simulated at `cycle` (border.h).
bool has_timed_unit_maker(const std::string& slot);

}  // namespace vrpipe
