#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <systemc>

#include <vrpipe/kernel/link.h>
#include <vrpipe/kernel/local_clock.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/model/crossing.h>
#include <vrpipe/model/timed.h>

/// A unit at `cycle` among others at `lt`. At lt calls nest: what one vertex warp leads to runs down to its last blend at once,
/// and who sends an item is told when it is taken. So the unit has a local clock, which runs ahead as these calls do: an item
/// that is offered to it advances that clock until there is room, and what it sends is offered to the others behind each edge.
///
/// Two kinds of ports are used in another time than the rest. What comes back from later in the pipeline is known long before
/// its time (InPort::set_comes_ahead, set_answers): it waits for that, and who sends it does not wait for the queue. And where
/// a unit stands twice on the way of the same quads, one way is used earlier than the other (Lane).

namespace vrpipe {

/// From an input of a unit to an output, in order and one for one (InPort::set_passes_to). The local clock may be ahead of those
/// who send and receive there, by what the unit's other ports are used for: then an item passes late, and is handed on as if it
/// had not.
class Lane {
 public:
  /// Items that it holds at most, in the input's queue and in the unit; before the first.
  void set_size(std::uint64_t items) { size_ = items; }
  /// When the item of a number, from 0, that is offered in a cycle is taken, for who sends it: when that has left whose place
  /// it takes.
  Cycle taken(std::uint64_t item, Cycle at) const;
  /// It goes in, in a cycle of the local clock.
  void enters(std::uint64_t item, Cycle at, Cycle local) { late_.push(local - std::min(local, taken(item, at))); }
  /// There is room for another that comes out: since a cycle for those who receive it, told in one of the local clock.
  void has_room(Cycle since, Cycle told) { rooms_.push({since, told}); }
  /// The next comes out, in a cycle of the local clock; returns the one for those who receive it.
  Cycle leaves(Cycle local);

 private:
  struct Room {
    Cycle since = 0;
    Cycle told = 0;
  };
  Ring<Cycle> late_;
  Ring<Room> rooms_;
  Ring<Cycle> left_at_;     ///< of the last items that have left, one more than it holds
  std::uint64_t left_ = 0;  ///< items
  std::uint64_t size_ = 0;
  Cycle last_local_ = 0;  ///< when the last has left
  Cycle last_at_ = 0;     ///< for those who receive it
};

/// The local clock of such a unit, and what stands at its ports.
class Border final : public LocalClock {
 public:
  /// At an output of the unit.
  class Exit {
   public:
    virtual ~Exit() = default;
    /// Before the first cycle.
    virtual void open() = 0;
    virtual const OutPort& unit_out() const = 0;
    /// Offers the first item that it holds; false if there is none, or it is at that already.
    virtual bool offer_first() = 0;
  };

  using LocalClock::LocalClock;

  /// What stands at a port.
  void keep(std::unique_ptr<sc_core::sc_module> at_port) { at_ports_.push_back(std::move(at_port)); }
  void add(Exit& exit) { exits_.push_back(&exit); }
  /// An input whose sender is to be asked for what it sends before each edge.
  void add_asked(std::function<void(Cycle edge)> ask) { asks_.push_back(std::move(ask)); }
  /// An input that follows an output (InPort::set_follows), of which a unit has one.
  void set_followed(const OutPort& out) { followed_ = &out; }
  Lane& make_lane(const OutPort& out) { return lanes_[&out]; }
  /// Null if no input passes all on to it.
  Lane* lane_to(const OutPort& out);
  void open();

  /// An exit holds items more, or less.
  void holds(int more) { held_ += more; }
  /// Makes room for what is offered to the unit. Throws SimulationFault naming who waits, if nothing is left to happen.
  void make_room(const char* who);
  /// Lets edges come before a cycle, or, for `never`, until `is_enough`: for one who asks for what comes of them. What is in lanes
  /// stays there, since it might wait for who asks.
  void advance_for(Cycle until, const std::function<bool()>& is_enough);
  /// While an item is offered to the input that follows an output, nothing is offered from that.
  void withhold(bool begins) { withholds_ = begins; }
  bool rouse() override;

 private:
  void before_edge(Cycle cycle) override;
  bool offer_held();
  bool offer_followed();

