#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <systemc>
#include <tlm>

#include <vrpipe/component/error.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/kernel/link_observer.h>
#include <vrpipe/kernel/pipeline_stages.h>

/// The stream link between two units: TLM-2.0 sockets with protocol traits of our own.
///
/// Forward, phase `transfer`: one item moves; the receiver must have room, always accepts, and sees it `latency`
/// cycles later. Backward, phase `credit`: the receiver has freed `credits` places of its queue; the sender sees them
/// one cycle later. Initial credits, the depth of the queue, arrive in the same way before the first cycle.
/// Thus no unit sees what another did in the same cycle.

namespace vrpipe {

enum class StreamPhase : std::uint8_t { transfer, credit };

template <class Item>
struct StreamPayload {
  const Item* item = nullptr;  ///< transfer
  unsigned latency = 0;        ///< transfer: cycles that the sender's pipeline adds to those of the link
  unsigned credits = 0;        ///< credit
  /// Between units that are not clocked (timed.h): the cycles in which it begins and ends, how many it takes of the
  /// link, and whether its first part goes with the last of the item before it.
  Cycle at = never;
  Cycle last = never;
  unsigned beats = 1;
  bool joins = false;
};

template <class Item>
struct StreamProtocol {
  using tlm_payload_type = StreamPayload<Item>;
  using tlm_phase_type = StreamPhase;
};

template <class Item>
using StreamInitiatorSocket = tlm::tlm_initiator_socket<32, StreamProtocol<Item>>;
template <class Item>
using StreamTargetSocket = tlm::tlm_target_socket<32, StreamProtocol<Item>>;

/// The clock domain of a unit and the unit's handle in it.
struct ClockHandle {
  ClockDomain* domain = nullptr;
  unsigned unit = 0;
};

class PortOwner;

/// What the ports of all item types have in common: a name, and being stubbed or made to stall.
class Port {
 public:
  virtual ~Port() = default;
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  const std::string& name() const { return name_; }
  bool connected() const { return connected_; }
  /// Leaves the port legally unconnected.
  virtual void stub() = 0;
  /// A platform need not mention it: it is a stub then.
  void set_optional() { optional_ = true; }
  bool is_optional() const { return optional_; }
  /// For tests: in a random part of the cycles (`per_256` of 256) the port pretends that nothing moves. Results of a
  /// strict run do not depend on it.
  void stall_randomly(std::uint64_t seed, unsigned per_256) {
    stall_seed_ = seed;
    stall_per_256_ = per_256;
    limited_ = limited_ || per_256 != 0;
  }

 protected:
  Port(std::string name, const ClockHandle& clock) : clock_(clock), name_(std::move(name)) {}
  [[gnu::always_inline]] bool stalled() const { return stall_per_256_ != 0 && stalls_at(clock_.domain->now()); }
  bool stalled_at(Cycle cycle) const { return stall_per_256_ != 0 && stalls_at(cycle); }
  void mark_connected() { connected_ = true; }
  /// Throws SimulationFault. Out of line, so that what does not fail stays short.
  [[noreturn]] void fault(const sc_core::sc_object& socket, const char* what) const;

  const ClockHandle clock_;
  bool limited_ = false;  ///< by random stalls or a rate

 private:
  bool stalls_at(Cycle cycle) const;

  std::string name_;
  bool connected_ = false;
  bool optional_ = false;
  std::uint64_t stall_seed_ = 0;
  unsigned stall_per_256_ = 0;
};

class OutPort;

class InPort : public Port {
 public:
  using Port::Port;
  /// Grants the initial credits, before the first cycle.
  virtual void open() = 0;
  /// Whether nothing is queued.
  virtual bool empty() const = 0;
  // Of a unit that is simulated cycle by cycle among others at `lt` (border.h):
  /// What comes here follows from what the unit has sent: it may be known long before its time, for which it waits here.
  void set_comes_ahead() { comes_ahead_ = true; }
  bool comes_ahead() const { return comes_ahead_; }
  /// The same of what units say that come later in the pipeline: they are asked for what they say before a cycle comes.
  void set_answers() { comes_ahead_ = has_answers_ = true; }
  bool has_answers() const { return has_answers_; }
  /// What comes here follows from what the unit has sent there, and waits for room: what is sent meanwhile is withheld there.
  void set_follows(const OutPort& out) { follows_ = &out; }
  const OutPort* follows() const { return follows_; }
  /// The unit passes on there what comes here, each in turn, and nothing else; it holds so many at most, beyond the queue.
  void set_passes_to(const OutPort& out, unsigned holds) {
    passes_to_ = &out;
    holds_ = holds;
  }
  const OutPort* passes_to() const { return passes_to_; }
  unsigned holds() const { return holds_; }

