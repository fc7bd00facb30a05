#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/prop.h>

namespace vrpipe {

namespace {

class CheckedProp final : public CheckedSlot<PropBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  TimingParameters timing() const override {
    const TimingParameters timing = ask("timing", [&] { return checked_->timing(); });
    check_rate("quads_per_cycle", timing.quads_per_cycle);
    check_rate("color_rate", timing.color_rate, ColorBeat::capacity);
    check_latency("latency_cycles", timing.latency_cycles);
    if (timing.order > Order::tile)
      fault("timing", "order {} is neither draw nor tile", static_cast<unsigned>(timing.order));
    return timing;
  }
  void check_timing() const override { timing(); }
  void check_counters() const override {}
};

}  // namespace

std::unique_ptr<Behaviour> check_prop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedProp, PropBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