  std::vector<std::unique_ptr<sc_core::sc_module>> at_ports_;
  std::vector<Exit*> exits_;
  std::vector<std::function<void(Cycle)>> asks_;
  std::map<const OutPort*, Lane> lanes_;
  const OutPort* followed_ = nullptr;
  int held_ = 0;  ///< items, by all exits
  bool withholds_ = false;
  bool is_asked_ = false;
};

/// A link of which one end at least is of such a unit.
struct BorderLink {
  Border* from;  ///< null for a unit at lt
  PortOwner& sender;
  OutPort& out;
  Border* to;  ///< null for a unit at lt
  PortOwner& receiver;
  InPort& in;
};

/// At an input of the unit.
template <class Exact, class Loose>
class IntoCycle final : public Clocked, public sc_core::sc_module, public PortOwner {
 public:
  IntoCycle(const sc_core::sc_module_name& name, const BorderLink& link)
      : sc_module(name),
        PortOwner({link.to, link.to->attach(*this)}),
        in(*this),
        out(*this, "out"),
        border_(*link.to),
        sender_(link.sender),
        waits_(!link.in.comes_ahead()),
        follows_(link.in.follows() != nullptr),
        lane_(link.in.passes_to() == nullptr ? nullptr : &border_.make_lane(*link.in.passes_to())) {
    if (follows_) border_.set_followed(*link.in.follows());
  }

 private:
  class End final : public InEnd<Loose> {
   public:
    explicit End(IntoCycle& owner) : InEnd<Loose>(owner, "in"), owner_(owner) {}
    void configure(unsigned, unsigned) override {}
    void open() override {}
    bool empty() const override { return owner_.waiting_.empty(); }

   private:
    void b_transport(StreamPayload<Loose>& payload, sc_core::sc_time&) override { owner_.offer(payload); }
    tlm::tlm_sync_enum nb_transport_fw(StreamPayload<Loose>&, StreamPhase&, sc_core::sc_time&) override {
      this->fault(this->socket, "nb_transport from a unit at lt");
      return tlm::TLM_ACCEPTED;
    }
    IntoCycle& owner_;
  };

 public:
  End in;
  StreamOut<Exact> out;

  /// Whether one that is offered now need not wait.
  bool has_room() const { return !waits_ || waiting_.size() < out.next_credits(); }
  void connect(StreamIn<Exact>& unit_in, const LinkOptions& options) {
    out.connect(unit_in, options);
    if (lane_ != nullptr) lane_->set_size(std::uint64_t{unit_in.depth()} + unit_in.holds());
  }

 private:
  struct Waiting {
    Cycle at = 0;
    Exact item;
  };

  /// Tells when it is taken.
  void offer(StreamPayload<Loose>& payload) {
    const std::uint64_t first = offered_;
    Crossing<Exact, Loose>::into_cycle(*payload.item, {payload.at, payload.last}, payload.beats,
                                       [&](const Exact& item, Cycle at) {
                                         last_at_ = std::max(last_at_, at);
                                         if (payload.joins && !waiting_.empty() && waiting_.back().at == at &&
                                             Crossing<Exact, Loose>::join(waiting_.back().item, item))
                                           return;
                                         waiting_.push({last_at_, item});
                                         ++offered_;
                                       });
    if (first == offered_) return;
    border_.wake(clock.unit, waiting_.front().at);
    if (!waits_) return;
    ++sender_.sends_waiting;
    if (follows_) border_.withhold(true);
    first_awaited_ = first;
    border_.advance(last_at_);
    // What there is room for goes in its cycle, which need not have come: others may be offered in the same.
    while (waiting_.size() > out.next_credits()) border_.make_room(name());
    if (follows_) border_.withhold(false);
    --sender_.sends_waiting;
    if (lane_ != nullptr) {
      payload.at = lane_->taken(first, payload.at);
      payload.last = std::max(payload.at, lane_->taken(offered_ - 1, payload.last));
      return;
    }
    const Cycle next = border_.now() + 1;
    payload.at = std::max(payload.at, pushed_ > first ? first_pushed_at_ : next);
    payload.last = std::max(payload.last, pushed_ == offered_ ? pushed_at_ : next);
    if (!waiting_.empty()) last_at_ = waiting_.back().at = std::max(last_at_, next);
  }