 private:
  bool comes_ahead_ = false;
  bool has_answers_ = false;
  const OutPort* follows_ = nullptr;
  const OutPort* passes_to_ = nullptr;
  unsigned holds_ = 0;
};

/// Of those of a link the one that sees such items; null for none. Throws UserError if there are others alone.
template <class Item>
ItemObserver<Item>* observer_of(const LinkObservers& observers, const Port& port);
[[noreturn]] void refuse_observers(const Port& port);

/// How a link is made.
struct LinkOptions {
  unsigned depth = 4;            ///< items that the receiver's queue holds, at least 1
  unsigned latency = 1;          ///< cycles from push to visibility, at least 1
  unsigned items_per_cycle = 0;  ///< that the link passes; 0: as many as its ends move
  LinkObservers observers = {};  ///< which outlive the link
};

class OutPort : public Port {
 public:
  using Port::Port;
  /// Binds to `in`. Throws UserError when the ends carry different items or one is taken.
  virtual void connect(InPort& in, const LinkOptions& options) = 0;
  void connect(InPort& in, unsigned depth, unsigned latency) { connect(in, LinkOptions{depth, latency}); }
  virtual std::uint64_t transferred() const = 0;  ///< items so far
};

/// Whatever has ports: a unit, a test's source or sink.
class PortOwner {
 public:
  explicit PortOwner(ClockHandle handle) : clock(handle) {}
  virtual ~PortOwner() = default;
  const ClockHandle clock;
  std::vector<InPort*> in_ports;
  std::vector<OutPort*> out_ports;
  unsigned sends_waiting = 0;  ///< at a border (border.h)
};

template <class Item>
class LinkTap;

/// What the sending ends of all fidelities have in common.
template <class Item>
class OutEnd : public OutPort, protected tlm::tlm_bw_transport_if<StreamProtocol<Item>> {
 public:
  OutEnd(PortOwner& owner, const std::string& name) : OutPort(name, owner.clock), socket(name.c_str()) {
    socket.bind(*this);
    owner.out_ports.push_back(this);
  }

  StreamInitiatorSocket<Item> socket;

  /// The stages behind what the sender pushes. Before `connect`.
  void set_pipeline(const PipelineStages& pipeline) { pipeline_ = pipeline; }
  const PipelineStages& pipeline() const { return pipeline_; }
  std::uint64_t transferred() const override { return transferred_; }
  /// Called when the socket is bound by hand, for instance through a recorder.
  void taken() { mark_connected(); }
  using OutPort::connect;
  void connect(InPort& in, const LinkOptions& options) override;

  /// Whatever is pushed is taken at once and lost.
  void stub() override {
    stub_ = std::make_unique<Sink>(sc_core::sc_gen_unique_name("stub"));
    socket.bind(stub_->socket);
    mark_connected();
    unlimited();
  }
  bool is_stub() const { return stub_ != nullptr; }

 protected:
  /// The receiver has room for whatever comes.
  virtual void unlimited() = 0;

  std::uint64_t transferred_ = 0;
  PipelineStages pipeline_;

 private:
  struct Sink : sc_core::sc_module, tlm::tlm_fw_transport_if<StreamProtocol<Item>> {
    explicit Sink(const sc_core::sc_module_name& name) : sc_module(name), socket("socket") { socket.bind(*this); }
    StreamTargetSocket<Item> socket;
    tlm::tlm_sync_enum nb_transport_fw(StreamPayload<Item>&, StreamPhase&, sc_core::sc_time&) override {
      return tlm::TLM_ACCEPTED;
    }
    void b_transport(StreamPayload<Item>&, sc_core::sc_time&) override {}
    bool get_direct_mem_ptr(StreamPayload<Item>&, tlm::tlm_dmi&) override { return false; }
    unsigned transport_dbg(StreamPayload<Item>&) override { return 0; }
  };

  void invalidate_direct_mem_ptr(sc_dt::uint64, sc_dt::uint64) override {}

