#include <vrpipe/link.h>

#include <vrpipe/random.h>

namespace vrpipe {

// Out of line, since only tests stall ports.
bool Port::stalls_at(Cycle cycle) const { return stall_at(stall_seed_, cycle, stall_per_256_); }

void Port::fault(const sc_core::sc_object& socket, const char* what) const {
  throw SimulationFault(socket.name(), clock_.domain->now(), what);
}

}  // namespace vrpipe
