#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <systemc>

#include <vrpipe/component/statistic.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/kernel/link.h>
#include <vrpipe/memory/memory_request.h>
#include <vrpipe/model/occupancy.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// A unit of a platform, at any fidelity: a functional model with ports. Ports are found by name, so that a platform wires
/// units without knowing their classes. Its own statistics are those that the functional model cannot have, since they
/// depend on time; reports show both together.
class Component : public PortOwner, public StatisticSet {
 public:
  using PortOwner::PortOwner;
  /// Throws UserError naming the nearest port.
  InPort& in(const std::string& name);
  OutPort& out(const std::string& name);
  bool has_out(const std::string& name) const;
  /// For messages.
  virtual std::string label() const = 0;
  virtual Behaviour& behaviour() = 0;
};

/// The timing model of a unit, a SystemC module with a clock. Clocked is the first base, so that the clock calls it
/// directly.
class Unit : public Clocked, public sc_core::sc_module, public Component {
 public:
  /// Attaches to the clock. `work`: the kinds of work that take the unit's time, at most `most_work_kinds`; otherwise a
  /// SimulationFault.
  Unit(const sc_core::sc_module_name& name, ClockDomain& domain, std::vector<WorkKind> work);

  std::string label() const override { return name(); }
  /// Whether no work is left inside or queued.
  virtual bool idle() const = 0;
  /// For a unit with a memory port; null otherwise.
  virtual tlm::tlm_initiator_socket<32>* memory_socket() { return nullptr; }
  /// What it has asked for there.
  virtual MemoryBytes memory_bytes() const { return {}; }
  /// That the port moves at most, in each direction; 0 leaves that to the memory.
  virtual unsigned memory_bytes_per_cycle() const { return 0; }
  /// Whether that port may stay unconnected: then the unit knows what its accesses take.
  virtual bool memory_is_optional() const { return false; }
  /// Whether the draw is done when this unit, with others of the kind, is done: those at the end of the pipeline.
  virtual bool ends_frame() const { return false; }
  /// For such a unit: the cycle in which the end of the frame has come there and all before it is done; `never` before that.
  virtual Cycle end_of_frame() const { return never; }

  const Occupancy& occupancy() const { return occupancy_; }
  const StateAccount& account() const { return account_; }
  virtual void close_account(Cycle end);
  void observe_states(StateObserver& observer) { account_.observe(observer); }

 protected:
  void enter(UnitState state, Cycle now) { account_.enter(state, now); }
  Cycle now() const { return clock.domain->now(); }
  /// The unit did `items` of a kind of work in this cycle, or from cycle `from` to `until` - 1.
  void did(unsigned kind, std::uint64_t items, Cycle at) { did(kind, items, at, at + 1); }
  void did(unsigned kind, std::uint64_t items, Cycle from, Cycle until) {
    if (kind >= most_work_kinds) refuse_work_kind(name(), kind);  // no instruction where the kind is a constant
    occupancy_.add(kind, items, from, until);
  }
  /// A quad is blended or dropped in the cycle before `cycle`, or later: the draw does not end earlier.
  void frame_lasts(Cycle cycle) { clock.domain->frame_end().not_before(cycle); }
  /// Whether it is to be said of which draws such quads are as well.
  bool tells_draws() const { return tells_draws_; }
  void draw_lasts(std::size_t draw, Cycle cycle) { clock.domain->frame_end().draw_not_before(draw, cycle); }
  /// Of `count` quads some are blended or dropped then, and where draws are told apart no quad's draw ends earlier:
  /// `draw_of(i)` is that of the i-th.
  template <class DrawOf>
  void quads_last(Cycle cycle, unsigned count, DrawOf&& draw_of) {
    frame_lasts(cycle);
    for (unsigned i = 0; tells_draws() && i < count; ++i) draw_lasts(draw_of(i), cycle);
  }

 private:
  Occupancy occupancy_;
  StateAccount account_;
  const bool tells_draws_;
};

/// Makes the timing model of `cycle` around a functional model of a slot. `gpcs` is how many GPCs the front end serves.
using UnitMaker = std::function<std::unique_ptr<Unit>(const std::string& name, ClockDomain& domain,
                                                      std::unique_ptr<Behaviour> behaviour,
                                                      const RenderContext& context, unsigned gpcs)>;

/// Registered by each timing model for its slot. A second one for a slot is a problem of the registry's.
void register_unit_maker(const std::string& slot, UnitMaker maker);
const UnitMaker& unit_maker(const std::string& slot);

}  // namespace vrpipe