  std::unique_ptr<Sink> stub_;
  std::unique_ptr<LinkTap<Item>> tap_;
};

template <class Item>
class StreamIn;

/// The sending end of a clocked unit. Ends of clocked units with nothing in between call each other directly instead of
/// through their sockets, as with a direct memory interface; in the same cycles.
template <class Item>
class StreamOut : public OutEnd<Item> {
 public:
  using OutEnd<Item>::OutEnd;
  using OutEnd<Item>::connect;

  void connect(InPort& in, const LinkOptions& options) override;

  /// Free places at the receiver, as known at the start of this cycle. For 0 of them the unit need not come back by
  /// itself: a credit wakes it, and so does the end of a random stall.
  unsigned credits() {
    if (pending_ > 0 && clock_.domain->now() > credit_cycle_) credits_ += std::exchange(pending_, 0);
    return this->limited_ ? limited_credits() : credits_;
  }
  /// The free places as they will be known in the next cycle; a rate or random stalls may leave less of them.
  unsigned next_credits() const { return credits_ + pending_; }
  /// Moves an item; `credits()` must not be 0.
  void push(const Item& item) {
    if (credits_ == 0) this->fault(this->socket, "an item was pushed without a credit");
    --credits_;
    ++this->transferred_;
    if (direct_ == nullptr) return transfer(item);
    direct_->accept(item, this->pipeline_.cycles);
  }

 private:
  using OutEnd<Item>::clock_;

  friend class StreamIn<Item>;

  [[gnu::noinline]] unsigned wait_a_cycle() {
    clock_.domain->wake(clock_.unit, clock_.domain->now() + 1);
    return 0;
  }
  /// What the rate leaves of the credits in this cycle.
  [[gnu::noinline]] unsigned limited_credits() {
    const Cycle now = clock_.domain->now();
    if (now > rate_cycle_) {
      rate_cycle_ = now;
      passed_ = 0;
    }
    if (this->stalled()) return wait_a_cycle();
    if (rate_ == 0) return credits_;
    if (passed_ == rate_ && credits_ > 0) return wait_a_cycle();
    return std::min(credits_, rate_ - passed_);
  }
  [[gnu::noinline]] void transfer(const Item& item) {
    if (rate_ != 0) ++passed_;
    payload_.item = &item;
    payload_.latency = this->pipeline_.cycles;
    StreamPhase phase = StreamPhase::transfer;
    sc_core::sc_time delay;
    this->socket->nb_transport_fw(payload_, phase, delay);
  }
  /// Credits from the receiver, for the next cycle.
  void give(unsigned credits) {
    const Cycle now = clock_.domain->now();
    if (now > credit_cycle_) {
      credits_ += pending_;
      pending_ = 0;
      credit_cycle_ = now;
    }
    pending_ += credits;
    clock_.domain->wake(clock_.unit, now + 1);
  }
  tlm::tlm_sync_enum nb_transport_bw(StreamPayload<Item>& payload, StreamPhase&, sc_core::sc_time&) override {
    if (clock_.domain->running()) {
      give(payload.credits);
    } else {
      credits_ += payload.credits;
    }
    return tlm::TLM_ACCEPTED;
  }
  void unlimited() override { credits_ = ~0U; }

  StreamIn<Item>* direct_ = nullptr;
  StreamPayload<Item> payload_;  ///< of the transfer under way
  unsigned credits_ = 0;
  unsigned pending_ = 0;
  unsigned rate_ = 0;  ///< items per cycle; 0 for no limit. With one, items go through the socket
  Cycle credit_cycle_ = 0;
  unsigned passed_ = 0;  ///< in `rate_cycle_`
  Cycle rate_cycle_ = 0;
};

/// What the receiving ends of all fidelities have in common.
template <class Item>
class InEnd : public InPort, protected tlm::tlm_fw_transport_if<StreamProtocol<Item>> {
 public:
  InEnd(PortOwner& owner, const std::string& name) : InPort(name, owner.clock), socket(name.c_str()) {
    socket.bind(*this);
    owner.in_ports.push_back(this);
  }

  StreamTargetSocket<Item> socket;

  /// @param depth items that the queue holds, at least 1
  /// @param latency cycles from push to visibility, at least 1
  virtual void configure(unsigned depth, unsigned latency) = 0;
  /// Called by the sending end.
  void taken() { mark_connected(); }

