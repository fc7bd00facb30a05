#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/component/error.h>
#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/checks.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// The unit and its parameters that a request has for a slot that is in no netlist: of a kernel or an accelerator.
struct ChosenKernel {
  const Implementation* implementation = nullptr;
  std::unique_ptr<ParameterSet> parameters;
  std::string name() const { return implementation->slot + "=" + implementation->name; }

  template <class SlotBehaviour>
  std::unique_ptr<SlotBehaviour> make(const RenderContext& context) const {
    return behaviour_as<SlotBehaviour>(implementation->make_behaviour(*parameters, context));
  }
  template <class Call>
  decltype(auto) call(const char* what, Call&& call) const {
    return call_foreign(name(), what, 0, std::forward<Call>(call));
  }
  [[noreturn]] void fail(const std::string& item) const { throw SimulationFault(name(), 0, item); }

  /// SLOT.PARAMETER and value of each.
  void add_parameters_to(std::vector<std::pair<std::string, std::string>>& all) const;
  /// The slot's own unit, and that its defaults.
  bool is_as_shipped() const;
};

/// Throws UserError for an unknown unit or parameter, and a value out of range.
ChosenKernel choose_kernel(const std::string& slot, const RunRequest& request);

/// Throws UserError, for `what`, for a frame that is not one draw of splats.
void check_is_of_splats(const Frame& frame, const char* what);

}  // namespace vrpipe
