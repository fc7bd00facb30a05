#include <vrpipe/kernel/link.h>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {

// Out of line, since only tests stall ports.
bool Port::stalls_at(Cycle cycle) const { return stall_at(stall_seed_, cycle, stall_per_256_); }

void Port::fault(const sc_core::sc_object& socket, const char* what) const {
  throw SimulationFault(socket.name(), clock_.domain->now(), what);
}

void check_ends(const OutPort& out, const InPort& in, bool same_item) {
  if (!same_item) {
    throw UserError("cannot connect", out.name() + " to " + in.name(), "the ports carry different items",
                    "connect ports of the same item type");
  }
  if (out.connected() || in.connected()) {
    throw UserError("cannot connect", out.name() + " to " + in.name(), "a port is connected already",
                    "connect each port once");
  }
}

void refuse_observers(const Port& port) {
  throw UserError("cannot observe a link", port.name(), "the link carries other items than the observer sees",
                  "see batch.h for the items of each fidelity");
}

}  // namespace vrpipe