  Cycle tick(Cycle now) override {
    for (; !waiting_.empty() && waiting_.front().at <= now; waiting_.pop()) {
      if (out.credits() == 0) return never;  // one wakes it
      out.push(waiting_.front().item);
      if (lane_ != nullptr) lane_->enters(pushed_, waiting_.front().at, now);
      if (pushed_++ == first_awaited_) first_pushed_at_ = now;
      pushed_at_ = now;
    }
    return waiting_.empty() ? never : waiting_.front().at;
  }

  Border& border_;
  PortOwner& sender_;
  const bool waits_;    ///< who sends waits for room
  const bool follows_;  ///< an output
  Lane* const lane_;    ///< that it leads into; null for none
  Ring<Waiting> waiting_;
  Cycle last_at_ = 0;
  std::uint64_t offered_ = 0;
  std::uint64_t pushed_ = 0;
  std::uint64_t first_awaited_ = 0;  ///< of the last offer
  Cycle first_pushed_at_ = 0;        ///< when that went in
  Cycle pushed_at_ = 0;
};

/// At an output of the unit.
template <class Exact, class Loose>
class OutOfCycle final : public Clocked, public sc_core::sc_module, public PortOwner, public Border::Exit {
 public:
  OutOfCycle(const sc_core::sc_module_name& name, const BorderLink& link)
      : sc_module(name),
        PortOwner({link.from, link.from->attach(*this)}),
        in(*this),
        out(*this, "out"),
        border_(*link.from),
        unit_out_(link.out),
        receiver_(link.receiver),
        is_work_(!link.in.comes_ahead()) {
    border_.add(*this);
    out.on_asked([this](Cycle until) {
      border_.advance_for(until, [this, sent = out.transferred()] { return out.transferred() > sent; });
    });
  }

 private:
  class End final : public InEnd<Exact> {
   public:
    explicit End(OutOfCycle& owner) : InEnd<Exact>(owner, "in"), owner_(owner) {}
    void configure(unsigned depth, unsigned) override { owner_.depth_ = depth; }
    void open() override {}
    bool empty() const override { return owner_.held_.empty(); }
    void give(unsigned credits) {
      StreamPayload<Exact> payload;
      payload.credits = credits;
      StreamPhase phase = StreamPhase::credit;
      sc_core::sc_time delay;
      this->socket->nb_transport_bw(payload, phase, delay);
    }

   private:
    tlm::tlm_sync_enum nb_transport_fw(StreamPayload<Exact>& payload, StreamPhase&, sc_core::sc_time&) override {
      owner_.held_.push({owner_.border_.now(), *payload.item});
      owner_.border_.holds(1);
      return tlm::TLM_ACCEPTED;
    }
    void b_transport(StreamPayload<Exact>&, sc_core::sc_time&) override {
      this->fault(this->socket, "b_transport from a unit at cycle");
    }
    OutOfCycle& owner_;
  };

 public:
  End in;
  TimedOut<Loose> out;

  void set_entry(const IntoCycle<Exact, Loose>& entry) { entry_ = &entry; }
  /// Where the receiver does not tell of its queue, being at cycle as well, there are few places on the way to that.
  void open() override {
    lane_ = border_.lane_to(unit_out_);
    const unsigned places = out.knows_room() ? depth_ : std::min(depth_, places_between_);
    for (unsigned place = 0; place < places; ++place) grant(0, 0);
  }
  const OutPort& unit_out() const override { return unit_out_; }
  bool offer_first() override {
    if (is_offering_ || held_.empty()) return false;
    if (border_.global().steps_locals() && might_wait()) return false;
    is_offering_ = true;
    const Held next = held_.front();
    held_.pop();
    border_.holds(-1);
    const Cycle left = lane_ != nullptr ? lane_->leaves(next.at) : next.at;
    crossing_.out_of_cycle(next.item, left, [&](const Loose& item, CycleInterval at, unsigned places) {
      at.first = std::max(at.first, out.last());
      at.last = std::max(at.last, at.first);
      out.send(item, at, places, places == 0);
      placed_ += places;
    });
    ++offered_;
    if (!out.knows_room()) free_at_.push(out.last());
    is_offering_ = false;
    grant_what_is_free(border_.now());
    return true;
  }

 private:
  static constexpr unsigned places_between_ = 4;
  struct Held {
    Cycle at = 0;
    Exact item;
  };