  /// Nothing ever arrives.
  void stub() override {
    stub_ = std::make_unique<Source>(sc_core::sc_gen_unique_name("stub"));
    stub_->socket.bind(socket);
    mark_connected();
  }

  bool is_stub() const { return stub_ != nullptr; }

 private:
  struct Source : sc_core::sc_module, tlm::tlm_bw_transport_if<StreamProtocol<Item>> {
    explicit Source(const sc_core::sc_module_name& name) : sc_module(name), socket("socket") { socket.bind(*this); }
    StreamInitiatorSocket<Item> socket;
    tlm::tlm_sync_enum nb_transport_bw(StreamPayload<Item>&, StreamPhase&, sc_core::sc_time&) override {
      return tlm::TLM_ACCEPTED;
    }
    void invalidate_direct_mem_ptr(sc_dt::uint64, sc_dt::uint64) override {}
  };

  bool get_direct_mem_ptr(StreamPayload<Item>&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(StreamPayload<Item>&) override { return 0; }

  std::unique_ptr<Source> stub_;
};

/// The receiving end of a clocked unit, with its queue.
template <class Item>
class StreamIn : public InEnd<Item> {
 public:
  StreamIn(PortOwner& owner, const std::string& name) : InEnd<Item>(owner, name) { StreamIn::configure(4, 1); }

  void configure(unsigned depth, unsigned latency) override {
    depth_ = depth;
    latency_ = latency;
    unsigned size = 1;
    while (size < depth) size *= 2;
    queue_.resize(size);
    mask_ = size - 1;
  }
  unsigned depth() const { return depth_; }

  void open() override {
    if (!this->is_stub()) grant(depth_);
  }
  bool empty() const override { return head_ == tail_; }

  bool ready() const { return front_ready_ <= clock_.domain->now() && !this->stalled(); }
  const Item& front() const { return queue_[head_ & mask_].item; }
  void pop() {
    ++head_;
    front_ready_ = head_ == tail_ ? never : queue_[head_ & mask_].ready;
    if (direct_ == nullptr) return grant(1);
    direct_->give(1);
  }
  /// Items in the queue, visible or not.
  unsigned size() const { return tail_ - head_; }
  /// The cycle at which the head becomes visible; `never` for an empty queue.
  Cycle next_ready() const { return this->stalled() ? std::max(front_ready_, clock_.domain->now() + 1) : front_ready_; }

 private:
  friend class StreamOut<Item>;
  using InEnd<Item>::clock_;
  struct Entry {
    Cycle ready;
    Item item;
  };

  [[gnu::noinline]] void grant(unsigned credits) {
    payload_.credits = credits;
    StreamPhase phase = StreamPhase::credit;
    sc_core::sc_time delay;
    this->socket->nb_transport_bw(payload_, phase, delay);
  }

  /// An item from the sender, behind a pipeline of so many cycles.
  void accept(const Item& item, unsigned pipeline) {
    if (size() == depth_) this->fault(this->socket, "an item arrived at a full queue");
    Entry& entry = queue_[tail_ & mask_];
    const Cycle ready = clock_.domain->now() + latency_ + pipeline;
    entry.ready = ready;
    entry.item = item;
    if (head_ == tail_) front_ready_ = ready;
    ++tail_;
    clock_.domain->wake(clock_.unit, ready);
  }
  tlm::tlm_sync_enum nb_transport_fw(StreamPayload<Item>& payload, StreamPhase&, sc_core::sc_time&) override {
    accept(*payload.item, payload.latency);
    return tlm::TLM_ACCEPTED;
  }
  void b_transport(StreamPayload<Item>&, sc_core::sc_time&) override {
    this->fault(this->socket, "b_transport on a link of a clocked unit");
  }

