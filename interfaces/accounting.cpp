#include <vrpipe/accounting.h>

namespace vrpipe {

const char* name_of(UnitState state) {
  switch (state) {
    case UnitState::busy: return "busy";
    case UnitState::starved: return "starved";
    case UnitState::blocked: return "blocked";
    case UnitState::memory: return "memory";
    case UnitState::latency: return "latency";
  }
  return "";
}

}  // namespace vrpipe
