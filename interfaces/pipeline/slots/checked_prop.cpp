#include "pipeline/slots/checks.h"

#include <vrpipe/pipeline/slots/prop.h>

namespace vrpipe {

namespace {

class CheckedProp final : public CheckedSlot<PropBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  Cost cost() const override {
    const Cost cost = ask("cost", [&] { return checked_->cost(); });
    check_rate("quads_per_cycle", cost.quads_per_cycle);
    check_rate("color_rate", cost.color_rate, ColorBeat::capacity);
    check_latency("latency_cycles", cost.latency_cycles);
    if (cost.order > Order::tile) fault("cost", "order {} is neither draw nor tile", static_cast<unsigned>(cost.order));
    return cost;
  }
  void check_costs() const override { cost(); }
  void check_counters() const override {}
};

}  // namespace

std::unique_ptr<Behaviour> check_prop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedProp, PropBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
