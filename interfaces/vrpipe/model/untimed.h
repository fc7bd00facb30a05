#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/kernel/link.h>
#include <vrpipe/memory/cache_organization.h>
#include <vrpipe/memory/sectors.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/batch.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/memory.h>

/// Units and ports without time: the fidelities `functional` and `bound`, and what strict termination runs ahead. They
/// have the ports of `lt` (batch.h) and no SystemC. Sending is a call: it returns when all that the item leads to
/// has been done, down to the last blend.

namespace vrpipe {

template <class Item>
class UntimedIn;

/// Whatever takes items: the receiving end of a unit, or a tap on a link.
template <class Item>
class UntimedTarget {
 public:
  virtual ~UntimedTarget() = default;
  virtual void take(const Item& item) = 0;
};

/// The sending end.
template <class Item>
class UntimedOut : public OutPort {
 public:
  UntimedOut(PortOwner& owner, const std::string& name) : OutPort(name, owner.clock) {
    owner.out_ports.push_back(this);
  }
  void send(const Item& item) const { target_->take(item); }

  using OutPort::connect;
  /// Throws UserError as between other ports; depth, latency and rate mean nothing without time.
  void connect(InPort& in, const LinkOptions& options) override;
  /// What is sent is lost.
  void stub() override {
    struct Sink final : UntimedTarget<Item> {
      void take(const Item&) override {}
    };
    static Sink sink;
    attach(sink);
    is_stub_ = true;
  }
  bool is_stub() const { return is_stub_; }
  /// Sends to something else than a unit's port.
  void attach(UntimedTarget<Item>& target) {
    target_ = &target;
    mark_connected();
  }
  /// Where it goes, for a tap that is put before that; null before it is connected.
  UntimedTarget<Item>* target() const { return target_; }
  std::uint64_t transferred() const override { return 0; }

 private:
  UntimedTarget<Item>* target_ = nullptr;
  std::unique_ptr<UntimedTarget<Item>> tap_;
  bool is_stub_ = false;
};

/// The receiving end of a unit.
template <class Item>
class UntimedIn : public UntimedTarget<Item>, public InPort {
 public:
  UntimedIn(PortOwner& owner, const std::string& name) : InPort(name, owner.clock) { owner.in_ports.push_back(this); }
  void taken() { mark_connected(); }
  void open() override {}
  bool empty() const override { return true; }
  void stub() override { mark_connected(); }
};

/// The same around the unit's handler, a lambda, so that taking an item is one call.
template <class Item, class Function>
class UntimedHandler final : public UntimedIn<Item> {
 public:
  UntimedHandler(PortOwner& owner, const std::string& name, Function function)
      : UntimedIn<Item>(owner, name), function_(function) {}
  void take(const Item& item) override { function_(item); }

 private:
  Function function_;
};

template <class Item>
void UntimedOut<Item>::connect(InPort& in, const LinkOptions& options) {
  struct Tap final : UntimedTarget<Item> {
    Tap(UntimedTarget<Item>& end, ItemObserver<Item>& observing) : next(end), observer(observing) {}
    void take(const Item& item) override {
      next.take(item);
      observer.passed(item, 0, 0);
    }
    UntimedTarget<Item>& next;
    ItemObserver<Item>& observer;
  };
  auto* const typed = dynamic_cast<UntimedIn<Item>*>(&in);
  check_ends(*this, in, typed != nullptr);
  typed->taken();
  attach(*typed);
  if (ItemObserver<Item>* const observer = observer_of<Item>(options.observers, *this)) {
    tap_ = std::make_unique<Tap>(*typed, *observer);
    attach(*tap_);
  }
}

/// A memory port without time: an access is a call of the memory's functional model.
class UntimedMemoryPort {
 public:
  /// @param origin  of reads and writes
  explicit UntimedMemoryPort(MemoryOrigin origin) : origin_(origin) {}

  /// The memory outlives the port.
  void connect(MemoryBehaviour& memory) { memory_ = &memory; }
  /// Where it is not, accesses need not be found out.
  bool connected() const { return memory_ != nullptr; }
  void read(std::uint64_t address, unsigned bytes) { access({address, bytes, tlm::TLM_READ_COMMAND, origin_}); }
  void write(std::uint64_t address, unsigned bytes) { access({address, bytes, tlm::TLM_WRITE_COMMAND, origin_}); }
  /// What a cache moves for a line, in naturally aligned runs of sectors. Connected.
  void move(const LineAccess& line, const CacheOrganization& cache) {
    const auto each = [&](std::uint32_t mask, std::uint64_t address, tlm::tlm_command command) {
      for_each_sector_run(mask, cache.sectors_of_a_line(), [&](unsigned first, unsigned count) {
        access({address + std::uint64_t{first} * cache.sector_bytes, count * cache.sector_bytes, command, origin_});
      });
    };
    each(line.written_back, line.old_address, tlm::TLM_WRITE_COMMAND);
    each(line.filled, line.address, tlm::TLM_READ_COMMAND);
  }
  /// On behalf of another origin than the port's. Connected.
  void access(const MemoryRequest& request) {
    moved_.count(request);
    memory_->access(request);
  }
  const MemoryBytes& moved() const { return moved_; }

