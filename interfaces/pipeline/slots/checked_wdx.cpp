#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/wdx.h>

namespace vrpipe {

namespace {

class CheckedWdx final : public CheckedSlot<WdxBehaviour> {
 public:
  CheckedWdx(const std::string& name, const RenderContext& context, std::unique_ptr<WdxBehaviour> checked)
      : CheckedSlot(name, context, std::move(checked)), gpcs_(context.placement.gpcs) {}

  unsigned owner_of(TileId tile) const override {
    const unsigned owner = ask("owner_of", [&] { return checked_->owner_of(tile); });
    if (owner >= gpcs_) fault("owner_of", "{} belongs to GPC {} of {}", words_of(tile), owner, gpcs_);
    return owner;
  }
  Timing timing() const override {
    const Timing timing = ask("timing", [&] { return checked_->timing(); });
    check_rate("primitives_per_cycle", timing.primitives_per_cycle);
    check_latency("latency_cycles", timing.latency_cycles);
    if (timing.latency_cycles < 2) fault("timing", "latency_cycles is 1, and must be 2 or more");
    check_rate("credits", timing.credits, longest_latency);
    return timing;
  }
  void check_timing() const override { timing(); }
  void check_counters() const override {}

 private:
  const unsigned gpcs_;
};

}  // namespace

std::unique_ptr<Behaviour> check_wdx(const std::string& name, const RenderContext& context,
                                     std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedWdx, WdxBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
