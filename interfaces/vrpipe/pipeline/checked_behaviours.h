#pragma once

#include <exception>
#include <new>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

/// Units that are not trusted, a plugin's, stand behind checks of all that they return: a mistake of theirs ends in a
/// SimulationFault that names the unit (slot=implementation), the cycle and the item, at every fidelity, rather than in a
/// crash, a hang or a wrong picture elsewhere. Trusted units are called directly.

namespace vrpipe {

class ClockDomain;

/// Puts whatever the implementation makes behind checks. The registry does so for each that is not trusted.
void check_calls(Implementation& implementation);

/// The clock by which faults of a unit name the cycle; without one they name cycle 0. It outlives the unit.
void follow_clock(Behaviour& unit, const ClockDomain& clock);

/// After a draw: throws SimulationFault where the counters of the slot are not what went through a checked unit.
void check_counters(const Behaviour& unit);

/// Code of a plugin that runs at this moment, for the report of a crash.
struct ForeignCode {
  const char* owner = nullptr;  ///< slot=implementation, or the plugin's path; null when none runs
  const char* call = nullptr;   ///< e.g. "insert"
};
ForeignCode foreign_code_running();

/// Marks such code for as long as it lives.
class ForeignCall {
 public:
  ForeignCall(const char* owner, const char* call);
  ~ForeignCall();
  ForeignCall(const ForeignCall&) = delete;
  ForeignCall& operator=(const ForeignCall&) = delete;

 private:
  ForeignCode before_;
};

/// Calls such code. Of what it throws, a UserError is meant for the user, a SimulationFault says whose fault it is, and
/// memory may run out anywhere; for anything else `fault` throws, given its text, or null where it has none.
template <class Call, class Fault>
decltype(auto) call_with_fault(Call&& call, const Fault& fault) {
  try {
    return call();
  } catch (const UserError&) {
    throw;
  } catch (const SimulationFault&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& thrown) {
    fault(thrown.what());
    throw;
  } catch (...) {
    fault(nullptr);
    throw;
  }
}

}  // namespace vrpipe