 private:
  MemoryBehaviour* memory_ = nullptr;
  MemoryOrigin origin_;
  MemoryBytes moved_;
};

/// What runs with time may do otherwise than one without, and what their memory takes at least.
struct BoundTerms {
  bool bins_vary = false;  ///< they are flushed at other times: what a quad terminates may spare others later than here
  bool order_varies = false;  ///< screen tiles are blended in another order
  std::uint32_t memory_latency_cycles = 0;
  bool updates_hide = false;  ///< of termination, beside tests that take longer
};

/// A unit without time: a functional model with ports.
class UntimedUnit : public Component {
 public:
  using Items = std::array<std::uint64_t, most_work_kinds>;  ///< by kind of work
  /// @param work  what it counts, and what that takes, for `bound`; as of `lt` and `cycle` (unit.h), unless what is counted
  ///              here is another item. Cycles of 0 for what is counted beside.
  explicit UntimedUnit(std::string name, std::vector<WorkKind> work = {})
      : Component(ClockHandle()), name_(std::move(name)), work_(std::move(work)) {}

  std::string label() const override { return name_; }
  /// Of a kind of work, so far.
  std::uint64_t items(unsigned kind) const { return items_[kind]; }
  const Items& items() const { return items_; }
  const std::vector<WorkKind>& work() const { return work_; }
  /// Throws SimulationFault if it did work of a kind that it has not declared.
  void check_work() const;

  /// For a unit with a memory port; null otherwise.
  virtual UntimedMemoryPort* memory_port() { return nullptr; }
  /// For the unit that begins a draw: does a piece of it; false after the last.
  virtual bool run_piece() { return false; }
  /// For the unit that blends: quads that will come before long. Then what they are blended into is in the host's cache.
  virtual void prefetch(const Warp&) {}
  /// For the unit that launches warps: who is to know of them. It outlives this one.
  virtual void prefetch_for(UntimedUnit& /*blender*/) {}
  // For `bound`:
  /// As far as it is up to this unit.
  virtual BoundTerms terms() const { return {}; }
  /// From now on counts the work alone that any run with time makes.
  virtual void count_least(const BoundTerms&) {}
  /// What so much work takes at least. `to_last`: up to the last item, for the rest of whose interval nobody waits.
  virtual std::vector<OccupancyPart> least_parts(const Items& items, bool to_last) const;
  /// The least cycles of so much, which can begin at once.
  virtual double least_cycles(const Items& items) const { return busiest(least_parts(items, false)); }
  /// Of work so far, what need not be done when the last item has gone.
  virtual void leave_out_pending(Items&) const {}
  /// In which it does nothing more after the last item has gone, at most: the rest of an interval.
  virtual double idle_after_last() const;
  /// Warps between TC and the end of CROP that it has room for, at worst.
  virtual std::uint64_t room_in_warps() const { return 0; }

 protected:
  template <class Item, class Function>
  std::unique_ptr<UntimedIn<Item>> input(const std::string& name, Function function) {
    return std::make_unique<UntimedHandler<Item, Function>>(*this, name, function);
  }
  void did(unsigned kind, std::uint64_t items) {
    if (kind >= items_.size()) refuse_work_kind(name_, kind);  // no instruction where the kind is a constant
    items_[kind] += items;
  }

 private:
  std::string name_;
  std::vector<WorkKind> work_;
  Items items_{};
};

/// Makes the unit without time around a functional model of a slot. `gpcs` is how many GPCs the front end serves.
using UntimedUnitMaker =
    std::function<std::unique_ptr<UntimedUnit>(const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                               const RenderContext& context, unsigned gpcs)>;

/// Registered by each unit without time for its slot. A second one for a slot is a problem of the registry's.
void register_untimed_unit_maker(const std::string& slot, UntimedUnitMaker maker);
const UntimedUnitMaker& untimed_unit_maker(const std::string& slot);

}  // namespace vrpipe
