#include <vrpipe/pipeline/checked_behaviours.h>

#include <utility>

#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/kernel/clock_domain.h>

namespace vrpipe {

namespace {
ForeignCode running;
}  // namespace

Cycle Checks::cycle() const { return clock_ == nullptr ? 0 : clock_->now(); }

void check_calls(Implementation& implementation) {
  const std::string name = implementation.slot + "=" + implementation.name;
  implementation.make_parameters = [name, make = std::move(implementation.make_parameters)] {
    auto parameters = call_foreign(name, "make_parameters", 0, [&] { return make(); });
    if (parameters == nullptr) throw SimulationFault(name, 0, "make_parameters makes nothing");
    return parameters;
  };
  implementation.make_behaviour =
      [name, make = std::move(implementation.make_behaviour),
       check = Registry::instance().slot(implementation.slot).check](const ParameterSet& parameters,
                                                                     const RenderContext& context) {
        auto behaviour = call_foreign(name, "make_behaviour", 0, [&] { return make(parameters, context); });
        if (behaviour == nullptr) throw SimulationFault(name, 0, "make_behaviour makes nothing");
        // What a slot of a plugin's returns, only that plugin knows.
        return check == nullptr ? std::move(behaviour) : check(name, context, std::move(behaviour));
      };
}

void follow_clock(Behaviour& unit, const ClockDomain& clock) {
  if (auto* const checks = dynamic_cast<Checks*>(&unit)) checks->follow(clock);
}

void check_counters(const Behaviour& unit) {
  if (const auto* const checks = dynamic_cast<const Checks*>(&unit)) {
    checks->check_counters();
    checks->check_draws(unit.unit());
  }
}

ForeignCode foreign_code_running() { return running; }

ForeignCall::ForeignCall(const char* owner, const char* call) : before_(running) { running = {owner, call}; }
ForeignCall::~ForeignCall() { running = before_; }

}  // namespace vrpipe