  StreamOut<Item>* direct_ = nullptr;
  StreamPayload<Item> payload_;  ///< of credits
  std::vector<Entry> queue_;
  unsigned mask_ = 0;
  unsigned head_ = 0;
  unsigned tail_ = 0;
  Cycle front_ready_ = never;  ///< when the head becomes visible; `never` for an empty queue
  unsigned depth_ = 0;
  unsigned latency_ = 1;
};

/// A proxy on a link that shows every transfer to an observer, and changes nothing.
template <class Item>
class LinkTap : public sc_core::sc_module,
                private tlm::tlm_fw_transport_if<StreamProtocol<Item>>,
                private tlm::tlm_bw_transport_if<StreamProtocol<Item>> {
 public:
  LinkTap(const sc_core::sc_module_name& name, const ClockDomain& clock, ItemObserver<Item>& observer)
      : sc_module(name), in("in"), out("out"), clock_(clock), observer_(observer) {
    in.bind(*static_cast<tlm::tlm_fw_transport_if<StreamProtocol<Item>>*>(this));
    out.bind(*static_cast<tlm::tlm_bw_transport_if<StreamProtocol<Item>>*>(this));
  }
  StreamTargetSocket<Item> in;
  StreamInitiatorSocket<Item> out;

 private:
  tlm::tlm_sync_enum nb_transport_fw(StreamPayload<Item>& payload, StreamPhase& phase, sc_core::sc_time& t) override {
    const bool clocked = payload.at == never;
    observer_.passed(*payload.item, clocked ? clock_.now() : payload.at, clocked ? clock_.now() : payload.last);
    observer_.places_taken(payload.beats, clocked ? clock_.now() : payload.at);
    return out->nb_transport_fw(payload, phase, t);
  }
  tlm::tlm_sync_enum nb_transport_bw(StreamPayload<Item>& payload, StreamPhase& phase, sc_core::sc_time& t) override {
    observer_.places_freed(payload.credits, payload.at == never ? clock_.now() : payload.last);
    return in->nb_transport_bw(payload, phase, t);
  }
  void b_transport(StreamPayload<Item>& payload, sc_core::sc_time& t) override {
    // The cycles in which it is taken are known when the call returns; what it carries may have changed by then.
    const Item item = *payload.item;
    out->b_transport(payload, t);
    observer_.passed(item, payload.at, payload.last);
  }
  bool get_direct_mem_ptr(StreamPayload<Item>&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(StreamPayload<Item>&) override { return 0; }
  void invalidate_direct_mem_ptr(sc_dt::uint64, sc_dt::uint64) override {}

  const ClockDomain& clock_;
  ItemObserver<Item>& observer_;
};

/// An observer that keeps every item with the cycle in which its first part was taken.
template <class Item>
class LinkRecorder : public ItemObserver<Item> {
 public:
  struct Record {
    Cycle cycle;
    Item item;
  };
  void passed(const Item& item, Cycle first, Cycle) override { records_.push_back({first, item}); }
  const std::vector<Record>& records() const { return records_; }

 private:
  std::vector<Record> records_;
};

/// Throws UserError unless two ends carry the same item and are free.
void check_ends(const OutPort& out, const InPort& in, bool same_item);

/// Checks the two ends; gives the receiving one.
template <class Item>
InEnd<Item>& receiving_end(OutPort& out, InPort& in) {
  auto* const typed = dynamic_cast<InEnd<Item>*>(&in);
  check_ends(out, in, typed != nullptr);
  return *typed;
}

template <class Item>
ItemObserver<Item>* observer_of(const LinkObservers& observers, const Port& port) {
  for (LinkObserver* observer : observers) {
    if (auto* const typed = dynamic_cast<ItemObserver<Item>*>(observer)) return typed;
  }
  if (!observers.empty()) refuse_observers(port);
  return nullptr;
}

template <class Item>
void OutEnd<Item>::connect(InPort& in, const LinkOptions& options) {
  InEnd<Item>& end = receiving_end<Item>(*this, in);
  end.configure(options.depth + pipeline_.cycles * pipeline_.items_per_cycle, options.latency);
  if (ItemObserver<Item>* const observer = observer_of<Item>(options.observers, *this)) {
    tap_ = std::make_unique<LinkTap<Item>>(sc_core::sc_gen_unique_name("tap"), *clock_.domain, *observer);
    socket.bind(tap_->in);
    tap_->out.bind(end.socket);
  } else {
    socket.bind(end.socket);
  }
  mark_connected();
  end.taken();
}

template <class Item>
void StreamOut<Item>::connect(InPort& in, const LinkOptions& options) {
  OutEnd<Item>::connect(in, options);
  rate_ = options.items_per_cycle;
  this->limited_ = rate_ != 0;
  auto* const end = dynamic_cast<StreamIn<Item>*>(&in);
  if (end == nullptr || !options.observers.empty() || clock_.domain->passes_sockets()) return;
  if (rate_ == 0) direct_ = end;
  end->direct_ = this;
}

}  // namespace vrpipe