  /// Whether who goes on for another's sake might have to wait for that one.
  bool might_wait() const { return entry_ != nullptr ? !entry_->has_room() : is_work_ && receiver_.sends_waiting > 0; }
  void grant(Cycle free_at, Cycle now) {
    ++granted_;
    if (lane_ != nullptr) lane_->has_room(free_at, now);
    in.give(1);
  }
  /// Places that are free in a cycle; comes back when the next one is.
  void grant_what_is_free(Cycle now) {
    for (Cycle free_at = next_free(); free_at != never; free_at = next_free()) {
      // The credit is given when the item leaves, and there a cycle later.
      if (free_at > now + 1) return border_.wake(clock.unit, free_at - 1);
      if (!out.knows_room()) free_at_.pop();
      grant(free_at, now);
    }
  }
  /// From when on the next place can be filled that is not granted yet; `never` if that is not known.
  Cycle next_free() {
    if (!out.knows_room()) return free_at_.empty() ? never : free_at_.front() + 1;
    return granted_ < offered_ + depth_ ? out.room_from(granted_ - placed_) : never;
  }
  /// Not while an item is on its way, whose place is not known to be free or taken: then it is granted behind that.
  Cycle tick(Cycle now) override {
    if (!is_offering_) grant_what_is_free(now);
    return never;
  }

  Border& border_;
  const OutPort& unit_out_;
  const PortOwner& receiver_;
  const bool is_work_;  ///< for the receiver; at lt it takes what comes ahead while it waits, too
  const IntoCycle<Exact, Loose>* entry_ = nullptr;  ///< to a receiver at cycle
  Lane* lane_ = nullptr;                            ///< that leads here; null for none
  Crossing<Exact, Loose> crossing_;
  Ring<Held> held_;
  bool is_offering_ = false;
  unsigned depth_ = 4;         ///< of the receiver's queue
  std::uint64_t granted_ = 0;  ///< places
  std::uint64_t offered_ = 0;  ///< of them
  std::uint64_t placed_ = 0;   ///< of them, in the receiver's queue: those of a warp all at its end
  Ring<Cycle> free_at_;        ///< of places, where the receiver does not tell
};

/// Connects the ends; false if they do not carry these items.
template <class Exact, class Loose>
bool connect_across(const BorderLink& link, const LinkOptions& options) {
  auto* const exact_out = dynamic_cast<StreamOut<Exact>*>(&link.out);
  auto* const loose_out = dynamic_cast<TimedOut<Loose>*>(&link.out);
  auto* const exact_in = dynamic_cast<StreamIn<Exact>*>(&link.in);
  const bool sends = link.from != nullptr ? exact_out != nullptr : loose_out != nullptr;
  const bool receives = link.to != nullptr ? exact_in != nullptr : dynamic_cast<TimedIn<Loose>*>(&link.in) != nullptr;
  if (!sends || !receives) return false;
  const LinkOptions plain{options.depth, options.latency, 0, {}};
  TimedOut<Loose>* before = loose_out;
  OutOfCycle<Exact, Loose>* leaves = nullptr;
  if (link.from != nullptr) {
    auto exit = std::make_unique<OutOfCycle<Exact, Loose>>(sc_core::sc_gen_unique_name("border"), link);
    exact_out->connect(exit->in, plain);
    leaves = exit.get();
    before = &exit->out;
    before->set_pipeline(exact_out->pipeline());
    link.from->keep(std::move(exit));
  }
  if (link.to == nullptr) {
    before->connect(link.in, options);
    return true;
  }
  auto entry = std::make_unique<IntoCycle<Exact, Loose>>(sc_core::sc_gen_unique_name("border"), link);
  before->connect(entry->in, plain);
  if (leaves != nullptr) leaves->set_entry(*entry);
  entry->out.set_pipeline(before->pipeline());
  entry->connect(*exact_in, options);
  if (link.in.has_answers() && before->can_be_asked()) link.to->add_asked([before](Cycle edge) { before->ask(edge); });
  link.to->keep(std::move(entry));
  return true;
}

/// The same for whatever items are known: those of payload.h, and those of BorderRegistrar. Throws UserError naming the ends if
/// they carry others.
void connect_across_borders(const BorderLink& link, const LinkOptions& options);

/// Makes items of your own known, in a plugin from a static initialiser: BorderRegistrar(connect_across<Mine, Mine>).
struct BorderRegistrar {
  using Connect = bool (*)(const BorderLink& link, const LinkOptions& options);
  explicit BorderRegistrar(Connect connect);
};

}  // namespace vrpipe
